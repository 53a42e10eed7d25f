"""One training view of the reconstruction: a photo, its ground truth, samples of it, and the guide
body."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.record import Record
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray, OrthographicCamera

PHOTO_SIZE = 1024
"""Side of a photo, pixels."""
MAP_SIZE = 512
"""Side of its maps, pixels."""
GUIDE_SIZE = 256
"""Side of the guide's maps, pixels."""

_MAPS = {
    "mask": (PHOTO_SIZE, np.uint8),
    "normals_front": (MAP_SIZE, np.int8),
    "normals_back": (MAP_SIZE, np.int8),
    "depth_front": (MAP_SIZE, np.float16),
    "depth_back": (MAP_SIZE, np.float16),
    "parts_front": (MAP_SIZE, np.int8),
    "guide_normals_front": (GUIDE_SIZE, np.int8),
    "guide_normals_back": (GUIDE_SIZE, np.int8),
    "guide_depth_front": (GUIDE_SIZE, np.float16),
    "guide_depth_back": (GUIDE_SIZE, np.float16),
    "things": (PHOTO_SIZE, np.uint8),
}  # side in pixels and type of each map
_OPTIONAL = "things"


def _decode_once(name: str) -> cached_property[np.ndarray]:
    """Return the property of a `View` for the map of that name."""

    def decode(view: View) -> np.ndarray:
        return view.map(name)

    return cached_property(decode)


@dataclass(frozen=True, kw_only=True)
class View(Record):
    """A synthetic photo with its ground truth, in the photo's frame: an orthographic view along -z,
    meters, y up, z = 0 at the guide's mean.

    Pictures are stored encoded (JPEG, PNG) in `encoded` and decoded at their first use, each by the
    property of its name:

    - `image` (1024, 1024, 3) uint8 sRGB; `mask` (1024, 1024) uint8, where it shows the person: 255
      inside, soft at the rim.
    - `things` (1024, 1024) uint8, where it shows something else than person and background, as
    `mask`. A
      view without this picture (`surrounded` is false) shows the whole person, with nothing in
      front.
    - `normals_front`, `normals_back` (512, 512, 3) int8, 127 is 1; zero outside. The back is seen
      through the front: on the same pixels, in the same axes.
    - `depth_front`, `depth_back` (512, 512) float16, z in meters; NaN outside. `parts_front` (512,
      512) int8, -1 outside.
    - `guide_normals_front`, `guide_normals_back` (256, 256, 3) int8; `guide_depth_front`,
      `guide_depth_back` (256, 256) float16.

    Normals, depths and parts are those of the whole person, as if there were no objects; `hidden`
    marks the pixels where the photo shows an object instead. Parts beyond the border are only in
    the samples. All maps cover the whole photo; pixel (i, j) of a map of side s is seen at u = (j +
    0.5) 1024 / s, v = (i + 0.5) 1024 / s.

    Attributes
    ----------
    encoded : mapping of str to (n,) uint8
        The pictures' files.
    camera : OrthographicCamera
        Of the photo's 1024 pixels.
    points : (N, 3) float32
        Samples in space, meters.
    distance : (N,) float16
        Signed distance of `points` to the person, meters, negative inside.
    guide_distance : (N,) float16, guide_normals : (N, 3) int8
        Signed distance to the guide, and the guide's normal at the closest point.
    surface_points : (M, 3) float32
        Uniform by area on the person's outer surface.
    surface_normals : (M, 3) int8, surface_colors : (M, 3) uint8
        Outward normals; sRGB colors: the texture's in the photo's mean light.
    surface_visible : (M,) bool
        Whether the photo shows the point: objects may occlude it, and the border may cut it off.
    surface_parts : (M,) int8
        Index into `a2v.body.PARTS`.
    surface_guide_distance : (M,) float16, surface_guide_normals : (M, 3) int8
        The same as for `points`.
    guide_vertices : (G, 3) float32
        The guide body; its faces are in the data set's ``guide.npz``.
    avatar : str
    gain : (3,) float32
        Linear RGB: mean irradiance over pi on the visible part of the person. ``surface_colors``
        are the texture times this.
    yaw : float
        Turn of the person about the vertical, degrees; positive toward the person's left.
    seed, index : int
        Seed of the data set, and index of the view in its split.
    split : str
    """

    encoded: Mapping[str, np.ndarray]
    camera: OrthographicCamera
    points: FloatArray
    distance: FloatArray
    guide_distance: FloatArray
    guide_normals: IntArray
    surface_points: FloatArray
    surface_normals: IntArray
    surface_colors: ByteArray
    surface_visible: BoolArray
    surface_parts: IntArray
    surface_guide_distance: FloatArray
    surface_guide_normals: IntArray
    guide_vertices: FloatArray
    avatar: str
    gain: FloatArray
    yaw: float
    seed: int
    index: int
    split: str

    def __post_init__(self) -> None:
        sizes: dict[str, int] = {}
        for name, shape in {
            "points": ("N", 3),
            "distance": ("N",),
            "guide_distance": ("N",),
            "guide_normals": ("N", 3),
            "surface_points": ("M", 3),
            "surface_normals": ("M", 3),
            "surface_colors": ("M", 3),
            "surface_visible": ("M",),
            "surface_parts": ("M",),
            "surface_guide_distance": ("M",),
            "surface_guide_normals": ("M", 3),
            "guide_vertices": ("G", 3),
            "gain": (3,),
        }.items():
            self._check(name, shape, sizes)
        if missing := [
            name for name in ("image", *_MAPS) if name not in self.encoded and name != _OPTIONAL
        ]:
            raise InputError(
                f"View has no picture '{missing[0]}'; it has {', '.join(self.encoded) or 'none'}"
            )

    def forget_pictures(self) -> None:
        """Drop the decoded pictures; they are decoded again at their next use."""
        for name in ("image", *_MAPS):
            vars(self).pop(name, None)

    @cached_property
    def image(self) -> ByteArray:
        """(1024, 1024, 3) uint8 sRGB."""
        import cv2

        return np.ascontiguousarray(
            self._decoded("image", cv2.IMREAD_COLOR, (PHOTO_SIZE, PHOTO_SIZE, 3))[..., ::-1]
        )

    def map(self, name: str) -> np.ndarray:
        """Return a picture other than the photo, by name.

        Raises
        ------
        InputError
            Unknown name, or a damaged picture.
        """
        import cv2

        if name not in _MAPS:
            raise InputError(f"unknown map '{name}'; choose from {', '.join(_MAPS)}")
        side, kind = _MAPS[name]
        shape = (side, side, 3) if "normals" in name else (side, side)
        raw = self._decoded(name, cv2.IMREAD_UNCHANGED, shape)
        return np.asarray(raw.view(kind)) if raw.dtype.itemsize == np.dtype(kind).itemsize else raw

    def _decoded(self, name: str, flags: int, shape: tuple[int, ...]) -> np.ndarray:
        import cv2

        found = cv2.imdecode(np.asarray(self.encoded[name]), flags)
        if found is None or found.shape != shape:
            raise InputError(f"View: picture '{name}' is damaged; make the view again")
        return np.asarray(found)

    @property
    def surrounded(self) -> bool:
        """Whether something may occlude the person, or the border may cut it off."""
        return _OPTIONAL in self.encoded

    @cached_property
    def things(self) -> ByteArray:
        """(1024, 1024) uint8; zeros if no objects are around the person."""
        return (
            self.map(_OPTIONAL) if self.surrounded else np.zeros((PHOTO_SIZE, PHOTO_SIZE), np.uint8)
        )

    @property
    def hidden(self) -> BoolArray:
        """Pixels (512, 512) of the maps at which an object covers more than the person."""
        return hidden_by(self.things, self.mask, self.depth_front)

    mask = _decode_once("mask")
    normals_front = _decode_once("normals_front")
    normals_back = _decode_once("normals_back")
    depth_front = _decode_once("depth_front")
    depth_back = _decode_once("depth_back")
    parts_front = _decode_once("parts_front")
    guide_normals_front = _decode_once("guide_normals_front")
    guide_normals_back = _decode_once("guide_normals_back")
    guide_depth_front = _decode_once("guide_depth_front")
    guide_depth_back = _decode_once("guide_depth_back")


def hidden_by(things: np.ndarray, mask: np.ndarray, front: FloatArray) -> BoolArray:
    """Return the pixels (S, S) at which a photo shows less of a person than of objects.

    Only pixels with a depth `front` (S, S) count; it is NaN outside.

    Parameters
    ----------
    things, mask : (H, H)
        Their coverage of each pixel of the photo; H is a multiple of S.
    """
    size = len(front)
    whole, own = (
        shares.reshape(size, len(shares) // size, size, -1).sum(axis=(1, 3))
        for shares in (things, mask)
    )
    return np.asarray(np.isfinite(front) & (whole > own))


def jpeg_of(image: ByteArray, quality: int) -> ByteArray:
    """Return the JPEG file (n,) uint8 of an RGB image (H, W, 3)."""
    import cv2

    code = cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return np.asarray(code, np.uint8).ravel()


def encode_pictures(
    image: ByteArray, quality: int, maps: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Return `View.encoded` from a photo, the quality of its JPEG, and the maps (lossless). Only
    `things` may be missing."""
    import cv2

    encoded = {"image": jpeg_of(image, quality)}
    for name, (_, kind) in _MAPS.items():
        if name == _OPTIONAL and name not in maps:
            continue
        plain = np.ascontiguousarray(maps[name], kind).view(
            np.uint16 if kind is np.float16 else np.uint8
        )
        encoded[name] = cv2.imencode(".png", plain, [cv2.IMWRITE_PNG_COMPRESSION, 2])[1]
    return {name: np.asarray(data, np.uint8).ravel() for name, data in encoded.items()}


def view_path(folder: str | os.PathLike[str], split: str, index: int) -> Path:
    """Return the path of a view in a data set's folder."""
    return Path(folder) / "views" / split / f"{index:06d}.npz"


def list_views(folder: str | os.PathLike[str], split: str) -> list[Path]:
    """List the finished views of a split, sorted.

    Raises
    ------
    InputError
        There are none.
    """
    found = sorted((Path(folder) / "views" / split).glob("[0-9]*.npz"))
    if not found:
        raise InputError(
            f"{folder} has no views of the split '{split}'; make some with a2v studio --out "
            f"{folder}"
        )
    return found
