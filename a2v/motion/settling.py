"""Bring generated clips to the ground: rising actions, longest times in the air, settings for
planting feet."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

import numpy as np
from scipy.ndimage import gaussian_filter1d, minimum_filter1d

from a2v.kinematics import Skeleton, skeleton_of
from a2v.kinematics.foot_contacts import PlantSettings, own_floor
from a2v.kinematics.limbs import legs_of
from a2v.motion.card import ModelCard
from a2v.types import FloatArray, Motion

RISING = ("Climb", "Step")
"""The papers' actions, and families of finer ones, that go up."""

FLYING = ("jump", "hop", "leap", "kick", "ballet", "animal", "dive")
"""Parts of the names of actions, or of their families, with jumps."""
RUNNING = ("run", "jog")
"""Parts of the names of actions with running."""

AIR_SECONDS = 0.7
"""Longest time without a joint near the ground in a jump, seconds."""
STEP_SECONDS = 0.4
"""Longest such time between two steps of a run, seconds."""
TOE_SECONDS = 0.3
"""Longest such time if a foot is always on the ground, seconds. With less than a step, the
correction would shake the body at every step."""

MOST_APART = 0.03
"""Largest height difference in meters of the floors of two feet on one ground."""


def rises(card: ModelCard, action: str) -> bool:
    """Return whether an action of a model may end higher than it began: climbing and stepping
    up."""
    return action in RISING or any(f"coarse:{name}" in _traits(card, action) for name in RISING)


def _traits(card: ModelCard, action: str) -> tuple[str, ...]:
    return dict(zip(card.actions, card.traits, strict=False)).get(action, ())


def air_seconds(card: ModelCard, action: str) -> float:
    """Longest time in seconds that the person is in the air in this action."""
    words = " ".join((action, *_traits(card, action))).lower()
    if any(part in words for part in FLYING):
        return AIR_SECONDS
    return STEP_SECONDS if any(part in words for part in RUNNING) else TOE_SECONDS


def planting(card: ModelCard, actions: Iterable[str]) -> PlantSettings:
    """Settings for planting the feet of these actions; the ground has steps if one of them goes
    up."""
    return PlantSettings(settled=not any(rises(card, name) for name in actions))


def settled(
    motion: Motion, card: ModelCard, actions: Iterable[str], *, kept: FloatArray | None = None
) -> Motion:
    """Bring a generated clip or batch to the ground (`settle`), unless one of its actions goes
    up."""
    names = tuple(actions)
    if any(rises(card, name) for name in names):
        return motion
    return settle(motion, seconds=max(air_seconds(card, name) for name in names), kept=kept)


def settle(
    motion: Motion, *, seconds: float = AIR_SECONDS, kept: FloatArray | None = None
) -> Motion:
    """Lower a floating clip to the ground.

    If the lowest joint of every frame in a span of `seconds` is above the clip's lowest joint, the
    difference is removed. A model encodes the root's height once per window, so its clips can rise
    by decimeters. Do not use this for stairs and ladders.

    `kept` (T,) is the fraction in [0, 1] of its height that each frame keeps. If it is given, the
    ground is y = 0.
    """
    lowest = _lowest(motion)
    width = max(1, round(seconds * motion.fps))
    floor = gaussian_filter1d(
        minimum_filter1d(lowest, width, axis=-1, mode="nearest"), width / 4, axis=-1, mode="nearest"
    )
    off = np.zeros((*lowest.shape, 3), np.float32)
    if kept is None:
        off[..., 1] = np.minimum(floor, lowest) - lowest.min(axis=-1, keepdims=True)
    else:
        off[..., 1] = np.minimum(floor, lowest) * (1 - kept)
    return dataclasses.replace(
        motion, joints=motion.joints - off[..., None, :], root=motion.root - off
    )


def _lowest(motion: Motion) -> FloatArray:
    """Height (..., T) of the lowest joint, with each foot measured from its own floor."""
    heights = motion.joints[..., 1].astype(np.float64)
    legs = legs_of(skeleton_of_motion(motion))
    for pair in zip(*(leg[2:] for leg in legs), strict=True) if len(legs) == 2 else ():
        own = np.stack([own_floor(heights[..., joint], motion.fps)[..., :1] for joint in pair])
        for joint, floor in zip(pair, own - own.min(axis=0), strict=True):
            heights[..., joint] -= np.minimum(floor, MOST_APART)
    lowest: FloatArray = heights.min(axis=-1)
    return lowest


def skeleton_of_motion(motion: Motion) -> Skeleton:
    """The skeleton of a clip or batch."""
    return skeleton_of(motion.skeleton, motion.parents.tolist(), motion.joint_names)
