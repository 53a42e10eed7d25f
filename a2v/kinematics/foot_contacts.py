"""Find the contacts of the feet in a clip, and their level, relative to each foot's own floor.

Here a foot is an ankle and a toe, and clips come in batches. For a person's rig with heels, toes
and soles see `a2v.animation.contacts`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d, minimum_filter1d

from a2v.types import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, kw_only=True)
class PlantSettings:
    """Settings of foot contacts, and of the corrections that keep feet in place.

    Attributes
    ----------
    height : float
        Height in meters above its own floor above which a foot at rest is not in contact.
    speed, share : float
        Speed in meters per second above which a foot on its floor is not in contact, and the share
        of the body's speed that is added to it. The feet of a generated runner slide with the body,
        but far slower than they swing.
    least, most : float
        A foot whose height and speed, in these units, add up to less than `least` is in contact; of
        two feet, the one with the smaller sum is in contact up to `most`, since one foot must
        stand.
    low : float
        Height in meters above its own floor below which the better foot must be in contact. Above
        it, the person is airborne.
    shortest : float
        Seconds; shorter contacts are dropped, shorter gaps are closed.
    carry : float
        Share of the slide of standing feet by which the whole body is moved back.
    sway : float
        Seconds (standard deviation) over which this correction of the body is smoothed.
    ease : float
        Seconds (standard deviation) over which a correction of a foot begins and ends.
    even : float
        Width of `evened` in seconds, which removes kinks from the paths of planted feet.
    clearance, rise : float
        Clearance of a swinging foot in meters, and the seconds in which it is reached.
    reach : float
        Largest drop of the pelvis, meters, for a leg that is too short for its place.
    settled : bool
        True: the ground is level, and standing feet come down to their own floor. False: they stand
        on steps, whose heights are found (`step_levels`).
    """

    height: float = 0.06
    speed: float = 0.5
    share: float = 0.4
    least: float = 1.0
    most: float = 2.2
    low: float = 0.06
    shortest: float = 0.1
    carry: float = 1.0
    sway: float = 0.12
    ease: float = 0.04
    even: float = 0.033
    clearance: float = 0.045
    rise: float = 0.12
    reach: float = 0.12
    settled: bool = True


PLANT = PlantSettings()
LOW_SECONDS = 0.8
"""With steps, a foot's floor is its lowest level within this time, seconds."""
LOW_QUANTILE = 0.05
"""Share of a clip in which a foot may be below its own floor."""
LEAST_STEP = 0.07
"""Least height of a step above the ground, meters."""
SAME_STEP = 0.045
"""Largest distance in meters between two levels that are one step."""
STEP_QUANTILE = 0.02
"""Share of a clip in which the lowest foot may be below the ground under its steps."""


def own_floor(heights: FloatArray, fps: float, *, steps: bool = False) -> FloatArray:
    """Return the level (..., T) on which a joint of a foot with `heights` (..., T) stands.

    It is one level for the clip or, with `steps`, the lowest nearby.
    """
    if not steps:
        return np.broadcast_to(
            np.quantile(heights, LOW_QUANTILE, axis=-1, keepdims=True), heights.shape
        )
    width = max(1, round(LOW_SECONDS * fps))
    floor: FloatArray = minimum_filter1d(heights, width, axis=-1, mode="nearest")
    return floor


def contacts(
    feet: FloatArray, root: FloatArray, fps: float, settings: PlantSettings = PLANT
) -> tuple[BoolArray, BoolArray, FloatArray]:
    """Find contacts by height above each foot's own floor and by speed.

    Parameters
    ----------
    feet : (2, N, T, 2, 3) float
        Ankle and toe of both legs, meters.
    root : (N, T, 3) float

    Returns
    -------
    stands : (2, N, T) bool
    by_toe : (2, N, T) bool
        Whether the toe is in contact rather than the heel.
    floor : (2, N, T, 2) float
        Own floor of ankles and toes.
    """
    floor = np.stack(
        [own_floor(feet[..., part, 1], fps, steps=not settings.settled) for part in (0, 1)], axis=-1
    )
    over = np.maximum(feet[..., 1] - floor, 0)
    speed = speeds_of(feet[..., [0, 2]], fps)
    body = gaussian_filter1d(speeds_of(root[..., [0, 2]], fps), 0.2 * fps, axis=-1, mode="nearest")
    cost = (
        over / settings.height + speed / (settings.speed + settings.share * body)[None, :, :, None]
    )
    by_toe = cost[..., 1] <= cost[..., 0] + 0.1
    best = cost.min(axis=-1)
    low = over.min(axis=-1) < settings.low
    has_to = (best <= best[::-1]) & low & (best < settings.most)
    stands = _without_short((best < settings.least) | has_to, settings.shortest * fps)
    if not settings.settled:
        ground = np.quantile(feet[..., 1], STEP_QUANTILE, axis=2).min(axis=0)
        floor = (
            ground[None, :, None]
            + step_levels(feet[..., 1] - ground[None, :, None], stands)[..., None]
        )
    return stands, by_toe, floor


def step_levels(heights: FloatArray, stands: BoolArray) -> FloatArray:
    """Return the height above the ground of the surface under each foot, smooth between contacts.

    Levels of all contacts that lie within `SAME_STEP` of one another are one step; under
    `LEAST_STEP` they are the ground.

    Parameters
    ----------
    heights : (2, N, T, 2) float
        Of ankles and toes over the ground, meters.
    stands : (2, N, T) bool

    Returns
    -------
    (2, N, T) float
    """
    levels = np.zeros((*stands.shape, 1))
    lower = heights.min(axis=-1)
    for clip in range(stands.shape[1]):
        which, number, counts, _ = runs_of(stands[:, clip])
        if not len(counts):
            continue
        own = lower[:, clip][which]
        rises = np.array([np.median(own[number == run]) for run in range(len(counts))])
        order = np.argsort(rises)
        group = np.concatenate([[0], np.cumsum(np.diff(rises[order]) > SAME_STEP)])
        means = np.bincount(group, rises[order] * counts[order]) / np.bincount(group, counts[order])
        level = np.zeros(len(counts))
        level[order] = np.where(means[group] < LEAST_STEP, 0.0, means[group])
        held = np.zeros(which.shape)
        held[which] = level[number]
        levels[:, clip, :, 0] = held
    flat = levels.reshape(-1, *levels.shape[2:])
    bridge_gaps(flat, stands.reshape(-1, stands.shape[-1]))
    found: FloatArray = flat.reshape(stands.shape)
    return found


def steps_under(feet: FloatArray, root: FloatArray, fps: float) -> tuple[FloatArray, BoolArray]:
    """Return the height above the ground of the surface under each foot (2, T), and its contacts
    (2, T), on steps.

    Parameters
    ----------
    feet : (2, T, 2, 3) float
        Ankle and toe of both legs, meters.
    root : (T, 3) float
    fps : float
    """
    stands, _, floor = contacts(feet[:, None], root[None], fps, PlantSettings(settled=False))
    level = floor[:, 0, :, 0]
    return level - np.quantile(feet[..., 0, 1], STEP_QUANTILE, axis=1).min(), stands[:, 0]


def speeds_of(points: FloatArray, fps: float) -> FloatArray:
    """Return speeds (..., T) or (..., T, P) of points (N, T, D) or (2, N, T, P, D): the slower of
    the steps before and after."""
    axis = -2 if points.ndim == 3 else -3
    steps = np.linalg.norm(np.diff(points, axis=axis), axis=-1) * fps
    at = axis + 1
    first, last = np.take(steps, [0], axis=at), np.take(steps, [-1], axis=at)
    slower: FloatArray = np.minimum(
        np.concatenate([first, steps], axis=at), np.concatenate([steps, last], axis=at)
    )
    return slower


def _without_short(flags: BoolArray, frames: float) -> BoolArray:
    """Remove gaps, and then runs, shorter than `frames` from flags (..., T)."""
    flat = flags.reshape(-1, flags.shape[-1]).copy()
    for value in (False, True):
        which, number, counts, ends = runs_of(flat == value)
        short = counts < min(frames, flat.shape[-1])
        if not value:
            short &= ~ends  # the time before the first contact and after the last is not a gap
        flat[which] ^= short[number]
    return flat.reshape(flags.shape)


def runs_of(flags: BoolArray) -> tuple[BoolArray, IntArray, IntArray, BoolArray]:
    """Return the flags (N, T), the number of the run of each flagged frame, the lengths of the
    runs, and which runs touch an end of the clip."""
    begins = flags & ~np.concatenate([np.zeros_like(flags[:, :1]), flags[:, :-1]], axis=1)
    number = np.cumsum(begins.reshape(-1)).reshape(flags.shape)[flags] - 1
    counts = np.bincount(number, minlength=int(begins.sum()))
    ends = np.zeros(len(counts), bool)
    at = np.zeros(flags.shape, int)
    at[flags] = number
    for column in (0, -1):
        ends[at[flags[:, column], column]] = True
    return flags, number, counts, ends


def bridge_gaps(move: FloatArray, flags: BoolArray) -> None:
    """Fill the frames of rows (N, T, C) without a flag (N, T), in place: smoothly from the last
    flagged row to the next, constant beyond the ends."""
    frames = flags.shape[1]
    at = np.arange(frames)
    before = np.maximum.accumulate(np.where(flags, at, -1), axis=1)
    after = np.minimum.accumulate(np.where(flags, at, frames)[:, ::-1], axis=1)[:, ::-1]
    some = flags.any(axis=1)
    first, last = np.where(before < 0, after, before), np.where(after >= frames, before, after)
    first, last = np.where(some[:, None], first, 0), np.where(some[:, None], last, 0)
    share = np.where(last > first, (at - first) / np.maximum(last - first, 1), 0.0)
    share = (share * share * (3 - 2 * share))[..., None]
    rows = np.arange(len(flags))[:, None]
    move[:] = (1 - share) * move[rows, first] + share * move[rows, last]
