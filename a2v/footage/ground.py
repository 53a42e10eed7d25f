"""Find when feet stand on the ground, from the rays of the camera to them."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from a2v.footage.figure import NAMES
from a2v.footage.fit import Moves
from a2v.footage.terms import SOLE, SOLES, Stands
from a2v.kinematics.foot_contacts import PlantSettings, contacts
from a2v.kinematics.resample import SHOWN_FPS
from a2v.types import FloatArray

LEGS = tuple(
    tuple(NAMES.index(f"{side}_{joint}") for joint in ("ankle", "foot"))
    for side in ("left", "right")
)
"""Joints of the left and the right foot: ankle and toes."""
SURE = PlantSettings(least=0.9, most=1.1, speed=0.35, height=0.2, low=0.15)
"""Limits for contacts of feet whose depth is estimated. Heights are less reliable than speeds on
the ground, because an error of depth along a ray is an error of height too."""
_FLOOR = 0.15
"""Share of the frames in which the lower foot may be below the ground."""
_BELOW = 0.3
"""Least distance in meters below the camera of a foot whose ray is followed to the ground."""
_FARTHEST = 3.0
"""Largest factor on the distance of a foot."""


def evenly(values: FloatArray, times: FloatArray, fps: float) -> FloatArray:
    """Resample values (T, ...) from `times` (T,), seconds, to `fps` from the first to the last."""
    count = int(np.floor((times[-1] - times[0]) * fps + 1e-6)) + 1
    at = times[0] + np.arange(count) / fps
    if len(times) < 3:
        return np.asarray(values[np.minimum(np.arange(count), len(values) - 1)])
    return np.asarray(CubicSpline(times, values, axis=0)(at))


def on_rays(feet: FloatArray) -> FloatArray:
    """Move feet along the rays from the camera onto the ground.

    The depth of a foot is the least certain coordinate. A foot that stands is on the ground, so
    its ray gives its place without that depth: a standing foot stays there, and a swinging foot
    does not, whatever their estimated depths are.

    Parameters
    ----------
    feet : (2, T, 2, 3)
        Ankle and toes of both legs, meters, with the camera at the origin.

    Returns
    -------
    (2, T, 2, 3)
        With the heights of `feet`.
    """
    floor = np.quantile(feet[..., 1].min(axis=0), _FLOOR, axis=0)
    height = np.minimum(feet[..., 1], -_BELOW)
    factor = np.clip(floor / height, 1 / _FARTHEST, _FARTHEST)
    found: FloatArray = feet.copy()
    found[..., [0, 2]] *= factor[..., None]
    return found


def standing(moves: Moves, times: FloatArray) -> Stands | None:
    """Find the contacts of the feet of a body at `times` (T,); None if there is no contact."""
    even = evenly(moves.joints, times, SHOWN_FPS)
    if len(even) < 4:
        return None
    feet = on_rays(np.stack([even[:, leg] for leg in LEGS]))
    stands, by_toe, _ = contacts(feet[:, None], even[None, :, 0], SHOWN_FPS, SURE)
    at = np.clip(np.round((times - times[0]) * SHOWN_FPS).astype(int), 0, len(even) - 1)
    columns = []
    for leg in (0, 1):
        own, toe = stands[leg, 0, at], by_toe[leg, 0, at]
        columns += [own * np.where(toe, 0.2, 1.0), own * np.where(toe, 1.0, 0.6)]
    held = np.stack(columns, axis=1)
    soles = np.minimum(*(moves.landmarks[:, SOLES[:, part], 1] for part in (0, 1)))  # (T, 2)
    stood = soles[held.reshape(-1, 2, 2).max(axis=-1) > 0.5]
    return Stands(held, float(np.median(stood)) - SOLE) if len(stood) else None
