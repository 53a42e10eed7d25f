"""Training examples of the body map from quick views: pictures, ground truth, and augmentation of
photographs and masks."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from a2v.kinematics.names import BLAZEPOSE, MIRRORED_BLAZEPOSE
from a2v.lab.studio.quick.settings import SHARD
from a2v.lab.studio.quick.views import QuickShard, QuickView, list_shards
from a2v.perception.bodymap import GRAY, on_gray
from a2v.perception.depth import HIPS
from a2v.types import BoolArray, FloatArray

_LESS = {0.3: (*range(1, 7), 9, 10), 0.6: tuple(range(17, 23)), 0.7: tuple(range(29, 33))}


def landmark_weights() -> FloatArray:
    """Return the weights of the landmarks (33,). Eyes, mouth, fingers and toes weigh less than
    those that the fit depends on."""
    weights = np.ones(len(BLAZEPOSE), np.float32)
    for weight, chosen in _LESS.items():
        weights[list(chosen)] = weight
    return weights


@dataclass(frozen=True, eq=False)
class Example:
    """A picture and its ground truth; `stack` makes a batch of B of them.

    Lengths are in sides of the picture, and depth is relative to the middle of the hips.

    Attributes
    ----------
    picture : (4, 256, 256) float32
        RGB and mask in [0, 1].
    points : (33, 3) float32
        Landmarks: u, v, depth.
    weights : (33,) float32
        Weight of each landmark.
    places : (3, 64, 64) float32
    depths : (2, 64, 64) float32
        Depth of front and back; 0 at pixels without the person.
    seen : (2, 64, 64) bool
        Whether front and back are known at a pixel: it shows the person. False where an object
        occludes the person.
    scale : () float32
        Sides of the picture per meter.
    """

    picture: np.ndarray
    points: np.ndarray
    weights: np.ndarray
    places: np.ndarray
    depths: np.ndarray
    seen: np.ndarray
    scale: np.ndarray


def stack(examples: Sequence[Example]) -> Example:
    """Make a batch: every array gets a leading axis B."""
    return Example(
        **{
            item.name: np.stack([getattr(one, item.name) for one in examples])
            for item in fields(Example)
        }
    )


def make_example(view: QuickView, generator: np.random.Generator | None = None) -> Example:
    """Make an example from a view, with the person on gray.

    With a `generator` the picture and the mask get random changes as in real photographs, and half
    of the examples are mirrored. Landmarks behind objects have the same weight as those behind the
    person's own body: they must be guessed, and their predicted scales become larger.
    """
    picture, mask = view.image.astype(np.float32) / 255, view.mask.astype(np.float32)
    points = view.landmarks.astype(np.float32)
    hips = points[HIPS, 2].mean()
    points = points - np.array([0, 0, hips], np.float32)
    flip = generator is not None and generator.random() < 0.5
    picture, mask = (
        (on_gray(picture, mask), mask)
        if generator is None
        else _augmented(picture, mask, view.things, generator)
    )
    inside = ((points[:, :2] > 0.01) & (points[:, :2] < 0.99)).all(axis=1)
    depths = np.stack([view.front, view.back]).astype(np.float32) - hips
    example = Example(
        picture=np.concatenate([picture, mask[..., None]], axis=-1).transpose(2, 0, 1),
        points=points,
        weights=(landmark_weights() * np.where(inside, 1.0, 0.1)).astype(np.float32),
        places=view.places.astype(np.float32).transpose(2, 0, 1) / 127,
        depths=np.nan_to_num(depths),
        seen=np.isfinite(depths) & ~view.hidden,
        scale=np.array(view.scale, np.float32),
    )
    return mirrored(example) if flip else example


def mirrored(example: Example) -> Example:
    """Mirror an example: left and right of the picture and of the body are swapped."""
    order, sign = MIRRORED_BLAZEPOSE, np.array([-1, 1, 1], np.float32)
    return replace(
        example,
        picture=example.picture[..., ::-1],
        points=example.points[order] * sign + np.array([1, 0, 0], np.float32),
        weights=example.weights[order],
        places=example.places[..., ::-1] * sign[:, None, None],
        depths=example.depths[..., ::-1],
        seen=example.seen[..., ::-1],
    )


def _augmented(
    picture: FloatArray, mask: FloatArray, things: BoolArray, generator: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Augment a picture (256, 256, 3) and its mask (256, 256).

    The background becomes mostly gray, an occluder is added, and the light changes. The mask gets
    errors, or is removed. Two masks in five include the `things` (256, 256) near the person, as
    segmentations do.
    """
    import cv2

    size, picture, mask = len(mask), picture.copy(), mask.copy()
    if things.any() and generator.random() < 0.4:
        reach = cv2.getStructuringElement(
            cv2.MORPH_ELLIPSE, (2 * int(generator.integers(4, 40)) + 1,) * 2
        )
        mask = np.maximum(mask, cv2.dilate(mask, reach) * things)
    if generator.random() < 0.88:
        plain = generator.random(3).astype(np.float32) if generator.random() < 0.15 else GRAY
        cover, kind = mask, generator.random()
        if kind < 0.3:  # keep a part of the true background
            cover = cv2.dilate(mask, np.ones((3, 3) if kind < 0.2 else (5, 5), np.uint8))
        elif kind < 0.4:
            cover = cv2.erode(mask, np.ones((3, 3), np.uint8))
        picture = on_gray(picture, cover, softness=generator.uniform(0.6, 1.6), gray=plain)
    if generator.random() < 0.2:
        middle, extent = generator.random(2), 0.08 + 0.2 * generator.random(2)
        left, top, right, bottom = (
            np.clip(np.r_[middle - extent / 2, middle + extent / 2], 0, 1) * size
        ).astype(int)
        picture[top:bottom, left:right] = generator.random(3)
        if generator.random() < 0.6:
            mask[top:bottom, left:right] = 0
    if generator.random() < 0.06:
        picture = np.repeat(picture.mean(axis=-1, keepdims=True), 3, axis=-1)
    light = np.exp(generator.normal(0, 0.12) + generator.normal(0, 0.05, 3)).astype(np.float32)
    picture = np.clip(picture * light, 0, 1)
    kind = generator.random()
    if kind < 0.25:
        mask = (cv2.erode if kind < 0.12 else cv2.dilate)(mask, np.ones((3, 3), np.uint8))
    if generator.random() < 0.05:
        mask = np.zeros_like(mask)
    return picture, mask


class QuickViews:
    """All views of a folder's split, in memory (45 KB each).

    Parameters
    ----------
    folder : path
        Folder written by `a2v.lab.studio.quick.dataset`.
    split : str

    Raises
    ------
    InputError
        There are no views, or a file is damaged.
    """

    def __init__(self, folder: str | os.PathLike[str], split: str) -> None:
        self._folder, self._split = folder, split
        self._shards: dict[Path, QuickShard] = {}
        self.refresh()

    def refresh(self) -> None:
        """Add shards that were written since the last call."""
        for path in list_shards(self._folder, self._split):
            if path not in self._shards:
                self._shards[path] = QuickShard.load(path)
        self._order = list(self._shards.values())

    def __len__(self) -> int:
        """Number of views."""
        return SHARD * len(self._order)

    def view(self, index: int) -> QuickView:
        """Return view `index`; views that are added later have larger numbers."""
        return self._order[index // SHARD].view(index % SHARD)
