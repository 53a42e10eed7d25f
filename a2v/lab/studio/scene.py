"""The scene of one view: a person with a build, clothes and a pose in front of a camera, and the
guide that a fit would find."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from a2v.body.parts import PARTS
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.guide import Guide
from a2v.lab.studio.guide_errors import disturb_in_place, girth_errors
from a2v.lab.studio.pose_source import PoseSource, draw_pose
from a2v.lab.studio.settings import StudioSettings
from a2v.lab.studio.solid import (
    OPEN_RAYS,
    PhotoFrame,
    Solid,
    caps,
    open_faces,
    smooth_normals,
    weld,
)
from a2v.lab.studio.stand import PreparedAvatar, Sitting, Stand, draw_outfit, stand
from a2v.lab.studio.things.clutter import NOTHING, Clutter, among
from a2v.lab.studio.things.framing import LEAST_LEFT, Square, share_left, unhidden
from a2v.lab.studio.things.solids import Thing
from a2v.lab.studio.view import PHOTO_SIZE
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray, OrthographicCamera, Surface

TRIES = 8
"""Number of attempts to place objects so that enough of the person is visible. If all fail, there
are no objects."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FaceKinds:
    """Kinds of an avatar's faces, (F,) bool each, and faces (C, 3) that close the wall; see
    `Solid`."""

    outer: BoolArray
    wall: BoolArray
    layered: BoolArray
    shell: BoolArray
    closing: IntArray


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene(Sitting):
    """A person and the guide in the photo's frame.

    Attributes
    ----------
    parts : (V,) int
        Body part of each vertex.
    faces : FaceKinds
    guide : (G, 3) float32
        Vertices of the guide.
    landmarks : (33, 3) float32
        The person's BlazePose landmarks, defined as in a body model, without errors of the guide.
    yaw : float
        Turn of the person about the vertical, degrees.
    avatar : str
    pose : str
        Name of the pose.
    guide_faces : (F, 3) int
        Of the guide.
    shown : Sitting, optional
        The person among objects, in front of the same camera: the content of the photo. None
        without objects.
    clutter : Clutter
        The requested objects around the person.
    around : mapping
        The objects that are really around the person, by name, for `View.provenance`. Empty if
        nothing occludes or cuts the person and the background is a drawn one.
    turn : float
        Angle by which the person has turned since the first photo of the scene, degrees.
    """

    parts: IntArray
    faces: FaceKinds
    guide: FloatArray
    landmarks: FloatArray
    yaw: float
    avatar: str
    pose: str
    guide_faces: IntArray
    shown: Sitting | None = None
    clutter: Clutter = NOTHING
    around: Mapping[str, object] = field(default_factory=dict)
    turn: float = 0.0

    def solid(self) -> Solid:
        """The person as a solid."""
        kinds = self.faces
        return Solid(
            self.surface.vertices,
            self.surface.faces,
            wall=kinds.wall,
            outer=kinds.outer,
            layered=kinds.layered,
            shell=kinds.shell,
            closing=kinds.closing,
        )


def sort_faces(avatar: Avatar) -> FaceKinds:
    """Sort an avatar's faces. The pocket of the mouth is not a wall of the solid, so that it counts
    as filled."""
    rest = avatar.skin(avatar.rest_transforms)
    wig = np.isin(
        avatar.mesh_ids,
        [
            index
            for index, name in enumerate(avatar.mesh_names)
            if "wig" in name.lower() or "hair" in name.lower()
        ],
    )
    outer = open_faces(rest, avatar.faces, rays=OPEN_RAYS)
    bare = outer
    if wig.any():
        bare = np.ones(len(wig), bool)
        bare[~wig] = open_faces(rest, avatar.faces[~wig], rays=OPEN_RAYS)
    head = avatar.parts[avatar.faces].max(axis=1) == PARTS.index("head")
    wall = bare | ~head | wig
    return FaceKinds(
        outer=outer,
        wall=wall,
        layered=(head | wig) & bool(wig.any()),
        shell=wig,
        closing=caps(avatar.faces[wall & ~wig], weld(rest)),
    )


@dataclass(frozen=True, eq=False)
class Dressed:
    """A person with all data for photographs.

    Attributes
    ----------
    prepared : PreparedAvatar
    faces : FaceKinds
        Result of `sort_faces` for the avatar.
    guide : Guide
        Guide of the avatar's sex and outfit.
    """

    prepared: PreparedAvatar
    faces: FaceKinds
    guide: Guide


def draw_scene(
    person: Dressed,
    poses: PoseSource,
    settings: StudioSettings,
    generator: np.random.Generator,
    *,
    clutter: Clutter = NOTHING,
    chance: np.random.Generator | None = None,
    again: tuple[float, np.random.Generator] | None = None,
) -> Scene:
    """Draw build, clothes, pose, camera and the guide's errors; the same state of the `generator`
    gives the same scene.

    Parameters
    ----------
    person, poses, settings, generator
    clutter, chance
        Objects around the person, and the generator of their positions. All else is drawn from
        `generator`, so that it is the same without objects, except for arms that hold one.
    again : pair of float and numpy Generator, optional
        For another photo of the same person: the turn in degrees, and the generator of its pose and
        camera.
    """
    prepared, guide = person.prepared, person.guide
    plain = prepared.avatar
    outfit = draw_outfit(prepared, generator)
    turn, generator = again or (0.0, generator)
    pose, name, yaw = draw_pose(poses, plain, settings, generator)
    placed = stand(
        outfit,
        pose | clutter.grip,
        yaw + turn,
        generator,
        distance=settings.distance,
        height=settings.height,
    )
    held = _draw_guide(placed, guide, settings, generator)
    setting = _set(placed, settings, clutter, chance)
    origin = np.append(setting.middle, held[:, 2].mean())
    factor = float(np.exp(settings.guide.scale * generator.standard_normal()))
    vertices = (factor * (placed.seen - origin)).astype(np.float32)
    made = {"avatar": plain.name, "pose": name, **_camera_facts(placed.frame, origin, factor)}
    scene = Scene(
        surface=_textured(dataclasses.replace(plain, texture=outfit.texture), vertices, made),
        parts=plain.parts,
        normals=smooth_normals(vertices, plain.faces, prepared.places),
        faces=person.faces,
        guide=(factor * (held - origin)).astype(np.float32),
        landmarks=(factor * (placed.landmarks(guide) - origin)).astype(np.float32),
        camera=_camera(setting.square, origin, factor),
        yaw=float((yaw + turn + 180) % 360 - 180),
        avatar=plain.name,
        pose=name,
        guide_faces=guide.faces,
        clutter=clutter,
        around=setting.around(clutter),
        turn=turn,
    )
    return _among_things(scene, setting, origin, factor)


def _textured(avatar: Avatar, vertices: FloatArray, made: Mapping[str, object]) -> Surface:
    """Return an avatar's surface with other vertices."""
    return Surface(
        vertices=vertices,
        faces=avatar.faces,
        colors=avatar.vertex_colors(),
        uv=avatar.uv,
        texture=avatar.texture,
        provenance=made,
    )


def _camera_facts(frame: PhotoFrame, origin: FloatArray, factor: float) -> dict[str, object]:
    """Return the camera (`a2v.types.PhotoCamera`) in coordinates around `origin` (3,) whose unit is
    `factor` meters."""
    aim = (-factor * origin).tolist()
    return {
        "camera_height": frame.height,
        "camera_distance": factor * frame.over_floor,
        "camera_pitch": frame.pitch,
        "camera_aim": aim,
    }


def _draw_guide(
    placed: Stand, guide: Guide, settings: StudioSettings, generator: np.random.Generator
) -> FloatArray:
    """Draw the guide's vertices (G, 3) in the frame of the person, with the errors of fits."""
    outfit, frame = placed.outfit, placed.frame
    wrong = disturb_in_place(
        outfit.avatar, placed.transforms, frame.axes[2], settings.guide, generator
    )
    posed = guide.posed(
        outfit.prepared.avatar, outfit.build.thicker(girth_errors(settings.guide, generator)), wrong
    )
    held = frame.warp(posed + placed.shift)
    held[:, :2] += settings.guide.shift * generator.standard_normal(2)
    return held


def _camera(square: Square, origin: FloatArray, factor: float) -> OrthographicCamera:
    """Return the camera of a photo of the square, in coordinates around `origin` (3,) whose unit is
    `factor` meters."""
    scale = square.fill * PHOTO_SIZE / square.extent / factor
    right, up = scale * factor * (square.middle - origin[:2])
    return OrthographicCamera(
        scale=scale, center_u=PHOTO_SIZE / 2 - float(right), center_v=PHOTO_SIZE / 2 + float(up)
    )


@dataclass(frozen=True, eq=False)
class _Setting:
    """Content of a photo: a square of the frame, and objects in the frame with their patterns, if
    any.

    It also has a flag that the border cuts the person, and `middle` (2,), the middle of the
    person's box.
    """

    middle: FloatArray
    square: Square
    things: tuple[Thing, list[ByteArray]] | None = None
    cut: bool = False

    def around(self, clutter: Clutter) -> dict[str, object]:
        """Return `Scene.around`."""
        found: dict[str, object] = {}
        if self.things is not None:
            found = {
                "held": clutter.held.kind if clutter.held else "",
                "furniture": clutter.furniture,
            }
        if self.cut:
            found["cut"] = True
        return found | ({"photograph": True} if clutter.photographs else {})


def _set(
    placed: Stand, settings: StudioSettings, clutter: Clutter, chance: np.random.Generator | None
) -> _Setting:
    """Place objects around a person, and draw the photographed square, so that enough of the person
    is visible."""
    avatar, seen = placed.outfit.avatar, placed.seen
    square = Square.around(seen, settings.fill)
    alone = _Setting(square.middle, square)
    whole = chance is None or not chance.random() < settings.cut
    if chance is None or (whole and clutter.held is None and not clutter.furniture):
        return alone
    for _ in range(TRIES):
        things = clutter.solids(placed, chance)
        if things is None and (clutter.held is not None or clutter.furniture):
            continue  # they would reach the camera
        framed = (
            square
            if things is None
            else Square.around(unhidden(seen, things[0], chance), square.fill)
        )
        framed = framed if whole else framed.cut(chance)
        if share_left(seen, avatar.faces, things[0] if things else None, framed) >= LEAST_LEFT:
            return _Setting(square.middle, framed, things, not whole)
    return alone


def _among_things(scene: Scene, setting: _Setting, origin: FloatArray, factor: float) -> Scene:
    """Return the scene with the setting's objects, in the coordinates of `_camera`."""
    if setting.things is None:
        return scene
    thing, patterns = setting.things
    thing = dataclasses.replace(thing, vertices=factor * (thing.vertices - origin))
    return dataclasses.replace(scene, shown=among(scene, thing, patterns))
