"""Choose for the whole clip whether each limb points to the front or to the back, so that depth
does not flicker."""

from __future__ import annotations

import itertools

import numpy as np

from a2v.kinematics.names import LANDMARK_INDEX, LIMBS_BY_HEIGHT
from a2v.kinematics.stature import TYPICAL_HEIGHT
from a2v.types import FloatArray

LIMBS = tuple(
    (f"{side}_{a}", f"{side}_{b}", f"{side}_{c}")
    for side in ("left", "right")
    for a, b, c in (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle"))
)
"""Landmarks of the limbs, each of two bones."""
STATES = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]], np.float64)
"""Signs of the depths of a limb's two bones: 1 is towards the camera."""
_TOLD = 0.07
"""Expected error of the detectors' depth of a bone, relative to the height."""
_MOST = 9.0
"""Largest cost of the depth of one frame, in squared standard deviations."""
_SPEED = 1.6
"""Usual speed at which the depth of a bone changes, heights per second."""
_BACKWARDS = 0.15
"""Apparent bend of a knee to the front that is tolerated, radians."""


def steady_depths(
    points: FloatArray,
    pixels: FloatArray,
    heights: FloatArray,
    times: FloatArray,
    weights: FloatArray,
) -> FloatArray:
    """Remove jumps of limbs between front and back from 3D landmarks.

    A bone of known length L that has the length l in the picture has the depth ±√(L² − l²). The
    sign of each bone of a limb is chosen by dynamic programming (Viterbi 1967) over four states per
    frame. The cost depends on the detectors' depth, on the speed at which depth changes, and on
    knees that bend to the front. Depths of the wrong sign are inverted.

    Parameters
    ----------
    points : (T, 33, 3)
        Meters of a person of typical height.
    pixels : (T, 33, 2)
    heights : (T,)
        Heights of the person, pixels.
    times : (T,)
    weights : (T, 33)

    Returns
    -------
    (T, 33, 3)
    """
    out = points.copy()
    for names in LIMBS:
        rows = [LANDMARK_INDEX[name] for name in names]
        told = np.diff(points[:, rows, 2], axis=1) / TYPICAL_HEIGHT  # (T, 2)
        seen = np.linalg.norm(np.diff(pixels[:, rows], axis=1), axis=-1) / heights[:, None]
        lengths = np.array(
            [
                LIMBS_BY_HEIGHT[(a.split("_")[1], b.split("_")[1])]
                for a, b in itertools.pairwise(names)
            ]
        )
        lengths = np.maximum(lengths, np.quantile(seen, 0.9, axis=0) * 0.97)
        deep = np.sqrt(np.maximum(lengths**2 - seen**2, 0))
        deep = np.maximum(
            deep, np.minimum(np.abs(told), lengths)
        )  # the detected depth may be larger
        signs = _chosen(told, deep, times, weights[:, rows].min(axis=1), _knees(points, names))
        wrong = (signs * told < 0) & (np.abs(told) > 0.01)
        change = np.where(wrong, -2 * told, 0.0) * TYPICAL_HEIGHT
        out[:, rows[1], 2] += change[:, 0]
        below = [LANDMARK_INDEX[name] for name in _hanging(names[2])]
        out[:, below, 2] += (change[:, 0] + change[:, 1])[:, None]
    return out


def _hanging(last: str) -> tuple[str, ...]:
    side, joint = last.split("_")
    ends = (
        ("wrist", "pinky", "index", "thumb")
        if joint == "wrist"
        else ("ankle", "heel", "foot_index")
    )
    return tuple(f"{side}_{name}" for name in ends)


def _chosen(
    told: FloatArray, deep: FloatArray, times: FloatArray, weights: FloatArray, bends: FloatArray
) -> FloatArray:
    """Return the signs (T, 2) of the sequence of states with the lowest cost."""
    wanted = STATES[None] * deep[:, None]  # (T, 4, 2)
    cost = (
        weights[:, None] * np.minimum(((wanted - told[:, None]) / _TOLD) ** 2, _MOST).sum(-1)
    ) + bends
    steps = np.maximum(np.diff(times), 1 / 120)
    best, came = cost[0], np.zeros((len(cost), 4), int)
    for frame in range(1, len(cost)):
        jump = (
            (wanted[frame][None] - wanted[frame - 1][:, None]) / (_SPEED * steps[frame - 1])
        ) ** 2
        way = best[:, None] + np.minimum(jump, 4 * _MOST).sum(-1)
        came[frame] = way.argmin(axis=0)
        best = way.min(axis=0) + cost[frame]
    state = int(best.argmin())
    signs = np.zeros_like(told)
    for frame in range(len(cost) - 1, -1, -1):
        signs[frame] = STATES[state]
        state = int(came[frame, state])
    return signs


def _knees(points: FloatArray, names: tuple[str, str, str]) -> FloatArray:
    """Return the cost (T, 4) of each state by which a knee would bend to the front; zero for
    arms."""
    if not names[1].endswith("knee"):
        return np.zeros((len(points), 4))
    hip, knee, ankle = (points[:, LANDMARK_INDEX[name]] for name in names)
    left = points[:, LANDMARK_INDEX["left_hip"]] - points[:, LANDMARK_INDEX["right_hip"]]
    left = left / np.maximum(np.linalg.norm(left, axis=-1, keepdims=True), 1e-9)
    costs = []
    for first, second in STATES:
        thigh, shin = knee - hip, ankle - knee
        thigh, shin = thigh.copy(), shin.copy()
        thigh[:, 2] = first * np.abs(thigh[:, 2])
        shin[:, 2] = second * np.abs(shin[:, 2])
        size = np.linalg.norm(thigh, axis=-1) * np.linalg.norm(shin, axis=-1)
        bend = (np.cross(thigh, shin) * left).sum(-1) / np.maximum(
            size, 1e-9
        )  # positive: the shin goes to the back
        costs.append(np.minimum((np.maximum(-bend - _BACKWARDS, 0) / 0.15) ** 2, _MOST))
    return np.stack(costs, axis=1)
