"""Compute the rest pose and the bone axes of another rig from a body's own bones."""

from __future__ import annotations

import numpy as np

from a2v.animation.rig_spec import RigBone, RigSpec, world_direction
from a2v.errors import InputError
from a2v.geometry.vectors import unit
from a2v.kinematics import rotvec_to_rotmat, swing_between
from a2v.types import Body, FloatArray, IntArray

_AXES = {"x": 0, "y": 1, "z": 2}


def bones_of(body: Body, spec: RigSpec) -> tuple[IntArray, IntArray]:
    """Match the bones of a rig to the bones of a body.

    Parameters
    ----------
    body : Body
    spec : RigSpec

    Returns
    -------
    drivers : (K,) int
        Body's bone at the head of each of `spec.bones`.
    owner : (B,) int
        Index into `spec.bones` for each bone of the body: its own bone, or that of its nearest
        ancestor.

    Raises
    ------
    InputError
        The body lacks a bone that the rig needs.
    """
    index = {name: bone for bone, name in enumerate(body.bone_names)}
    if missing := [source for bone in spec.bones for source in bone.sources if source not in index]:
        raise InputError(
            f"the rig '{spec.name}' is made of Anny's bones; body model '{body.model}' has no "
            f"{missing[0]}: leave --rig out, or use --fit.model anny"
        )
    drivers = np.array([index[bone.sources[0]] for bone in spec.bones])
    owner = np.full(len(body.bone_names), -1)
    for place, made_of in enumerate(spec.bones):
        owner[[index[source] for source in made_of.sources]] = place
    for bone, parent in enumerate(body.bone_parents.tolist()):
        if owner[bone] < 0:
            owner[bone] = owner[parent] if parent >= 0 else 0
    return drivers, owner


def heads_of(body: Body, spec: RigSpec, drivers: IntArray, transforms: FloatArray) -> FloatArray:
    """Heads (..., K, 3) of a rig's bones for transforms (..., B, 4, 4) of the body's bones."""
    rest = body.rest_transforms.astype(np.float64)
    index = {name: bone for bone, name in enumerate(body.bone_names)}
    points = np.stack(
        [rest[[index[name] for name in bone.at], :3, 3].mean(axis=0) for bone in spec.bones]
    )
    local = np.einsum("kca,kc->ka", rest[drivers, :3, :3], points - rest[drivers, :3, 3])
    leading = transforms[..., drivers, :, :]
    heads: FloatArray = (
        np.einsum("...kac,kc->...ka", leading[..., :3, :3], local) + leading[..., :3, 3]
    )
    return heads


def tails_of(body: Body, spec: RigSpec, drivers: IntArray, transforms: FloatArray) -> FloatArray:
    """Tails (K, 3) of a rig's bones for transforms (B, 4, 4) of the body's bones."""
    places = {bone.name: place for place, bone in enumerate(spec.bones)}
    heads = heads_of(body, spec, drivers, transforms)
    fitted = body.bone_transforms.astype(np.float64)
    own = np.einsum(
        "bca,bc->ba", fitted[:, :3, :3], body.bone_tails.astype(np.float64) - fitted[:, :3, 3]
    )
    tails = np.einsum("bac,bc->ba", transforms[:, :3, :3], own) + transforms[:, :3, 3]
    ends = [
        heads[places[bone.tail]] if bone.tail else tails[driver]
        for bone, driver in zip(spec.bones, drivers, strict=True)
    ]
    return np.stack(ends)


def rest_transforms(body: Body, spec: RigSpec) -> FloatArray:
    """The body's bones (B, 4, 4) float64, world from bone, in the rig's rest pose.

    Each bone that has a direction turns towards it the short way, after its parents; a foot turns
    only about the vertical. The hips are above the origin, at the height of the body's own rest
    pose.
    """
    rest = body.rest_transforms.astype(np.float64)
    drivers, _ = bones_of(body, spec)
    vectors = tails_of(body, spec, drivers, rest) - heads_of(body, spec, drivers, rest)
    wanted = {
        int(driver): (bone, vector)
        for bone, driver, vector in zip(spec.bones, drivers, vectors, strict=True)
        if bone.direction
    }
    turns, made = np.tile(np.eye(3), (len(rest), 1, 1)), rest.copy()
    for bone, parent in enumerate(body.bone_parents.tolist()):
        if parent >= 0:
            turns[bone] = turns[parent]
            made[bone, :3, 3] = made[parent, :3, 3] + turns[parent] @ (
                rest[bone, :3, 3] - rest[parent, :3, 3]
            )
        if bone in wanted:
            turns[bone] = _turned(*wanted[bone], turns[bone])
        made[bone, :3, :3] = turns[bone] @ rest[bone, :3, :3]
    made[:, [0, 2], 3] -= heads_of(body, spec, drivers, made)[0, [0, 2]]
    return made


def _turned(bone: RigBone, vector: FloatArray, turn: FloatArray) -> FloatArray:
    """Rotation (3, 3) from the body's rest pose that points a bone along `vector` in the rig's
    direction; `turn` is the rotation of its parent."""
    if bone.direction == "ahead":
        return rotvec_to_rotmat(np.array([0.0, -np.arctan2(vector[0], vector[2]), 0.0]))
    made: FloatArray = (
        rotvec_to_rotmat(swing_between(turn @ vector, world_direction(bone.direction))) @ turn
    )
    return made


def bone_axes(spec: RigSpec, vectors: FloatArray) -> FloatArray:
    """Orientations (K, 3, 3), world from bone, of a rig's bones along `vectors` (K, 3) in the rest
    pose."""
    if not spec.along:
        return np.tile(np.eye(3), (len(spec.bones), 1, 1))
    first, second = _AXES[spec.along[1]], _AXES[spec.toward[1]]
    signs = np.array(
        [-1.0 if spec.along[0] == "-" else 1.0, -1.0 if spec.toward[0] == "-" else 1.0]
    )
    frames = np.zeros((len(spec.bones), 3, 3))
    for place, (bone, vector) in enumerate(zip(spec.bones, vectors, strict=True)):
        reverse = -1.0 if spec.mirrored and bone.sources[0].endswith(".R") else 1.0
        along = unit(vector)
        aim = world_direction(bone.toward)
        toward = unit(aim - along * float(along @ aim))
        frames[place, :, first], frames[place, :, second] = (
            along * signs[0] * reverse,
            toward * signs[1] * reverse,
        )
        third = 3 - first - second
        frames[place, :, third] = np.cross(
            frames[place, :, (third + 1) % 3], frames[place, :, (third + 2) % 3]
        )
    return frames
