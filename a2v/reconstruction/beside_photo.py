"""Compare a finished character, in the pose and by the camera of its photo, with the photo."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from a2v.body.parts import PARTS
from a2v.geometry.rays import RayScene
from a2v.rendering.preview import colors_at
from a2v.types import BoolArray, Camera, FloatArray, IntArray, Subject, Surface

SIZE = 320
"""Pixels along the longer side of the pictures that are compared."""
LIMBS: Mapping[str, tuple[str, ...]] = {
    "head": ("head", "neck"),
    "trunk": ("torso",),
    "arms": tuple(name for name in PARTS if "arm" in name or "hand" in name),
    "legs": tuple(name for name in PARTS if any(x in name for x in ("thigh", "shin", "foot"))),
}
"""Parts of the body whose colors are compared."""
_FEW = 20
"""Smallest number of pixels of a limb whose color is compared."""


@dataclass(frozen=True, eq=False)
class Reposed:
    """The character as photographed: on the pixels of the photo, smaller.

    Attributes
    ----------
    image : (H, W, 3) float32
        The photo, sRGB in [0, 1].
    mask : (H, W) bool
        The person in the photo.
    colors : (H, W, 3) float32
        The character; gray outside.
    shown : (H, W) bool
        Where it is.
    parts : (H, W) int
        Its body part there, -1 outside.
    """

    image: FloatArray
    mask: BoolArray
    colors: FloatArray
    shown: BoolArray
    parts: IntArray

    def compared(self) -> dict[str, float]:
        """Return "iou", of the outlines, and the mean CIELAB differences where both are: "color",
        and "color, head" and so on for `LIMBS`, NaN for one that is hardly seen."""
        both = self.mask & self.shown
        away = np.linalg.norm(_lab(self.image) - _lab(self.colors), axis=-1)
        found = {
            "iou": float(both.sum() / max(int((self.mask | self.shown).sum()), 1)),
            "color": _mean(away, both),
        }
        for limb, names in LIMBS.items():
            own = np.isin(self.parts, [PARTS.index(name) for name in names])
            found[f"color, {limb}"] = _mean(away, both & own)
        return found


def repose(
    surface: Surface, parts: IntArray, subject: Subject, camera: Camera, *, size: int = SIZE
) -> Reposed:
    """Draw a character beside its photo.

    Parameters
    ----------
    surface : Surface
        Colored, in the pose of the photo.
    parts : (V,) int
        Body part of each vertex; empty if they are not known.
    camera : Camera
        Of `subject.image`.
    size : int
        Pixels along the photo's longer side.
    """
    import cv2

    seen = dataclasses.replace(surface, vertices=camera.flatten(surface.vertices))
    shape = subject.image.shape[:2]
    step = max(shape) / size
    rows, columns = (np.arange(max(1, round(length / step))) + 0.5 for length in shape)
    height, width = len(rows), len(columns)
    pixels = np.stack(np.meshgrid(columns * step, rows * step), axis=-1).reshape(-1, 2)
    far = float(np.abs(seen.vertices[:, 2]).max()) + 1
    hits = RayScene(seen.vertices, seen.faces).cast(
        np.asarray(camera.flat.unproject(pixels, far), np.float32),
        np.array([0, 0, -1], np.float32),
    )
    on = hits.hit
    own, colors = np.full(len(pixels), -1, np.int64), np.full((len(pixels), 3), 0.5, np.float32)
    if len(parts):
        own[on] = np.asarray(parts, np.int64)[seen.faces[hits.face[on], 0]]
    weights = np.column_stack([1 - hits.barycentric[on].sum(axis=1), hits.barycentric[on]])
    colors[on] = colors_at(seen, hits.face[on], weights)
    small = cv2.resize(subject.image, (width, height), interpolation=cv2.INTER_AREA)
    mask = cv2.resize(
        subject.mask.astype(np.float32), (width, height), interpolation=cv2.INTER_AREA
    )
    return Reposed(
        small.astype(np.float32) / 255,
        mask > 0.5,
        colors.reshape(height, width, 3),
        on.reshape(height, width),
        own.reshape(height, width),
    )


def _lab(picture: FloatArray) -> FloatArray:
    """CIELAB (H, W, 3) of a picture, sRGB in [0, 1]."""
    import cv2

    return np.asarray(cv2.cvtColor(np.ascontiguousarray(picture, np.float32), cv2.COLOR_RGB2LAB))


def _mean(values: FloatArray, chosen: BoolArray) -> float:
    """Mean over at least `_FEW` chosen pixels, else NaN."""
    return float(values[chosen].mean()) if chosen.sum() >= _FEW else float("nan")
