"""Dressed persons as `Avatar`s for the studio, with their guides."""

from __future__ import annotations

import dataclasses
import os
from functools import cached_property

import cv2
import numpy as np

from a2v.body import load_body_model
from a2v.body.parts import PARTS
from a2v.geometry.mesh import piece_of_faces
from a2v.kinematics.names import BLAZEPOSE
from a2v.lab.studio.avatar_files import pack_atlas, to_atlas
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.frames import MotionFrames
from a2v.lab.studio.guide import CARRIERS, Guide
from a2v.lab.studio.makehuman.binding import (
    carried,
    kept_faces,
    lay_on,
    opaque_faces,
    visible_parts,
)
from a2v.lab.studio.makehuman.hm08 import (
    RIG_BONES,
    RIG_PARENTS,
    Shaped,
    load_base,
    rig_parts,
    rig_transforms,
    rig_weights,
    shape_body,
    sparse_weights,
    strongest,
)
from a2v.lab.studio.makehuman.people import Person, Wardrobes, draw_person
from a2v.lab.studio.scene import Dressed, sort_faces
from a2v.lab.studio.solid import weld
from a2v.lab.studio.stand import PreparedAvatar
from a2v.lab.studio.variation import Wardrobe, paint_faces, sort_clothes
from a2v.types import ByteArray, FloatArray, IntArray


def dress(person: Person, wardrobes: Wardrobes) -> Dressed:
    """Shape, dress and rig a person."""
    shaped = shape_body(person.shape)
    avatar = make_avatar(person, shaped, wardrobes)
    prepared = PreparedAvatar(avatar, garments(avatar), weld(avatar.skin(avatar.rest_transforms)))
    return Dressed(prepared, sort_faces(avatar), make_guide(shaped, person.name))


class _Pieces:
    """Meshes that are joined: vertices, weights, faces and their corners, each on its own
    texture."""

    def __init__(self) -> None:
        self.vertices: list[FloatArray] = []
        self.weights: list[FloatArray] = []
        self.faces: list[IntArray] = []
        self.uv: list[FloatArray] = []
        self.meshes: list[IntArray] = []
        self.names: list[str] = []
        self.images: list[ByteArray] = []
        self._count = 0

    def add(
        self,
        name: str,
        vertices: FloatArray,
        weights: FloatArray,
        faces: IntArray,
        uv: FloatArray,
        image: ByteArray,
    ) -> None:
        """Add a mesh without its unused vertices. `uv` (F, 3, 2) has its origin at the lower
        left."""
        if not len(faces):
            return
        used, index = np.unique(faces, return_inverse=True)
        self.vertices.append(vertices[used])
        self.weights.append(weights[used])
        self.faces.append(np.asarray(index).reshape(-1, 3) + self._count)
        self.uv.append(np.stack([uv[..., 0], 1 - uv[..., 1]], axis=-1))
        self.meshes.append(np.full(len(faces), len(self.names)))
        self.names.append(name)
        self.images.append(image)
        self._count += len(used)


def make_avatar(person: Person, shaped: Shaped, wardrobes: Wardrobes) -> Avatar:
    """Join the person's skin, eyes and clothes to one rigged mesh in T-pose."""
    base = load_base()
    worn = [
        ("cloth", person.outfit),
        ("shoes", person.shoes),
        ("hair", person.hair),
        ("hat", person.hat),
    ]
    items = [(kind, wardrobes.item(name)) for kind, name in worn if name]
    skin_seen, seen = visible_parts([item for _, item in items])
    pieces = _Pieces()
    shown = kept_faces(base.skin, skin_seen)
    pieces.add(
        "skin",
        shaped.base,
        base.weights,
        base.skin[shown],
        base.skin_uv[shown],
        wardrobes.skin(person.skin),
    )
    for side, faces in zip(("left", "right"), base.eyes, strict=True):
        pieces.add(
            f"{side} eye",
            shaped.base,
            base.weights,
            faces,
            eye_corners(shaped.base, faces),
            eye_texture(person.eye_color),
        )
    for (kind, item), own in zip(items, seen, strict=True):
        kept = kept_faces(item.mesh.faces, own) & opaque_faces(item)
        image = filled_texture(item.texture)
        image = tinted(image, person.hair_color) if kind == "hair" else image
        weights = strongest(carried(item.binding, base.weights))
        pieces.add(
            f"{kind} {item.name}",
            lay_on(item.binding, shaped.base),
            weights,
            item.mesh.faces[kept],
            item.mesh.uv[kept],
            image,
        )
    texture, tiles = pack_atlas(pieces.images)
    meshes, dense = np.concatenate(pieces.meshes), np.concatenate(pieces.weights)
    rest = shaped.to_t_pose(np.concatenate(pieces.vertices), dense)
    weights, bones = sparse_weights(dense)
    return Avatar(
        name=person.name,
        influences=np.repeat(rest[:, None], weights.shape[1], axis=1).astype(np.float32),
        weights=weights.astype(np.float32),
        bones=bones,
        faces=np.concatenate(pieces.faces).astype(np.int32),
        uv=to_atlas(np.concatenate(pieces.uv), tiles[meshes]).astype(np.float32),
        texture=texture,
        materials=meshes.astype(np.int32),
        material_names=tuple(pieces.names),
        mesh_ids=meshes.astype(np.int32),
        mesh_names=tuple(pieces.names),
        bone_names=RIG_BONES,
        bone_parents=RIG_PARENTS,
        rest_transforms=rig_transforms(shaped.heads),
        parts=rig_parts()[bones[:, 0]],
        provenance={"person": dataclasses.asdict(person)},
    )


def garments(avatar: Avatar) -> Wardrobe:
    """Find the clothes that may take other colors in a dressed avatar's texture."""
    meshes = [
        index
        for index, name in enumerate(avatar.mesh_names)
        if name.startswith(("cloth", "shoes", "hat"))
    ]
    if not meshes:
        nothing = np.zeros(0, np.int64)
        return Wardrobe(
            nothing,
            nothing,
            np.zeros((0, 3), np.float32),
            np.zeros(0, np.float32),
            nothing,
            nothing,
        )
    chosen = np.flatnonzero(np.isin(avatar.mesh_ids, meshes))
    faces = avatar.faces[chosen]
    piece = piece_of_faces(len(avatar.parts), faces)
    # a shirt has one color down to its hem: a connected piece has the body part that it mostly
    # covers
    held = np.zeros((int(piece.max()) + 1, len(PARTS)), int)
    np.add.at(held, (piece, avatar.parts[faces[:, 0]]), 1)
    part = paint_faces(avatar, chosen, held.argmax(axis=1)[piece])
    rows, columns = np.nonzero(part >= 0)
    lab = cv2.cvtColor(avatar.texture.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)[rows, columns]
    return sort_clothes(part, rows, columns, lab, np.ones(len(rows), np.float32))


def make_guide(shaped: Shaped, name: str) -> Guide:
    """Return the person's own body as the guide: the result of a perfect fit under the clothes."""
    model = load_body_model()
    faces = np.asarray(model.faces, np.int64)
    piece = piece_of_faces(len(shaped.body), faces)
    own = faces[piece == np.bincount(piece).argmax()]
    used, index = np.unique(own, return_inverse=True)
    dense = rig_weights(model.bone_names, model.weights)[used]
    weights, bones = sparse_weights(dense)
    carriers = []
    for mark in BLAZEPOSE:
        side, _, joint = mark.partition("_")
        carriers.append(
            RIG_BONES.index(f"{side.title()}{CARRIERS[joint]}" if joint in CARRIERS else "Head")
        )
    up = np.linalg.inv(shaped.lower[carriers])
    landmarks = np.einsum("kij,kj->ki", up[:, :3, :3], shaped.landmarks) + up[:, :3, 3]
    return Guide(
        vertices=shaped.to_t_pose(shaped.body[used], dense).astype(np.float32),
        faces=np.asarray(index).reshape(-1, 3).astype(np.int32),
        weights=weights.astype(np.float32),
        bones=bones,
        bone_names=RIG_BONES,
        heads=shaped.heads.astype(np.float32),
        parts=np.asarray(model.parts)[used].astype(np.int8),
        landmarks=landmarks.astype(np.float32),
        landmark_bones=np.array(carriers, np.int32),
        provenance={"avatar": name},
    )


def eye_corners(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Return the texture coordinates (F, 3, 2) of an eye: u is the angle from its gaze (+z), 1 at
    the back."""
    corner = vertices[faces] - vertices[np.unique(faces)].mean(axis=0)
    u = (
        np.arccos(
            np.clip(corner[..., 2] / np.maximum(np.linalg.norm(corner, axis=-1), 1e-9), -1, 1)
        )
        / np.pi
    )
    return np.stack([u, np.full(u.shape, 0.5)], axis=-1)


def eye_texture(color: tuple[float, float, float]) -> ByteArray:
    """Return pupil, iris of an sRGB color, and white of an eye by the angle from the gaze (16, 180,
    3)."""
    strip = np.full((16, 180, 3), (228, 222, 216), np.uint8)
    strip[:, :27] = np.clip(color, 0, 255).astype(np.uint8)
    strip[:, :11] = 8
    return strip


def filled_texture(texture: ByteArray) -> ByteArray:
    """Fill transparent texels of a texture (H, W, 4) with the mean color, and drop the opacity."""
    clear = texture[..., 3] < 128
    result = np.ascontiguousarray(texture[..., :3])
    if clear.any() and not clear.all():
        result[clear] = np.rint(result[~clear].mean(axis=0)).astype(np.uint8)
    return result


def tinted(texture: ByteArray, color: tuple[float, float, float]) -> ByteArray:
    """Tint a texture of hair (H, W, 3) with another sRGB color; the strands stay visible."""
    light = texture.astype(np.float32).mean(axis=-1, keepdims=True)
    strands = np.clip(light / max(float(light.mean()), 1.0), 0.4, 1.5) ** 0.8
    return np.asarray(np.rint(np.clip(strands * np.array(color, np.float32), 0, 255)), np.uint8)


class Dresser:
    """Makes the people of a data set: the same seed, split and number give the same person.

    Parameters
    ----------
    data : path
        Folder with `ARCHIVE` and the motion data.
    seed : int
        Seed of the data set.

    Raises
    ------
    InputError
        See `Wardrobes`.
    """

    def __init__(self, data: str | os.PathLike[str], seed: int) -> None:
        """See the class."""
        self.wardrobes, self._data, self._seed = Wardrobes(data), data, seed
        self._last: dict[tuple[str, int], Dressed] = {}

    @cached_property
    def frames(self) -> MotionFrames:
        """Frames of people in action.

        Raises
        ------
        InputError
            See `MotionFrames`.
        """
        return MotionFrames(self._data)

    def person(self, split: str, number: int) -> Person:
        """Draw the person of a number."""
        return draw_person(self.wardrobes, split, number, self._seed)

    def dressed(self, split: str, number: int) -> Dressed:
        """Return the person, dressed; the last two are cached."""
        key = (split, number)
        if key not in self._last:
            self._last = dict([*self._last.items()][-1:])
            self._last[key] = dress(self.person(split, number), self.wardrobes)
        return self._last[key]
