"""The scene of one view: a person of some build, in some clothes and pose, before a camera, and the guide that a fit would have found."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
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
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera, Surface


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


@dataclass(frozen=True, eq=False)
class Scene:
    """A person and the guide in the photo's frame.

    Attributes
    ----------
    surface : Surface
        The person, textured (albedo), metres.
    parts : (V,) int
        Body part of each vertex.
    normals : (V, 3) float32
    faces : FaceKinds
    guide : (G, 3) float32
        Vertices of the guide.
    landmarks : (33, 3) float32
        The person's BlazePose landmarks as a body model has them (no error of the guide moves them).
    camera : OrthographicCamera
    yaw : float
        Degrees.
    avatar : str
    pose : str
        What the person does.
    guide_faces : (F, 3) int
        Of the guide.
    """

    surface: Surface
    parts: IntArray
    normals: FloatArray
    faces: FaceKinds
    guide: FloatArray
    landmarks: FloatArray
    camera: OrthographicCamera
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
    """
    plain = prepared.avatar
    build = Build.draw(generator)
    avatar = rebuild(plain, build)
    texture = recolor(plain.texture, prepared.clothes, generator)
    pose, name, yaw = _draw_pose(library, settings, generator, stance, partial(frames.draw, plain) if frames else None)
    transforms = _turn_about_vertical(avatar.bone_transforms(pose), yaw)
    person = avatar.skin(transforms)
    shift = np.array([0.0, -float(person[:, 1].min()), 0.0])
    frame = _draw_camera(person + shift, settings, generator)
    wrong = _disturb_in_place(avatar, transforms, frame.axes[2], settings, generator)
    posed = guide.posed(plain, build.thicker(girth_errors(settings.guide, generator)), wrong)
    seen, held = frame.warp(person + shift), frame.warp(posed + shift)
    held[:, :2] += settings.guide.shift * generator.standard_normal(2)
    landmarks = frame.warp(guide.posed_landmarks(plain, build, transforms) + shift)
    # the photo's square around the person, and the guide's idea of the metre
    least, most = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
    origin = np.append((least + most) / 2, held[:, 2].mean())
    factor = float(np.exp(settings.guide.scale * generator.standard_normal()))
    scale = settings.fill * PHOTO_SIZE / float((most - least).max()) / factor
    vertices = (factor * (seen - origin)).astype(np.float32)
    colors = dataclasses.replace(plain, texture=texture).vertex_colors()
    made = {"avatar": plain.name, "pose": name, "camera_height": frame.height, "camera_distance": frame.over_floor}
    surface = Surface(vertices=vertices, faces=plain.faces, colors=colors, uv=plain.uv, texture=texture, provenance=made)
    return Scene(
        surface=surface,
        parts=plain.parts,
        normals=smooth_normals(vertices, plain.faces, prepared.places),
        faces=faces,
        guide=(factor * (held - origin)).astype(np.float32),
        landmarks=(factor * (landmarks - origin)).astype(np.float32),
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
) -> tuple[Pose, str, float]:
    """A pose, its name, and the turn about the vertical, degrees; of the class `stance`, if that is not empty.

    Poses in action are those that `recorded` draws, if it is given.
    """
    if stance:
        pose, yaw = draw_stance(stance, generator)
        return pose, stance, yaw
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
    pose = joint_noise(pose, generator)
    return pose, name, float(generator.normal(0, settings.yaw) if generator.random() < settings.facing else generator.uniform(-180, 180))


def _draw_camera(person: FloatArray, settings: StudioSettings, generator: np.random.Generator) -> PhotoFrame:
    """A camera aimed at the middle of a person (V, 3) who stands on the ground."""
    low, high = person.min(axis=0), person.max(axis=0)
    # near cameras are as likely as far ones in terms of the perspective that they give
    nearest, farthest = settings.distance
    distance = 1 / generator.uniform(1 / farthest, 1 / nearest)
    return PhotoFrame.looking((low + high) / 2, distance=distance, height=float(generator.uniform(settings.height[0], settings.height[1])))


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
