"""A person moved in two dimensions: the photo's pixels carried along by a posed body (in the spirit
of Liu et al. 2019, Liquid Warping GAN)."""

from __future__ import annotations

import numpy as np

from a2v.geometry.images import nearest_known, sample_image
from a2v.geometry.rays import RayScene
from a2v.geometry.visibility import depth_map
from a2v.rendering import ViewCamera
from a2v.types import Body, ByteArray, FloatArray, OrthographicCamera, Subject

TOLERANCE = 0.02
"""Distance in meters behind the first visible point up to which a point counts as visible."""
BACKGROUND = 235
"""Gray around the person."""


class Warp:
    """Moves the photo's colors along with the posed body; without a reconstruction or a network.

    Each pixel of a view that the posed body covers takes the color of the photo at the same point
    of the body. Points that the photo does not show take the color of the nearest pixel that it
    shows. Hair and clothes outside of the body's outline are lost.

    Parameters
    ----------
    subject : Subject
    body : Body
        In the photo's pose.
    camera : OrthographicCamera
        Of ``subject.image``.
    """

    def __init__(self, subject: Subject, body: Body, camera: OrthographicCamera) -> None:
        height, width = subject.mask.shape
        self._image, self._mask, self._camera = subject.image, subject.mask, camera
        self._vertices, self._faces = np.asarray(body.vertices, np.float32), body.faces
        self._depth = depth_map(self._vertices, self._faces, camera, (width, height))

    def frame(self, posed: FloatArray, view: ViewCamera, size: int) -> ByteArray:
        """A picture (size, size, 3) uint8 of the body posed to vertices (V, 3), meters, seen by
        `view`."""
        out = np.full((size * size, 3), BACKGROUND, np.uint8)
        hits = RayScene(posed, self._faces).cast(
            np.tile(np.asarray(view.origin, np.float32), (size * size, 1)), directions(view, size)
        )
        if not hits.hit.any():
            return out.reshape(size, size, 3)
        colors, seen = self._colors(hits.interpolate(self._vertices, self._faces))
        known = np.zeros(size * size, bool)
        known[np.flatnonzero(hits.hit)[seen]] = True
        out[known] = colors[seen]
        if known.any():
            rows, columns = nearest_known(known.reshape(size, size))
            filled = out.reshape(size, size, 3)[rows, columns].reshape(-1, 3)
        else:
            filled = np.tile(
                np.median(self._image[self._mask > 0.5], axis=0).astype(np.uint8), (size * size, 1)
            )
        holes = hits.hit & ~known
        out[holes] = filled[holes]
        return out.reshape(size, size, 3)

    def _colors(self, points: FloatArray) -> tuple[ByteArray, np.ndarray]:
        """Return the colors (N, 3) of the photo at points (N, 3) of its body, and which points (N,)
        the photo shows."""
        pixels = self._camera.project(points)
        height, width = self._depth.shape
        u, v = (
            np.clip(np.floor(pixels[:, axis]).astype(np.int64), 0, limit - 1)
            for axis, limit in ((0, width), (1, height))
        )
        within = (pixels >= 0).all(axis=1) & (pixels < (width, height)).all(axis=1)
        seen = within & (self._mask[v, u] > 0.5) & (self._depth[v, u] <= points[:, 2] + TOLERANCE)
        return np.clip(sample_image(self._image, pixels), 0, 255).astype(np.uint8), seen


def directions(view: ViewCamera, size: int) -> FloatArray:
    """Directions (size * size, 3) of the rays through a view's pixels, rows first."""
    reach = size / 2 / np.tan(np.radians(view.fov) / 2)
    across = (np.arange(size) + 0.5 - size / 2) / reach
    local = np.stack([*np.meshgrid(across, -across), np.full((size, size), -1.0)], axis=-1).reshape(
        -1, 3
    )
    return np.asarray(local @ view.axes, np.float32)
