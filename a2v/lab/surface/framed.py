"""Views with occluding objects or cut off by the border, prepared like real photos: framed by the
mask, and sampled only where the person is visible."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from a2v.lab.studio.view import MAP_SIZE, PHOTO_SIZE, View, encode_pictures
from a2v.reconstruction.implicit.inputs import FRAME, GuideMesh, frame_box, make_frame, place_of
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera

_QUALITY = 98
"""JPEG quality of the frame, per cent; the photo was a JPEG before."""
_IN_SPACE = ("points", "distance", "guide_distance", "guide_normals")
_ON_SURFACE = tuple(
    f"surface_{name}"
    for name in (
        "points",
        "normals",
        "colors",
        "visible",
        "parts",
        "guide_distance",
        "guide_normals",
    )
)


def framed(view: View, guide_faces: IntArray) -> View:
    """Crop a view to the square around its mask; parts of the person outside of the photo are not
    sampled.

    A photo's surface is cut to its mask (`a2v.reconstruction.implicit.surface`), but the person may
    continue behind an object at the mask's border. So there are no normals and depths at occluded
    pixels, and no samples behind them or beyond the photo's border.

    Parameters
    ----------
    view : View
    guide_faces : (F, 3) int
        Faces of the guide.

    Raises
    ------
    InputError
        The mask is empty, or a picture of the view is damaged.
    """
    from scipy.ndimage import binary_dilation

    mask = view.mask / np.float32(255)
    frame, box = make_frame(view.image, mask, view.camera), frame_box(mask)
    shown = ~binary_dilation(view.hidden, np.ones((3, 3), bool))  # including the person's rim there
    maps: dict[str, np.ndarray] = {"mask": np.rint(255 * frame.mask).astype(np.uint8)}
    for name, outside in (("normals", 0), ("depth", np.nan)):
        for side in ("front", "back"):
            maps[f"{name}_{side}"] = _part(view.map(f"{name}_{side}"), shown, box, outside)
    maps["parts_front"] = _part(view.parts_front, shown, box, -1)
    guide = GuideMesh(view.guide_vertices, guide_faces).maps(frame.camera, FRAME)
    maps |= {"guide_depth_front": guide.depth_front, "guide_depth_back": guide.depth_back}
    for side, normals in (("front", guide.normals_front), ("back", guide.normals_back)):
        maps[f"guide_normals_{side}"] = np.rint(127 * normals)
    kept: dict[str, Any] = {}
    for names in (_IN_SPACE, _ON_SURFACE):
        asked = _are_shown(view, shown, frame.camera, getattr(view, names[0]))
        kept |= {name: getattr(view, name)[asked] for name in names}
    return dataclasses.replace(
        view, encoded=encode_pictures(frame.image, _QUALITY, maps), camera=frame.camera, **kept
    )


def _part(
    values: np.ndarray, shown: BoolArray, box: tuple[float, float, float], outside: float
) -> np.ndarray:
    """Sample a map (S, S, ...) of the photo at the nearest pixels of the frame `box` (u, v and
    side); `outside` where it is not `shown` (S, S)."""
    u, v, side = box
    size = len(values)
    steps = (np.arange(size) + 0.5) / size - 0.5
    rows, columns = (
        np.floor((middle + side * steps) * size / PHOTO_SIZE).astype(int) for middle in (v, u)
    )
    inside = ((rows >= 0) & (rows < size))[:, None] & ((columns >= 0) & (columns < size))[None]
    at = np.ix_(rows.clip(0, size - 1), columns.clip(0, size - 1))
    there = inside & shown[at]
    return np.where(
        there.reshape(*there.shape, *(1,) * (values.ndim - 2)),
        values[at],
        np.asarray(outside, values.dtype),
    )


def _are_shown(
    view: View, shown: BoolArray, camera: OrthographicCamera, points: FloatArray
) -> BoolArray:
    """Return which points (N, 3) lie in the frame of `camera` and at `shown` (512, 512) pixels of
    the view's photo."""
    column, row = (
        np.floor((place_of(points, view.camera, PHOTO_SIZE) + 1) / 2 * MAP_SIZE).astype(int).T
    )
    inside = (
        (np.minimum(column, row) >= 0)
        & (np.maximum(column, row) < MAP_SIZE)
        & (np.abs(place_of(points, camera, FRAME)) < 1).all(axis=1)
    )
    return np.asarray(inside & shown[row.clip(0, MAP_SIZE - 1), column.clip(0, MAP_SIZE - 1)])
