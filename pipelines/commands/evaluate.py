"""``a2v evaluate``: measure motion models as the papers do."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2v.errors import InputError
from a2v.io import atomic_path

if TYPE_CHECKING:
    from a2v.datasets import ActionDataset
    from a2v.evaluation.classifier import Evaluator
    from a2v.evaluation.protocol import Generate, Scores
    from a2v.motion import MotionModel

HELP = "Measure motion models under the papers' protocol: FID, accuracy, diversity and multimodality beside real motions."
EXAMPLES = """examples:
  a2v evaluate --dataset humanact12 --data ../shared/data --model humanact12 --out table.md
  a2v evaluate --dataset cmu --data ../shared/data --model cmu --model mine.onnx --repeats 5 --state zeros --out table.md
  a2v evaluate --dataset cmu --data ../shared/data --model cmu --labels uniform --out table.md
  a2v evaluate --dataset cmu --data ../shared/data --model cmu --actions Walk,Jump --out table.md     Table 4: locomotion
  a2v evaluate --dataset humanact12 --data ../shared/data --model runs/unseen/motion.onnx --held_out P03,P10 --out table.md
  a2v evaluate --dataset bvh --data my_actions --model runs/mine/motion.onnx --out table.md
  a2v evaluate reconstruction --help                        people from photos: another protocol, with options of its own

Writes the tables as Markdown and, beside them, every repeat's values with protocol, seeds and data hashes as JSON. --state zeros is the
deterministic protocol: the classifier then adds no noise of its own, and the seed decides everything.
Rows that --out already has of the same models, data, classifier and protocol are kept: a killed run goes on, and a model is added at its own cost.
--evaluator is the trained action classifier; by default the authors' own in DATA/evaluators, else OUT's folder/classifier.pt, which is
trained first (with the settings --classifier) if it is not there.
--held_out adds a table against the clips of these people alone (auto: those that `a2v train --held_out auto` leaves out)."""

EVALUATORS = {
    "humanact12": "action_recognition_model_humanact12.tar",
    "humanact12-fine": "action_recognition_model_humanact12_fineG.tar",
    "cmu": "action_recognition_model_mocap_new.tar",
    "ntu_vibe": "action_recognition_model_vibe_v2.tar",
}
"""The authors' classifier of each data set."""


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    from a2v.evaluation.protocol import EvaluationSettings
    from a2v.evaluation.training import ClassifierSettings
    from pipelines.inputs import add_model_argument
    from pipelines.motion_data import add_dataset_arguments

    add_dataset_arguments(parser)
    add_model_argument(parser, several=True)
    parser.add_argument("--evaluator", type=str | None, default=None, help="file of a trained action classifier")
    parser.add_argument("--actions", default="", help="actions to measure each by itself too, with commas (500 clips)")
    parser.add_argument("--held_out", "--held-out", default="none", help="subjects to compare with alone too: names with commas, or auto")
    parser.add_argument("--out", required=True, help="the .md to write; the .json lies beside it")
    parser.add_class_arguments(EvaluationSettings, None)
    parser.add_argument(
        "--classifier", type=ClassifierSettings, default=ClassifierSettings(), help="of a classifier that has to be trained"
    )


def find_evaluator(settings: Any, dataset: ActionDataset) -> Evaluator:
    """The classifier: the given file, or the authors' one under the data folder, or our own beside the tables.

    Raises
    ------
    InputError
        The given one is missing or knows other actions.
    """
    from a2v.evaluation.classifier import load_evaluator
    from a2v.evaluation.training import FILE
    from pipelines.commands.train import run_classifier
    from pipelines.motion_data import hold_out

    name = EVALUATORS.get(settings.dataset)
    published = None if name is None else Path(settings.data) / "evaluators" / name
    if settings.evaluator is not None:
        found = load_evaluator(settings.evaluator)
    elif published is not None and published.is_file():
        found = load_evaluator(published)
    else:
        folder = Path(settings.out).parent
        lacking = f"no classifier of the authors at {published}" if published else f"the authors published no classifier for {dataset.name}"
        print(f"{lacking}; taking ours, {folder / FILE}", file=sys.stderr)
        training, unseen = hold_out(dataset, "auto" if settings.held_out == "none" else settings.held_out)
        found = run_classifier(training, unseen, folder, settings.classifier)
    found.demand_actions(dataset)
    return found


def open_models(names: list[str], dataset: ActionDataset) -> dict[str, MotionModel]:
    """Models by the name that the tables show.

    Raises
    ------
    InputError
        One is missing or knows other actions or joints.
    """
    from a2v.motion import MotionModel

    models: dict[str, MotionModel] = {}
    for name in names:
        model = MotionModel.load(name)
        if model.actions != dataset.actions or model.card.joint_names != dataset.skeleton.joint_names:
            raise InputError(
                f"model '{name}' knows other actions or joints than {dataset.name}; evaluate it on {model.card.dataset}"
            )
        path = Path(name)
        shown = f"{model.card.decoder} ({path.name})"
        if shown in models:  # such as runs/a/motion.onnx and runs/b/motion.onnx
            shown = f"{model.card.decoder} ({path.parent.name}/{path.name})"
        if shown in models:
            raise InputError(f"model '{name}' is given twice, or two models lie in folders of the same name; rename one")
        models[shown] = model
    return models


def run(settings: Any) -> int:
    """Measure; print the tables."""
    from a2v.evaluation.protocol import (
        EvaluationSettings,
        action_table,
        evaluate,
        evaluate_actions,
        generator_of,
        markdown_table,
        physics_table,
        recorded,
        report,
        scores_as_dict,
    )
    from pipelines.bar import bar
    from pipelines.inputs import check_writable
    from pipelines.motion_data import hold_out, open_dataset

    out = Path(settings.out)
    if out.suffix != ".md":
        raise InputError(f"cannot write {out}; expected a name that ends in .md")
    check_writable(out.parent)
    protocol = EvaluationSettings(**{name: settings[name] for name in EvaluationSettings.__dataclass_fields__})
    dataset = open_dataset(settings)
    training, unseen = hold_out(dataset, settings.held_out)
    opened = open_models(settings.model, dataset)
    evaluator = find_evaluator(settings, dataset)
    models: Mapping[str, Generate] = {name: generator_of(model, dataset.length) for name, model in opened.items()}

    described = {name: {"sha256": model.digest, "trained_on": model.card.dataset_digest or None} for name, model in opened.items()}

    def content_of(rows: Sequence[Scores]) -> dict[str, Any]:
        names = {row.name for row in rows}
        return report(rows, dataset, evaluator, protocol) | {"models": {name: about for name, about in described.items() if name in names}}

    # rows that the file has of the same models, data, classifier and protocol are kept: a killed run goes on, and a model can be added
    known, known_actions = _known_rows(out.with_suffix(".json"), content_of([]), described)
    measured = list(known.values())

    def keep(row: Scores) -> None:
        measured.append(row)
        _write_json(out, content_of(measured) | {"unfinished": True})

    with bar("evaluate", "set") as progress:
        scores = evaluate(models, dataset, evaluator, protocol, known=known, progress=progress, on_row=keep)
    text = [f"# {dataset.name}", f"Protocol: {protocol.name}; classifier {evaluator.source}.", markdown_table(scores)]
    content = content_of(scores)
    if physics := physics_table(scores):
        text += [
            f"Physical plausibility of {min(protocol.physics_clips, protocol.clips)} clips (real motions are not at zero either):",
            physics,
        ]
    if settings.actions:
        alone = EvaluationSettings(**{**vars(protocol), "clips": min(500, protocol.clips), "physics_clips": 0})
        named = [name.strip() for name in settings.actions.split(",")]
        single = {action: list(rows.values()) for action, rows in known_actions.items()}

        def actions_of(rows: Mapping[str, Sequence[Scores]]) -> dict[str, Any]:
            return {"actions": {"clips": alone.clips, "scores": {action: scores_as_dict(part) for action, part in rows.items()}}}

        def keep_single(action: str, row: Scores) -> None:
            single.setdefault(action, []).append(row)
            _write_json(out, content | actions_of(single) | {"unfinished": True})

        with bar("actions", "set") as progress:
            tables = evaluate_actions(models, dataset, evaluator, named, alone, known=known_actions, progress=progress, on_row=keep_single)
        text += [
            f"Single actions, {alone.clips} clips each (Table 4 of the journal paper is this for CMU's Walk and Jump):",
            action_table(tables),
        ]
        content |= actions_of(tables)
    if unseen is not None:
        with bar("held out", "set") as progress:
            against = evaluate({"Training clips": recorded(training), **models}, unseen, evaluator, protocol, progress=progress)
        text += [_describe_split(training, unseen, evaluator, opened), markdown_table(against)]
        content["held_out"] = {
            "subjects": sorted(set(unseen.subjects)), "clips": len(unseen), "sha256": unseen.digest, "training_sha256": training.digest,
            "scores": scores_as_dict(against),
        }  # fmt: skip
    joined = "\n\n".join(text) + "\n"
    with atomic_path(out) as temporary:
        temporary.write_text(joined)
    _write_json(out, content)
    print(joined)
    print(out)
    return 0


def _write_json(out: Path, content: Mapping[str, Any]) -> None:
    with atomic_path(out.with_suffix(".json")) as temporary:
        temporary.write_text(json.dumps(content, indent=1))


def _known_rows(
    path: Path, wanted: Mapping[str, Any], models: Mapping[str, Mapping[str, Any]]
) -> tuple[dict[str, Scores], dict[str, dict[str, Scores]]]:
    """Rows of an earlier table at `path` that measuring again would give again: by name, and those of single actions by action and name."""
    from a2v.evaluation.protocol import REAL, scores_from_dict

    try:
        old = json.loads(path.read_text())
        if any(old[part] != wanted[part] for part in ("protocol", "dataset", "classifier", "versions")):
            return {}, {}
        kept = {REAL, *(name for name, about in models.items() if old["models"].get(name) == about)}

        def rows(part: Mapping[str, Any]) -> dict[str, Scores]:
            return scores_from_dict({name: row for name, row in part.items() if name in kept})

        actions = old.get("actions", {}).get("scores", {})
        return rows(old["scores"]), {action: rows(part) for action, part in actions.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}, {}  # none, or not such a table: it is measured anew and replaced


def _describe_split(training: ActionDataset, unseen: ActionDataset, evaluator: Evaluator, models: Mapping[str, MotionModel]) -> str:
    """Who is compared with whom, and which models and classifiers have seen the held-out people."""
    people = sorted(set(unseen.subjects))
    blind = [name for name, model in models.items() if model.card.dataset_digest == training.digest]
    seen = [name for name in models if name not in blind]
    lines = [
        f"Against the {len(unseen)} clips of {', '.join(people)} alone ({len(training)} clips are of others). Actions and bone lengths of generated "
        "clips are the held-out people's; 'Training clips' are recordings of the others with the same actions: what a perfect model could know."
    ]
    if blind:
        lines.append(f"Trained without these people: {', '.join(blind)}.")
    if seen:
        lines.append(f"Trained on other data, these people possibly included: {', '.join(seen)}.")
    unaware = evaluator.info.get("dataset_digest") == training.digest
    lines.append(f"The classifier was trained {'without' if unaware else 'with'} them.")
    return " ".join(lines)
