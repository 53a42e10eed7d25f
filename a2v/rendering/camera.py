"""Perspective cameras, and the four that follow the character."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.types import FloatArray, Record, RenderSettings, View

DIRECTIONS: dict[View, tuple[float, float, float]] = {
    "front": (0.0, 0.0, 1.0),
    "back": (0.0, 0.0, -1.0),
    "left": (1.0, 0.0, 0.0),
    "right": (-1.0, 0.0, 0.0),
}
"""From the person towards the camera: the person faces +z and its left is +x."""


@dataclass(frozen=True, kw_only=True)
class ViewCamera(Record):
    """A perspective camera that renders a square picture.

    Attributes
    ----------
    origin, target : tuple of 3 float
        Where it stands and what it looks at, metres, world.
    up : tuple of 3 float
        Direction that is up in the picture.
    fov : float
        Field of view, degrees, the same across and up.
    """

    origin: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    fov: float = 28.0

    def __post_init__(self) -> None:
        values = np.array([*self.origin, *self.target, *self.up, self.fov], np.float64)
        if not np.isfinite(values).all() or not 0 < self.fov < 180:
            raise InputError(f"a camera with fov {self.fov} at {self.origin} cannot be used; expected finite numbers, fov in (0, 180)")
        if np.linalg.norm(np.cross(self.up, np.subtract(self.target, self.origin))) < 1e-9:
            raise InputError(f"the camera at {self.origin} looks along its own up direction; choose another target or up")

    @property
    def axes(self) -> FloatArray:
        """Rows (3, 3): the picture's right, up, and the direction towards the viewer, unit length, world."""
        backward = np.subtract(self.origin, self.target).astype(np.float64)
        backward /= np.linalg.norm(backward)
        right = np.cross(self.up, backward)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(backward, right), backward])

    def project(self, points: FloatArray, size: int) -> FloatArray:
        """Pixels (..., 2), u to the right and v down, of points (..., 3) in metres; the first pixel's centre is (0.5, 0.5).

        Points behind the camera give NaN.
        """
        local = (np.asarray(points, np.float64) - self.origin) @ self.axes.T
        depth = np.where(local[..., 2] < 0, -local[..., 2], np.nan)
        reach = size / 2 / np.tan(np.radians(self.fov) / 2)
        return np.stack([size / 2 + reach * local[..., 0] / depth, size / 2 - reach * local[..., 1] / depth], axis=-1)


def follow_cameras(
    track: FloatArray,
    settings: RenderSettings = RenderSettings(),  # noqa: B008 - frozen
    *,
    fov: float = 28.0,
    margin: float = 0.06,
    smoothing: float = 8.0,
    height: float | None = None,
) -> dict[View, tuple[ViewCamera, ...]]:
    """Cameras at half the character's height that follow it, one a frame and view (paper, section 4.2.2).

    They keep one distance and one direction for the whole clip, the same for all views, so large that the
    whole body stays in the picture at every frame.

    Parameters
    ----------
    track : (T, N, 3) float
        The character over time, metres: all vertices, or N = 2 for each frame's bounding box (least and greatest corner).
    settings : RenderSettings
        Its `views`.
    fov : float
        Degrees.
    margin : float
        Free border on each side, a fraction of the picture.
    smoothing : float
        Standard deviation of the Gaussian low-pass on the character's path over the ground, frames.
    height : float or None
        The character's height, metres; None: the median over the clip of the tallest extent, at least half of the largest.

    Returns
    -------
    dict of view to T cameras

    Raises
    ------
    InputError
        `track` has another shape, no frames, or holds NaN.
    """
    from scipy.ndimage import gaussian_filter1d

    points = np.asarray(track, np.float64)
    if points.ndim != 3 or points.shape[-1] != 3 or points.shape[0] < 1 or points.shape[1] < 1:
        raise InputError(f"the character's track has shape {points.shape}; expected (frames, vertices, 3), or (frames, 2, 3) for bounds")
    if not np.isfinite(points).all():
        raise InputError("the character's track holds NaN or infinite numbers; check the motion that moved it")
    low, high = points.min(axis=1), points.max(axis=1)
    if points.shape[1] == 2:  # the corners of the boxes stand for what is inside
        points = np.stack([np.where([i & 1, i & 2, i & 4], high, low) for i in range(8)], axis=1)
    if height is None:
        extent = high[:, 1] - low[:, 1]
        height = float(max(np.median(extent), 0.5 * extent.max()))
    centre = (low + high) / 2
    centre[:, 1] = height / 2
    path = centre
    if smoothing > 0 and len(centre) > 1:
        # continued at both ends by point reflection, or the camera would lag behind whoever walks into the clip
        beyond = min(len(centre) - 1, int(4 * smoothing))
        padded = np.pad(centre, ((beyond, beyond), (0, 0)), mode="reflect", reflect_type="odd")
        path = gaussian_filter1d(padded, smoothing, axis=0, mode="nearest")[beyond : beyond + len(centre)]
    reach = (1 - 2 * margin) * np.tan(np.radians(fov) / 2)
    distance = 0.5
    offsets = points - path[:, None]
    for view in settings.views:
        toward = np.array(DIRECTIONS[view])
        right = np.cross((0.0, 1.0, 0.0), toward)
        lateral = np.maximum(np.abs(offsets @ right), np.abs(offsets[..., 1]))
        distance = max(distance, float((lateral / reach + offsets @ toward).max()))
    return {
        view: tuple(
            ViewCamera(
                origin=_triple(target + distance * np.array(DIRECTIONS[view])),
                target=_triple(target),
                fov=fov,
            )
            for target in path
        )
        for view in settings.views
    }


def _triple(vector: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return x, y, z
