"""A person in front of the camera: an avatar is prepared, dressed and posed on the ground, and
becomes the content of a photograph."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from a2v.kinematics import rotvec_to_rotmat
from a2v.lab.studio.avatar_files import load_avatar
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.guide import Guide
from a2v.lab.studio.posing import Pose
from a2v.lab.studio.solid import PhotoFrame, weld
from a2v.lab.studio.variation import Build, Wardrobe, find_clothes, rebuild, recolor
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray, OrthographicCamera, Surface


@dataclass(frozen=True, eq=False)
class PreparedAvatar:
    """An avatar with everything that is independent of the view: its clothes, and the `places` (V,)
    of its vertices (`weld`)."""

    avatar: Avatar
    clothes: Wardrobe
    places: IntArray


@dataclass(frozen=True, eq=False, kw_only=True)
class Sitting:
    """A person in the photo's frame, in front of its camera: the content of a photograph.

    Attributes
    ----------
    surface : Surface
        The person, textured (albedo), meters.
    normals : (V, 3) float32
    camera : OrthographicCamera
    own : (int, int), optional
        Number of first vertices and faces that are the person's; the others belong to objects.
        None: all are the person's.
    """

    surface: Surface
    normals: FloatArray
    camera: OrthographicCamera
    own: tuple[int, int] | None = None

    @property
    def person_vertices(self) -> int:
        """Number of first vertices that are the person's."""
        return len(self.surface.vertices) if self.own is None else self.own[0]

    def is_person(self, faces: IntArray) -> BoolArray:
        """Return whether faces with indices (n,) are the person's."""
        return np.asarray(faces < (len(self.surface.faces) if self.own is None else self.own[1]))


@lru_cache(
    maxsize=2
)  # reading an avatar is a part of a view's cost, and successive views show the same avatar
def prepare_avatar(path: str) -> PreparedAvatar:
    """Read an avatar and find its clothes; the last two are cached.

    Raises
    ------
    InputError
        See `load_avatar`.
    """
    avatar = load_avatar(path)
    return PreparedAvatar(avatar, find_clothes(avatar), weld(avatar.skin(avatar.rest_transforms)))


@dataclass(frozen=True, eq=False)
class Outfit:
    """A person with a build, in clothes with colors.

    Attributes
    ----------
    prepared : PreparedAvatar
        The person of the file.
    build : Build
    avatar : Avatar
        The avatar with that build.
    texture : (H, W, 3) uint8
        Albedo.
    """

    prepared: PreparedAvatar
    build: Build
    avatar: Avatar
    texture: ByteArray


def draw_outfit(prepared: PreparedAvatar, generator: np.random.Generator) -> Outfit:
    """Draw a build, then colors and patterns of the clothes."""
    build = Build.draw(generator)
    return Outfit(
        prepared,
        build,
        rebuild(prepared.avatar, build),
        recolor(prepared.avatar.texture, prepared.clothes, generator),
    )


@dataclass(frozen=True, eq=False)
class Stand:
    """A posed person on the ground in front of a camera.

    Attributes
    ----------
    outfit : Outfit
    transforms : (B, 4, 4) float
        World-from-bone of the outfit's avatar.
    shift : (3,) float
        Shift from there to the ground, meters.
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
        """Return the person's landmarks (33, 3) in the frame."""
        outfit = self.outfit
        return self.frame.warp(
            guide.posed_landmarks(outfit.prepared.avatar, outfit.build, self.transforms)
            + self.shift
        )


def stand(
    outfit: Outfit,
    pose: Pose,
    yaw: float,
    generator: np.random.Generator,
    *,
    distance: Sequence[float],
    height: Sequence[float],
) -> Stand:
    """Put a person on the ground, turned by `yaw` degrees about the vertical, and draw a camera.

    Parameters
    ----------
    distance, height : 2 float
        Ranges of the camera's distance from the person's middle and of its height above the floor,
        meters.
    """
    transforms = _turn_about_vertical(outfit.avatar.bone_transforms(pose), yaw)
    person = outfit.avatar.skin(transforms)
    shift = np.array([0.0, -float(person[:, 1].min()), 0.0])
    frame = _draw_camera(person + shift, distance, height, generator)
    return Stand(outfit, transforms, shift, frame, frame.warp(person + shift))


def _draw_camera(
    person: FloatArray,
    distances: Sequence[float],
    heights: Sequence[float],
    generator: np.random.Generator,
) -> PhotoFrame:
    """Draw a camera aimed at the middle of a person (V, 3) who stands on the ground; see
    `stand`."""
    low, high = person.min(axis=0), person.max(axis=0)
    # uniform in the strength of the perspective: near cameras are as likely as far ones
    nearest, farthest = distances
    distance = 1 / generator.uniform(1 / farthest, 1 / nearest)
    return PhotoFrame.looking(
        (low + high) / 2, distance=distance, height=float(generator.uniform(heights[0], heights[1]))
    )


def _turn_about_vertical(transforms: FloatArray, yaw: float) -> FloatArray:
    """Turn world-from-bone transforms (B, 4, 4) of the person by `yaw` degrees, positive to the
    person's left."""
    whole = np.eye(4)
    whole[:3, :3] = np.asarray(rotvec_to_rotmat(np.array([0.0, np.radians(yaw), 0.0])))
    return np.asarray(whole @ transforms)
