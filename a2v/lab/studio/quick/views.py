"""Quick views and their files: a small photo, the mask, and the place on the body of each pixel of
the maps."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.lab.studio.view import hidden_by
from a2v.record import Record
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray

PHOTO = 256
"""Side of a quick photo, pixels."""
MAP = 64
"""Side of its maps, pixels."""


@dataclass(frozen=True, eq=False, kw_only=True)
class QuickView:
    """A picture of a person within a square, and its ground truth.

    Lengths are in sides of the square: u right and v down from its upper left corner, depth toward
    the camera. Pixel (i, j) of a map is seen at u = (j + 0.5) / 64, v = (i + 0.5) / 64.

    Attributes
    ----------
    photo : (n,) uint8
        The file, JPEG of 256 x 256 pixels.
    mask : (256, 256) bool
        Pixels that show the person.
    things : (256, 256) bool
        Pixels that show an object: one that the person holds, or one in front of or beside the
        person.
    places : (64, 64, 3) int8
        The place on the body (`a2v.body.places`) at each pixel, 127 is 1; 0 outside. Objects are
        ignored.
    front, back : (64, 64) float16
        Depth of the person's front, and of the back behind it; NaN outside. Objects are ignored.
    landmarks : (33, 3) float32
        BlazePose's landmarks: u, v, depth; also occluded ones.
    scale : float
        Sides of the square per meter.
    yaw : float
        Turn of the person about the vertical, degrees; positive toward the person's left.
    camera : (4,) float32
        Distance over the floor from the camera to the person's middle, meters; angle by which the
        camera looks down, radians; u and v of the optical axis. NaN where unknown.
    """

    photo: ByteArray
    mask: BoolArray
    things: BoolArray
    places: IntArray
    front: FloatArray
    back: FloatArray
    landmarks: FloatArray
    scale: float
    yaw: float
    camera: FloatArray = field(default_factory=lambda: np.full(4, np.nan, np.float32))

    @property
    def hidden(self) -> BoolArray:
        """Pixels (64, 64) of the maps at which an object covers more than the person."""
        return hidden_by(self.things, self.mask, self.front)

    @cached_property
    def image(self) -> ByteArray:
        """(256, 256, 3) uint8 sRGB.

        Raises
        ------
        InputError
            The photo is damaged.
        """
        import cv2

        found = cv2.imdecode(np.asarray(self.photo), cv2.IMREAD_COLOR)
        if found is None or found.shape != (PHOTO, PHOTO, 3):
            raise InputError(
                "QuickView: the photo is damaged; remove the file that holds it and make it again"
            )
        return np.ascontiguousarray(found[..., ::-1])


@dataclass(frozen=True, kw_only=True)
class QuickShard(Record):
    """N quick views in one file.

    Attributes
    ----------
    photos : (B,) uint8
        The JPEG files, one after the other.
    ends : (N,) int64
        End of each file.
    masks, things : (N, 8192) uint8
        Eight pixels per byte, row by row (`np.packbits`). Files of version 1 have no `things`.
    places : (N, 64, 64, 3) int8, front : (N, 64, 64) float16, back : (N, 64, 64) float16
    landmarks : (N, 33, 3) float32, scales : (N,) float32, yaws : (N,) float32
        See `QuickView`.
    cameras : (N, 4) float32
        `QuickView.camera`. Files before version 3 have none, which reads as NaN.
    """

    may_hold_nan = frozenset({"front", "back", "cameras"})

    photos: ByteArray
    ends: IntArray
    masks: ByteArray
    places: IntArray
    front: FloatArray
    back: FloatArray
    landmarks: FloatArray
    scales: FloatArray
    yaws: FloatArray
    things: ByteArray = field(default_factory=lambda: np.zeros((0, PHOTO * PHOTO // 8), np.uint8))
    cameras: FloatArray = field(default_factory=lambda: np.zeros((0, 4), np.float32))

    def __post_init__(self) -> None:
        sizes: dict[str, int] = {}
        if not len(self.things):
            object.__setattr__(self, "things", np.zeros_like(self.masks))
        if not len(self.cameras):
            unknown = np.full((len(self.ends), 4), np.nan, np.float32)
            object.__setattr__(self, "cameras", unknown)
        for name, shape in {
            "photos": ("B",),
            "ends": ("N",),
            "masks": ("N", PHOTO * PHOTO // 8),
            "things": ("N", PHOTO * PHOTO // 8),
            "places": ("N", MAP, MAP, 3),
            "front": ("N", MAP, MAP),
            "back": ("N", MAP, MAP),
            "landmarks": ("N", 33, 3),
            "scales": ("N",),
            "yaws": ("N",),
            "cameras": ("N", 4),
        }.items():
            self._check(name, shape, sizes)
        if len(self.ends) and (
            int(self.ends[-1]) != len(self.photos) or (np.diff(self.ends, prepend=0) <= 0).any()
        ):
            raise InputError("QuickShard: the photos do not end where it says; make the file again")

    @classmethod
    def of(cls, views: Sequence[QuickView]) -> QuickShard:
        """Pack views into a shard."""
        return cls(
            photos=np.concatenate([view.photo for view in views]),
            ends=np.cumsum([len(view.photo) for view in views]),
            masks=np.stack([np.packbits(view.mask) for view in views]),
            things=np.stack([np.packbits(view.things) for view in views]),
            places=np.stack([view.places for view in views]),
            front=np.stack([view.front for view in views]),
            back=np.stack([view.back for view in views]),
            landmarks=np.stack([view.landmarks for view in views]),
            scales=np.array([view.scale for view in views], np.float32),
            yaws=np.array([view.yaw for view in views], np.float32),
            cameras=np.stack([view.camera for view in views]),
        )

    def __len__(self) -> int:
        """Number of views."""
        return len(self.ends)

    def view(self, index: int) -> QuickView:
        """Return view `index`, a new object each time."""
        start = int(self.ends[index - 1]) if index else 0
        return QuickView(
            photo=self.photos[start : int(self.ends[index])],
            mask=np.unpackbits(self.masks[index]).reshape(PHOTO, PHOTO).astype(bool),
            things=np.unpackbits(self.things[index]).reshape(PHOTO, PHOTO).astype(bool),
            places=self.places[index],
            front=self.front[index],
            back=self.back[index],
            landmarks=self.landmarks[index],
            scale=float(self.scales[index]),
            yaw=float(self.yaws[index]),
            camera=self.cameras[index],
        )


def shard_path(folder: str | os.PathLike[str], split: str, number: int) -> Path:
    """Return the path of a shard in a folder of quick views."""
    return Path(folder) / split / f"{number:05d}.npz"


def list_shards(folder: str | os.PathLike[str], split: str) -> list[Path]:
    """List the finished shards of a split, sorted.

    Raises
    ------
    InputError
        There are none.
    """
    found = sorted((Path(folder) / split).glob("[0-9]*.npz"))
    if not found:
        raise InputError(
            f"{folder} has no quick views of the split '{split}'; a2v train bodymap makes them"
        )
    return found
