"""What the training commands share: the options of a motion model's run, and the bar."""

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
"""Called with a row of the log and the numbers of it that are shown."""

RESUMES = (
    "The same command resumes a run that was stopped. CUDA is used where there is one "
    "(--device cpu to stay on the CPU)."
)


@dataclass(frozen=True, kw_only=True)
class LearningOptions(DataOptions):
    """What is learned from, and where the run is."""

    held_out: str = option(
        "subjects not to learn from: names with commas, auto or none", default=""
    )
    out: str = option("folder of the run")


@dataclass(frozen=True, kw_only=True)
class WatchedOptions(LearningOptions):
    """Those and the classifier that measures the model while it learns."""

    evaluator: str | None = option(
        "action classifier for a running FID and accuracy (monitoring only)",
        default=None,
        metavar="FILE",
    )

    def watch(self, dataset: ActionDataset) -> Evaluator | None:
        """The classifier, if one is given.

        Raises
        ------
        InputError
            It cannot be read, or does not know the data set's actions.
        """
        if not self.evaluator:
            return None
        evaluator = load_evaluator(self.evaluator)
        evaluator.demand_actions(dataset)
        return evaluator


@dataclass(frozen=True, kw_only=True)
class MotionModelOptions(LearningOptions):
    """Those and what the exported motion model says and does."""

    license: str = option(
        "license of the weights, kept in the exported file", default="see the data set's license"
    )
    temperature: float = option(
        "of the exported model's noise; below 1: more typical, less varied", default=1.0
    )

    def learned_part(self) -> tuple[ActionDataset, dict[str, list[str]]]:
        """What the model learns from, and what its file says about those held out."""
        training, unseen = hold_out(self.open(), self.held_out)
        return training, {"held_out": sorted(set(unseen.subjects)) if unseen is not None else []}


@contextmanager
def training_bar(name: str, iterations: int) -> Iterator[Show]:
    """A bar as a context whose value shows a row of the log."""
    from tqdm import tqdm

    with tqdm(
        total=iterations, desc=f"train {name}", unit="it", file=sys.stderr, smoothing=0.05
    ) as bar:

        def show(row: Mapping[str, float], numbers: Mapping[str, float]) -> None:
            bar.update(int(row["iteration"]) - bar.n)
            bar.set_postfix({name: f"{value:.3g}" for name, value in numbers.items()})

        yield show
