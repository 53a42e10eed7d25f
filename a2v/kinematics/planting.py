"""Plant feet: hold feet in contact in place, move the body along with them, bend legs to reach.

Models place feet only approximately, so that feet slide by decimeters while in contact. Here a foot
is an ankle and a toe, and clips come in batches. A person's rig with heels, toes and soles is
cleaned by `a2v.animation.grounding`.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d, minimum_filter1d

from a2v.kinematics.even_paths import evened
from a2v.kinematics.foot_contacts import (
    PLANT,
    PlantSettings,
    bridge_gaps,
    contacts,
    runs_of,
    speeds_of,
)
from a2v.kinematics.limbs import REACH, bend_to, legs_of
from a2v.kinematics.skeleton import Skeleton
from a2v.types import BoolArray, FloatArray

CLEAR_SECONDS = 0.07
"""Seconds before and after a required rise of a foot over which it goes up and down."""


def plant_feet(
    joints: FloatArray,
    skeleton: Skeleton,
    fps: float,
    *,
    settings: PlantSettings = PLANT,
    stays: FloatArray | None = None,
) -> FloatArray:
    """Hold feet in contact in place.

    Parameters
    ----------
    joints : (..., T, J, 3) float
        Meters, y up; the ground is level if ``settings.settled``.
    skeleton : Skeleton
        Clips without two legs that end in feet are returned unchanged.
    fps : float
    settings : PlantSettings
    stays : (T,) float or None
        Share of each frame that stays unchanged, in [0, 1].

    Returns
    -------
    (..., T, J, 3) float32
        Bones keep their lengths.
    """
    legs = legs_of(skeleton)
    if len(legs) != 2 or joints.shape[-3] < 4:
        return np.asarray(joints, np.float32)
    clips = joints.reshape(-1, *joints.shape[-3:]).astype(np.float64)
    # (leg, clip, frame): ankles and toes
    feet = (
        np.stack([clips[:, :, [leg[2], leg[3]]] for leg in legs])
        .swapaxes(2, 3)
        .transpose(0, 1, 3, 2, 4)
    )
    stands, by_toe, floor = contacts(feet, clips[:, :, 0], fps, settings)
    steps = _held_steps(feet, by_toe)
    free = np.ones(clips.shape[1]) if stays is None else 1 - stays
    body = _carried(stands, steps, fps, settings) * free[:, None]
    clips[..., 0] += body[..., None, 0]
    clips[..., 2] += body[..., None, 1]
    steps = steps + np.diff(body, axis=1, prepend=body[:, :1])
    over = feet[..., 1] - floor
    move = _moves(stands, steps, over, fps, settings) * free[:, None]
    move[..., 1] += _cleared(over + move[..., None, 1], feet, stands, fps, settings) * free
    _reach(clips, legs, move, free, fps, settings)
    return clips.astype(np.float32).reshape(joints.shape)


def _held_steps(feet: FloatArray, by_toe: BoolArray) -> FloatArray:
    """Return the step over the ground, since the previous frame, of the part of each foot in
    contact (2, N, T, 2); 0 in the first frame."""
    steps = np.diff(feet[..., [0, 2]], axis=2, prepend=feet[:, :, :1][..., [0, 2]])
    toe = by_toe.copy()
    toe[:, :, 1:] &= by_toe[:, :, :-1]  # the toe holds where it stood in the previous frame
    held: FloatArray = np.where(toe[..., None], steps[..., 1, :], steps[..., 0, :])
    return held


def _carried(
    stands: BoolArray, steps: FloatArray, fps: float, settings: PlantSettings
) -> FloatArray:
    """Return the offset of the whole body (N, T, 2) that removes the slide of feet in contact."""
    both = stands.copy()
    both[:, :, 1:] &= stands[:, :, :-1]
    both[:, :, 0] = False
    weight = both.astype(float)
    slid = (weight[..., None] * steps).sum(axis=0)
    total = weight.sum(axis=0)[..., None]
    sigma = settings.sway * fps
    smooth = gaussian_filter1d(slid, sigma, axis=1, mode="nearest") / np.maximum(
        gaussian_filter1d(np.maximum(total, 0.02), sigma, axis=1, mode="nearest"), 1e-6
    )
    moved: FloatArray = -settings.carry * np.cumsum(smooth, axis=1)
    return moved - moved[:, :1]


def _moves(
    stands: BoolArray, steps: FloatArray, over: FloatArray, fps: float, settings: PlantSettings
) -> FloatArray:
    """Return the offset of each foot (2, N, T, 3): in contact it stays at the mean of its slide, on
    its floor; smooth between."""
    shape = stands.shape
    flat = stands.reshape(-1, shape[-1])
    which, number, counts, _ = runs_of(flat)
    slid = -np.cumsum(steps.reshape(-1, shape[-1], 2), axis=1)
    move = np.zeros((*flat.shape, 3))
    height = -over.min(axis=-1).reshape(flat.shape)
    for axis in (0, 1):
        own = slid[..., axis][which]
        mean = np.bincount(number, own, minlength=len(counts)) / np.maximum(counts, 1)
        held = np.zeros(flat.shape)
        held[which] = own - mean[number]
        move[..., 2 * axis] = held
    move[..., 1] = np.where(flat, height, 0)
    bridge_gaps(move, flat)
    smooth = gaussian_filter1d(move, settings.ease * fps, axis=1, mode="nearest")
    # standing feet keep their correction, and feet approach it as they land
    inner = minimum_filter1d(flat.astype(float), 3, axis=1, mode="nearest")[..., None]
    moved: FloatArray = (inner * move + (1 - inner) * smooth).reshape(*shape, 3)
    return moved


def _cleared(
    over: FloatArray, feet: FloatArray, stands: BoolArray, fps: float, settings: PlantSettings
) -> FloatArray:
    """Return the rise of each foot (2, N, T) that keeps it above its floor, and clear of it while
    it swings."""
    swings = np.clip((speeds_of(feet[..., [0, 2]], fps).min(axis=-1) - 0.3) / 0.4, 0, 1) * ~stands
    frames = max(1, round(settings.rise * fps))
    rising = gaussian_filter1d(
        minimum_filter1d(swings, frames, axis=-1, mode="nearest"),
        frames / 3,
        axis=-1,
        mode="nearest",
    )
    wanted = settings.clearance * np.minimum(rising * 1.5, 1.0)
    needed = np.maximum(wanted - over.min(axis=-1), 0)
    wide = maximum_filter1d(
        needed, 2 * max(1, round(CLEAR_SECONDS * fps)) + 1, axis=-1, mode="nearest"
    )
    smooth: FloatArray = gaussian_filter1d(wide, CLEAR_SECONDS * fps, axis=-1, mode="nearest")
    return smooth


def _reach(
    clips: FloatArray,
    legs: tuple[tuple[int, int, int, int], ...],
    move: FloatArray,
    free: FloatArray,
    fps: float,
    settings: PlantSettings,
) -> None:
    """Move feet by `move` (2, N, T, 3), in place, weighted by `free` (T,).

    The pelvis comes down for legs that are too short, and knees bend.
    """
    drop = np.zeros(clips.shape[:2])
    targets = []
    for (hip, knee, ankle, _), by in zip(legs, move, strict=True):
        upper, lower = (
            np.linalg.norm(clips[:, :, b] - clips[:, :, a], axis=-1)
            for a, b in ((hip, knee), (knee, ankle))
        )
        target = clips[:, :, ankle] + by
        target += (evened(target, settings.even * fps) - target) * free[:, None]
        targets.append(target)
        way = target - clips[:, :, hip]
        now = np.linalg.norm(clips[:, :, ankle] - clips[:, :, hip], axis=-1)
        longest = np.maximum(REACH * (upper + lower), now)
        flat = (way[..., [0, 2]] ** 2).sum(-1)
        down = np.sqrt(np.maximum(longest**2 - flat, (0.5 * longest) ** 2))
        drop = np.maximum(drop, np.clip(-way[..., 1] - down, 0, settings.reach))
    width = max(1, round(0.1 * fps))
    drop = gaussian_filter1d(
        maximum_filter1d(drop, 2 * width + 1, axis=-1, mode="nearest"),
        width / 1.5,
        axis=-1,
        mode="nearest",
    )
    clips[..., 1] -= (drop * free)[..., None]
    for (hip, knee, ankle, toe), target in zip(legs, targets, strict=True):
        foot = clips[:, :, toe] - clips[:, :, ankle]
        clips[:, :, knee], clips[:, :, ankle] = bend_to(
            clips[:, :, hip], clips[:, :, knee], clips[:, :, ankle], target
        )
        clips[:, :, toe] = clips[:, :, ankle] + foot
