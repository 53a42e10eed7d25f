"""Decide whether cloth hangs between the legs, which is not a displacement of a leg."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import on_parts
from a2v.geometry.colors import lab_of_bytes
from a2v.geometry.mesh import face_normals
from a2v.geometry.rays import RayScene
from a2v.types import Body, BoolArray, Camera, FloatArray, Subject, Surface

_GAP = 0.05
"""Distance between the skins of both legs below which a place between them is not used, meters."""
_SHARE = 0.5
"""Smallest share of the used places that lie within cloth, and that have the colors of the legs
around them."""
_LEAST = 3
_ALIKE = 12.0
"""Largest distance of similar colors, CIELAB units. Lightness counts a third, because cloth between
two legs lies in their shadow."""
_AROUND = 0.25
"""Share of the gap, around its middle, over which colors are sampled."""
_ROWS = 0.03
"""Height above and below a place within which the legs are sampled, meters."""
_SAMPLES = 1500
"""Largest number of samples of the legs at one height."""
_OFTEN = 0.15
"""Smallest share of these samples with a similar color."""
BENT = 60.0
"""Bend of the hips, degrees, above which only the shins are used: between the thighs of seated
people the photo shows the seat of the trousers."""
_THIGHS = 8
"""Number of places between the thighs; those between the shins follow them."""


def hangs_between_legs(surface: Surface, body: Body, subject: Subject, camera: Camera) -> bool:
    """Return whether cloth hangs between the thighs or shins of a body whose legs stand apart.

    There, the reconstructed `surface` (closed, in the pose of the photo) is filled, and the photo
    shows the same colors as on the legs at the same height. The second condition is needed because
    the surface is also filled if the mask wrongly includes the background between two trouser legs.
    Trousers whose legs touch are excluded by `line_between_legs`.
    """
    from scipy.spatial import cKDTree

    heads = body.bone_transforms[:, :3, 3].astype(np.float64)
    hips, knees, ankles = (
        np.stack([heads[body.bone_names.index(f"{bone}{side}")] for side in (".L", ".R")])
        for bone in ("upperleg01", "lowerleg01", "foot")
    )
    along = [(1 - t) * hips + t * knees for t in np.linspace(0.45, 1.0, _THIGHS)] + [
        (1 - t) * knees + t * ankles for t in np.linspace(0.1, 0.5, 4)
    ]
    middle = np.stack([pair.mean(axis=0) for pair in along])
    away = cKDTree(body.vertices).query(middle)[0]
    telling, least = 2 * away > _GAP, _LEAST
    if hips_bent(body) > BENT:
        telling[:_THIGHS], least = False, 2
    if telling.sum() < least:
        return False
    flat = face_normals(surface.vertices, np.asarray(surface.faces, np.int64))
    within = (
        RayScene(surface.vertices, surface.faces).crossings(
            np.asarray(middle[telling], np.float32), flat
        )
        > 0
    )
    if within[: max(least, int(within.size * 0.6))].mean() < _SHARE:
        return False
    return _alike(middle[telling][within], away[telling][within], body, subject, camera) >= _SHARE


def hips_bent(body: Body) -> float:
    """Return the angle, degrees, of the less bent thigh from its direction at rest, relative to the
    trunk."""
    from scipy.spatial.transform import Rotation

    moved = body.bone_transforms[:, :3, :3].astype(np.float64) @ np.swapaxes(
        body.rest_transforms[:, :3, :3].astype(np.float64), 1, 2
    )
    trunk = moved[body.bone_names.index("spine03")]
    heads = body.bone_transforms[:, :3, 3].astype(np.float64)
    rest = body.rest_transforms[:, :3, 3].astype(np.float64)
    bent = []
    for side in (".L", ".R"):
        hip, knee = (
            body.bone_names.index(f"upperleg01{side}"),
            body.bone_names.index(f"lowerleg01{side}"),
        )
        ways = [trunk @ (rest[knee] - rest[hip]), heads[knee] - heads[hip]]
        turn, _ = Rotation.align_vectors(ways[1][None], ways[0][None])
        bent.append(float(np.degrees(turn.magnitude())))
    return min(bent)


def _alike(
    middle: FloatArray, away: FloatArray, body: Body, subject: Subject, camera: Camera
) -> float:
    """Compare the colors between the legs with those of the legs.

    Returns the share of the colors around `middle` (n, 3), places between the legs, that the photo
    also shows on the legs at the same height; 1 if no place is used. The places are `away` (n,)
    meters from the legs.
    """
    from scipy.spatial import cKDTree

    lab = lab_of_bytes(subject.image) * [1 / 3, 1.0, 1.0]
    legs = camera.project(
        body.vertices[on_parts(body.parts, "left_thigh", "left_shin", "right_thigh", "right_shin")]
    )
    own = _around(legs, 1.0, lab.shape)
    shares = []
    for pixel, gap in zip(camera.project(middle), away, strict=True):
        asked = _around(pixel[None], max(1.0, _AROUND * gap * camera.scale), lab.shape)
        row = np.arange(len(lab))[:, None]
        beside = own & ~asked & (np.abs(row - pixel[1]) < max(2.0, _ROWS * camera.scale))
        if asked.any() and beside.sum() > _LEAST:
            palette = lab[beside]
            palette = palette[:: max(1, len(palette) // _SAMPLES)]
            alike = cKDTree(palette).query_ball_point(
                lab[asked], _ALIKE, workers=1, return_length=True
            )
            shares.append(float((alike > _OFTEN * len(palette)).mean()))
    return float(np.mean(shares)) if shares else 1.0


def _around(pixels: FloatArray, radius: float, shape: tuple[int, ...]) -> BoolArray:
    """Return which pixels (H, W) of a picture of `shape` lie within `radius` of `pixels` (n, 2)."""
    import cv2

    marked = np.ones(shape[:2], np.uint8)
    column, row = np.floor(pixels).astype(np.int64).T
    inside = (column >= 0) & (row >= 0) & (column < shape[1]) & (row < shape[0])
    marked[row[inside], column[inside]] = 0
    if marked.all():
        return np.zeros(shape[:2], bool)
    return np.asarray(cv2.distanceTransform(marked, cv2.DIST_L2, 5) <= radius)
