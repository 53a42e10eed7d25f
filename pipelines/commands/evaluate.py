"""``a2v evaluate``: measure motion models as the papers do."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from a2v.errors import InputError
from a2v.io import atomic_path

HELP = "Measure motion models under the papers' protocol: FID, accuracy, diversity and multimodality beside real motions."
EXAMPLES = """examples:
  a2v evaluate --dataset humanact12 --data ../shared/data --model humanact12 --out table.md
  a2v evaluate --dataset cmu --data ../shared/data --model cmu --model mine.onnx --repeats 5 --state zeros --out table.md
  a2v evaluate --dataset cmu --data ../shared/data --model cmu --labels uniform --out table.md

Writes the table as Markdown and, beside it, every repeat's values with protocol, seeds and data hashes as JSON.
--evaluator is the trained action classifier; by default the authors' own in DATA/evaluators."""

EVALUATORS = {
    "humanact12": "action_recognition_model_humanact12.tar",
    "humanact12-fine": "action_recognition_model_humanact12_fineG.tar",
    "cmu": "action_recognition_model_mocap_new.tar",
}
"""The authors' classifier of each data set."""


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    from a2v.evaluation.protocol import EvaluationSettings

    parser.add_argument("--dataset", required=True, help="humanact12, humanact12-fine or cmu")
    parser.add_argument("--data", required=True, help="folder or archive that holds it")
    parser.add_argument("--model", action="append", default=[], help="cmu, humanact12 or an .onnx file; may be repeated")
    parser.add_argument("--evaluator", type=str | None, default=None, help="file of a trained action classifier")
    parser.add_argument("--out", required=True, help="the .md to write; the .json lies beside it")
    parser.add_class_arguments(EvaluationSettings, None)


def find_evaluator(dataset: str, data: str, given: str | None) -> Path:
    """The classifier's file: `given`, or the authors' one under the data folder.

    Raises
    ------
    InputError
        None is there.
    """
    if given is not None:
        return Path(given)
    path = Path(data) / "evaluators" / EVALUATORS.get(dataset, "")
    if not path.is_file():
        raise InputError(f"no action classifier at {path}; give one with --evaluator (a2v train classifier makes one)")
    return path


def run(settings: Any) -> int:
    """Measure; print the table."""
    import sys

    from tqdm import tqdm

    from a2v.datasets import load_dataset
    from a2v.evaluation.classifier import load_evaluator
    from a2v.evaluation.protocol import EvaluationSettings, evaluate, generator_of, markdown_table, report
    from a2v.motion import MotionModel

    out = Path(settings.out)
    if out.suffix != ".md":
        raise InputError(f"cannot write {out}; expected a name that ends in .md")
    protocol = EvaluationSettings(**{name: settings[name] for name in EvaluationSettings.__dataclass_fields__})
    dataset = load_dataset(settings.dataset, settings.data)
    evaluator = load_evaluator(find_evaluator(settings.dataset, settings.data, settings.evaluator))
    models = {}
    for name in settings.model:
        model = MotionModel.load(name)
        if model.actions != dataset.actions:
            raise InputError(f"model '{name}' knows other actions than {dataset.name}; evaluate it on {model.metadata['dataset']}")
        models[f"{model.metadata['decoder']} ({Path(name).name})"] = generator_of(model, dataset.length)
    with tqdm(desc="evaluate", unit="set", file=sys.stderr) as bar:

        def progress(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        scores = evaluate(models, dataset, evaluator, protocol, progress=progress)
    table = markdown_table(scores)
    with atomic_path(out) as temporary:
        temporary.write_text(f"# {dataset.name}\n\nProtocol: {protocol.name}; classifier {evaluator.source}.\n\n{table}\n")
    with atomic_path(out.with_suffix(".json")) as temporary:
        content = report(scores, dataset, evaluator, protocol) | {
            "models": {name: MotionModel.load(name).digest for name in settings.model}
        }
        temporary.write_text(json.dumps(content, indent=1))
    print(table)
    print(out)
    return 0
