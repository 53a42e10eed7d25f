"""The place of the photo, and lights that reproduce the person's look in it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from a2v.geometry.colors import linear_to_srgb, srgb_to_linear, to_bytes
from a2v.geometry.images import nearest_known
from a2v.geometry.mesh import evened, vertex_normals
from a2v.geometry.rays import texels
from a2v.record import Record
from a2v.rendering.camera import ViewCamera
from a2v.rendering.renderer import Renderer
from a2v.rendering.scene import LookSettings
from a2v.types import BoolArray, ByteArray, FloatArray, RenderSettings, Surface

_DARKEST = 0.3
"""Smallest light that colors are divided by."""

_GREY = 0.5
"""Albedo of the gray person on which the light is measured."""
_SPREAD = 12
"""Number of rings of vertices by which the measured light is extended beyond the visible
vertices."""

DIRECTED = 0.4
"""Largest share of the light that comes from one direction. The photo's colors already contain its
shading."""


@dataclass(frozen=True, kw_only=True)
class Place(Record):
    """Where the photo was taken.

    Attributes
    ----------
    picture : (S, S, 3) uint8
        sRGB picture of the place without the person, with the photo in its middle.
    camera : ViewCamera
        Square, around the photo (`a2v.rendering.viewpoint`).
    moved : (V, 3) float32
        Offsets of the person's vertices in the photo's pose, so that this camera shows them as in
        the photo.
    look : LookSettings
        Lights.
    frame : tuple of 4 int
        Left, top, right, bottom of the photo in `picture`.
    light : (V, 3) float32
        Light on the person's vertices in the photo's pose, irradiance over pi. `without_light`
        removes it from the colors.
    floor : (h, h) bool
        Pixels of `picture` that show the floor on which the person stood.
    things : (h, h) float32
        Distance of the object at each pixel, meters (`a2v.rendering.occluders`).
    """

    picture: ByteArray
    camera: ViewCamera
    moved: FloatArray
    look: LookSettings
    frame: tuple[int, ...]
    light: FloatArray
    floor: BoolArray
    things: FloatArray

    def __post_init__(self) -> None:
        self._check("picture", ("S", "S", 3))
        square: dict[str, int] = {}
        self._check("floor", ("h", "h"), square)
        self._check("things", ("h", "h"), square)
        sizes: dict[str, int] = {}
        self._check("light", ("V", 3), sizes)
        self._check("moved", ("V", 3), sizes)


def square(photo: ByteArray) -> tuple[ByteArray, tuple[int, int, int, int]]:
    """Place a photo (H, W, 3) in the middle of a square and fill the rest with an enlarged, blurred
    copy.

    Returns the square and the photo's box in it (left, top, right, bottom).
    """
    import cv2

    height, width = photo.shape[:2]
    side = max(height, width)
    left, top = (side - width) // 2, (side - height) // 2
    short = min(height, width)
    inner = photo[(height - short) // 2 :, (width - short) // 2 :][:short, :short]
    whole = cv2.GaussianBlur(
        cv2.resize(inner, (side, side), interpolation=cv2.INTER_AREA), (0, 0), side / 40
    )
    whole = (whole * np.float32(0.8)).astype(np.uint8)
    whole[top : top + height, left : left + width] = photo
    return whole, (left, top, left + width, top + height)


def square_mask(mask: FloatArray, frame: tuple[int, ...]) -> FloatArray:
    """Place a mask (H, W) of the photo in its `square`, 0 around it; `frame` is the photo's box in
    the square."""
    left, top, right, bottom = frame
    whole = np.zeros((max(mask.shape), max(mask.shape)), np.float32)
    whole[top:bottom, left:right] = mask
    return whole


def estimate_light(surface: Surface) -> LookSettings:
    """Estimate the lights from the photo's brightness on sides of the person that face different
    ways.

    The brightness over the visible vertices is fitted by a constant and a direction. Bright and
    dark materials average out. The total light is such that surfaces that face the camera keep
    their colors.

    Parameters
    ----------
    surface : Surface
        In the frame of the photo's camera, with `visible`; without it all vertices that face the
        camera count.
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
    direction[1] = max(direction[1], 0.5)  # lamps hang above, and shadows must have a finite length
    direction /= np.linalg.norm(direction)
    facing = float(np.maximum(normals[seen] @ direction, 0).mean())
    fill = float(linear_to_srgb(np.array(1 - share)))
    return LookSettings(
        background=(fill, fill, fill),
        sun=(share / max(facing, 0.45),) * 3,
        sun_direction=tuple(direction.tolist()),
        sun_angle=8.0,
        spot=(0.0, 0.0, 0.0),
        grid=0.0,
        gloss=False,
    )


def exposed(look: LookSettings, gain: FloatArray) -> LookSettings:
    """Multiply all lights by `gain` (3,), linear RGB. The fill light is at most white."""
    fill = np.clip(srgb_to_linear(np.array(look.background)) * gain, 0, 1)
    background = tuple(np.asarray(linear_to_srgb(fill), np.float64).tolist())
    sun = tuple((np.array(look.sun) * gain).tolist())
    return dataclasses.replace(look, background=background, sun=sun)


def light_on(
    surface: Surface,
    vertices: FloatArray,
    camera: ViewCamera,
    look: LookSettings,
    settings: RenderSettings,
) -> FloatArray:
    """Measure the light of a look on the vertices that the photo shows, irradiance over pi (V, 3)
    float32.

    Unseen vertices get about the mean.

    Parameters
    ----------
    surface, vertices : Surface, (V, 3)
        The person, and its vertices in the world.
    camera, look, settings : ViewCamera, LookSettings, RenderSettings
        They render a gray person, whose brightness is read at each vertex.
    """
    gray = np.full_like(surface.colors, linear_to_srgb(np.array(_GREY)))
    bare = Surface(vertices=surface.vertices, faces=surface.faces, colors=gray)
    cut = Renderer(bare, dataclasses.replace(settings, background="transparent"), look).cutout(
        vertices, camera
    )
    size = settings.size
    at = np.clip(camera.project(vertices, size), 0, size - 1e-3).astype(np.int64)
    alpha = cut.alpha[at[:, 1], at[:, 0]]
    normals = vertex_normals(surface.vertices, surface.faces)
    known = (alpha > 0.95) & (normals[:, 2] > 0.2)
    if surface.visible is not None:
        known &= surface.visible
    if not known.any():
        return np.ones_like(surface.colors, np.float32)
    light = cut.color[at[:, 1], at[:, 0]] / np.maximum(alpha, 1e-3)[:, None] / _GREY
    filled = np.where(known[:, None], light, light[known].mean(axis=0))
    for _ in range(_SPREAD):
        filled = np.where(known[:, None], light, evened(surface.faces, filled))
    return np.asarray(np.maximum(filled, _DARKEST), np.float32)


def without_light(surface: Surface, light: FloatArray) -> Surface:
    """Divide a surface's linear colors and texture by the light (V, 3) on its vertices.

    Under that light the result looks like the given surface.
    """
    colors = linear_to_srgb(np.clip(srgb_to_linear(surface.colors) / light, 0, 1)).astype(
        np.float32
    )
    if surface.uv is None or surface.texture is None:
        return dataclasses.replace(surface, colors=colors)
    size = surface.texture.shape[0]
    face, weight = texels(surface.uv.astype(np.float64) * size, size)
    rows, columns = nearest_known(face >= 0)  # extend the charts beyond their borders
    texture = np.empty_like(surface.texture)
    for top in range(0, size, 256):  # in blocks, to bound memory
        part = slice(top, top + 256)
        at = rows[part], columns[part]
        over = (light[surface.faces[face[at]]] * weight[at][..., None]).sum(axis=2)
        linear = srgb_to_linear(surface.texture[part] / np.float32(255))
        texture[part] = to_bytes(linear_to_srgb(np.clip(linear / np.maximum(over, _DARKEST), 0, 1)))
    return dataclasses.replace(surface, colors=colors, texture=texture)
