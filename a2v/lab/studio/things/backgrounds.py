"""Photographs behind people: the free ones in scikit-image's wheel, and those of any folder."""

from __future__ import annotations

import os
from functools import lru_cache
from importlib.resources import files
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from a2v.errors import InputError
from a2v.geometry.colors import srgb_to_linear
from a2v.io import open_file, reading
from a2v.types import ByteArray, FloatArray

WHEEL = (
    "brick.png",
    "chelsea.png",
    "clock_motion.png",
    "coffee.png",
    "grass.png",
    "gravel.png",
    "hubble_deep_field.jpg",
    "rocket.jpg",
)
"""Files in ``skimage/data`` of the wheel, CC0 or public domain by the docstrings of `skimage.data`.
None shows people."""
_ENDINGS = (".jpg", ".jpeg", ".png", ".webp")
_LONGEST = 1024
"""Largest kept length of the longer side, pixels."""
_GREY = 8.0
"""Photos whose channels differ by less than this (mean, of 255) are gray and get a tint."""


class Backgrounds:
    """Photographs for backgrounds, each read once.

    Parameters
    ----------
    folder : path, optional
        Folder of JPEG, PNG and WebP files, including subfolders. Default: only those of the wheel.

    Raises
    ------
    InputError
        The folder has no picture.
    """

    def __init__(self, folder: str | os.PathLike[str] = "") -> None:
        """See the class."""
        self.paths = _of_wheel()
        if folder:
            found = sorted(
                path for path in Path(folder).rglob("*") if path.suffix.lower() in _ENDINGS
            )
            if not found:
                raise InputError(
                    f"{folder} has no picture ({', '.join(_ENDINGS)}) for a background; choose "
                    "another folder, or none"
                )
            self.paths = [*self.paths, *found]
        self._read = lru_cache(maxsize=64)(_read)

    def draw(self, size: int, generator: np.random.Generator) -> FloatArray:
        """Draw a part of one of the photographs, linear light (size, size, 3) float32.

        It is randomly mirrored, brightened or darkened, tinted and blurred.

        Raises
        ------
        InputError
            The picture cannot be read.
        """
        image = self._read(str(self.paths[int(generator.integers(len(self.paths)))]))
        height, width = image.shape[:2]
        side = max(2, int(min(height, width) * generator.uniform(0.35, 1.0)))
        top, left = (
            int(generator.integers(height - side + 1)),
            int(generator.integers(width - side + 1)),
        )
        part = image[top : top + side, left : left + side]
        seen = cv2.resize(
            part, (size, size), interpolation=cv2.INTER_AREA if side > size else cv2.INTER_LINEAR
        )
        if generator.random() < 0.5:
            seen = seen[:, ::-1]
        linear = srgb_to_linear(seen.astype(np.float32) / 255).astype(np.float32)
        tint = generator.normal(
            0, 0.35 if np.ptp(seen.astype(float), axis=-1).mean() < _GREY else 0.06, 3
        )
        linear = linear * np.exp(generator.normal(0, 0.3) + tint).astype(np.float32)
        if generator.random() < 0.5:  # out of focus
            linear = cv2.GaussianBlur(
                np.ascontiguousarray(linear), (0, 0), float(generator.uniform(0.4, 5))
            )
        return np.asarray(linear, np.float32)


def _of_wheel() -> list[Path]:
    """List the existing photographs of the wheel."""
    folder = Path(str(files("skimage") / "data"))
    return [folder / name for name in WHEEL if (folder / name).is_file()]


def _read(path: str) -> ByteArray:
    with (
        reading(path, "picture", "a JPEG, PNG or WebP"),
        open_file(path) as stream,
        Image.open(stream, formats=("JPEG", "PNG", "WEBP")) as file,
    ):
        file.draft("RGB", (2 * _LONGEST, 2 * _LONGEST))  # large JPEGs are decoded at a smaller size
        image = file.convert("RGB")
    image.thumbnail((_LONGEST, _LONGEST))
    return np.ascontiguousarray(image)
