"""The papers' evaluation protocol, run on any number of models beside real data (Sec. 5.1)."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import torch

from a2v.errors import InputError
from a2v.lab.datasets import ActionDataset, ClipSampler
from a2v.lab.evaluation.classifier import Evaluator, State
from a2v.lab.evaluation.metrics import accuracy, diversity, fid, multimodality
from a2v.lab.evaluation.physics import PhysicsMetrics, joints_physics
from a2v.lab.evaluation.scores import METRICS, Scores, scores_as_dict
from a2v.lab.evaluation.sources import Generate, recorded
from a2v.types import FloatArray, IntArray, Progress
from a2v.version import __version__

REAL = "Real motions"
REAL_ALIKE = "Real, drawn alike"
"""Name of the row of recordings whose actions are drawn uniformly, as those of the models' clips
are."""


@dataclass(frozen=True)
class EvaluationSettings:
    """The protocol; the defaults follow the papers.

    Attributes
    ----------
    clips : int
        Generated and real clips per repeat, drawn with replacement; with "each" without, and at
        most as many as the data has.
    repeats : int
        Independent repeats; tables give their mean and 95 % interval.
    labels : "data", "uniform" or "each"
        Actions of the generated clips: as frequent as in the data, or all equally frequent, as in
        the published evaluation. Real clips always keep the data's frequencies. So under "uniform"
        even real motions with equally frequent actions have an FID of 2.0 on HumanAct12 (0.5
        fine-grained, 3.7 on CMU); a separate row shows it. With "each" every recording stands for
        itself once: the reference has a window of it, and a generated clip has its action. This is
        ACTOR's evaluation (Petrovich et al., ICCV 2021). Do not compare rows of two protocols.
    state : "random" or "zeros"
        First state of the classifier's GRU: random, as in the papers, or zeros, which makes the
        scores deterministic.
    seed : int
        Seed of the draws of clips, actions and noise.
    physics_clips : int
        Number of clips of the first repeat whose physical plausibility is measured; 0 for none.
    """

    clips: int = 3000
    repeats: int = 20
    labels: Literal["data", "uniform", "each"] = "data"
    state: State = "random"
    seed: int = 0
    physics_clips: int = 500

    def __post_init__(self) -> None:
        if self.clips < 40 or self.repeats < 1:
            raise InputError(
                f"clips={self.clips}, repeats={self.repeats}; expected at least 40 "
                "clips (more than the 30 features) and 1 repeat"
            )
        if self.physics_clips < 0:
            raise InputError(f"physics_clips is {self.physics_clips}; expected 0 or more")

    @property
    def name(self) -> str:
        """One line that describes the protocol, for tables."""
        return (
            f"{self.clips} real and generated clips, {self.repeats} "
            f"repeat{'s' if self.repeats > 1 else ''}, {self.labels} labels, "
            f"{self.state} classifier state, seed {self.seed}"
        )


def evaluate(
    models: Mapping[str, Generate],
    dataset: ActionDataset,
    evaluator: Evaluator,
    settings: EvaluationSettings | None = None,
    *,
    known: Mapping[str, Scores] | None = None,
    progress: Progress | None = None,
    on_row: Callable[[Scores], None] | None = None,
) -> list[Scores]:
    """Score models, with real motions as the first row.

    Each row has its own generators with the same seeds: the same actions, bones and first states,
    independent of the other rows.

    Parameters
    ----------
    models : name -> Generate
        See `generator_of`.
    dataset : ActionDataset
        Real clips.
    evaluator, settings
    known : name -> Scores
        Rows of the same protocol, data and classifier, which are not measured again.
    progress : Progress
        Called after every repeat of a row.
    on_row : callable
        Called with each row as soon as it is measured.

    Returns
    -------
    list of Scores
        "Real motions" (two independent draws against each other), with uniform labels "Real, drawn
        alike", then the models.

    Raises
    ------
    InputError
        The classifier was trained for other actions.
    """
    settings = settings or EvaluationSettings()
    evaluator.demand_actions(dataset)
    models = ({REAL_ALIKE: recorded(dataset)} if settings.labels == "uniform" else {}) | dict(
        models
    )
    names = [REAL, *models]
    rows = {name: row for name, row in (known or {}).items() if name in names}
    wanted = [name for name in names if name not in rows]
    trial = _Trial.of(dataset, evaluator, settings, repeats=settings.repeats if wanted else 0)
    for done, name in enumerate(wanted):

        def report_repeat(repeat: int, before: int = done * settings.repeats) -> None:
            if progress is not None:
                progress(before + repeat, settings.repeats * len(wanted))

        rows[name] = _measure_row(name, models.get(name), trial, report_repeat)
        if on_row is not None:
            on_row(rows[name])
    return [rows[name] for name in names]


@dataclass(frozen=True, eq=False)
class _Trial:
    """Common inputs of all rows. `references` are the features (clips, 30) of real motions, one
    array per repeat."""

    dataset: ActionDataset
    evaluator: Evaluator
    sampler: ClipSampler
    settings: EvaluationSettings
    references: Sequence[FloatArray]

    @classmethod
    def of(
        cls,
        dataset: ActionDataset,
        evaluator: Evaluator,
        settings: EvaluationSettings,
        *,
        repeats: int,
    ) -> _Trial:
        """Create it and draw the references."""
        sampler, references = ClipSampler(dataset, dataset.length), []
        for repeat in range(repeats):
            generator = np.random.default_rng([settings.seed, repeat, 0])
            if settings.labels == "each":
                reference = sampler.windows(_each_clip(dataset, settings, repeat), generator)
            else:
                reference, _, _ = sampler.batch(settings.clips, generator)
            references.append(
                evaluator(dataset.frame.flip(reference), state=settings.state, generator=generator)[
                    0
                ]
            )
        return cls(dataset, evaluator, sampler, settings, references)


def _measure_row(
    name: str, generate: Generate | None, trial: _Trial, report_repeat: Callable[[int], None]
) -> Scores:
    """Measure every repeat of one row against the references; None measures recorded motions."""
    dataset, settings = trial.dataset, trial.settings
    values: dict[str, list[float]] = {metric: [] for metric in METRICS}
    physics: PhysicsMetrics | None = None
    for repeat, real in enumerate(trial.references):
        generator = np.random.default_rng([settings.seed, repeat, 1])
        motions, labels = _draw(generate, trial, repeat, generator)
        features, predicted = trial.evaluator(motions, state=settings.state, generator=generator)
        values["fid"].append(fid(real, features))
        values["accuracy"].append(accuracy(predicted, labels))
        values["diversity"].append(diversity(features, generator))
        values["multimodality"].append(multimodality(features, labels, generator))
        if repeat == 0 and settings.physics_clips and dataset.skeleton.feet:
            world = dataset.frame.flip(motions[: settings.physics_clips]) * np.float32(
                dataset.frame.meters_per_unit
            )
            physics = joints_physics(
                world, dataset.fps, dataset.skeleton.parents, dataset.skeleton.feet
            )
        report_repeat(repeat + 1)
    return Scores(name, {metric: tuple(numbers) for metric, numbers in values.items()}, physics)


def _each_clip(dataset: ActionDataset, settings: EvaluationSettings, draw: int) -> IntArray:
    """Return the clips of a repeat, each once and in random order: all of them or a part."""
    shuffled: IntArray = np.random.default_rng([settings.seed, draw, 2]).permutation(len(dataset))
    return shuffled[: settings.clips]


def _draw(
    generate: Generate | None, trial: _Trial, repeat: int, generator: np.random.Generator
) -> tuple[FloatArray, IntArray]:
    """Return native motions and labels of one repeat; None returns recorded ones."""
    dataset, sampler, settings = trial.dataset, trial.sampler, trial.settings
    if settings.labels == "each":
        # recordings are compared with another order of the data, as ACTOR's second real set is
        clips = _each_clip(dataset, settings, repeat + (settings.repeats if not generate else 0))
        labels = dataset.labels[clips]
        if generate is None:
            return dataset.frame.flip(sampler.windows(clips, generator)), labels
        return generate(labels, dataset.clip_bone_lengths[clips], generator), labels
    if generate is None:
        recordings, labels, _ = sampler.batch(settings.clips, generator)
        return dataset.frame.flip(recordings), labels
    clips = generator.integers(0, len(dataset), settings.clips)
    present = np.unique(dataset.labels)
    uniform = settings.labels == "uniform"
    labels = (
        present[generator.integers(0, len(present), settings.clips)]
        if uniform
        else dataset.labels[clips]
    )
    return generate(labels, dataset.clip_bone_lengths[clips], generator), labels


@dataclass(frozen=True, eq=False)
class ActionRows:
    """Rows of single actions that are already measured (`evaluate`), by action and name, and a
    function that is called with the action and each new row."""

    known: Mapping[str, Mapping[str, Scores]] = field(default_factory=dict)
    on_row: Callable[[str, Scores], None] | None = None


def evaluate_actions(
    models: Mapping[str, Generate],
    dataset: ActionDataset,
    evaluator: Evaluator,
    actions: Sequence[str],
    settings: EvaluationSettings | None = None,
    *,
    rows: ActionRows | None = None,
    progress: Progress | None = None,
) -> dict[str, list[Scores]]:
    """Score models on single actions: the locomotion analysis of the journal paper's Table 4 (Sec.
    5.1.2).

    Real and generated clips are of the one action; the classifier and its features are those of all
    actions.

    Parameters
    ----------
    actions : names out of ``dataset.actions``
        The paper's are Walk and Jump of CMU, with 500 clips.
    rows : ActionRows, optional

    Returns
    -------
    dict
        The rows of `evaluate` by action.

    Raises
    ------
    InputError
        An action is unknown.
    """
    settings, rows = settings or EvaluationSettings(clips=500), rows or ActionRows()
    for action in actions:
        if action not in dataset.actions:
            raise InputError(
                f"{dataset.name} has no action '{action}'; it has {', '.join(dataset.actions)}"
            )
    tables = {}
    for done, action in enumerate(actions):
        own = dataset.subset(
            np.flatnonzero(dataset.labels == dataset.actions.index(action)).tolist()
        )

        def report_part(part: int, total: int, before: int = done) -> None:
            if progress is not None:
                progress(before * total + part, len(actions) * total)

        kept = None if rows.on_row is None else functools.partial(rows.on_row, action)
        tables[action] = evaluate(
            models,
            own,
            evaluator,
            settings,
            known=rows.known.get(action),
            progress=report_part,
            on_row=kept,
        )
    return tables


def report(
    scores: Sequence[Scores],
    dataset: ActionDataset,
    evaluator: Evaluator,
    settings: EvaluationSettings,
) -> dict[str, Any]:
    """Return as JSON everything that is needed to reproduce a table."""
    return {
        # "generator": each row has its own generator, unlike tables of an older version, which had
        # one for the whole table
        "protocol": dataclasses.asdict(settings) | {"frames": dataset.length, "generator": "a row"},
        "dataset": {"name": dataset.name, "clips": len(dataset), "sha256": dataset.sha256},
        "classifier": {"file": evaluator.source, "sha256": evaluator.sha256, **evaluator.info},
        "versions": {"a2v": __version__, "numpy": np.__version__, "torch": str(torch.__version__)},
        "scores": scores_as_dict(scores),
    }
