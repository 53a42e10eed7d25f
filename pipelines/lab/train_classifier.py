"""``a2v train classifier``: the papers' action classifier, which `a2v evaluate` measures with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from a2v.io import say
from a2v.lab.datasets import ActionDataset
from a2v.lab.evaluation.classifier import Evaluator
from a2v.lab.evaluation.training import FILE, ClassifierSettings, train_classifier
from pipelines.answer import Answer
from pipelines.lab.dataset_options import hold_out
from pipelines.lab.training import RESUMES, LearningOptions, training_bar
from pipelines.options import settings

HELP = "Train the papers' action classifier; prints its accuracy on held-out people."
EXAMPLES = f"""examples:
  a2v train classifier --dataset bvh --data my_actions --out runs/classifier            what a2v evaluate measures them with

OUT gets classifier.pt (every few minutes) and log.csv. --held-out names subjects that are not
learned from; without it about a fifth of the clips (auto). {RESUMES}"""


@dataclass(frozen=True, kw_only=True)
class Options(LearningOptions):
    """Options of the command."""

    classifier: ClassifierSettings = settings(ClassifierSettings)


def run(options: Options) -> Answer:
    """Train the classifier."""
    training, unseen = hold_out(options.open(), options.held_out or "auto")
    path = Path(options.out) / FILE
    evaluator = run_classifier(training, unseen, path.parent, options.classifier)
    facts = {} if unseen is None else {"held_out_accuracy": evaluator.info["held_out_accuracy"]}
    return Answer(files=[path], facts=facts)


def run_classifier(
    training: ActionDataset, unseen: ActionDataset | None, out: Path, chosen: ClassifierSettings
) -> Evaluator:
    """Train a classifier with a progress bar.

    Its accuracy on the clips of `unseen`, if any, is printed on standard error.
    """
    with training_bar(f"{training.name} classifier", chosen.iterations) as show:

        def on_log(row: dict[str, float]) -> None:
            show(row, {name: row[name] for name in ("loss", "accuracy") if name in row})

        evaluator = train_classifier(training, out, held_out=unseen, settings=chosen, on_log=on_log)
    if unseen is not None:
        people = sorted(set(unseen.subjects))
        who = (
            f"of {', '.join(people[:12])}{' ...' if len(people) > 12 else ''}"
            if not set(people) & set(training.subjects)
            else "of the same people"
        )
        accuracy = evaluator.info["held_out_accuracy"]
        say(f"accuracy on {len(unseen)} clips {who}, not learned from: {accuracy:.3f}")
    return evaluator
