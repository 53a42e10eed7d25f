"""The place of the photo: its camera in the world, and lights under which the person looks there as in the photo."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.geometry.mesh import vertex_normals
from a2v.record import Record
from a2v.rendering.camera import ViewCamera
from a2v.rendering.scene import SceneSettings
from a2v.types import ByteArray, FloatArray, OrthographicCamera, Subject, Surface

FOV = 10.0
"""Degrees that the photo's longer side is taken to span. The person was reconstructed as an orthographic camera sees; from a camera that is
far away it looks nearly so, and still grows when it comes nearer. (30 degrees: outlines overlap by .94 on the sample; docs/rendering.md.)"""

DIRECTED = 0.4
"""Largest share of the light that comes from one direction: the colours of the photo hold its shading already."""


@dataclass(frozen=True, kw_only=True)
class Place(Record):
    """Where the photo was taken.

    Attributes
    ----------
    picture : (S, S, 3) uint8
        sRGB: what the camera sees without the person, the photo in its middle.
    camera : ViewCamera
        Square; level.
    scene : SceneSettings
        Lights.
    frame : tuple of 4 int
        Left, top, right, bottom of the photo in `picture`.
    """

    picture: ByteArray
    camera: ViewCamera
    scene: SceneSettings
    frame: tuple[int, ...]

    def __post_init__(self) -> None:
        self._check("picture", ("S", "S", 3))


def photo_camera(subject: Subject, camera: OrthographicCamera, surface: Surface, offset: FloatArray, *, fov: float = FOV) -> ViewCamera:
    """The level perspective camera that sees the plane of what the photo shows of the person, its middle, as the photo does.

    Parameters
    ----------
    subject : Subject
    camera : OrthographicCamera
        Of the fit, in pixels of the subject's crop.
    surface : Surface
        The person in the frame of `camera`.
    offset : (3,)
        From the frame of `camera` to the world, where the root is over the origin (`a2v.animation.photo_to_world`).
    fov : float
        Of the photo's longer side, degrees.

    Raises
    ------
    InputError
        `fov` is not in (0, 120).
    """
    if not 0 < fov < 120:
        raise InputError(f"the photo's field of view is {fov}; expected degrees in (0, 120)")
    left, top, right, _ = subject.crop
    ratio = (right - left) / subject.image.shape[1]  # pixels of the photo in one of the crop
    middle = (np.array(subject.photo_size) / 2 - (left, top)) / ratio
    place = camera.unproject(middle, _seen_depth(surface)) + offset
    distance = max(subject.photo_size) / 2 / (ratio * camera.scale * np.tan(np.radians(fov) / 2))
    x, y, z = (float(value) for value in place)
    return ViewCamera(origin=(x, y, z + distance), target=(x, y, z), fov=fov)


def _seen_depth(surface: Surface) -> float:
    """Mean z of what faces the camera, as large as the picture shows it."""
    corners = surface.vertices[surface.faces].astype(np.float64)
    facing = np.maximum(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2], 0)
    return float((facing * corners[..., 2].mean(axis=1)).sum() / max(float(facing.sum()), 1e-12))


def square(photo: ByteArray) -> tuple[ByteArray, tuple[int, int, int, int]]:
    """A photo (H, W, 3) in the middle of a square whose rest is the photo again, enlarged and soft; and where in it the photo lies."""
    import cv2

    height, width = photo.shape[:2]
    side = max(height, width)
    left, top = (side - width) // 2, (side - height) // 2
    short = min(height, width)
    inner = photo[(height - short) // 2 :, (width - short) // 2 :][:short, :short]
    whole = cv2.GaussianBlur(cv2.resize(inner, (side, side), interpolation=cv2.INTER_AREA), (0, 0), side / 40)
    whole = (whole * np.float32(0.8)).astype(np.uint8)
    whole[top : top + height, left : left + width] = photo
    return whole, (left, top, left + width, top + height)


def square_mask(mask: FloatArray, frame: tuple[int, ...]) -> FloatArray:
    """A mask (H, W) of the photo over its `square`, 0 around it; `frame` is where `square` put the photo."""
    left, top, right, bottom = frame
    whole = np.zeros((max(mask.shape), max(mask.shape)), np.float32)
    whole[top:bottom, left:right] = mask
    return whole


def estimate_light(surface: Surface) -> SceneSettings:
    """Lights by how bright the photo shows the sides of the person that face different ways.

    Brightness over the seen vertices is fitted by a constant and a direction; what is bright or dark by itself averages out. The sum of all
    light is such that surfaces towards the camera keep their colours.

    Parameters
    ----------
    surface : Surface
        In the frame of the photo's camera, with `visible`; without it all vertices that face the camera count.
    """
    normals = vertex_normals(surface.vertices, surface.faces)
    seen = normals[:, 2] > 0.15
    if surface.visible is not None and (seen & surface.visible).sum() > 100:
        seen &= surface.visible
    brightness = srgb_to_linear(surface.colors[seen]) @ np.array((0.2126, 0.7152, 0.0722))
    terms = np.column_stack([np.ones(int(seen.sum())), normals[seen]])
    constant, *slope = np.linalg.lstsq(terms, np.sqrt(np.maximum(brightness, 0)), rcond=None)[0]
    direction = np.array(slope)
    strength = float(np.linalg.norm(direction))
    share = DIRECTED * min(1.0, 2 * strength / max(abs(float(constant)), 1e-3))
    direction = direction / max(strength, 1e-9) if strength > 1e-3 else np.array((0.3, 1.0, 0.8))
    direction[1] = max(direction[1], 0.5)  # lamps hang above, and a shadow has to end somewhere
    direction /= np.linalg.norm(direction)
    facing = float(np.maximum(normals[seen] @ direction, 0).mean())
    fill = float(linear_to_srgb(np.array(1 - share)))
    return SceneSettings(
        background=(fill, fill, fill), sun=(share / max(facing, 0.2),) * 3, sun_direction=tuple(direction.tolist()), sun_angle=8.0,
        spot=(0.0, 0.0, 0.0), grid=0.0,
    )  # fmt: skip


def exposed(scene: SceneSettings, gain: FloatArray) -> SceneSettings:
    """All lights times `gain` (3,), linear RGB; the fill light no brighter than white."""
    fill = np.clip(srgb_to_linear(np.array(scene.background)) * gain, 0, 1)
    background = tuple(np.asarray(linear_to_srgb(fill), np.float64).tolist())
    sun = tuple((np.array(scene.sun) * gain).tolist())
    return dataclasses.replace(scene, background=background, sun=sun)


def gain_to(color: FloatArray, alpha: FloatArray, picture: ByteArray, mask: FloatArray) -> FloatArray:
    """By what to multiply the lights (3,), linear RGB, so that a rendered person is as bright and as coloured as in the picture.

    Parameters
    ----------
    color, alpha : (S, S, 3), (S, S)
        The rendered person: linear RGB times opacity, and opacity.
    picture, mask : (N, N, 3) uint8, (N, N) float
        The photo and the person's opacity in it, of the same field of view.
    """
    import cv2

    size = alpha.shape[::-1]
    photo = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    both = (alpha > 0.95) & (cv2.resize(mask, size, interpolation=cv2.INTER_AREA) > 0.95)
    if both.sum() < 20:
        return np.ones(3)
    wanted, given = srgb_to_linear(photo[both] / np.float32(255)), color[both]
    gain: FloatArray = np.clip(wanted.mean(axis=0) / np.maximum(given.mean(axis=0), 1e-4), 0.25, 4.0)
    return gain
