"""Measure how closely a retargeted clip follows the motion, and its contact with the ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.animation.posture import standing_posture, straightened, upright_back
from a2v.animation.rig import SIDES, Rig, joints_of, place, rig_of
from a2v.animation.source import heading_rotmat, source_joints
from a2v.geometry.vectors import unit
from a2v.lab.evaluation.physics import foot_skating
from a2v.types import Body, FloatArray, Motion

_LIMB_BONES = (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))


@dataclass(frozen=True)
class RetargetQuality:
    """Measures of one clip on one body.

    Attributes
    ----------
    error : float
        Mean distance in meters of hips, knees, ankles, shoulders, elbows and wrists from their
        expected places, with the middle of the hips in common. The expected places follow from the
        body's bone lengths and the rotations of the motion's bones from its standing posture.
    plain_error : float
        The same with the motion's own bone directions, independent of its skeleton's standing
        posture.
    skating : float
        `a2v.lab.evaluation.physics.foot_skating` of ankles and balls of the feet.
    penetration : float
        Mean over frames of the depth in meters of the deepest point of the skin under the ground.
    deepest : float
        Its largest value.
    hover : float
        Mean over frames of the height in meters of the skin's lowest point over the ground.
    """

    error: float
    plain_error: float
    skating: float
    penetration: float
    deepest: float
    hover: float


def measure_retargeting(motion: Motion, body: Body, transforms: FloatArray) -> RetargetQuality:
    """Compare a clip with the result of `retarget` with ``level="never"``.

    Parameters
    ----------
    motion : Motion
        One clip of T frames.
    body : Body
    transforms : (T, B, 4, 4) float
        World from bone, meters.
    """
    rig = rig_of(body)
    world = transforms.astype(np.float64)
    joints = joints_of(world, rig)
    source = source_joints(motion)
    turn = heading_rotmat(source)
    source = {name: points @ turn.T for name, points in source.items()}
    middle = 0.5 * (joints["left_hip"] + joints["right_hip"])

    def distance(wanted: dict[str, FloatArray]) -> float:
        return float(
            np.mean(
                [
                    np.linalg.norm(joints[name] - middle - wanted[name], axis=-1).mean()
                    for name in wanted
                ]
            )
        )

    posture = standing_posture(motion)
    pelvis = rig.bones["pelvis"]
    back = upright_back(_torso(source), world[:, pelvis, :3, :3] @ rig.rest[pelvis].T, posture, rig)
    lowest = place(rig.skin, world)[..., 1].min(-1)
    feet = np.stack(
        [joints[f"{side}_{name}"] for side in SIDES for name in ("ankle", "foot")], axis=1
    )
    return RetargetQuality(
        error=distance(_scaled(straightened(source, posture, rig), back, rig)),
        plain_error=distance(_scaled(source, _torso(source), rig)),
        skating=foot_skating(feet, motion.fps),
        penetration=float(np.maximum(-lowest, 0).mean()),
        deepest=float(np.maximum(-lowest, 0).max()),
        hover=float(np.maximum(lowest, 0).mean()),
    )


def _torso(source: dict[str, FloatArray]) -> FloatArray:
    shoulders, hips = (
        0.5 * (source[f"left_{joint}"] + source[f"right_{joint}"]) for joint in ("shoulder", "hip")
    )
    return shoulders - hips


def _scaled(source: dict[str, FloatArray], back: FloatArray, rig: Rig) -> dict[str, FloatArray]:
    """Joints relative to the middle of the hips that have the source's bone directions and the
    body's bone lengths."""

    torso = unit(back) * np.linalg.norm(rig.middle("shoulder") - rig.middle("hip"))
    out: dict[str, FloatArray] = {}
    for base, start in (("hip", np.zeros_like(torso)), ("shoulder", torso)):
        across = (
            unit(source[f"left_{base}"] - source[f"right_{base}"])
            * rig.length(f"left_{base}", f"right_{base}")
            / 2
        )
        out[f"left_{base}"], out[f"right_{base}"] = start + across, start - across
    for side in SIDES:
        for a, b in _LIMB_BONES:
            step = unit(source[f"{side}_{b}"] - source[f"{side}_{a}"])
            out[f"{side}_{b}"] = out[f"{side}_{a}"] + step * rig.length(
                f"{side}_{a}", f"{side}_{b}"
            )
    return out
