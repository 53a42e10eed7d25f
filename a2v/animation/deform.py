"""Posing a character by skinning: the start of Eq. 20 and the fast fallback, and the paper's control points S*."""

from __future__ import annotations

import numpy as np

from a2v.animation.polar import rotations_of
from a2v.errors import InputError
from a2v.types import Character, FloatArray


def skinning_matrices(character: Character, bone_transforms: FloatArray) -> FloatArray:
    """Matrices (B, 4, 4) float64 that move points of the bind pose with their bones.

    Raises
    ------
    InputError
        `bone_transforms` is not (B, 4, 4) of finite numbers.
    """
    bones = len(character.body.bone_names)
    if np.shape(bone_transforms) != (bones, 4, 4):
        raise InputError(
            f"bone transforms have shape {np.shape(bone_transforms)}; expected ({bones}, 4, 4): one frame of retarget's result"
        )
    if not np.isfinite(bone_transforms).all():
        raise InputError("bone transforms hold NaN or infinite numbers")
    inverse = np.linalg.inv(character.body.bone_transforms.astype(np.float64))
    matrices: FloatArray = bone_transforms.astype(np.float64) @ inverse
    return matrices


def blended_matrices(character: Character, bone_transforms: FloatArray) -> FloatArray:
    """Each vertex's blend (V, 3, 4) float64 of its four bones' matrices."""
    matrices = skinning_matrices(character, bone_transforms)[:, :3]
    weights = character.weights.astype(np.float64)
    flat = matrices.reshape(len(matrices), 12)
    blended = sum(weights[:, k, None] * flat[character.bones[:, k]] for k in range(4))
    result: FloatArray = np.reshape(blended, (-1, 3, 4))
    return result


def deform(character: Character, bone_transforms: FloatArray) -> FloatArray:
    """Linear blend skinning of a character's surface.

    Parameters
    ----------
    character : Character
    bone_transforms : (B, 4, 4) float
        World from bone, metres: one frame of `retarget`'s result.

    Returns
    -------
    (V, 3) float32
        Vertices, metres.

    Raises
    ------
    InputError
        Wrong shape or not finite.
    """
    blended = blended_matrices(character, bone_transforms)
    vertices = character.surface.vertices.astype(np.float64)
    posed = np.einsum("vab,vb->va", blended[..., :3], vertices) + blended[..., 3]
    vertices_now: FloatArray = posed.astype(np.float32)
    return vertices_now


def control_points(character: Character, bone_transforms: FloatArray) -> FloatArray:
    """The paper's target positions S* (V, 3) float64: the reposed body plus the displacement map (Eq. 19).

    The displacement of a vertex from its anchor turns with the skin at the anchor. Used alone ("free-form deformation" in the
    paper) these tear where neighbouring vertices have different anchors: `ArapDeformer` is what they are for.
    """
    matrices = skinning_matrices(character, bone_transforms)[:, :3]
    body = character.body
    used, back = np.unique(character.anchors, return_inverse=True)
    weights = body.weights[used].astype(np.float64)
    bones = np.flatnonzero(weights.any(axis=0))
    at_anchor = (weights[:, bones] @ matrices[bones].reshape(len(bones), 12)).reshape(-1, 3, 4)
    turns = rotations_of(at_anchor[..., :3], matrices[weights.argmax(axis=1), :, :3])
    anchors = body.vertices.astype(np.float64)[used]
    reposed = np.einsum("vab,vb->va", at_anchor[..., :3], anchors) + at_anchor[..., 3]
    shift = character.surface.vertices.astype(np.float64) - anchors[back]
    targets: FloatArray = reposed[back] + np.einsum("vab,vb->va", turns[back], shift)
    return targets
