"""The papers' evaluation protocol, run on any number of models beside real data (Sec. 5.1)."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from a2v.datasets import ActionDataset, ClipSampler
from a2v.errors import InputError
from a2v.evaluation.classifier import Evaluator, State
from a2v.evaluation.metrics import accuracy, confidence_interval, diversity, fid, multimodality
from a2v.motion import MotionModel
from a2v.types import FloatArray, IntArray, Progress

METRICS = ("fid", "accuracy", "diversity", "multimodality")

Generate = Callable[[IntArray, FloatArray, np.random.Generator], FloatArray]
"""``(labels (N,), bone lengths (N, J) native, generator) -> native joints (N, T, J, 3)``."""


@dataclass(frozen=True)
class EvaluationSettings:
    """The protocol; the defaults follow the papers.

    Attributes
    ----------
    clips : int
        Generated and real clips a repeat, drawn with replacement.
    repeats : int
        Independent repeats; tables give their mean and 95 % interval.
    labels : "data" or "uniform"
        Actions of the generated clips: as frequent as in the data, or all equally. Real clips are drawn as they
        are, so under "uniform" even real motions, drawn with equal actions, have an FID of 2.3 on HumanAct12
        (0.5 fine-grained, 3.3 on CMU).
    state : "random" or "zeros"
        First state of the classifier's GRU: the papers' random one, or the deterministic protocol.
    seed : int
    """

    clips: int = 3000
    repeats: int = 20
    labels: Literal["data", "uniform"] = "data"
    state: State = "random"
    seed: int = 0

    def __post_init__(self) -> None:
        if self.clips < 40 or self.repeats < 1:
            raise InputError(f"clips={self.clips}, repeats={self.repeats}; expected at least 40 clips (30 features) and 1 repeat")

    @property
    def name(self) -> str:
        """One line for tables."""
        return f"{self.clips} real and generated clips, {self.repeats} repeats, {self.labels} labels, {self.state} classifier state, seed {self.seed}"


@dataclass(frozen=True)
class Scores:
    """Metrics of one model: every repeat's value by metric."""

    name: str
    values: Mapping[str, tuple[float, ...]]

    def summary(self) -> dict[str, tuple[float, float]]:
        """Mean and half width of the 95 % interval by metric."""
        return {metric: confidence_interval(np.asarray(values)) for metric, values in self.values.items()}


def generator_of(model: MotionModel, frames: int) -> Generate:
    """Sampling of an exported model as the protocol wants it."""

    def generate(labels: IntArray, lengths: FloatArray, generator: np.random.Generator) -> FloatArray:
        joints = []
        for start in range(0, len(labels), 250):
            part = slice(start, start + 250)
            joints.append(model.generate_like_data(labels[part], lengths[part], frames, generator))
        return model.to_native(np.concatenate(joints))

    return generate


def evaluate(
    models: Mapping[str, Generate],
    dataset: ActionDataset,
    evaluator: Evaluator,
    settings: EvaluationSettings | None = None,
    *,
    progress: Progress | None = None,
) -> list[Scores]:
    """Score models, with real motions as the first row.

    Parameters
    ----------
    models : name -> Generate
        See `generator_of`.
    dataset : ActionDataset
        Real clips.
    evaluator : Evaluator
        A classifier of the data set's actions.
    settings : EvaluationSettings

    Returns
    -------
    list of Scores
        "Real motions" (two independent draws against each other), then the models.
    """
    settings = settings or EvaluationSettings()
    if evaluator.n_actions != len(dataset.actions):
        raise InputError(f"{evaluator.source} knows {evaluator.n_actions} actions; {dataset.name} has {len(dataset.actions)}")
    sampler = ClipSampler(dataset, dataset.length)
    signs = np.asarray(dataset.frame.signs, dtype=np.float32)
    names = ["Real motions", *models]
    values: dict[str, dict[str, list[float]]] = {name: {metric: [] for metric in METRICS} for name in names}
    for repeat in range(settings.repeats):
        generator = np.random.default_rng([settings.seed, repeat])
        reference, _, _ = sampler.batch(settings.clips, generator)
        real, _ = evaluator(reference * signs, state=settings.state, generator=generator)
        for done, name in enumerate(names):
            if name == "Real motions":
                motions, labels, _ = sampler.batch(settings.clips, generator)
                motions = motions * signs
            else:
                clips = generator.integers(0, len(dataset), settings.clips)
                labels = dataset.labels[clips] if settings.labels == "data" else generator.integers(0, len(dataset.actions), settings.clips)
                motions = models[name](labels, dataset.clip_bone_lengths[clips], generator)
            features, predicted = evaluator(motions, state=settings.state, generator=generator)
            row = values[name]
            row["fid"].append(fid(real, features))
            row["accuracy"].append(accuracy(predicted, labels))
            row["diversity"].append(diversity(features, generator))
            row["multimodality"].append(multimodality(features, labels, generator))
            if progress is not None:
                progress(repeat * len(names) + done + 1, settings.repeats * len(names))
    return [Scores(name, {metric: tuple(numbers) for metric, numbers in values[name].items()}) for name in names]


def markdown_table(scores: Sequence[Scores]) -> str:
    """The papers' table: mean ± half width of the 95 % interval."""
    lines = ["| Methods | FID↓ | Accuracy↑ | Diversity→ | MModality→ |", "|---|---|---|---|---|"]
    for row in scores:
        cells = " | ".join(f"{mean:.3f} ± {half:.3f}" for mean, half in (row.summary()[metric] for metric in METRICS))
        lines.append(f"| {row.name} | {cells} |")
    return "\n".join(lines)


def report(scores: Sequence[Scores], dataset: ActionDataset, evaluator: Evaluator, settings: EvaluationSettings) -> dict[str, Any]:
    """Everything a reader needs to reproduce a table, as JSON."""
    return {
        "protocol": dataclasses.asdict(settings) | {"frames": dataset.length},
        "dataset": {"name": dataset.name, "clips": len(dataset), "sha256": dataset.digest},
        "classifier": {"file": evaluator.source, "sha256": evaluator.digest},
        "scores": {row.name: {metric: list(numbers) for metric, numbers in row.values.items()} for row in scores},
    }
