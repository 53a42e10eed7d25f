"""Positions of the 33 BlazePose landmarks and the usual joints on a body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from a2v.geometry.mesh import piece_of_faces
from a2v.kinematics.names import BLAZEPOSE
from a2v.types import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from torch import Tensor

JOINT_BONES: dict[str, str] = {
    "hips": "root",
    "spine": "spine04",
    "spine1": "spine03",
    "spine2": "spine02",
    "chest": "spine01",
    "neck": "neck01",
    "head": "head",
    **{
        f"{side}_{joint}": f"{bone}.{side[0].upper()}"
        for side in ("left", "right")
        for joint, bone in {
            "collar": "clavicle",
            "shoulder": "upperarm01",
            "elbow": "lowerarm01",
            "wrist": "wrist",
            "hand": "finger3-1",
            "hip": "upperleg01",
            "knee": "lowerleg01",
            "ankle": "foot",
            "toe": "toe1-1",
        }.items()
    },
}
"""Our joint names and the Anny bone whose head is that joint."""

# Landmarks that are joints: mediapipe's own targets lie inside of the limb, at the joint's middle.
_BONES = {
    "shoulder": "upperarm01",
    "elbow": "lowerarm01",
    "wrist": "wrist",
    "pinky": "finger5-1",
    "index": "finger2-1",
    "thumb": "finger1-2",
    "hip": "upperleg01",
    "knee": "lowerleg01",
    "ankle": "foot",
}

# Offsets from the left eye's center (inner and outer corner) and from the nose (left corner of the
# mouth), meters at the default shape, measured on its front view; the nearest vertex of the face is
# taken.
_FACE = {
    "left_eye_inner": (-0.018, -0.002),
    "left_eye_outer": (0.018, 0.0),
    "mouth_left": (0.024, -0.031),
}


def landmark_table(
    rest: FloatArray,
    *,
    faces: IntArray,
    weights: FloatArray,
    bone_names: tuple[str, ...],
    anchors: Mapping[str, FloatArray],
) -> tuple[Tensor, Tensor, Tensor]:
    """Landmarks of a body with Anny's bones, as combinations of vertices and joints.

    Parameters
    ----------
    rest : (V, 3) float32
        Vertices of the default shape at rest, meters.
    faces : (F, 3) int
    weights : (V, B) float32
        Skinning weights.
    bone_names : tuple of B str
    anchors : mapping of str to (3,)
        Positions of the eyes and the ears: ``left_eye``, ``right_eye``, ``left_ear``,
        ``right_ear``; meters.

    Returns
    -------
    vertex_ids : (n,) int64
        The vertices that the landmarks depend on.
    of_vertices : (33, n) float32, of_bones : (33, B) float32
        Landmarks = ``of_vertices @ vertices[vertex_ids] + of_bones @ joints``.
    """
    import torch

    dense = np.zeros((len(BLAZEPOSE), len(rest)))
    bones = np.zeros((len(BLAZEPOSE), len(bone_names)), dtype=np.float32)
    skin = np.flatnonzero((weights[:, bone_names.index("head")] > 0.9) & _on_skin(faces, len(rest)))
    nose = rest[skin[rest[skin, 2].argmax()]]
    for row, name in enumerate(BLAZEPOSE):
        side, joint = name.split("_", 1) if name.startswith(("left", "right")) else ("", name)
        if joint in _BONES:
            bones[row, bone_names.index(f"{_BONES[joint]}.{side[0].upper()}")] = 1.0
        elif joint in ("heel", "foot_index"):
            letter = side[0].upper()
            stem = "foot" if joint == "heel" else "toe1-2"
            own = weights[:, bone_names.index(f"{stem}.{letter}")]
            dense[row, _heel(rest, own) if joint == "heel" else _toe_tip(rest, own)] = 1.0
        elif name in anchors:
            dense[row, skin[np.argsort(((rest[skin] - anchors[name]) ** 2).sum(axis=1))[:6]]] = 1.0
        elif name == "nose":
            dense[row, skin[rest[skin, 2].argmax()]] = 1.0
        else:
            mirror = -1.0 if "right" in name else 1.0
            anchor = nose if "mouth" in name else anchors[f"{side}_eye"]
            target = anchor[:2] + np.array(_FACE[name.replace("right", "left")]) * (mirror, 1.0)
            flat = ((rest[skin, :2] - target) ** 2).sum(axis=1)
            flat[rest[skin, 2] < anchor[2] - 0.05] = np.inf  # not the back of the head
            dense[row, skin[flat.argmin()]] = 1.0
    for row in range(len(BLAZEPOSE)):
        if dense[row].any():
            dense[row] /= dense[row].sum()
    used = np.flatnonzero(dense.any(axis=0))
    return (
        torch.from_numpy(used),
        torch.from_numpy(dense[:, used].astype(np.float32)),
        torch.from_numpy(bones),
    )


def _on_skin(faces: IntArray, count: int) -> BoolArray:
    """Mask of the `count` vertices that belong to the skin, not to eyeballs and tongue: the largest
    connected piece."""
    piece = piece_of_faces(count, faces)
    outer = np.zeros(count, bool)
    outer[faces[piece == np.bincount(piece).argmax()].ravel()] = True
    return outer


def _heel(rest: FloatArray, foot_weights: FloatArray) -> IntArray:
    """Vertices of the heel: the rearmost of the foot, about 2 cm above the sole."""
    own = np.flatnonzero(foot_weights > 0.6)
    score = rest[own, 2] + 0.5 * np.abs(rest[own, 1] - (rest[own, 1].min() + 0.02))
    heel: IntArray = own[np.argsort(score)[:8]]
    return heel


def _toe_tip(rest: FloatArray, toe_weights: FloatArray) -> IntArray:
    """Vertices at the tip of the big toe."""
    own = np.flatnonzero(toe_weights > 0.5)
    tip: IntArray = own[np.argsort(-rest[own, 2])[:8]]
    return tip
