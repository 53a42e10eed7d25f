"""Training batches for the networks, from the studio's views."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from a2v.geometry.images import nearest_known, sample_image
from a2v.io import read_npz
from a2v.lab.studio.view import View
from a2v.lab.surface.framed import framed
from a2v.reconstruction.implicit.inputs import (
    FRAME,
    GUIDE,
    GuideMaps,
    GuideMesh,
    guide_input,
    mask_distance,
    photo_input,
    place_of,
)
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray

LARGEST_SHIFT = 0.15
"""Maps with larger errors than this, meters, are not followed: they are at the start of their
training."""
FAR = 0.04
"""Points farther from the surface than this, meters, are drawn with twice the probability."""


@dataclass(frozen=True)
class Prepared:
    """A decoded view in small types: some megabytes, cached by `ViewReader`.

    Attributes
    ----------
    view : View
        The view; `framed` if an object may occlude the person or the border may cut it.
    image : (512, 512, 3) uint8
    mask : (512, 512) uint8
    guide : (10, 256, 256) float16
        See `a2v.lab.surface.networks.GUIDE_CHANNELS`.
    normals : (6, 256, 256) float16
        True normals of front and back, 0 outside.
    depth : (2, 256, 256) float16
        True depths, NaN outside and at pixels with an edge.
    nearest : (2, 256, 256) int16
        Row and column of the nearest pixel with true depths.
    guide_faces : (F, 3) int32
        Shared by all guides of a data set.
    """

    view: View
    image: ByteArray
    mask: ByteArray
    guide: FloatArray
    normals: FloatArray
    depth: FloatArray
    nearest: IntArray
    guide_faces: IntArray

    def guide_mesh(self) -> GuideMesh:
        """The guide. It is built again for each use (12 ms), because Open3D 0.20 crashes with a
        thousand ray casting scenes in memory."""
        return GuideMesh(self.view.guide_vertices, self.guide_faces)


@dataclass(frozen=True)
class Example:
    """One view as input of the networks, channels first, float32. A batch has a leading axis.

    Attributes
    ----------
    photo : (4, 512, 512)
    guide : (10, 256, 256)
    normals : (6, 256, 256), depth : (2, 256, 256)
        As in `Prepared`.
    points : dict of (N, ...)
        ``position`` (3) in the view's frame, ``place`` (2), and the targets: ``distance`` of
        points in space, or ``normals`` (3) and ``colors`` (3) of points on the surface. The inputs
        of the networks at them come from `align_example`.
    part : dict
        For the fine level, else empty: ``photo`` (4, crop, crop) of the frame's 1024 px, true
        ``normals`` (6, crop / 2, crop / 2), and ``corner`` (2): left and top of the part, pixels of
        the frame, multiples of 4.
    mirrored : () bool
        Whether left and right are exchanged (not in ``position``).
    """

    photo: FloatArray
    guide: FloatArray
    normals: FloatArray
    depth: FloatArray
    points: dict[str, FloatArray]
    part: dict[str, FloatArray]
    mirrored: BoolArray


class ViewReader:
    """Views by path, decoded once.

    Parameters
    ----------
    capacity : int
        Number of most recently used views in the cache.
    """

    def __init__(self, capacity: int = 2500) -> None:
        self._read = lru_cache(maxsize=capacity)(_prepare)

    def __call__(self, path: Path) -> Prepared:
        """Return the view in a file."""
        return self._read(path)


def _prepare(path: Path) -> Prepared:
    import cv2

    view, guide_faces = View.load(path), _guide_faces(path.parents[2])
    if view.surrounded:
        view = framed(view, guide_faces)
    half = (FRAME // 2, FRAME // 2)
    maps = GuideMaps(
        view.guide_depth_front.astype(np.float32),
        view.guide_depth_back.astype(np.float32),
        view.guide_normals_front / np.float32(127),
        view.guide_normals_back / np.float32(127),
    )
    mask = cv2.resize(view.mask, half, interpolation=cv2.INTER_AREA)
    depth = np.stack([_halved(view.depth_front), _halved(view.depth_back)])
    nearest = np.stack(nearest_known(np.isfinite(depth).all(axis=0)))
    small = (
        cv2.resize(view.mask, (GUIDE, GUIDE), interpolation=cv2.INTER_AREA).astype(np.float32) / 255
    )
    prepared = Prepared(
        view=view,
        image=cv2.resize(view.image, half, interpolation=cv2.INTER_AREA),
        mask=mask,
        guide=guide_input(maps, mask_distance(small, view.camera.scale * GUIDE / FRAME)).astype(
            np.float16
        ),
        normals=np.stack([_pooled(channel) for channel in _true_normals(view)]).astype(np.float16),
        depth=depth.astype(np.float16),
        nearest=nearest.astype(np.int16),
        guide_faces=guide_faces,
    )
    view.forget_pictures()
    return prepared


@lru_cache(maxsize=2)
def _guide_faces(folder: Path) -> IntArray:
    """Return the faces (F, 3) of the guides of a data set's folder."""
    faces: IntArray = read_npz(folder / "guide.npz")["faces"]
    return faces


def _true_normals(view: View) -> FloatArray:
    """Return the true normals (6, 512, 512) float32 of front and back."""
    both: FloatArray = np.concatenate([view.normals_front, view.normals_back], axis=-1).transpose(
        2, 0, 1
    ) / np.float32(127)
    return both


def _pooled(values: FloatArray) -> FloatArray:
    """Average 2 x 2 pixels."""
    height, width = values.shape
    means: FloatArray = values.reshape(height // 2, 2, width // 2, 2).mean(axis=(1, 3))
    return means


def make_example(
    prepared: Prepared,
    generator: np.random.Generator,
    points: int,
    *,
    colors: bool = False,
    crop: int = 0,
    augment: bool = True,
) -> Example:
    """Make an example from a view with `points` random points.

    Half of the examples are mirrored; mask and colors are slightly changed.

    Parameters
    ----------
    colors : bool
        Points on the surface with colors, instead of points in space with distances.
    crop : int
        Side of `Example.part`, pixels of the frame; 0 for none.
    """
    view = prepared.view
    mask, guide = prepared.mask, prepared.guide.astype(np.float32)
    tint = np.ones(3)
    grow = 0
    if augment:
        grow = int(generator.integers(-1, 2))  # masks of real photos err by a pixel or two
        mask = _grown(mask, grow)
        guide[9] -= grow / (view.camera.scale / 2)
        tint = generator.uniform(0.85, 1.15) * generator.uniform(0.96, 1.04, 3)
    part: dict[str, FloatArray] = {}
    if crop:
        chosen = view.points[int(generator.integers(len(view.points)))]
        left, top = (
            np.clip(
                (place_of(chosen, view.camera, FRAME) + 1) / 2 * FRAME - crop / 2, 0, FRAME - crop
            )
            // 4
            * 4
        ).astype(int)
        cut = np.s_[top : top + crop, left : left + crop]
        part = {
            "photo": photo_input(
                _tinted(view.image[cut], tint),
                _grown(view.mask, 2 * grow)[cut] / np.float32(255),
                crop,
            ),
            "normals": _true_normals(view)[
                :, top // 2 : (top + crop) // 2, left // 2 : (left + crop) // 2
            ],
            "corner": np.array([left, top], np.float32),
        }
        view.forget_pictures()
    example = Example(
        photo=photo_input(_tinted(prepared.image, tint), mask / np.float32(255), FRAME // 2),
        guide=guide,
        normals=prepared.normals.astype(np.float32),
        depth=prepared.depth.astype(np.float32),
        points=_surface_points(view, generator, points, tint, augment)
        if colors
        else _space_points(view, generator, points),
        part=part,
        mirrored=np.array(False),
    )
    return _mirrored(example) if augment and not crop and generator.random() < 0.5 else example


def _tinted(image: ByteArray, tint: FloatArray) -> ByteArray:
    import cv2

    table = np.clip(np.arange(256)[:, None] * tint + 0.5, 0, 255).astype(np.uint8)[None]
    return np.asarray(cv2.LUT(image, table), np.uint8)


def _grown(mask: ByteArray, pixels: int) -> ByteArray:
    """Dilate (or erode) a mask by some pixels."""
    import cv2

    if pixels == 0:
        return mask
    kernel = np.ones((2 * abs(pixels) + 1,) * 2, np.uint8)
    return np.asarray(cv2.dilate(mask, kernel) if pixels > 0 else cv2.erode(mask, kernel), np.uint8)


def align_points(prepared: Prepared, points: FloatArray, maps: FloatArray) -> FloatArray:
    """Move points (N, 3) along z by the error of the predicted depths there; (N, 3) float32.

    A photo shows the shape of an arm, but hardly its depth. If the field were trained with the true
    depth of an arm that the maps place elsewhere, it would learn to be uncertain, and make arms
    slabs. Relative to the maps it stays sharp.

    Parameters
    ----------
    maps : (2, 256, 256)
        Predicted depth of front and back, meters.
    """
    import cv2

    rows, columns = prepared.nearest.astype(np.intp)
    true = prepared.depth.astype(np.float32)[:, rows, columns]
    off = np.stack([cv2.blur(channel, (5, 5)) for channel in maps[:, rows, columns] - true])
    pixels = (place_of(points, prepared.view.camera, FRAME) + 1) / 2 * GUIDE
    (front, back), (front_off, back_off) = (
        (sample_image(np.ascontiguousarray(channel), pixels, linear=True) for channel in both)
        for both in (true, off)
    )
    share = np.clip((points[:, 2] - back) / np.maximum(front - back, 0.01), 0, 1)
    moved: FloatArray = points.astype(np.float32).copy()
    moved[:, 2] += np.clip(
        share * front_off + (1 - share) * back_off, -LARGEST_SHIFT, LARGEST_SHIFT
    )
    return moved


def align_example(prepared: Prepared, example: Example, maps: FloatArray) -> dict[str, FloatArray]:
    """Return the inputs at the example's points for networks with these predicted depths (2, 256,
    256); see `align_points`.

    Returns
    -------
    dict of ``depth`` (N,), ``guide_distance`` (N,), ``guide_normals`` (N, 3)
    """
    mirrored = bool(example.mirrored)
    moved = align_points(
        prepared, example.points["position"], maps[..., ::-1] if mirrored else maps
    )
    distance, normals = prepared.guide_mesh().at(moved)
    across = np.array([-1 if mirrored else 1, 1, 1], np.float32)
    return {"depth": moved[:, 2], "guide_distance": distance, "guide_normals": normals * across}


def _space_points(view: View, generator: np.random.Generator, count: int) -> dict[str, FloatArray]:
    distance = view.distance.astype(np.float32)
    odds = np.where(
        np.abs(distance) > FAR, 2.0, 1.0
    )  # most samples are near the surface, where errors matter least
    chosen = generator.choice(len(odds), count, p=odds / odds.sum())
    points = view.points[chosen]
    return {
        "position": points,
        "place": place_of(points, view.camera, FRAME),
        "distance": distance[chosen],
    }


def _surface_points(
    view: View, generator: np.random.Generator, count: int, tint: FloatArray, augment: bool
) -> dict[str, FloatArray]:
    odds = np.where(view.surface_visible, 1.0, 3.0)  # visible points are the easy ones
    chosen = generator.choice(len(odds), count, p=odds / odds.sum())
    normals = view.surface_normals[chosen] / np.float32(127)
    off = generator.normal(0, 0.008, (count, 1)) if augment else np.zeros((count, 1))
    points = (view.surface_points[chosen] + off * normals).astype(np.float32)
    return {
        "position": points,
        "place": place_of(points, view.camera, FRAME),
        "normals": normals,
        "colors": np.clip(view.surface_colors[chosen] * tint / 255, 0, 1).astype(np.float32),
    }


def _halved(depth: FloatArray, step: float = 0.02) -> FloatArray:
    """Average 2 x 2 pixels; NaN if one is outside or they differ by more than `step` meters."""
    height, width = depth.shape
    four = (
        depth.astype(np.float32)
        .reshape(height // 2, 2, width // 2, 2)
        .transpose(0, 2, 1, 3)
        .reshape(height // 2, width // 2, 4)
    )
    return np.where(
        four.max(axis=-1) - four.min(axis=-1) < step, four.mean(axis=-1), np.nan
    ).astype(np.float32)


def _mirrored(example: Example) -> Example:
    """Swap left and right, in the picture and in space."""

    def flip(values: FloatArray, *across: int) -> FloatArray:
        flipped = values[..., ::-1].copy()
        for channel in across:
            flipped[channel] *= -1
        return flipped

    points = dict(example.points)
    for name in {"place", "normals"} & set(points):
        points[name] = points[name] * np.array([-1, 1, 1][: points[name].shape[-1]], np.float32)
    return Example(
        photo=flip(example.photo),
        guide=flip(example.guide, 0, 3),
        normals=flip(example.normals, 0, 3),
        depth=flip(example.depth),
        points=points,
        part=example.part,
        mirrored=np.array(True),
    )


def stack(examples: Sequence[Example]) -> Example:
    """Stack several examples along a leading axis."""

    def all_of(values: Sequence[dict[str, FloatArray]]) -> dict[str, FloatArray]:
        return {name: np.stack([value[name] for value in values]) for name in values[0]}

    fields = {
        name: np.stack([getattr(example, name) for example in examples])
        for name in ("photo", "guide", "normals", "depth", "mirrored")
    }
    return Example(
        **fields,
        points=all_of([example.points for example in examples]),
        part=all_of([example.part for example in examples]),
    )
