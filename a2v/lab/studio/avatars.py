"""Posable, textured people in a2v's axes for the studios. They stand in T-pose, y up, facing +z, in
meters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import rotvec_to_rotmat
from a2v.record import Record
from a2v.types import ByteArray, FloatArray, IntArray, Surface

_PART_OF_BONE = {
    "Arm": "upper_arm",
    "ForeArm": "lower_arm",
    "Hand": "hand",
    "FingerBase": "hand",
    "UpLeg": "thigh",
    "Leg": "shin",
    "Foot": "foot",
    "ToeBase": "foot",
    "ToeEnd": "foot",
}


def avatar_part(bone: str) -> str:
    """Return the body part, one of `a2v.body.PARTS`, that a bone of the avatars' rig moves."""
    stem = bone.split("_")[0]
    for side in ("Left", "Right"):
        rest = stem.removeprefix(side)
        if rest == stem:
            continue
        if rest in _PART_OF_BONE or rest.startswith("Hand"):
            return f"{side.lower()}_{_PART_OF_BONE.get(rest, 'hand')}"
        if rest.startswith("Eye"):
            return "head"
    if stem.startswith("Neck"):
        return "neck"
    return "head" if stem.startswith("Head") else "torso"


@dataclass(frozen=True, kw_only=True)
class Avatar(Record):
    """A rigged, textured person, all meshes merged.

    Attributes
    ----------
    name : str
        File name without suffix.
    influences : (V, 4, 3) float32
        Position of each vertex in the rest pose, meters, by each of its four bones. The rest vertex
        is their mean weighted by `weights`. (If a file's rest pose is its bind pose, all four are
        equal.)
    weights : (V, 4) float32
        Skinning weights, rows sum to 1.
    bones : (V, 4) int32
        Bones of `weights`.
    faces : (F, 3) int32
        Counter-clockwise seen from outside.
    uv : (F, 3, 2) float32
        Texture coordinates of the faces' corners, origin at the lower left of `texture`.
    texture : (H, W, 3) uint8
        sRGB atlas: the materials' textures side by side.
    materials : (F,) int32
        Material of each face, an index into `material_names`.
    material_names : tuple of str
    mesh_ids : (F,) int32
        Mesh of each face, an index into `mesh_names`.
    mesh_names : tuple of str
        For example the body, two eyes and a wig.
    bone_names : tuple of B str
    bone_parents : (B,) int32
        Parents first, -1 for the root.
    rest_transforms : (B, 4, 4) float32
        World from bone in the rest pose, rigid (without the files' scale).
    parts : (V,) int8
        Body part of each vertex (its heaviest bone's), an index into `a2v.body.PARTS`.
    """

    name: str
    influences: FloatArray
    weights: FloatArray
    bones: IntArray
    faces: IntArray
    uv: FloatArray
    texture: ByteArray
    materials: IntArray
    material_names: tuple[str, ...]
    mesh_ids: IntArray
    mesh_names: tuple[str, ...]
    bone_names: tuple[str, ...]
    bone_parents: IntArray
    rest_transforms: FloatArray
    parts: IntArray

    def __post_init__(self) -> None:
        sizes = {"B": len(self.bone_names)}
        self._check("influences", ("V", 4, 3), sizes)
        self._check("weights", ("V", 4), sizes)
        self._check("bones", ("V", 4), sizes)
        self._check("parts", ("V",), sizes)
        self._check("faces", ("F", 3), sizes)
        self._check("uv", ("F", 3, 2), sizes)
        self._check("materials", ("F",), sizes)
        self._check("mesh_ids", ("F",), sizes)
        self._check("bone_parents", ("B",), sizes)
        self._check("rest_transforms", ("B", 4, 4), sizes)

    def bone_transforms(
        self, rotations: Mapping[str, Sequence[float] | FloatArray] | None = None
    ) -> FloatArray:
        """Return the transforms (B, 4, 4) float32, world from bone, after turning joints.

        Parameters
        ----------
        rotations : mapping of bone name to (3,) rotation vector, radians
            Rotation of each bone (with all bones below it) about its joint, **in the world's axes
            of the rest pose**: ``{"LeftArm": (0, 0, -pi / 2)}`` lowers the left arm of the T-pose
            to the side, and a rotation of ``LeftForeArm`` moves along with it.

        Raises
        ------
        InputError
            A name is not a bone of this avatar.
        """
        given = {} if rotations is None else rotations
        if unknown := [name for name in given if name not in self.bone_names]:
            raise InputError(
                f"avatar {self.name} has no bone '{unknown[0]}'; its bones: "
                f"{', '.join(self.bone_names)}"
            )
        rest = self.rest_transforms.astype(np.float64)
        delta = np.tile(np.eye(3), (len(rest), 1, 1))
        posed = rest.copy()
        for index, (name, parent) in enumerate(
            zip(self.bone_names, self.bone_parents, strict=True)
        ):
            own = (
                np.asarray(rotvec_to_rotmat(np.asarray(given[name], np.float64)))
                if name in given
                else np.eye(3)
            )
            if parent >= 0:
                posed[index, :3, 3] = posed[parent, :3, 3] + delta[parent] @ (
                    rest[index, :3, 3] - rest[parent, :3, 3]
                )
                own = delta[parent] @ own
            delta[index] = own
            posed[index, :3, :3] = own @ rest[index, :3, :3]
        return posed.astype(np.float32)

    def skin(self, bone_transforms: FloatArray) -> FloatArray:
        """Skin the vertices (V, 3) float32, meters, by world-from-bone transforms (B, 4, 4): linear
        blend skinning."""
        moves = bone_transforms.astype(np.float64) @ np.linalg.inv(
            self.rest_transforms.astype(np.float64)
        )
        return linear_blend(self.influences, self.weights, self.bones, moves)

    def surface(
        self,
        rotations: Mapping[str, Sequence[float] | FloatArray] | None = None,
        *,
        ground: bool = True,
    ) -> Surface:
        """Return the posed person as a textured mesh.

        Parameters
        ----------
        rotations
            As in `bone_transforms`.
        ground : bool
            Move it so that the lowest point is y = 0 and the hips are at x = z = 0.
        """
        transforms = self.bone_transforms(rotations)
        vertices = self.skin(transforms)
        if ground:
            hips = transforms[0, :3, 3]
            vertices = vertices - np.array([hips[0], vertices[:, 1].min(), hips[2]], np.float32)
        return Surface(
            vertices=vertices,
            faces=self.faces,
            colors=self.vertex_colors(),
            uv=self.uv,
            texture=self.texture,
            provenance={**self.provenance, "avatar": self.name},
        )

    def texels(self, uv: FloatArray) -> ByteArray:
        """Return the nearest texels (..., 3) uint8 at texture coordinates (..., 2)."""
        height, width = self.texture.shape[:2]
        columns = np.clip((uv[..., 0] * width).astype(int), 0, width - 1)
        rows = np.clip(((1 - uv[..., 1]) * height).astype(int), 0, height - 1)
        return np.asarray(self.texture[rows, columns])

    def vertex_colors(self) -> FloatArray:
        """Return the texture's color at each vertex (nearest texel of one of its corners), sRGB in
        [0, 1]."""
        colors = np.full((len(self.weights), 3), 0.5, np.float32)
        colors[self.faces] = self.texels(self.uv) / np.float32(255)
        return colors


def linear_blend(
    points: FloatArray, weights: FloatArray, bones: IntArray, moves: FloatArray
) -> FloatArray:
    """Linear blend skinning: vertices (V, 3) float32, meters.

    Parameters
    ----------
    points : (V, 3), or (V, K, 3) if each bone has its own rest position of the vertex
    weights : (V, K), rows sum to 1
    bones : (V, K) int
    moves : (B, 4, 4)
        From the rest pose to the new one, world axes.
    """
    if points.ndim == 2:
        points = points[:, None]
    chosen = moves[bones]
    placed = (
        np.einsum("vkij,vkj->vki", chosen[..., :3, :3], np.broadcast_to(points, (*bones.shape, 3)))
        + chosen[..., :3, 3]
    )
    return np.asarray(np.einsum("vk,vki->vi", weights, placed), np.float32)


def a_pose(
    *, arms: float = 40.0, feet: float = 6.0, elbows: float = 12.0, fingers: float = 14.0
) -> dict[str, tuple[float, float, float]]:
    """Return a relaxed standing pose for `Avatar.bone_transforms`.

    Parameters
    ----------
    arms : float
        Angle between the upper arms and the body's vertical, degrees (90: T-pose).
    feet : float
        Spread of each leg, degrees; the soles stay level.
    elbows, fingers : float
        Bend of the elbows (forward) and of each finger joint, degrees.

    Returns
    -------
    dict of bone name to rotation vector, radians, in the world's axes of the T-pose.
    """
    drop, spread, bend, curl = np.radians([90.0 - arms, feet, elbows, fingers])
    pose: dict[str, tuple[float, float, float]] = {}
    for side, sign in (("Left", 1.0), ("Right", -1.0)):
        # the collarbone takes a part of the rotation, as in people, so that the shoulders are not
        # shrugged
        pose[f"{side}Shoulder"] = (0.0, 0.0, -sign * 0.15 * drop)
        pose[f"{side}Arm"] = (0.0, 0.0, -sign * 0.85 * drop)
        pose[f"{side}ForeArm"] = (0.0, -sign * bend, 0.0)
        pose[f"{side}UpLeg"] = (0.0, 0.0, sign * spread)
        pose[f"{side}Foot"] = (0.0, 0.0, -sign * spread)
        for finger in ("Index", "Middle", "Ring", "Pinky"):
            for joint in (1, 2, 3):
                pose[f"{side}Hand{finger}{joint}"] = (0.0, 0.0, -sign * curl)
    return pose
