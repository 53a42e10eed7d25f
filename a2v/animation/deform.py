"""Pose a character by skinning (start of Eq. 20 and fast fallback), and the control points S*."""

from __future__ import annotations

import numpy as np

from a2v.errors import InputError
from a2v.geometry.polar import rotations_of
from a2v.types import Character, FloatArray


def skinning_matrices(character: Character, bone_transforms: FloatArray) -> FloatArray:
    """Return matrices (B, 4, 4) float64 that move points of the bind pose with their bones.

    Raises
    ------
    InputError
        `bone_transforms` is not (B, 4, 4) of finite numbers.
    """
    bones = len(character.body.bone_names)
    if np.shape(bone_transforms) != (bones, 4, 4):
        raise InputError(
            f"bone transforms have shape {np.shape(bone_transforms)}; expected ({bones}, 4, 4): "
            "one frame of retarget's result"
        )
    if not np.isfinite(bone_transforms).all():
        raise InputError("bone transforms hold NaN or infinite numbers")
    inverse = np.linalg.inv(character.body.bone_transforms.astype(np.float64))
    matrices: FloatArray = bone_transforms.astype(np.float64) @ inverse
    return matrices


def blended_matrices(character: Character, bone_transforms: FloatArray) -> FloatArray:
    """Return each vertex's blend (V, 3, 4) float64 of its four bones' matrices."""
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
        World from bone, meters: one frame of `retarget`'s result.

    Returns
    -------
    (V, 3) float32
        Vertices, meters.

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


class ControlPoints:
    """The paper's target positions S*: the reposed body plus the displacement map (Eq. 19).

    The displacement of a vertex from its anchor turns with the skin at the anchor. Used alone
    ("free-form deformation" in the paper) these tear the surface where neighboring vertices have
    different anchors; `ArapDeformer` uses them as soft constraints.
    """

    def __init__(self, character: Character):
        from scipy.sparse import csr_matrix

        self.character = character
        body = character.body
        used, self._back = np.unique(character.anchors, return_inverse=True)
        self._strongest = body.weights[used].argmax(axis=1)
        self._weights = csr_matrix(body.weights[used].astype(np.float64))
        self._anchors = body.vertices.astype(np.float64)[used]
        self._shift = character.surface.vertices.astype(np.float64) - self._anchors[self._back]

    def __call__(self, bone_transforms: FloatArray) -> FloatArray:
        """Targets (V, 3) float64 for one frame's bone transforms (B, 4, 4)."""
        matrices = skinning_matrices(self.character, bone_transforms)[:, :3]
        at_anchor = (self._weights @ matrices.reshape(len(matrices), 12)).reshape(-1, 3, 4)
        turns = rotations_of(at_anchor[..., :3], matrices[self._strongest, :, :3])
        reposed = np.einsum("vab,vb->va", at_anchor[..., :3], self._anchors) + at_anchor[..., 3]
        targets: FloatArray = reposed[self._back] + np.einsum(
            "vab,vb->va", turns[self._back], self._shift
        )
        return targets


def control_points(character: Character, bone_transforms: FloatArray) -> FloatArray:
    """`ControlPoints` of one frame, (V, 3) float64."""
    return ControlPoints(character)(bone_transforms)
