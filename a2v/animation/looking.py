"""Turn the head of a body to where a person looks: the camera, a side, a point."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from a2v.animation.hands import turn_bones
from a2v.animation.rig import Rig
from a2v.errors import InputError
from a2v.geometry.vectors import unit
from a2v.kinematics import rotvec_to_rotmat
from a2v.kinematics.ground import smoothed
from a2v.kinematics.skeleton import subtree
from a2v.types import FloatArray

LOOKS: dict[str, tuple[float, float]] = {
    "ahead": (0.0, 0.0),
    "left": (60.0, 0.0),
    "right": (-60.0, 0.0),
    "up": (0.0, 35.0),
    "down": (0.0, -35.0),
    "back": (75.0, 0.0),
}
"""Yaw to the left and pitch upwards of a look from the chest, degrees."""
CAMERA = "camera"
"""Looks ahead of the scene (+z), where the camera of the front view is."""
MOST_YAW = np.deg2rad(75.0)
"""Largest turn of neck and head together."""
MOST_PITCH = np.deg2rad(40.0)
"""Largest nod of neck and head together."""
HEAD_SHARE = 0.6
"""Share of the head in the turn; the neck has the rest."""
SMOOTH_SECONDS = 0.12


def read_look(text: str) -> FloatArray | str:
    """Read where a person looks: a word of `LOOKS`, "camera", or a point "x,y,z" in meters.

    Raises
    ------
    InputError
        The text is none of these.
    """
    if text in LOOKS or text == CAMERA:
        return text
    try:
        point = np.array([float(part) for part in text.split(",")])
    except ValueError:
        point = np.zeros(0)
    if point.shape != (3,) or not np.isfinite(point).all() or np.abs(point).max() > 1000:
        raise InputError(
            f"look is '{text}'; expected {CAMERA}, {', '.join(LOOKS)}, or a point x,y,z in meters"
        )
    return point


def look_at(
    transforms: FloatArray, rig: Rig, fps: float, looks: Sequence[str], shares: FloatArray
) -> FloatArray:
    """Turn neck and head of bone transforms.

    Parameters
    ----------
    transforms : (T, B, 4, 4) float64
        World from bone.
    rig : Rig
        One without a head stays as it is.
    fps : float
    looks : A str
        Where to look (`read_look`); "" leaves the head.
    shares : (T, A) float
        Weight of each look per frame.

    Returns
    -------
    (T, B, 4, 4) float64
    """
    chain = rig.chains["neck"]
    if "head" not in rig.bones or not chain or not any(looks):
        return transforms
    head, upper = rig.bones["head"], (rig.chains["spine"] or [rig.bones["pelvis"]])[-1]
    front = np.array([0.0, 0.0, 1.0])
    chest = transforms[:, upper, :3, :3] @ (rig.rest[upper].T @ front)
    face = transforms[:, head, :3, :3] @ (rig.rest[head].T @ front)
    heading = np.unwrap(np.arctan2(chest[:, 0], chest[:, 2]))
    turn, lift = np.zeros(len(face)), np.zeros(len(face))
    for look, share in zip(looks, shares.T, strict=True):
        if not look:
            continue
        yaw, pitch = _wanted(look, transforms[:, head, :3, 3], heading)
        yaw = np.clip(_around(yaw - heading), -MOST_YAW, MOST_YAW)
        pitch = np.clip(pitch, -MOST_PITCH, MOST_PITCH)
        now = _around(np.arctan2(face[:, 0], face[:, 2]) - heading)
        turn += share * (yaw - now)
        lift += share * (pitch - np.arcsin(np.clip(face[:, 1], -1, 1)))
    turn, lift = (smoothed(one[:, None], SMOOTH_SECONDS * fps)[:, 0] for one in (turn, lift))
    out = transforms.copy()
    right = unit(np.cross(face, np.array([0.0, 1.0, 0.0])))
    for bone in (*chain, head):
        own = HEAD_SHARE if bone == head else (1 - HEAD_SHARE) / len(chain)
        rotmat = rotvec_to_rotmat(own * turn[:, None] * np.array([0.0, 1.0, 0.0]))
        rotmat = rotmat @ rotvec_to_rotmat(own * lift[:, None] * right)
        turn_bones(out, subtree(rig.parents, bone), rotmat)
    return out


def _wanted(look: str, head: FloatArray, heading: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Yaw and pitch (T,) of a look from heads at places (T, 3)."""
    target = read_look(look)
    if look in LOOKS:
        yaw, pitch = np.deg2rad(LOOKS[look])
        return heading + yaw, np.full(len(heading), pitch)
    if look == CAMERA:
        return np.zeros(len(heading)), np.zeros(len(heading))
    way = np.asarray(target, np.float64) - head
    return np.arctan2(way[:, 0], way[:, 2]), np.arctan2(way[:, 1], np.hypot(way[:, 0], way[:, 2]))


def _around(angle: FloatArray) -> FloatArray:
    turned: FloatArray = (angle + np.pi) % (2 * np.pi) - np.pi
    return turned
