"""Common parts of the training commands: the options of a motion model's run, and the bar."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

from a2v.lab.datasets import ActionDataset
from a2v.lab.evaluation.classifier import Evaluator, load_evaluator
from pipelines.lab.dataset_options import DataOptions, hold_out
from pipelines.options import option

Show = Callable[[Mapping[str, float], Mapping[str, float]], None]
"""Called with a row of the log and those of its numbers that are shown."""

RESUMES = (
    "The same command resumes a run that was stopped. CUDA is used if it is available "
    "(--device cpu to stay on the CPU)."
)


@dataclass(frozen=True, kw_only=True)
class LearningOptions(DataOptions):
    """Training data, and the folder of the run."""

    held_out: str = option(
        "subjects that are left out of the training: names separated by commas, auto or none",
        default="",
    )
    out: str = option("folder of the run")


@dataclass(frozen=True, kw_only=True)
class WatchedOptions(LearningOptions):
    """Run options and the classifier that measures the model during training."""

    evaluator: str | None = option(
        "action classifier for a running FID and accuracy (monitoring only)",
        default=None,
        metavar="FILE",
    )

    def watch(self, dataset: ActionDataset) -> Evaluator | None:
        """Return the classifier, if one is given.

        Raises
        ------
        InputError
            It cannot be read, or was trained for other actions.
        """
        if not self.evaluator:
            return None
        evaluator = load_evaluator(self.evaluator)
        evaluator.demand_actions(dataset)
        return evaluator


@dataclass(frozen=True, kw_only=True)
class MotionModelOptions(LearningOptions):
    """Run options and the properties of the exported motion model."""

    license: str = option(
        "license of the weights, kept in the exported file", default="see the data set's license"
    )
    temperature: float = option(
        "temperature of the exported model's noise; below 1: more typical, less varied", default=1.0
    )

    def learned_part(self) -> tuple[ActionDataset, dict[str, list[str]]]:
        """Return the training data, and the held-out subjects for the model's file."""
        training, unseen = hold_out(self.open(), self.held_out)
        return training, {"held_out": sorted(set(unseen.subjects)) if unseen is not None else []}


@contextmanager
def training_bar(name: str, iterations: int) -> Iterator[Show]:
    """Context of a bar; its value shows a row of the log."""
    from tqdm import tqdm

    with tqdm(
        total=iterations, desc=f"train {name}", unit="it", file=sys.stderr, smoothing=0.05
    ) as bar:

        def show(row: Mapping[str, float], numbers: Mapping[str, float]) -> None:
            bar.update(int(row["iteration"]) - bar.n)
            bar.set_postfix({name: f"{value:.3g}" for name, value in numbers.items()})

        yield show
