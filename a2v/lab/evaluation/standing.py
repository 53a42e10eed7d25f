"""Measure foot contact, liveliness and variation between seeds for each action, on clips of the
commands.

A foot is down while its toe is near its own lowest level, at any height. So a floating clip, or one
whose toes stand at different heights, is measured like any other.
(`a2v.lab.evaluation.physics.foot_skating` uses one floor for all, and counts floating clips as
clean.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import Skeleton
from a2v.kinematics.resample import resample_motion
from a2v.lab.datasets import ActionDataset
from a2v.lab.datasets.base import ClipSampler
from a2v.lab.evaluation.physics import (
    SLIDES,
    contact_speeds,
    ends_of,
    floor_height,
    ground_distance,
    jitter,
)
from a2v.lab.evaluation.vocabulary import ENOUGH_CLIPS, aligned_windows, repetition
from a2v.motion.beginnings import rests
from a2v.types import FloatArray, Motion, Progress

FPS = 30.0
"""Frame rate at which clips are measured."""
SECONDS = 5.0
"""Length of a clip, seconds."""
RECORDINGS = 12
"""Largest number of recordings of an action that are measured."""
COPY = 1e-3
"""Distance between windows, meters (root mean square), below which two recordings are copies: the
database has some recordings under two numbers."""


@dataclass(frozen=True)
class Standing:
    """Measures of clips of one action.

    Attributes
    ----------
    slide : float
        Speed of toes over the ground while they are down, median over frames, m/s.
    fast : float
        Share of those frames with more than `SLIDES`.
    penetration, floating : float
        Mean depth and height of the lowest joint under and over the clip's floor, beyond 5 mm, mm.
    jerk : float
        Mean third difference of joints, m/s^3.
    speed : float
        Mean speed of joints, m/s.
    """

    slide: float
    fast: float
    penetration: float
    floating: float
    jerk: float
    speed: float


@dataclass(frozen=True)
class StandingScore:
    """One action: generated clips beside recordings.

    Attributes
    ----------
    action : str
    recordings : int
        Number of recordings that are not copies of one another.
    generated, recorded : Standing
    spread : float
        Distance between clips of different seeds, relative to that between recordings (root mean
        square over joints, medians); None for fewer than two recordings.
    alike : float or None
        The same with recordings that begin like generated clips: when the person starts to move.
        `spread` takes a random window of each recording, so that a part of its distance comes from
        different phases of the recordings.
    nearest : float
        Median distance of a generated clip to the most similar recorded window, meters.
    """

    action: str
    recordings: int
    generated: Standing
    recorded: Standing
    spread: float | None
    alike: float | None
    nearest: float


def measure(clips: Sequence[FloatArray], fps: float, skeleton: Skeleton) -> Standing:
    """`Standing` of clips (T_i, J, 3), meters."""
    speeds = np.concatenate(
        [contact_speeds(clip[:, ends_of(skeleton.feet, skeleton.parents)], fps) for clip in clips]
    )
    grounds = [ground_distance(clip, floor=floor_height(clip)) for clip in clips]
    return Standing(
        slide=float(np.median(speeds)) if len(speeds) else 0.0,
        fast=float((speeds > SLIDES).mean()) if len(speeds) else 0.0,
        penetration=float(np.mean([depth for depth, _ in grounds])),
        floating=float(np.mean([over for _, over in grounds])),
        jerk=float(np.mean([jitter(clip, fps) for clip in clips])),
        speed=float(
            np.mean([np.linalg.norm(np.diff(clip, axis=0), axis=-1).mean() * fps for clip in clips])
        ),
    )


def score_standing(
    make: Callable[[str, int], Motion],
    dataset: ActionDataset,
    *,
    clips: int = 4,
    seconds: float = SECONDS,
    actions: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> list[StandingScore]:
    """Score clips of `make` for each action of `dataset`, with seeds from 0 on.

    Parameters
    ----------
    make : callable
        Makes a clip of `seconds` from an action's name and a seed, on the data's skeleton.
    dataset : ActionDataset
    clips : int
        Number of seeds per action.
    seconds : float
    actions : sequence of str or None
        Default: all actions with clips in the data.

    Raises
    ------
    InputError
        `clips` is under 2.
    """
    if clips < 2:
        raise InputError(f"{clips} clips per action; expected at least 2, to compare seeds")
    present = (
        [dataset.actions[label] for label in np.unique(dataset.labels)]
        if actions is None
        else list(actions)
    )
    scores = []
    for done, action in enumerate(present):
        own = np.flatnonzero(dataset.labels == dataset.actions.index(action))
        scores.append(_score(make, dataset, action, own, clips, seconds))
        if progress is not None:
            progress(done + 1, len(present))
    return scores


def _score(
    make: Callable[[str, int], Motion],
    dataset: ActionDataset,
    action: str,
    own: np.ndarray,
    clips: int,
    seconds: float,
) -> StandingScore:
    made = [resample_motion(make(action, seed), FPS) for seed in range(clips)]
    frames = round(seconds * dataset.fps)
    usual = int(np.median([len(dataset.joints[index]) for index in own]))
    length = max(min(frames, usual, dataset.length), 2)
    one = dataset.subset(_without_copies(dataset, own, length)[:RECORDINGS])
    real = [
        _middle(resample_motion(one.motion(index), FPS).joints, round(seconds * FPS))
        for index in range(len(one))
    ]
    unit = np.float32(dataset.frame.meters_per_unit)
    windows = np.stack([_resampled(clip, length, dataset.fps) for clip in made]) / unit
    spread = alike = None
    if len(one) > 1:
        taken = ClipSampler(one, length).windows(np.arange(len(one)), np.random.default_rng(0))
        begun = np.stack([_without_rest(clip, length, dataset) for clip in one.joints])
        spread, alike = (
            _median_distance(windows, dataset.skeleton)
            / max(_median_distance(real_windows, dataset.skeleton), 1e-9)
            for real_windows in (taken, begun)
        )
    nearest, _ = repetition(windows, list(one.joints), dataset.skeleton)
    return StandingScore(
        action=action,
        recordings=len(one),
        generated=measure([clip.joints for clip in made], FPS, dataset.skeleton),
        recorded=measure([clip for clip in real if len(clip) >= 4], FPS, dataset.skeleton),
        spread=spread,
        alike=alike,
        nearest=nearest * float(unit),
    )


def _without_copies(dataset: ActionDataset, own: np.ndarray, length: int) -> list[int]:
    """Return the clips `own` without copies of earlier ones."""
    first = aligned_windows(
        np.stack([_first(dataset.joints[index], length) for index in own]), dataset.skeleton
    )
    kept: list[int] = []
    for at in range(len(own)):
        if all(np.linalg.norm(first[at] - first[other]) > COPY for other in kept):
            kept.append(at)
    return [int(own[at]) for at in kept]


def _middle(clip: FloatArray, length: int) -> FloatArray:
    """Return at most `length` frames from the middle of a recording, because the action does not
    start at its beginning."""
    begin = max(len(clip) - length, 0) // 2
    return clip[begin : begin + length]


def _first(clip: FloatArray, length: int) -> FloatArray:
    padded: FloatArray = clip[np.minimum(np.arange(length), len(clip) - 1)]
    return padded


def _without_rest(clip: FloatArray, length: int, dataset: ActionDataset) -> FloatArray:
    """The first `length` frames (length, J, 3) of a recording without the time in which the person
    stands (`a2v.motion.beginnings.rests`)."""
    joints = clip[None] * np.float32(dataset.frame.meters_per_unit)
    skip = int(rests(joints, dataset.fps, len(clip))[0])
    return _first(clip[min(skip, len(clip) - 2) :], length)


def _resampled(motion: Motion, length: int, fps: float) -> FloatArray:
    """The first `length` frames (length, J, 3) of a clip at `fps`, by linear interpolation."""
    at = np.minimum(np.arange(length) * (motion.fps / fps), motion.frames - 1)
    first = np.minimum(at.astype(np.int64), motion.frames - 2)
    share = (at - first)[:, None, None]
    found: FloatArray = (
        motion.joints[first] * (1 - share) + motion.joints[first + 1] * share
    ).astype(np.float32)
    return found


def _median_distance(windows: FloatArray, skeleton: Skeleton) -> float:
    """Return the median distance between windows (N, T, J, 3): root mean square over joints.

    The windows are compared with their first roots at the origin, facing +z.
    """
    flat = aligned_windows(windows, skeleton)
    pairs = np.triu_indices(len(flat), 1)
    return float(np.median(np.linalg.norm(flat[pairs[0]] - flat[pairs[1]], axis=-1)))


def standing_table(scores: Sequence[StandingScore]) -> str:
    """Return Markdown: actions sorted by slide, the worst first, and the medians of all."""
    columns = (
        "Slide cm/s",
        "(rec.)",
        "Over 30 cm/s %",
        "(rec.)",
        "Float mm",
        "(rec.)",
        "Penetration mm",
        "Jerk / rec.",
        "Speed / rec.",
        "Spread / rec.",
        "(begun alike)",
        "Nearest cm",
    )
    lines = [f"| Action | Recordings | {' | '.join(columns)} |", "|---" * (len(columns) + 2) + "|"]
    for row in sorted(scores, key=lambda score: -score.generated.slide):
        made, real = row.generated, row.recorded
        spread, alike = (
            "" if value is None else f"{value:.2f}" for value in (row.spread, row.alike)
        )
        cells = [
            f"{100 * made.slide:.0f}",
            f"{100 * real.slide:.0f}",
            f"{100 * made.fast:.0f}",
            f"{100 * real.fast:.0f}",
            f"{made.floating:.0f}",
            f"{real.floating:.0f}",
            f"{made.penetration:.1f}",
            f"{ratio(made.jerk, real.jerk):.2f}",
            f"{ratio(made.speed, real.speed):.2f}",
            spread,
            alike,
            f"{100 * row.nearest:.0f}",
        ]
        lines.append(f"| {row.action} | {row.recordings} | {' | '.join(cells)} |")
    return "\n".join([*lines, "", summary(scores)])


def ratio(made: float, real: float) -> float:
    """Return the generated value divided by the recorded one."""
    return made / max(real, 1e-9)


def summary(scores: Sequence[StandingScore]) -> str:
    """One paragraph of medians and worst actions."""
    slides, real = (
        [100 * getattr(row, which).slide for row in scores] for which in ("generated", "recorded")
    )
    fast = [
        100 * np.mean([getattr(row, which).fast for row in scores])
        for which in ("generated", "recorded")
    ]
    jerks = [ratio(row.generated.jerk, row.recorded.jerk) for row in scores]
    speeds = [ratio(row.generated.speed, row.recorded.speed) for row in scores]
    judged = [row for row in scores if row.recordings >= ENOUGH_CLIPS]
    spreads = [row.spread for row in judged if row.spread is not None]
    alike = [row.alike for row in judged if row.alike is not None]
    worst = scores[int(np.argmax(slides))].action
    text = (
        f"Slide in contact: median {np.median(slides):.0f} cm/s (recordings "
        f"{np.median(real):.0f}), at most {max(slides):.0f} ({worst}). "
        f"Contacts over 30 cm/s: {fast[0]:.0f} % (recordings {fast[1]:.0f}). Jerk over the "
        f"recordings': median {np.median(jerks):.2f}, at most "
        f"{max(jerks):.2f} ({scores[int(np.argmax(jerks))].action}); speed: "
        f"{np.median(speeds):.2f}, at most {max(speeds):.2f} "
        f"({scores[int(np.argmax(speeds))].action}). "
    )
    if spreads:
        text += (
            f"Seeds' spread over the recordings', {len(spreads)} actions with {ENOUGH_CLIPS} "
            f"recordings or more: median {np.median(spreads):.2f}, "
            f"{sum(value >= 0.6 for value in spreads)} of them at least .6, least "
            f"{min(spreads):.2f}; "
            f"over recordings that begin alike: median {np.median(alike):.2f}, "
            f"{sum(value >= 0.6 for value in alike)} at least .6, least {min(alike):.2f}."
        )
    return text
