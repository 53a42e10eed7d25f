"""Render surfaces in the frame of the photo."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.geometry.colors import linear_to_srgb
from a2v.geometry.rays import RayScene
from a2v.geometry.vectors import unit
from a2v.lab.studio.texture import texture_at
from a2v.types import BoolArray, Camera, FloatArray, OrthographicCamera, Subject, Surface


def camera_of_crop(camera: OrthographicCamera, subject: Subject) -> OrthographicCamera:
    """The camera of the photo for the pixels of the subject's crop."""
    left, top, right, _ = subject.crop
    zoom = subject.image.shape[1] / (right - left)
    return OrthographicCamera(
        scale=camera.scale * zoom,
        center_u=(camera.center_u - left) * zoom,
        center_v=(camera.center_v - top) * zoom,
    )


def to_true_frame(
    points: FloatArray, camera: Camera, subject: Subject, *, true: OrthographicCamera
) -> FloatArray:
    """Points (N, 3) from the frame of `camera` (of the subject's crop) in that of the `true` flat
    camera of the photo: same pixels, same proportions."""
    crop = camera_of_crop(true, subject)
    return crop.unproject(camera.project(points), points[:, 2] * (camera.scale / crop.scale))


@dataclass(frozen=True, eq=False)
class Maps:
    """A surface seen along the viewing axis of the photo, from the front or from the back, on the
    same pixels.

    Attributes
    ----------
    mask : (S, S) bool
    depth : (S, S) float32
        z, meters; NaN outside.
    normals : (S, S, 3) float32
        Unit, towards the viewer's side; 0 outside.
    colors : (S, S, 3) float32
        sRGB in [0, 1], unlit; mid gray outside.
    """

    mask: BoolArray
    depth: FloatArray
    normals: FloatArray
    colors: FloatArray


def surface_maps(
    surface: Surface,
    normals: FloatArray,
    camera: OrthographicCamera,
    photo: tuple[int, int],
    *,
    size: int,
    side: int,
) -> Maps:
    """Render a surface with parallel rays through a grid over the photo.

    Parameters
    ----------
    surface : Surface
        Textured, or with colors on its vertices.
    normals : (V, 3)
    camera : OrthographicCamera
        Of the photo's pixels.
    photo : tuple of 2 int
        The photo's height and width, pixels.
    size : int
        Rays along the longer side.
    side : int
        1 from the front, -1 from the back.
    """
    step = max(photo) / size
    rows, columns = (np.arange(max(1, round(length / step))) + 0.5 for length in photo)
    pixels = np.stack(np.meshgrid(columns * step, rows * step), axis=-1)
    far = side * (float(np.abs(surface.vertices[:, 2]).max()) + 1)
    hits = RayScene(surface.vertices, surface.faces).cast(
        np.asarray(camera.unproject(pixels.reshape(-1, 2), far), np.float32),
        np.array([0, 0, -side], np.float32),
    )
    shape, seen = pixels.shape[:2], hits.hit
    depth = np.full(seen.shape, np.nan, np.float32)
    depth[seen] = far - side * hits.distance[seen]
    facing = np.zeros((len(seen), 3), np.float32)
    found = hits.interpolate(normals, surface.faces)
    facing[seen] = unit(found * np.where(side * found[:, 2:] < 0, -1, 1), least=1e-9)
    colors = np.full((len(seen), 3), 0.5, np.float32)
    if surface.texture is None:
        colors[seen] = hits.interpolate(surface.colors, surface.faces)
    else:
        colors[seen] = linear_to_srgb(texture_at(surface, hits.face[seen], hits.barycentric[seen]))
    return Maps(
        seen.reshape(shape),
        depth.reshape(shape),
        facing.reshape(*shape, 3),
        colors.reshape(*shape, 3),
    )


def mask_in_photo(subject: Subject) -> FloatArray:
    """The mask of the person found by perception, in the whole photo, (H, W) float32."""
    import cv2

    left, top, right, bottom = subject.crop
    width, height = subject.photo_size
    crop = cv2.resize(subject.mask, (right - left, bottom - top), interpolation=cv2.INTER_AREA)
    whole = np.zeros((height, width), np.float32)
    y, x = slice(max(0, top), min(height, bottom)), slice(max(0, left), min(width, right))
    whole[y, x] = crop[y.start - top : y.stop - top, x.start - left : x.stop - left]
    return whole
