"""Cloth that hangs between the legs: no displacement of a leg."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import on_parts
from a2v.geometry.mesh import face_normals
from a2v.geometry.rays import RayScene
from a2v.types import Body, BoolArray, Camera, FloatArray, Subject, Surface

_GAP = 0.05
"""Where the legs' skins are nearer to each other, metres, what lies between says nothing."""
_SHARE = 0.5
"""Of the places between the legs that tell, at least so many lie within cloth, and have the colours of the legs around them."""
_LEAST = 3
_ALIKE = 12.0
"""Colours within so many CIELAB units are alike; lightness counts a third, for cloth between two legs lies in their shadow."""
_AROUND = 0.25
"""The picture's colours are asked over this share of the gap around its middle."""
_ROWS = 0.03
"""And so far above and below, metres."""
_SAMPLES = 1500
"""Samples of the legs at that height."""
_OFTEN = 0.15
"""At least this share of them is alike."""


def hangs_between_legs(surface: Surface, body: Body, subject: Subject, camera: Camera) -> bool:
    """Whether cloth hangs between a body's thighs or shins where the legs stand apart.

    The reconstructed `surface` (closed, in the photo's pose) is filled there, and the photo shows what it shows on the legs at the same height:
    a mask that took the background between two trouser legs for the person fills the surface as well.
    """
    from scipy.spatial import cKDTree

    heads = body.bone_transforms[:, :3, 3].astype(np.float64)
    hips, knees, ankles = (np.stack([heads[body.bone_names.index(f"{bone}{side}")] for side in (".L", ".R")]) for bone in ("upperleg01", "lowerleg01", "foot"))
    along = [(1 - t) * hips + t * knees for t in np.linspace(0.45, 1.0, 8)] + [(1 - t) * knees + t * ankles for t in np.linspace(0.1, 0.5, 4)]
    middle = np.stack([pair.mean(axis=0) for pair in along])
    away = cKDTree(body.vertices).query(middle)[0]
    telling = 2 * away > _GAP
    if telling.sum() < _LEAST:
        return False
    flat = face_normals(surface.vertices, np.asarray(surface.faces, np.int64))
    within = RayScene(surface.vertices, surface.faces).crossings(np.asarray(middle[telling], np.float32), flat) > 0
    if within[: max(_LEAST, int(within.size * 0.6))].mean() < _SHARE:
        return False
    return _alike(middle[telling][within], away[telling][within], body, subject, camera) >= _SHARE


def _alike(middle: FloatArray, away: FloatArray, body: Body, subject: Subject, camera: Camera) -> float:
    """Share of what the photo shows around `middle` (n, 3), places between the legs `away` (n,) metres from them, that it also shows on legs at the same height; 1 where nothing tells."""
    from scipy.spatial import cKDTree
    from skimage.color import rgb2lab

    lab = np.asarray(rgb2lab(subject.image), np.float64) * [1 / 3, 1.0, 1.0]
    legs = camera.project(body.vertices[on_parts(body.parts, "left_thigh", "left_shin", "right_thigh", "right_shin")])
    own = _around(legs, 1.0, lab.shape)
    shares = []
    for pixel, gap in zip(camera.project(middle), away, strict=True):
        asked = _around(pixel[None], max(1.0, _AROUND * gap * camera.scale), lab.shape)
        row = np.arange(len(lab))[:, None]
        beside = own & ~asked & (np.abs(row - pixel[1]) < max(2.0, _ROWS * camera.scale))
        if asked.any() and beside.sum() > _LEAST:
            palette = lab[beside]
            palette = palette[:: max(1, len(palette) // _SAMPLES)]
            alike = cKDTree(palette).query_ball_point(lab[asked], _ALIKE, workers=1, return_length=True)
            shares.append(float((alike > _OFTEN * len(palette)).mean()))
    return float(np.mean(shares)) if shares else 1.0


def _around(pixels: FloatArray, radius: float, shape: tuple[int, ...]) -> BoolArray:
    """Which pixels (H, W) of a picture of `shape` lie within `radius` of `pixels` (n, 2)."""
    import cv2

    marked = np.ones(shape[:2], np.uint8)
    column, row = np.floor(pixels).astype(np.int64).T
    inside = (column >= 0) & (row >= 0) & (column < shape[1]) & (row < shape[0])
    marked[row[inside], column[inside]] = 0
    if marked.all():
        return np.zeros(shape[:2], bool)
    return np.asarray(cv2.distanceTransform(marked, cv2.DIST_L2, 5) <= radius)
