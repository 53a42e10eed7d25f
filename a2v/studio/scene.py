"""The scene of one view: a person of some build, in some clothes and pose, before a camera, and the guide that a fit would have found."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from a2v.body.parts import PARTS
from a2v.kinematics import rotvec_to_rotmat
from a2v.studio.avatar_files import load_avatar
from a2v.studio.avatars import Avatar
from a2v.studio.frames import MotionFrames
from a2v.studio.guide import Guide
from a2v.studio.guide_errors import disturb, girth_errors
from a2v.studio.posing import Pose, PoseLibrary, joint_noise, natural_pose, open_pose
from a2v.studio.settings import StudioSettings
from a2v.studio.solid import PhotoFrame, Solid, caps, open_faces, smooth_normals, weld
from a2v.studio.stances import draw_stance
from a2v.studio.variation import Build, Wardrobe, find_clothes, rebuild, recolor
from a2v.studio.view import PHOTO_SIZE
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray, OrthographicCamera, Surface


@dataclass(frozen=True, eq=False, kw_only=True)
class FaceKinds:
    """What an avatar's faces are, (F,) bool each, and faces (C, 3) that close the wall: see `Solid`."""

    outer: BoolArray
    wall: BoolArray
    layered: BoolArray
    shell: BoolArray
    closing: IntArray


@dataclass(frozen=True, eq=False)
class PreparedAvatar:
    """An avatar with what does not depend on the view: its clothes, and the `places` (V,) of its vertices (`weld`)."""

    avatar: Avatar
    clothes: Wardrobe
    places: IntArray


@dataclass(frozen=True, eq=False, kw_only=True)
class Sitting:
    """A person in the photo's frame, before its camera: all that a photograph shows.

    Attributes
    ----------
    surface : Surface
        The person, textured (albedo), metres.
    normals : (V, 3) float32
    camera : OrthographicCamera
    own : (int, int), optional
        How many of the first vertices and faces are the person's; the others are things'. All of them where it is None.
    """

    surface: Surface
    normals: FloatArray
    camera: OrthographicCamera
    own: tuple[int, int] | None = None

    @property
    def person_vertices(self) -> int:
        """How many of the first vertices are the person's."""
        return len(self.surface.vertices) if self.own is None else self.own[0]

    def is_person(self, faces: IntArray) -> BoolArray:
        """Whether faces, by their numbers (n,), are the person's."""
        return np.asarray(faces < (len(self.surface.faces) if self.own is None else self.own[1]))


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
        The person's BlazePose landmarks as a body model has them (no error of the guide moves them).
    yaw : float
        Degrees.
    avatar : str
    pose : str
        What the person does.
    guide_faces : (F, 3) int
        Of the guide.
    """

    parts: IntArray
    faces: FaceKinds
    guide: FloatArray
    landmarks: FloatArray
    yaw: float
    avatar: str
    pose: str
    guide_faces: IntArray

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


@lru_cache(maxsize=2)  # reading an avatar is a part of a view's cost, and successive views show the same one
def prepare_avatar(path: str) -> PreparedAvatar:
    """Read an avatar and find its clothes; the last two are kept.

    Raises
    ------
    InputError
        As of `load_avatar`.
    """
    avatar = load_avatar(path)
    return PreparedAvatar(avatar, find_clothes(avatar), weld(avatar.skin(avatar.rest_transforms)))


def sort_faces(avatar: Avatar) -> FaceKinds:
    """Sort an avatar's faces; the mouth's pocket is no wall of the solid, so that it counts as filled."""
    rest = avatar.skin(avatar.rest_transforms)
    wig = np.isin(
        avatar.mesh_ids, [index for index, name in enumerate(avatar.mesh_names) if "wig" in name.lower() or "hair" in name.lower()]
    )
    outer = open_faces(rest, avatar.faces, rays=24)
    bare = outer
    if wig.any():
        bare = np.ones(len(wig), bool)
        bare[~wig] = open_faces(rest, avatar.faces[~wig], rays=24)
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
class Outfit:
    """A person of some build in clothes of some colours.

    Attributes
    ----------
    prepared : PreparedAvatar
        Who it is, as its file has it.
    build : Build
    avatar : Avatar
        With that build.
    texture : (H, W, 3) uint8
        Albedo.
    """

    prepared: PreparedAvatar
    build: Build
    avatar: Avatar
    texture: ByteArray


def draw_outfit(prepared: PreparedAvatar, generator: np.random.Generator) -> Outfit:
    """Draw a build, then colours and patterns of the clothes."""
    build = Build.draw(generator)
    return Outfit(prepared, build, rebuild(prepared.avatar, build), recolor(prepared.avatar.texture, prepared.clothes, generator))


@dataclass(frozen=True, eq=False)
class Stand:
    """How a posed person stands on the ground before a camera.

    Attributes
    ----------
    outfit : Outfit
    transforms : (B, 4, 4) float
        World-from-bone of the outfit's avatar.
    shift : (3,) float
        From there to the ground, metres.
    frame : PhotoFrame
    seen : (V, 3) float64
        The person's vertices in the frame.
    """

    outfit: Outfit
    transforms: FloatArray
    shift: FloatArray
    frame: PhotoFrame
    seen: FloatArray

    def landmarks(self, guide: Guide) -> FloatArray:
        """The person's landmarks (33, 3) in the frame."""
        outfit = self.outfit
        return self.frame.warp(guide.posed_landmarks(outfit.prepared.avatar, outfit.build, self.transforms) + self.shift)


def stand(
    outfit: Outfit, pose: Pose, yaw: float, generator: np.random.Generator, *, distance: Sequence[float], height: Sequence[float]
) -> Stand:
    """Put a person on the ground, turned by `yaw` degrees about the vertical, and draw a camera.

    Parameters
    ----------
    distance, height : 2 float
        Between which the camera stands, metres: from the person's middle, and over the floor.
    """
    transforms = _turn_about_vertical(outfit.avatar.bone_transforms(pose), yaw)
    person = outfit.avatar.skin(transforms)
    shift = np.array([0.0, -float(person[:, 1].min()), 0.0])
    frame = _draw_camera(person + shift, distance, height, generator)
    return Stand(outfit, transforms, shift, frame, frame.warp(person + shift))


def draw_scene(
    prepared: PreparedAvatar,
    faces: FaceKinds,
    guide: Guide,
    library: PoseLibrary,
    settings: StudioSettings,
    generator: np.random.Generator,
    *,
    stance: str = "",
    frames: MotionFrames | None = None,
    varied: Callable[[np.random.Generator], Pose] | None = None,
) -> Scene:
    """Draw build, clothes, pose, camera and the guide's errors; the same state of the `generator` gives the same scene.

    Parameters
    ----------
    prepared, faces, guide
        An avatar, its `sort_faces`, and the guide of its sex and outfit.
    library, frames
        What poses in action are drawn from: the library, or all frames if these are given.
    settings, generator
    stance : str
        Of `STANCES`, instead of the poses of the settings.
    varied
        Draws the poses of ``settings.varied``.
    """
    plain = prepared.avatar
    outfit = draw_outfit(prepared, generator)
    pose, name, yaw = _draw_pose(library, settings, generator, stance, partial(frames.draw, plain) if frames else None, varied)
    placed = stand(outfit, pose, yaw, generator, distance=settings.distance, height=settings.height)
    frame, seen = placed.frame, placed.seen
    wrong = _disturb_in_place(outfit.avatar, placed.transforms, frame.axes[2], settings, generator)
    posed = guide.posed(plain, outfit.build.thicker(girth_errors(settings.guide, generator)), wrong)
    held = frame.warp(posed + placed.shift)
    held[:, :2] += settings.guide.shift * generator.standard_normal(2)
    # the photo's square around the person, and the guide's idea of the metre
    least, most = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
    origin = np.append((least + most) / 2, held[:, 2].mean())
    factor = float(np.exp(settings.guide.scale * generator.standard_normal()))
    scale = settings.fill * PHOTO_SIZE / float((most - least).max()) / factor
    vertices = (factor * (seen - origin)).astype(np.float32)
    colors = dataclasses.replace(plain, texture=outfit.texture).vertex_colors()
    made = {"avatar": plain.name, "pose": name, "camera_height": frame.height, "camera_distance": frame.over_floor}
    surface = Surface(vertices=vertices, faces=plain.faces, colors=colors, uv=plain.uv, texture=outfit.texture, provenance=made)
    return Scene(
        surface=surface,
        parts=plain.parts,
        normals=smooth_normals(vertices, plain.faces, prepared.places),
        faces=faces,
        guide=(factor * (held - origin)).astype(np.float32),
        landmarks=(factor * (placed.landmarks(guide) - origin)).astype(np.float32),
        camera=OrthographicCamera(scale=scale, center_u=PHOTO_SIZE / 2, center_v=PHOTO_SIZE / 2),
        yaw=float((yaw + 180) % 360 - 180),
        avatar=plain.name,
        pose=name,
        guide_faces=guide.faces,
    )


def _draw_pose(
    library: PoseLibrary,
    settings: StudioSettings,
    generator: np.random.Generator,
    stance: str,
    recorded: Callable[[np.random.Generator], tuple[Pose, str]] | None = None,
    varied: Callable[[np.random.Generator], Pose] | None = None,
) -> tuple[Pose, str, float]:
    """A pose, its name, and the turn about the vertical, degrees; of the class `stance`, if that is not empty.

    Poses in action are those that `recorded` draws, if it is given; `varied` draws those of ``settings.varied``.
    """
    if stance:
        pose, yaw = draw_stance(stance, generator)
        return pose, stance, yaw
    if varied is not None and generator.random() < settings.varied:
        pose, name = varied(generator), "varied"
    else:
        pose, name = _common_pose(library, settings, generator, recorded)
    return pose, name, float(generator.normal(0, settings.yaw) if generator.random() < settings.facing else generator.uniform(-180, 180))


def _common_pose(
    library: PoseLibrary,
    settings: StudioSettings,
    generator: np.random.Generator,
    recorded: Callable[[np.random.Generator], tuple[Pose, str]] | None,
) -> tuple[Pose, str]:
    """A pose in action, between A and T, or natural, and its name."""
    kind = generator.random()
    if kind < settings.actions and recorded:
        pose, name = recorded(generator)
    elif kind < settings.actions:
        index = int(generator.integers(len(library.actions)))
        pose, name = library.pose(index), library.actions[index]
    elif kind < settings.actions + settings.open:
        pose, name = open_pose(generator), "open"
    else:
        pose, name = natural_pose(generator), "natural"
    return joint_noise(pose, generator), name


def _draw_camera(person: FloatArray, distances: Sequence[float], heights: Sequence[float], generator: np.random.Generator) -> PhotoFrame:
    """A camera aimed at the middle of a person (V, 3) who stands on the ground; see `stand`."""
    low, high = person.min(axis=0), person.max(axis=0)
    # near cameras are as likely as far ones in terms of the perspective that they give
    nearest, farthest = distances
    distance = 1 / generator.uniform(1 / farthest, 1 / nearest)
    return PhotoFrame.looking((low + high) / 2, distance=distance, height=float(generator.uniform(heights[0], heights[1])))


_ALIGNED = ("Head", *(f"{side}{bone}" for side in ("Left", "Right") for bone in ("Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot")))
"""Bones whose heads a fit lays on the photo's joints."""


def _disturb_in_place(
    avatar: Avatar, transforms: FloatArray, view: FloatArray, settings: StudioSettings, generator: np.random.Generator
) -> FloatArray:
    """`disturb`, then moved in the image plane: a fit that turns a bone moves the body until the joints lie on the photo's again."""
    wrong = disturb(avatar, transforms, view, settings.guide, generator)
    aligned = [avatar.bone_names.index(name) for name in _ALIGNED]
    gap = (wrong - transforms)[aligned, :3, 3].mean(axis=0)
    wrong[:, :3, 3] -= gap - (gap @ view) * view
    return wrong


def _turn_about_vertical(transforms: FloatArray, yaw: float) -> FloatArray:
    """World-from-bone transforms (B, 4, 4) of the person turned by `yaw` degrees, positive to the person's left."""
    whole = np.eye(4)
    whole[:3, :3] = np.asarray(rotvec_to_rotmat(np.array([0.0, np.radians(yaw), 0.0])))
    return np.asarray(whole @ transforms)
