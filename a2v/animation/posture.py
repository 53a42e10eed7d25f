"""Posture of a skeleton whose person stands upright, to keep feet flat and backs straight.

Data sets place the joints of toes, knees and hips centimeters away from the rig's, which changes
the direction of a bone by ten degrees and more. A pose that is upright in the motion must be
upright on the body, so rotations are taken from *standing* to standing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.animation.rig import SIDES, Rig
from a2v.kinematics import rotvec_to_rotmat
from a2v.kinematics.names import canonical_joints
from a2v.types import FloatArray, Motion

_TABLES: dict[str, dict[str, float]] = {
    "humanact12": {
        "lean": 0.8,
        "spine1 below": 1.5,
        "spine1 above": 13.5,
        "spine2 below": 8.6,
        "spine2 above": 10.3,
        "neck": 33.5,
        "dip": -39.0,
        "knee": 20.0,
    },
    "cmu": {"lean": -1.9, "neck": 12.1, "dip": -12.0, "knee": 24.0},
}
"""Standing postures in the data sets, degrees: medians over frames in which the person stands still
and upright; those of the spine over all upright frames (`scripts/fit_posture.py` reproduces them
within 4 degrees). "lean", "neck", "dip" and "knee" as in `Posture`; "spine1 below" and "above":
forward lean from the middle of the hips to that joint, and from there to the middle of the
shoulders."""

SOFT_KNEE = 12.0
"""Largest bend in degrees, above that of the rest pose, that is attributed to an unknown skeleton;
chosen by eye."""


@dataclass(frozen=True, kw_only=True)
class Posture:
    """Directions of a skeleton's bones while its person stands upright and faces +z; angles in
    degrees.

    Attributes
    ----------
    lean : float or None
        Lean from the middle of the hips to the middle of the shoulders, positive forward; None
        takes the rig's.
    back : dict of str to pair of (3,) float64
        Directions from the middle of the hips to a spine joint, and from there to the middle of the
        shoulders.
    neck : (3,) float64 or None
        Direction from the neck to the head; None takes the rig's.
    dip : float or None
        Angle of the line from the ankle to the ball of the foot above the horizon (negative: down);
        None: unknown.
    knee : float
        Largest bend that counts as a straight leg. Clips that straighten the leg further give a
        smaller value.
    """

    lean: float | None
    back: dict[str, tuple[FloatArray, FloatArray]]
    neck: FloatArray | None
    dip: float | None
    knee: float


def table_of(skeleton: str) -> dict[str, float]:
    """Standing posture in the data set of the skeleton, degrees (see `scripts/fit_posture.py`);
    empty for other skeletons."""
    return dict(_TABLES.get(skeleton, {}))


def standing_posture(motion: Motion) -> Posture:
    """Find the posture of a motion's skeleton from its BVH rest pose, else from the data set's
    table."""
    rest = _rest_pose(motion)
    if rest is None:
        table = table_of(motion.skeleton)
        joints = [key.removesuffix(" below") for key in table if key.endswith(" below")]
        return Posture(
            lean=table.get("lean"),
            back={
                joint: (_forward(table[f"{joint} below"]), _forward(table[f"{joint} above"]))
                for joint in joints
            },
            neck=_forward(table["neck"]) if "neck" in table else None,
            dip=table.get("dip"),
            knee=table.get("knee", SOFT_KNEE),
        )
    hips, shoulders = (
        0.5 * (rest[f"left_{joint}"] + rest[f"right_{joint}"]) for joint in ("hip", "shoulder")
    )
    dips, knees = [], []
    for side in SIDES:
        if f"{side}_foot" in rest:
            dips.append(_dip(rest[f"{side}_foot"] - rest[f"{side}_ankle"]))
        knees.append(float(np.degrees(knee_bend(rest, side))))
    return Posture(
        lean=lean_of(shoulders - hips),
        back={
            name: (point - hips, shoulders - point)
            for name, point in rest.items()
            if name.startswith("spine")
        },
        neck=rest["head"] - rest["neck"] if "head" in rest and "neck" in rest else None,
        dip=float(np.mean(dips)) if dips else None,
        knee=float(np.mean(knees)) + SOFT_KNEE,
    )


def straightened(
    source: dict[str, FloatArray], posture: Posture, rig: Rig
) -> dict[str, FloatArray]:
    """Straighten knees to those of the rig where the person straightens them, and keep the distance
    of the feet.

    The input and the result are canonical joints (T, 3). The bend of a straight leg is the 5 %
    quantile of the clip's bends, at most `Posture.knee`. The part of it above six tenths of the
    rig's own bend at rest is subtracted from all frames. Shins turn in the plane of the knee and
    move the feet. If the hips are narrower or wider than the rig's, the legs turn sideways by at
    most 3.5 degrees.
    """
    source = _keep_foot_distance(source, rig)
    bends = {side: knee_bend(source, side) for side in SIDES}
    straight = min(
        np.deg2rad(posture.knee), float(np.quantile(np.concatenate(list(bends.values())), 0.05))
    )
    at_rest = float(np.mean([knee_bend(rig.joints, side) for side in SIDES]))
    excess = straight - 0.6 * at_rest
    if excess <= 0:
        return source
    out = dict(source)
    soft = np.deg2rad(3.0)
    for side, bend in bends.items():
        thigh, shin = (
            source[f"{side}_knee"] - source[f"{side}_hip"],
            source[f"{side}_ankle"] - source[f"{side}_knee"],
        )
        axis = np.cross(thigh, shin)
        axis = axis / np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-12)
        less = np.minimum(
            bend - soft * np.logaddexp(0, (bend - excess) / soft), bend
        )  # never past straight
        turned = np.einsum("tab,tb->ta", rotvec_to_rotmat(-less[:, None] * axis), shin)
        for name in (f"{side}_ankle", f"{side}_foot", f"{side}_toes"):
            if name in out:
                out[name] = source[name] + turned - shin
    return out


def _keep_foot_distance(source: dict[str, FloatArray], rig: Rig) -> dict[str, FloatArray]:
    """Turn legs at the hips so that the distance of the feet is kept on the rig's wider or narrower
    hips."""
    across = source["left_hip"] - source["right_hip"]
    width = np.linalg.norm(across, axis=-1, keepdims=True)
    legs = {side: source[f"{side}_ankle"] - source[f"{side}_hip"] for side in SIDES}
    longest = max(float(np.quantile(np.linalg.norm(leg, axis=-1), 0.95)) for leg in legs.values())
    if longest <= 1e-9:
        return source
    excess = (
        rig.length("left_hip", "right_hip") / rig.leg_length - float(np.median(width)) / longest
    )
    angle = np.clip(np.arcsin(np.clip(excess / 2, -1, 1)), -np.deg2rad(3.5), np.deg2rad(3.5))
    out = dict(source)
    for side, leg in legs.items():
        outward = across if side == "left" else -across
        axis = np.cross(outward, leg)  # turns the leg inwards; shorter where it points sideways
        turn = rotvec_to_rotmat(angle * axis / np.maximum(width * longest, 1e-12))
        for name in (f"{side}_knee", f"{side}_ankle", f"{side}_foot", f"{side}_toes"):
            if name in out:
                out[name] = source[f"{side}_hip"] + np.einsum(
                    "tab,tb->ta", turn, source[name] - source[f"{side}_hip"]
                )
    return out


def upright_back(back: FloatArray, pelvis: FloatArray, posture: Posture, rig: Rig) -> FloatArray:
    """Rotate vectors (T, 3) from hips to shoulders by the rotation from the skeleton's upright back
    to the rig's; `pelvis` (T, 3, 3) from rest."""
    if posture.lean is None:
        return back
    turn = rotvec_to_rotmat(
        np.array(
            [
                np.deg2rad(lean_of(rig.middle("shoulder") - rig.middle("hip")) - posture.lean),
                0.0,
                0.0,
            ]
        )
    )
    turned: FloatArray = np.einsum("tab,bc,tdc,td->ta", pelvis, turn, pelvis, back)
    return turned


def foot_pitch(
    source: dict[str, FloatArray], side: str, posture: Posture, rest_foot: FloatArray, fps: float
) -> float:
    """Angle in radians about the foot's left-pointing axis that makes a flat foot of the motion
    flat in the rig.

    A foot that is low and at rest at both ends is taken as flat. The skeleton's own dip has the
    weight of a third of a second of such frames. Dips more than 35 degrees from it are tiptoes or
    heels and do not count.

    Parameters
    ----------
    source : dict of canonical joint to (T, 3)
        Meters at the body's size.
    side : "left" or "right"
    posture : Posture
    rest_foot : (3,) float
        From the ankle to the ball of the foot in the rig at rest.
    fps : float
    """
    ankle, ball = source[f"{side}_ankle"], source[f"{side}_foot"]
    dips = np.degrees(
        np.arcsin(
            np.clip(
                (ball - ankle)[:, 1] / np.maximum(np.linalg.norm(ball - ankle, axis=-1), 1e-12),
                -1,
                1,
            )
        )
    )
    rest = _dip(rest_foot)
    speed = np.zeros(len(ankle))
    if len(ankle) > 1:
        speed = np.maximum(
            *(
                np.linalg.norm(np.gradient(points, axis=0), axis=-1) * fps
                for points in (ankle, ball)
            )
        )
    low = (
        sum(
            np.exp(-((np.maximum(p[:, 1] - np.quantile(p[:, 1], 0.1), 0) / 0.04) ** 2))
            for p in (ankle, ball)
        )
        - 1
    )
    weight = np.exp(-((speed / 0.2) ** 2)) * np.clip(low, 0, 1)
    prior, strength = (posture.dip, fps / 3) if posture.dip is not None else (rest, 0.2)
    weight = weight * (np.abs(dips - prior) < (35 if posture.dip is not None else 60))
    flat = (strength * prior + float((weight * dips).sum())) / (strength + float(weight.sum()))
    return float(
        np.deg2rad(flat - rest)
    )  # a positive turn about the left-pointing axis lowers the toes


def knee_bend(joints: dict[str, FloatArray], side: str) -> FloatArray:
    """Angle (...) in radians between thigh and shin; 0 for a straight leg."""
    thigh, shin = (
        joints[f"{side}_knee"] - joints[f"{side}_hip"],
        joints[f"{side}_ankle"] - joints[f"{side}_knee"],
    )
    angle: FloatArray = np.arctan2(
        np.linalg.norm(np.cross(thigh, shin), axis=-1), (thigh * shin).sum(-1)
    )
    return angle


def lean_of(vector: FloatArray) -> float:
    """Degrees by which a vector (3,) leans forward (+z) from +y."""
    return float(np.degrees(np.arctan2(vector[2], vector[1])))


def _dip(vector: FloatArray) -> float:
    return float(np.degrees(np.arcsin(vector[1] / max(float(np.linalg.norm(vector)), 1e-12))))


def _forward(degrees: float) -> FloatArray:
    angle = np.deg2rad(degrees)
    return np.array([0.0, np.cos(angle), np.sin(angle)])


def _rest_pose(motion: Motion) -> dict[str, FloatArray] | None:
    """Canonical joints of a BVH file's rest pose, facing +z; None if it is missing or is not a
    standing person."""
    offsets = motion.rest_offsets
    if offsets is None:
        return None
    points = np.zeros_like(offsets)
    for j in range(1, len(points)):
        points[j] = points[motion.parents[j]] + offsets[j]
    found = canonical_joints(motion.joint_names, motion.parents.tolist())
    rest = {name: points[index] for name, index in found.items()}
    hips, shoulders = (
        0.5 * (rest["left_hip"] + rest["right_hip"]),
        0.5 * (rest["left_shoulder"] + rest["right_shoulder"]),
    )
    torso, across = shoulders - hips, rest["left_hip"] - rest["right_hip"]
    if (
        torso[1] < 0.94 * np.linalg.norm(torso)
        or np.linalg.norm(across) < 1e-6
        or abs(across[1]) > 0.2 * np.linalg.norm(across)
    ):
        return None
    yaw = np.arctan2(across[2], across[0])
    turn = rotvec_to_rotmat(np.array([0.0, yaw, 0.0]))
    return {name: turn @ point for name, point in rest.items()}
