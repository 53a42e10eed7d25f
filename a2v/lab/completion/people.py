"""True colors of the studio's people on the sheets of the body, and which places a photo shows."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from a2v.body.parts import PART_NEIGHBORS, PARTS
from a2v.errors import InputError
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.rays import RayScene, at_barycentric
from a2v.lab.completion.layout import COLUMNS, ROWS, skin_sheets
from a2v.lab.studio.avatar_files import list_avatars
from a2v.lab.studio.avatars import Avatar, a_pose
from a2v.lab.studio.guide import Guide, guide_key
from a2v.lab.studio.makehuman.dressing import Dresser
from a2v.lab.studio.posing import Pose
from a2v.lab.studio.quick.people import quick_split_of
from a2v.lab.studio.stand import Outfit, PreparedAvatar, prepare_avatar, stand
from a2v.lab.studio.texture import sample_bilinear
from a2v.lab.studio.variation import Build, split_of
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray

_REACH = 0.14
"""Largest distance of cloth from the skin, meters."""
_INSIDE = 0.03
"""Depth below the skin from which rays start, meters."""
_LIFT = 0.03
"""Other limbs count as occluding from this distance before a place, meters."""
_MARGIN = 0.011
"""Distance, across the picture, from other limbs up to which places are not trusted, meters."""


def _alike() -> BoolArray:
    """Which pairs of parts (P, P) may lie on one another: the same, neighbors, and hair on the
    trunk."""
    same = np.eye(len(PARTS), dtype=bool)
    for first, second in (*PART_NEIGHBORS, ("head", "torso")):
        one, two = PARTS.index(first), PARTS.index(second)
        same[one, two] = same[two, one] = True
    return same


@dataclass(frozen=True, eq=False)
class OnSheets:
    """The places of an avatar's mesh at the pixels of the sheets.

    Attributes
    ----------
    where : (n,) int
        Pixels, indices into a flat (2, ROWS, COLUMNS).
    faces : (n,) int, barycentric : (n, 2)
        The place of the avatar there.
    """

    where: IntArray
    faces: IntArray
    barycentric: FloatArray


def place_on_sheets(avatar: Avatar, guide: Guide) -> OnSheets:
    """Find the outermost place of a dressed avatar along the normals of the body under it, both in
    A-pose."""
    transforms = avatar.bone_transforms(a_pose(arms=45.0))
    body = guide.posed(avatar, Build(), transforms).astype(np.float64)
    dressed = avatar.skin(transforms).astype(np.float64)
    sheets, faces, _ = skin_sheets()
    where = np.flatnonzero(sheets.filled.ravel())
    corner = faces[sheets.face.ravel()[where]]
    weight = sheets.barycentric.reshape(-1, 3)[where].astype(np.float64)
    normals = vertex_normals(body, faces)
    point, normal = (np.einsum("nk,nki->ni", weight, values[corner]) for values in (body, normals))
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    part = guide.parts[corner[np.arange(len(corner)), weight.argmax(axis=1)]]
    rays = RayScene(dressed.astype(np.float32), avatar.faces)
    face, uv = _outermost(avatar, rays, point, normal, part)
    lost = np.flatnonzero(face < 0)
    near = rays.closest(point[lost].astype(np.float32))
    face[lost], uv[lost] = near.face, near.barycentric
    return OnSheets(where, face, uv)


def _outermost(
    avatar: Avatar, rays: RayScene, point: FloatArray, normal: FloatArray, part: IntArray
) -> tuple[IntArray, FloatArray]:
    """The farthest hit (n,), -1 for none, of the rays along the normals that belongs to the `part`
    (n,), and its barycentric coordinates (n, 2)."""
    query = np.concatenate([point - _INSIDE * normal, normal], axis=1).astype(np.float32)
    found = rays._scene.list_intersections(query)
    ray = found["ray_ids"].numpy().astype(np.int64)
    distance = found["t_hit"].numpy()
    hit = found["primitive_ids"].numpy().astype(np.int64)
    good = (distance < _REACH + _INSIDE) & _alike()[part[ray], avatar.parts[avatar.faces[hit, 0]]]
    order = np.flatnonzero(good)
    order = order[np.argsort(distance[order], kind="stable")]
    face, uv = np.full(len(point), -1), np.zeros((len(point), 2), np.float32)
    face[ray[order]] = hit[order]
    uv[ray[order]] = found["primitive_uvs"].numpy()[order]
    return face, uv


def sheet_colors(avatar: Avatar, texture: ByteArray, placed: OnSheets) -> ByteArray:
    """Colors (2, ROWS, COLUMNS, 3) of an avatar's texture, sRGB; black outside."""
    height, width = texture.shape[:2]
    soft = cv2.GaussianBlur(texture, (0, 0), width / 900)
    at = at_barycentric(avatar.uv[placed.faces], placed.barycentric)
    pixels = np.stack([at[:, 0] * width - 0.5, (1 - at[:, 1]) * height - 0.5], axis=1)
    colors = np.zeros((2 * ROWS * COLUMNS, 3), np.uint8)
    colors[placed.where] = sample_bilinear(soft, pixels.astype(np.float32))
    return colors.reshape(2, ROWS, COLUMNS, 3)


def sheet_trust(
    outfit: Outfit, placed: OnSheets, pose: Pose, yaw: float, generator: np.random.Generator
) -> ByteArray:
    """Trust (2, ROWS, COLUMNS), 0 to 255, in the colors of a photo of the posed person."""
    seen = stand(outfit, pose, yaw, generator, distance=(2.0, 8.0), height=(0.8, 1.8)).seen
    faces = outfit.avatar.faces
    point = at_barycentric(seen[faces[placed.faces]], placed.barycentric)
    normals = vertex_normals(seen, faces.astype(np.int64))
    normal = at_barycentric(normals[faces[placed.faces]], placed.barycentric)
    facing = normal[:, 2] / np.maximum(np.linalg.norm(normal, axis=1), 1e-9)
    trust = np.clip((facing - 0.12) / 0.28, 0, 1)
    rays = RayScene(seen.astype(np.float32), faces)
    asked = np.flatnonzero(trust > 0)
    towards, covered = np.array([0, 0, 1.0]), np.zeros(len(asked), bool)
    covered |= rays.occluded((point[asked] + [0, 0, 0.012]).astype(np.float32), towards)
    for across in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        shift = np.array([*(_MARGIN * np.array(across)), _LIFT])
        covered |= rays.occluded((point[asked] + shift).astype(np.float32), towards)
    trust[asked[covered]] = 0
    result = np.zeros(2 * ROWS * COLUMNS, np.uint8)
    result[placed.where] = np.rint(255 * trust * trust * (3 - 2 * trust))
    return result.reshape(2, ROWS, COLUMNS)


class SheetPeople:
    """The studio's people of the quick studio's splits, by number.

    Parameters
    ----------
    data : path
        Folder with ``avatars/`` and MakeHuman's archive.
    guides : mapping of key (`guide_key`) to Guide
    seed : int
        Seed of MakeHuman's people.
    """

    def __init__(
        self, data: str | os.PathLike[str], guides: Mapping[str, Guide], seed: int
    ) -> None:
        """See the class."""
        own = [
            path
            for path in list_avatars(Path(data) / "avatars")
            if split_of(path.stem) == "training"
        ]
        self.paths = {
            split: [path for path in own if quick_split_of(path.stem) == split]
            for split in ("training", "validation")
        }
        self.guides, self.dresser = guides, Dresser(data, seed)

    def avatar(self, split: str, number: int) -> tuple[PreparedAvatar, Guide]:
        """Return avatar `number` of a split, and its guide."""
        paths = self.paths[split]
        if not 0 <= number < len(paths):
            raise InputError(f"there are {len(paths)} avatars of the split '{split}'")
        return prepare_avatar(str(paths[number])), self.guides[guide_key(paths[number].stem)]

    def makehuman(self, split: str, number: int) -> tuple[PreparedAvatar, Guide]:
        """Return person `number` of MakeHuman's, and their guide."""
        made = self.dresser.dressed(split, number)
        return made.prepared, made.guide
