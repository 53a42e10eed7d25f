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
from a2v.kinematics.ground import first_heading
from a2v.lab.datasets import ActionDataset, ClipSampler
from a2v.lab.evaluation.classifier import Evaluator, State
from a2v.lab.evaluation.metrics import accuracy, confidence_interval, diversity, fid, multimodality
from a2v.lab.evaluation.physics import PhysicsMetrics, joints_physics
from a2v.motion import MotionModel
from a2v.types import FloatArray, IntArray, Progress
from a2v.version import __version__

REAL = "Real motions"
REAL_ALIKE = "Real, drawn alike"
"""The floor of tables with actions drawn alike: recordings of the same actions as the models'
clips."""

PART = 250
"""Clips that are made at a time."""

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
        Actions of the generated clips: as frequent as in the data, or all drawn alike, as the
        published evaluation does. Real clips are drawn as they are, so under "uniform" even real
        motions, drawn with equal actions, have an FID of 2.3 on HumanAct12 (0.5 fine-grained, 3.3
        on CMU): a row of its own says so, and no row of one protocol compares with one of the
        other.
    state : "random" or "zeros"
        First state of the classifier's GRU: the papers' random one, or the deterministic protocol.
    seed : int
        Seed of the draws of clips, actions and noise.
    physics_clips : int
        Clips of the first repeat whose physical plausibility is measured, 0 for none.
    """

    clips: int = 3000
    repeats: int = 20
    labels: Literal["data", "uniform"] = "data"
    state: State = "random"
    seed: int = 0
    physics_clips: int = 500

    def __post_init__(self) -> None:
        if self.clips < 40 or self.repeats < 1:
            raise InputError(
                f"clips={self.clips}, repeats={self.repeats}; expected at least 40 clips (30 features) and 1 repeat"
            )
        if self.physics_clips < 0:
            raise InputError(f"physics_clips is {self.physics_clips}; expected 0 or more")

    @property
    def name(self) -> str:
        """One line for tables."""
        return f"{self.clips} real and generated clips, {self.repeats} repeat{'s' if self.repeats > 1 else ''}, {self.labels} labels, {self.state} classifier state, seed {self.seed}"


@dataclass(frozen=True)
class Scores:
    """Metrics of one model: every repeat's value by metric, and the physical measures of
    `physics_clips` clips."""

    name: str
    values: Mapping[str, tuple[float, ...]]
    physics: PhysicsMetrics | None = None

    def summary(self) -> dict[str, tuple[float, float]]:
        """Mean and half width of the 95 % interval by metric."""
        return {
            metric: confidence_interval(np.asarray(values))
            for metric, values in self.values.items()
        }


def generator_of(model: MotionModel, frames: int) -> Generate:
    """Sampling of an exported model as the protocol wants it."""

    def generate(
        labels: IntArray, lengths: FloatArray, generator: np.random.Generator
    ) -> FloatArray:
        joints = []
        for start in range(0, len(labels), PART):
            part = slice(start, start + PART)
            joints.append(model.generate_like_data(labels[part], lengths[part], frames, generator))
        return model.to_native(np.concatenate(joints))

    return generate


def generator_of_families(
    model: MotionModel, fine: ActionDataset, coarse: ActionDataset, frames: int
) -> Generate:
    """Sampling of a model of finer actions under coarser names: like a random clip of the family,
    of its action, as long, and facing as it does.

    What a clip does, how long it moves and where in the laboratory it heads go together, and
    classifiers that see headings know clips by that (docs/research/motion-flow.md): drawn apart,
    real clips lose as much.

    Parameters
    ----------
    model : MotionModel
        Of the actions of `fine`.
    fine : ActionDataset
    coarse : ActionDataset
        Recordings of the same names under the labels that are asked for; a recording of which
        `fine` has parts counts for each.

    Raises
    ------
    InputError
        A family has no clip in `fine`.
    """
    label_of = dict(zip(coarse.clip_names, coarse.labels.tolist(), strict=True))
    family = np.array([label_of.get(name.split("/")[0], -1) for name in fine.clip_names])
    members = [np.flatnonzero(family == label) for label in range(len(coarse.actions))]
    if empty := [name for name, own in zip(coarse.actions, members, strict=True) if not len(own)]:
        raise InputError(f"{fine.name} has no clips of '{empty[0]}'")
    sampler = ClipSampler(fine, fine.length)
    shares = np.minimum(np.array([len(clip) for clip in fine.joints]) / fine.length, 1)

    def generate(
        labels: IntArray, lengths: FloatArray, generator: np.random.Generator
    ) -> FloatArray:
        clips = np.array([generator.choice(members[label]) for label in labels.tolist()])
        ahead = first_heading(sampler.windows(clips, generator), fine.skeleton)
        headings = np.arctan2(ahead[:, 1], ahead[:, 0])
        joints = [
            model.generate_like_data(
                fine.labels[clips[part]],
                lengths[part],
                frames,
                generator,
                active=shares[clips[part]],
                headings=headings[part],
            )
            for part in (slice(start, start + PART) for start in range(0, len(clips), PART))
        ]
        return model.to_native(np.concatenate(joints))

    return generate


def recorded(dataset: ActionDataset) -> Generate:
    """Random windows of recorded clips of the wanted actions, as a model would give them (their own
    bone lengths).

    Raises
    ------
    InputError
        When called for an action that the data has no clip of.
    """
    sampler = ClipSampler(dataset, dataset.length)

    def generate(labels: IntArray, _: FloatArray, generator: np.random.Generator) -> FloatArray:
        clips = np.zeros(len(labels), dtype=np.int64)
        for label in np.unique(labels):
            own = np.flatnonzero(dataset.labels == label)
            if not len(own):
                raise InputError(f"{dataset.name} has no clip of '{dataset.actions[label]}' here")
            wanted = labels == label
            clips[wanted] = generator.choice(own, int(wanted.sum()))
        return dataset.frame.flip(sampler.windows(clips, generator))

    return generate


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

    Every row draws from generators of its own, the same for all: the same actions, bones and first
    states, whatever else is measured.

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
        Called with every row that was measured, at once.

    Returns
    -------
    list of Scores
        "Real motions" (two independent draws against each other), with uniform labels "Real, drawn
        alike", then the models.

    Raises
    ------
    InputError
        The classifier is of other actions.
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
    """What every row is measured with: `references` are the features (clips, 30) of real motions,
    one of each repeat."""

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
        """With the references drawn."""
        sampler, references = ClipSampler(dataset, dataset.length), []
        for repeat in range(repeats):
            generator = np.random.default_rng([settings.seed, repeat, 0])
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
    """Every repeat of one row, against the references; recorded motions for None."""
    dataset, settings = trial.dataset, trial.settings
    values: dict[str, list[float]] = {metric: [] for metric in METRICS}
    physics: PhysicsMetrics | None = None
    for repeat, real in enumerate(trial.references):
        generator = np.random.default_rng([settings.seed, repeat, 1])
        motions, labels = _draw(generate, dataset, trial.sampler, settings, generator)
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


def _draw(
    generate: Generate | None,
    dataset: ActionDataset,
    sampler: ClipSampler,
    settings: EvaluationSettings,
    generator: np.random.Generator,
) -> tuple[FloatArray, IntArray]:
    """Native motions and labels of one repeat: recorded ones for None."""
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
    """Rows of single actions that are known already (`evaluate`), by action and name, and what is
    called with the action and each row as it is measured."""

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


def _cell(scores: Scores, metric: str) -> str:
    mean, half = scores.summary()[metric]
    return f"{mean:.3f} ± {half:.3f}" if len(scores.values[metric]) > 1 else f"{mean:.3f}"


def markdown_table(scores: Sequence[Scores]) -> str:
    """The papers' table: mean ± half width of the 95 % interval (of several repeats)."""
    lines = ["| Methods | FID↓ | Accuracy↑ | Diversity→ | MModality→ |", "|---|---|---|---|---|"]
    lines += [
        f"| {row.name} | {' | '.join(_cell(row, metric) for metric in METRICS)} |" for row in scores
    ]
    return "\n".join(lines)


def action_table(tables: Mapping[str, Sequence[Scores]]) -> str:
    """The journal paper's Table 4: FID, accuracy and diversity of single actions side by side."""
    shown = METRICS[:3]
    head = [
        f"{action} {metric}" for action in tables for metric in ("FID↓", "Accuracy↑", "Diversity→")
    ]
    lines = [f"| Methods | {' | '.join(head)} |", "|---" * (len(head) + 1) + "|"]
    for rows in zip(*tables.values(), strict=True):
        lines.append(
            f"| {rows[0].name} | {' | '.join(_cell(row, metric) for row in rows for metric in shown)} |"
        )
    return "\n".join(lines)


def physics_table(scores: Sequence[Scores]) -> str:
    """Physical plausibility, real motions first: they are never at zero either; "" where it was not
    measured."""
    known = [row for row in scores if row.physics is not None]
    if not known:
        return ""
    columns = {
        "Foot skating": ("skating", 1), "Penetration mm": ("penetration", 1), "Float mm": ("floating", 1), "Slide mm/frame": ("slide", 1),
        "Jitter m/s³": ("jitter", 1), "Bone variation %": ("bone_variation", 100),
        "Slide in contact cm/s": ("contact_slide", 100), "Contacts over 30 cm/s %": ("contact_fast", 100),
    }  # fmt: skip
    lines = [f"| Methods | {' | '.join(columns)} |", "|---" * (len(columns) + 1) + "|"]
    for row in known:
        values = row.physics.as_dict() if row.physics is not None else {}
        lines.append(
            f"| {row.name} | {' | '.join(f'{values[name] * factor:.3g}' for name, factor in columns.values())} |"
        )
    return "\n".join(lines)


def scores_as_dict(scores: Sequence[Scores]) -> dict[str, Any]:
    """Rows as JSON: every repeat's values by metric, and the physical measures."""
    return {
        row.name: {metric: list(numbers) for metric, numbers in row.values.items()}
        | ({"physics": row.physics.as_dict()} if row.physics else {})
        for row in scores
    }


def scores_from_dict(content: Mapping[str, Mapping[str, Any]]) -> dict[str, Scores]:
    """The inverse of `scores_as_dict`, by name."""
    return {
        name: Scores(
            name,
            {metric: tuple(row[metric]) for metric in METRICS},
            PhysicsMetrics(**row["physics"]) if "physics" in row else None,
        )
        for name, row in content.items()
    }


def report(
    scores: Sequence[Scores],
    dataset: ActionDataset,
    evaluator: Evaluator,
    settings: EvaluationSettings,
) -> dict[str, Any]:
    """Everything a reader needs to reproduce a table, as JSON."""
    return {
        # "generator": each row draws from its own, which tells this protocol from one generator for
        # a whole table
        "protocol": dataclasses.asdict(settings) | {"frames": dataset.length, "generator": "a row"},
        "dataset": {"name": dataset.name, "clips": len(dataset), "sha256": dataset.digest},
        "classifier": {"file": evaluator.source, "sha256": evaluator.digest, **evaluator.info},
        "versions": {"a2v": __version__, "numpy": np.__version__, "torch": str(torch.__version__)},
        "scores": scores_as_dict(scores),
    }
