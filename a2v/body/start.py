"""Start of a fit: camera and orientation estimated from the keypoints."""

from __future__ import annotations

import numpy as np

from a2v.body.anny import AnnyModel
from a2v.body.evidence import Evidence
from a2v.body.pose_space import pose_space
from a2v.body.unknowns import Unknowns
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.kinematics.so3 import rotmat_to_rotvec
from a2v.kinematics.stature import TYPICAL_HEIGHT
from a2v.types import FloatArray, OrthographicCamera

_HIPS = 0.073
"""Approximate height of the hips of Anny's default adult above the model's origin, meters."""
_TRUNK = 0.29
"""Approximate length of its trunk as a fraction of its height."""


def candidates(evidence: Evidence, model: AnnyModel) -> list[Unknowns]:
    """Return starts for a fit.

    One if the detector gave 3D keypoints; otherwise the natural standing pose at several yaw
    angles around the direction that shoulders and hips indicate.
    """
    space = pose_space(model)
    camera = OrthographicCamera(scale=evidence.height / TYPICAL_HEIGHT, center_u=0.0, center_v=0.0)
    pelvis = (
        _middle(evidence, "hip")
        if _seen(evidence, "hip")
        else _middle(evidence, "shoulder") + np.array([0.0, _TRUNK * evidence.height])
    )
    camera = OrthographicCamera(
        scale=camera.scale,
        center_u=float(pelvis[0]),
        center_v=float(pelvis[1] + camera.scale * _HIPS),
    )
    return [
        Unknowns.build(
            root=root,
            angles=space.natural,
            shape=model.shape_default,
            translation=np.zeros(3),
            camera=camera,
            view=evidence.view,
        )
        for root in _orientations(evidence)
    ]


def _seen(evidence: Evidence, joint: str) -> bool:
    return bool(
        min(evidence.confidence[LANDMARK_INDEX[f"{side}_{joint}"]] for side in ("left", "right"))
        > 0.2
    )


def _middle(evidence: Evidence, joint: str) -> FloatArray:
    """Middle of a pair of landmarks, weighted by confidence, pixels."""
    index = [LANDMARK_INDEX[f"{side}_{joint}"] for side in ("left", "right")]
    weight = evidence.confidence[index] + 1e-6
    middle: FloatArray = (evidence.pixels[index] * weight[:, None]).sum(axis=0) / weight.sum()
    return middle


def _orientations(evidence: Evidence) -> list[FloatArray]:
    """Return rotation vectors of the whole body from which a fit can start."""
    trunk = [
        LANDMARK_INDEX[f"{side}_{joint}"]
        for side in ("left", "right")
        for joint in ("shoulder", "hip")
    ]
    if evidence.points is not None and np.isfinite(evidence.points[trunk]).all():
        point = {name: evidence.points[index] for name, index in LANDMARK_INDEX.items()}
        left = (
            point["left_shoulder"]
            - point["right_shoulder"]
            + point["left_hip"]
            - point["right_hip"]
        )
        up = (
            point["left_shoulder"]
            + point["right_shoulder"]
            - point["left_hip"]
            - point["right_hip"]
        )
        up = up / np.linalg.norm(up)
        left = left - up * (left @ up)
        left = left / np.linalg.norm(left)
        return [rotmat_to_rotvec(np.stack([left, up, np.cross(left, up)], axis=1))]
    widths = []
    for joint in ("shoulder", "hip", "ear"):
        pair = [LANDMARK_INDEX[f"left_{joint}"], LANDMARK_INDEX[f"right_{joint}"]]
        if evidence.confidence[pair].min() > 0.3:
            widths.append(evidence.pixels[pair[0], 0] - evidence.pixels[pair[1], 0])
    facing = sum(widths) >= 0 if widths else True
    yaws = (0.0, 0.8, -0.8) if facing else (np.pi, np.pi - 0.8, np.pi + 0.8)
    return [np.array([0.0, yaw, 0.0]) for yaw in yaws]
