"""Score each action of a large vocabulary: whether its clips are recognized, and how closely they
repeat the training clips."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import Skeleton
from a2v.kinematics.ground import face_forward, first_heading
from a2v.lab.datasets import ActionDataset
from a2v.lab.evaluation.classifier import Evaluator
from a2v.lab.evaluation.metrics import accuracy
from a2v.lab.evaluation.sources import Generate, recorded
from a2v.types import FloatArray, Progress

START_STEP = 2
"""Frames between the starts of two recorded windows that are compared."""

FRAME_STEP = 4
"""Frames between the poses of a window that are compared."""

ENOUGH_CLIPS = 5
"""Minimum number of recorded clips for which an action's accuracy measures the model rather than
the data."""


@dataclass(frozen=True)
class ActionScore:
    """One action of a model.

    Attributes
    ----------
    action : str
    clips : int
        Recorded clips.
    real_accuracy, accuracy : float
        Fraction of recorded and of generated windows that the classifier assigns to the action.
    nearest : float
        Median distance of a generated window to the most similar recorded one: root mean square
        over joints, meters.
    takes : float
        The same between windows of one recorded clip and those of the action's other clips, as a
        reference for another take. None for a single clip.
    """

    action: str
    clips: int
    real_accuracy: float
    accuracy: float
    nearest: float
    takes: float | None


def score_actions(
    generate: Generate,
    dataset: ActionDataset,
    evaluator: Evaluator,
    *,
    clips: int = 40,
    seed: int = 0,
    progress: Progress | None = None,
) -> list[ActionScore]:
    """Score a model on every action that `dataset` has clips of, with the classifier's
    deterministic (zero) first state.

    Parameters
    ----------
    generate : Generate
        See `a2v.lab.evaluation.protocol.generator_of`.
    clips : int
        Windows per action, generated and recorded.

    Raises
    ------
    InputError
        `clips` is not positive, or the classifier was trained for other actions.
    """
    if clips < 1:
        raise InputError(f"{clips} clips per action; expected at least 1")
    evaluator.demand_actions(dataset)
    real = recorded(dataset)
    present = np.unique(dataset.labels)
    scores = []
    for done, label in enumerate(present.tolist()):
        generator = np.random.default_rng([seed, label])
        own = np.flatnonzero(dataset.labels == label)
        labels, lengths = (
            np.full(clips, label),
            dataset.clip_bone_lengths[generator.choice(own, clips)],
        )
        motions = generate(labels, lengths, generator)
        nearest, takes = repetition(
            dataset.frame.flip(motions), [dataset.joints[i] for i in own], dataset.skeleton
        )
        unit = dataset.frame.meters_per_unit
        seen, made = (
            accuracy(evaluator(part)[1], labels)
            for part in (real(labels, lengths, generator), motions)
        )
        scores.append(
            ActionScore(
                dataset.actions[label],
                len(own),
                seen,
                made,
                nearest * unit,
                takes if takes is None else takes * unit,
            )
        )
        if progress is not None:
            progress(done + 1, len(present))
    return scores


def repetition(
    generated: FloatArray, clips: Sequence[FloatArray], skeleton: Skeleton
) -> tuple[float, float | None]:
    """Measure the distances of generated windows from recorded ones, and of recorded ones from
    those of other clips.

    Windows are compared with their first roots at the origin, facing +z.

    Parameters
    ----------
    generated : (N, T, J, 3)
        In the world's axes.
    clips : sequence of (T_i, J, 3)
        All recordings of the action.

    Returns
    -------
    float, float or None
        Medians of the distance to the nearest (root mean square over joints, in the joints' unit):
        of `generated` to `clips`, and of each clip's windows to the other clips; None for a single
        clip.
    """
    length = generated.shape[1]
    seen = [aligned_windows(_windows(clip, length), skeleton) for clip in clips]
    nearest = np.median(_nearest(aligned_windows(generated, skeleton), np.concatenate(seen)))
    between = [
        _nearest(part, np.concatenate(seen[:i] + seen[i + 1 :]))
        for i, part in enumerate(seen)
        if len(seen) > 1
    ]
    return float(nearest), float(np.median(np.concatenate(between))) if between else None


def _windows(clip: FloatArray, length: int) -> FloatArray:
    """Windows (N, length, J, 3) of a clip (T, J, 3), a short one padded by its last pose."""
    starts = np.arange(0, max(len(clip) - length, 0) + 1, START_STEP)
    windows: FloatArray = clip[np.minimum(starts[:, None] + np.arange(length), len(clip) - 1)]
    return windows


def aligned_windows(windows: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Flat windows (N, D) float32 whose first root is the origin and that face +z, so that |a - b|
    is a root mean square over joints."""
    moved = windows - windows[:, :1, :1]
    moved = face_forward(moved, first_heading(moved, skeleton))[:, ::FRAME_STEP]
    flat: FloatArray = (
        moved.reshape(len(moved), -1) / np.sqrt(moved.shape[1] * moved.shape[2])
    ).astype(np.float32)
    return flat


def _nearest(points: FloatArray, others: FloatArray) -> FloatArray:
    """Distance (N,) of each of points (N, D) to the nearest of others (M, D)."""
    products = (others**2).sum(axis=1) - 2 * points @ others.T
    nearest: FloatArray = np.sqrt(np.maximum(products.min(axis=1) + (points**2).sum(axis=1), 0))
    return nearest


def vocabulary_table(scores: Sequence[ActionScore]) -> str:
    """Return Markdown: the actions in their order, and the number of actions of which at least half
    of the clips are recognized."""
    lines = [
        "| Action | Clips | Real accuracy | Accuracy | Nearest recording cm | Between takes cm |",
        "|---|---|---|---|---|---|",
    ]
    for row in scores:
        takes = "" if row.takes is None else f"{100 * row.takes:.1f}"
        lines.append(
            f"| {row.action} | {row.clips} | {row.real_accuracy:.2f} | "
            f"{row.accuracy:.2f} | {100 * row.nearest:.1f} | {takes} |"
        )
    many = [row for row in scores if row.clips >= ENOUGH_CLIPS]
    good = sum(row.accuracy >= 0.5 for row in many)
    real, made = (
        np.mean([getattr(row, name) for row in scores]) for name in ("real_accuracy", "accuracy")
    )
    lines.append(
        f"\nAll actions alike: {made:.3f} of generated windows are recognized, "
        f"{real:.3f} of recorded ones. "
        f"Of the {len(many)} actions with {ENOUGH_CLIPS} clips or more, {good} are "
        "recognized at least half of the time."
    )
    return "\n".join(lines)
