"""Batches for the networks out of the studio's views."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from a2v.reconstruction.implicit.inputs import FRAME, GUIDE, GuideMaps, guide_input, mask_distance, photo_input, place_of
from a2v.reconstruction.synthetic.view import View
from a2v.types import ByteArray, FloatArray


@dataclass(frozen=True)
class Prepared:
    """What is decoded of a view once, in small types: some megabytes, kept in memory by `ViewReader`.

    Attributes
    ----------
    view : View
    image : (512, 512, 3) uint8
    mask : (512, 512) uint8
    guide : (10, 256, 256) float16
        See `a2v.reconstruction.implicit.networks.GUIDE_CHANNELS`.
    normals : (6, 256, 256) float16
        True normals of front and back, 0 outside.
    depth : (2, 256, 256) float16
        True depths, NaN outside and where a pixel holds an edge.
    """

    view: View
    image: ByteArray
    mask: ByteArray
    guide: FloatArray
    normals: FloatArray
    depth: FloatArray


@dataclass(frozen=True)
class Example:
    """One view as the networks take it (a batch: with a leading axis); channels first, float32.

    Attributes
    ----------
    photo : (4, 512, 512)
    guide : (10, 256, 256)
    normals : (6, 256, 256), depth : (2, 256, 256)
        As in `Prepared`.
    points : dict of (N, ...)
        ``place`` (2), ``depth``, ``guide_distance``, ``guide_normals`` (3), and what they are for: ``distance`` of points in space, or
        ``normals`` (3), ``colors`` (3) of points on the surface.
    part : dict
        For the fine level, else empty: ``photo`` (4, crop, crop) of the frame's 1024 px, true ``normals`` (6, crop / 2, crop / 2), and
        ``corner`` (2): left and top of the part, pixels of the frame, multiples of 4.
    """

    photo: FloatArray
    guide: FloatArray
    normals: FloatArray
    depth: FloatArray
    points: dict[str, FloatArray]
    part: dict[str, FloatArray]


class ViewReader:
    """Views by path, decoded once.

    Parameters
    ----------
    capacity : int
        How many are kept, the last used.
    """

    def __init__(self, capacity: int = 2500) -> None:
        self._read = lru_cache(maxsize=capacity)(_prepare)

    def __call__(self, path: Path) -> Prepared:
        """The view in a file."""
        return self._read(path)


def _prepare(path: Path) -> Prepared:
    import cv2

    view = View.load(path)
    half = (FRAME // 2, FRAME // 2)
    maps = GuideMaps(
        view.guide_depth_front.astype(np.float32),
        view.guide_depth_back.astype(np.float32),
        view.guide_normals_front / np.float32(127),
        view.guide_normals_back / np.float32(127),
    )
    mask = cv2.resize(view.mask, half, interpolation=cv2.INTER_AREA)
    small = cv2.resize(view.mask, (GUIDE, GUIDE), interpolation=cv2.INTER_AREA).astype(np.float32) / 255
    prepared = Prepared(
        view=view,
        image=cv2.resize(view.image, half, interpolation=cv2.INTER_AREA),
        mask=mask,
        guide=guide_input(maps, mask_distance(small, view.camera.scale * GUIDE / FRAME)).astype(np.float16),
        normals=np.stack([_pooled(channel) for channel in _true_normals(view)]).astype(np.float16),
        depth=np.stack([_halved(view.depth_front), _halved(view.depth_back)]).astype(np.float16),
    )
    for name in list(vars(view)):  # the decoded pictures, which the view keeps
        if name not in view.__dataclass_fields__:
            vars(view).pop(name)
    return prepared


def _true_normals(view: View) -> FloatArray:
    """(6, 512, 512) float32: of front and back."""
    both: FloatArray = np.concatenate([view.normals_front, view.normals_back], axis=-1).transpose(2, 0, 1) / np.float32(127)
    return both


def _pooled(values: FloatArray) -> FloatArray:
    """Means of 2 x 2 pixels."""
    height, width = values.shape
    means: FloatArray = values.reshape(height // 2, 2, width // 2, 2).mean(axis=(1, 3))
    return means


def make_example(
    prepared: Prepared, generator: np.random.Generator, points: int, *, colors: bool = False, crop: int = 0, augment: bool = True
) -> Example:
    """One view with `points` of its points at random, mirrored half of the time, its mask a little off, its colours a little changed.

    Parameters
    ----------
    colors : bool
        Points on the surface with colours, instead of points in space with distances.
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
        left, top = (np.clip((place_of(chosen, view.camera, FRAME) + 1) / 2 * FRAME - crop / 2, 0, FRAME - crop) // 4 * 4).astype(int)
        cut = np.s_[top : top + crop, left : left + crop]
        part = {
            "photo": photo_input(_tinted(view.image[cut], tint), _grown(view.mask, 2 * grow)[cut] / np.float32(255), crop),
            "normals": _true_normals(view)[:, top // 2 : (top + crop) // 2, left // 2 : (left + crop) // 2],
            "corner": np.array([left, top], np.float32),
        }
        for name in ("image", "mask", "normals_front", "normals_back"):
            vars(view).pop(name, None)
    example = Example(
        photo=photo_input(_tinted(prepared.image, tint), mask / np.float32(255), FRAME // 2),
        guide=guide,
        normals=prepared.normals.astype(np.float32),
        depth=prepared.depth.astype(np.float32),
        points=_surface_points(view, generator, points, tint, augment) if colors else _space_points(view, generator, points),
        part=part,
    )
    return _mirrored(example) if augment and not crop and generator.random() < 0.5 else example


def _tinted(image: ByteArray, tint: FloatArray) -> ByteArray:
    import cv2

    table = np.clip(np.arange(256)[:, None] * tint + 0.5, 0, 255).astype(np.uint8)[None]
    return np.asarray(cv2.LUT(image, table), np.uint8)


def _grown(mask: ByteArray, pixels: int) -> ByteArray:
    """A mask made larger (or smaller) by some pixels."""
    import cv2

    if pixels == 0:
        return mask
    kernel = np.ones((2 * abs(pixels) + 1,) * 2, np.uint8)
    return np.asarray(cv2.dilate(mask, kernel) if pixels > 0 else cv2.erode(mask, kernel), np.uint8)


def _space_points(view: View, generator: np.random.Generator, count: int) -> dict[str, FloatArray]:
    chosen = generator.integers(0, len(view.points), count)
    return {
        "place": place_of(view.points[chosen], view.camera, FRAME),
        "depth": view.points[chosen, 2],
        "guide_distance": view.guide_distance[chosen].astype(np.float32),
        "guide_normals": view.guide_normals[chosen] / np.float32(127),
        "distance": view.distance[chosen].astype(np.float32),
    }


def _surface_points(view: View, generator: np.random.Generator, count: int, tint: FloatArray, augment: bool) -> dict[str, FloatArray]:
    odds = np.where(view.surface_visible, 1.0, 3.0)  # what the photo shows is the easy part
    chosen = generator.choice(len(odds), count, p=odds / odds.sum())
    normals = view.surface_normals[chosen] / np.float32(127)
    off = generator.normal(0, 0.008, (count, 1)) if augment else np.zeros((count, 1))
    points = (view.surface_points[chosen] + off * normals).astype(np.float32)
    return {
        "place": place_of(points, view.camera, FRAME),
        "depth": points[:, 2],
        "guide_distance": view.surface_guide_distance[chosen].astype(np.float32) + off[:, 0].astype(np.float32),
        "guide_normals": view.surface_guide_normals[chosen] / np.float32(127),
        "normals": normals,
        "colors": np.clip(view.surface_colors[chosen] * tint / 255, 0, 1).astype(np.float32),
    }


def _halved(depth: FloatArray, step: float = 0.02) -> FloatArray:
    """Means of 2 x 2 pixels; NaN where one is outside or they differ by more than `step` metres."""
    height, width = depth.shape
    four = depth.astype(np.float32).reshape(height // 2, 2, width // 2, 2).transpose(0, 2, 1, 3).reshape(height // 2, width // 2, 4)
    return np.where(four.max(axis=-1) - four.min(axis=-1) < step, four.mean(axis=-1), np.nan).astype(np.float32)


def _mirrored(example: Example) -> Example:
    """Left and right exchanged, in the picture and in space."""

    def flip(values: FloatArray, *across: int) -> FloatArray:
        flipped = values[..., ::-1].copy()
        for channel in across:
            flipped[channel] *= -1
        return flipped

    points = dict(example.points)
    for name in {"place", "normals", "guide_normals"} & set(points):
        points[name] = points[name] * np.array([-1, 1, 1][: points[name].shape[-1]], np.float32)
    return Example(
        photo=flip(example.photo),
        guide=flip(example.guide, 0, 3),
        normals=flip(example.normals, 0, 3),
        depth=flip(example.depth),
        points=points,
        part=example.part,
    )


def stack(examples: Sequence[Example]) -> Example:
    """Several examples as one with a leading axis."""

    def all_of(values: Sequence[dict[str, FloatArray]]) -> dict[str, FloatArray]:
        return {name: np.stack([value[name] for value in values]) for name in values[0]}

    fields = {name: np.stack([getattr(example, name) for example in examples]) for name in ("photo", "guide", "normals", "depth")}
    return Example(**fields, points=all_of([example.points for example in examples]), part=all_of([example.part for example in examples]))
