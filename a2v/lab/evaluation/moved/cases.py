"""The photos of the benchmark, and the true person in the poses of the character."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from a2v.animation.life import STILL
from a2v.animation.retarget import RetargetSettings, retarget
from a2v.errors import InputError
from a2v.formats.deepmimic import read_deepmimic
from a2v.geometry.rays import RayScene, side_view
from a2v.io import sha256
from a2v.lab.evaluation.moved.carry import truth_turns
from a2v.lab.evaluation.reconstruction.cases import lit_by
from a2v.lab.evaluation.reconstruction.panels import Pin
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.makehuman.dressing import dress
from a2v.lab.studio.makehuman.named import NAMED_PEOPLE, named_person
from a2v.lab.studio.makehuman.people import Wardrobes
from a2v.lab.studio.ordinary import draw_ordinary
from a2v.lab.studio.photograph import FILM, Photograph, light_scene, photograph_scene
from a2v.lab.studio.posing import avatar_body
from a2v.lab.studio.scene import sort_faces
from a2v.lab.studio.settings import StudioSettings
from a2v.lab.studio.solid import smooth_normals
from a2v.lab.studio.stand import (
    Outfit,
    PreparedAvatar,
    Sitting,
    Stand,
    draw_outfit,
    prepare_avatar,
    stand,
)
from a2v.lab.studio.things.clutter import NOTHING, Clutter, among
from a2v.lab.studio.things.framing import Square
from a2v.lab.studio.things.solids import Thing
from a2v.lab.studio.view import PHOTO_SIZE
from a2v.record import Record
from a2v.types import ByteArray, FloatArray, IntArray, OrthographicCamera, Surface

VERSION = 2
"""Version of the cases; it is raised when photos or poses change."""

FRAMES: tuple[tuple[str, float], ...] = (
    ("walk", 0.25),
    ("run", 0.4),
    ("kick", 0.5),
    ("dance_a", 0.3),
    ("dance_a", 0.8),
    ("spinkick", 0.45),
)
"""Frames of motion: DeepMimic's clips (``motions/humanoid3d_*.txt``), and the share of each
clip."""
T_POSE = "T-pose"
POSES: tuple[str, ...] = (T_POSE, *(f"{name} {share:.2f}" for name, share in FRAMES))
_DISTANCE = (2.5, 8.0)
"""Range of the distance of the camera from the person, meters."""
_HEIGHT = (1.0, 1.7)
"""Range of the height of the camera over the floor, meters."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MovedCase(Record):
    """A photo, and the person in it in several poses.

    Attributes
    ----------
    name : str
        Of the avatar.
    index : int
        Of the pin.
    stance : str
        Class of the photo's pose.
    image : (H, W, 3) uint8
    camera : OrthographicCamera
        Of the photo's pixels, meters at the depth of the middle of the person's bounding box.
    hips_scale : float
        Pixels of the photo per meter at the depth of the hip joints. In a squat the hips are much
        farther from the camera than the middle of the bounding box.
    surface : Surface
        The person in T-pose, colored with the texture in the photo's mean light.
    outer : (n,) int
        Its faces that are visible from outside.
    vertices : (T, V, 3) float32
        Its vertices in each of `POSES`, meters, on the ground at the origin.
    bones : tuple of N str
        Of the person's rig.
    heads : (N, 3) float32
        Their heads in the T-pose, meters.
    turns : (T, N, 3, 3) float32
        Their rotations from there in each of `POSES`, world axes.
    facts : mapping
        For the report.
    """

    name: str
    index: int
    stance: str
    image: ByteArray
    camera: OrthographicCamera
    hips_scale: float
    surface: Surface
    outer: IntArray
    vertices: FloatArray
    bones: tuple[str, ...]
    heads: FloatArray
    turns: FloatArray
    facts: Mapping[str, Any] = dataclasses.field(default_factory=dict)


def open_moved_case(
    pin: Pin, data: str | os.PathLike[str], kept: str | os.PathLike[str] | None = None
) -> MovedCase:
    """Make a pinned photo and its person. With the folder `kept`, the case is stored there and read
    the next time.

    Parameters
    ----------
    pin : Pin
        Of `MOVED_PANELS`.
    data : path
        Folder with ``avatars/``, ``motions/`` and MakeHuman's archive.

    Raises
    ------
    InputError
        The avatar, a motion or the archive is missing or broken.
    """
    path = (
        None
        if kept is None
        else Path(kept) / f"{pin.index:06d}-{pin.avatar}-{pin.stance}-{VERSION}.npz"
    )
    if path is not None and path.exists():
        return MovedCase.load(path)
    prepared = _person(pin.avatar, Path(data))
    generator = np.random.default_rng([StudioSettings().seed, pin.index])
    outfit = draw_outfit(prepared, generator)
    photo, camera, hips_scale = _photographed(outfit, pin.stance, generator)
    transforms = np.stack([outfit.avatar.rest_transforms, *_frames(outfit.avatar, Path(data))])
    placed = [outfit.avatar.skin(pose) for pose in transforms]
    hips = transforms[:, outfit.avatar.bone_names.index("Hips"), :3, 3]
    grounded = [
        points - np.array([at[0], points[:, 1].min(), at[2]], np.float32)
        for points, at in zip(placed, hips, strict=True)
    ]
    case = MovedCase(
        name=outfit.avatar.name,
        index=pin.index,
        stance=pin.stance,
        image=photo.image,
        camera=camera,
        hips_scale=hips_scale,
        surface=lit_by(_textured(outfit, grounded[0]), photo.gain),
        outer=np.flatnonzero(sort_faces(outfit.avatar).outer),
        vertices=np.stack(grounded).astype(np.float32),
        bones=outfit.avatar.bone_names,
        heads=outfit.avatar.rest_transforms[:, :3, 3],
        turns=truth_turns(transforms, outfit.avatar.rest_transforms).astype(np.float32),
        facts={"sha256": sha256(photo.image.tobytes())},
    )
    if path is not None:
        case.save(path)
    return case


def _person(name: str, data: Path) -> PreparedAvatar:
    if name in NAMED_PEOPLE:
        return dress(named_person(name), Wardrobes(data)).prepared
    path = data / "avatars" / f"{name}.glb"
    if not path.exists():
        raise InputError(
            f"there is no avatar {path}; give the data's folder with all of its avatars"
        )
    return prepare_avatar(str(path))


def _textured(outfit: Outfit, vertices: FloatArray) -> Surface:
    own = dataclasses.replace(outfit.prepared.avatar, texture=outfit.texture)
    return Surface(
        vertices=vertices.astype(np.float32),
        faces=own.faces,
        colors=own.vertex_colors(),
        uv=own.uv,
        texture=own.texture,
    )


def _photographed(
    outfit: Outfit, stance: str, generator: np.random.Generator
) -> tuple[Photograph, OrthographicCamera, float]:
    """A photo of a person in a stance of `ORDINARY`, its camera, in meters, and the pixels per
    meter at the hips."""
    pose, yaw, held = draw_ordinary(stance, outfit.avatar, generator)
    placed = stand(outfit, pose, yaw, generator, distance=_DISTANCE, height=_HEIGHT)
    clutter = Clutter(held) if held is not None else NOTHING
    square = Square.around(placed.seen, StudioSettings().fill)
    origin = np.append(square.middle, placed.seen[:, 2].mean())
    scale = square.fill * PHOTO_SIZE / square.extent
    camera = OrthographicCamera(scale=scale, center_u=PHOTO_SIZE / 2, center_v=PHOTO_SIZE / 2)
    shown = _before_camera(placed, origin, camera)
    things = clutter.solids(placed, generator) if held is not None else None
    if things is not None:
        thing, patterns = things
        shown = among(
            shown, Thing(thing.vertices - origin, thing.faces, thing.uv, thing.patterns), patterns
        )
    surface = shown.surface
    rays = RayScene(surface.vertices, surface.faces)
    fore = side_view(rays, shown.normals, camera, FILM.size, FILM.shadows, 1)
    lit = light_scene(rays, shown, fore, generator)
    photo = photograph_scene(rays, shown, fore, lit, generator)
    return photo, camera, scale * _hips_zoom(placed)


def _hips_zoom(placed: Stand) -> float:
    """Size of a meter at the hip joints relative to one at the middle of the bounding box, as the
    camera sees both."""
    bones = placed.outfit.avatar.bone_names
    joints = [placed.transforms[bones.index(name), :3, 3] for name in ("LeftUpLeg", "RightUpLeg")]
    frame = placed.frame
    depth = (np.mean(joints, axis=0) + placed.shift - frame.middle) @ frame.axes[2]
    return float(frame.distance / (frame.distance - depth))


def _before_camera(placed: Stand, origin: FloatArray, camera: OrthographicCamera) -> Sitting:
    vertices = (placed.seen - origin).astype(np.float32)
    surface = _textured(placed.outfit, vertices)
    normals = smooth_normals(vertices, surface.faces, placed.outfit.prepared.places)
    return Sitting(surface=surface, normals=normals, camera=camera)


def _frames(avatar: Avatar, data: Path) -> list[FloatArray]:
    """World from bone (B, 4, 4) of an avatar in each of `FRAMES`."""
    body = avatar_body(avatar)
    found = []
    for name, share in FRAMES:
        motion = read_deepmimic(data / "motions" / f"humanoid3d_{name}.txt")
        moves = retarget(motion, body, settings=RetargetSettings(raw=True, life=STILL))
        found.append(moves[round(share * (len(moves) - 1))])
    return found
