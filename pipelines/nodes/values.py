"""Values between nodes, in addition to the types of `a2v.types`."""

from __future__ import annotations

import functools
import io
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from a2v.errors import InputError
from a2v.record import Record
from a2v.types import ByteArray, Character, FloatArray
from pipelines.engine.refs import File, Ref
from pipelines.engine.store import Store


@dataclass(frozen=True, kw_only=True)
class MotionFile:
    """A file with a recorded motion, or a video of a person.

    Attributes
    ----------
    file : File
    clip : str
        Name or number of one of several motions in it; "" for the best.
    bones : File or None
        A table that names its joints (`a2v.formats.bone_map`).
    """

    file: File
    clip: str = ""
    bones: File | None = None


@dataclass(frozen=True, kw_only=True)
class Blob(Record):
    """The bytes of a file.

    Attributes
    ----------
    data : (N,) uint8
    """

    data: ByteArray

    @classmethod
    def of(cls, data: bytes) -> Blob:
        """Wrap `data`."""
        return cls(data=np.frombuffer(data, dtype=np.uint8))

    def __bytes__(self) -> bytes:
        return self.data.tobytes()


@dataclass(frozen=True, kw_only=True)
class Poses(Record):
    """A body's bones over time.

    Attributes
    ----------
    bone_transforms : (T, B, 4, 4) float32
        World from bone, meters.
    fps : float
    action : str
    expressions : strengths (T,) float32 by ARKit's names
    """

    bone_transforms: FloatArray
    fps: float
    action: str = ""
    expressions: Mapping[str, FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._check("bone_transforms", ("T", "B", 4, 4))
        for name, strength in self.expressions.items():
            if np.shape(strength) != (len(self.bone_transforms),):
                raise InputError(
                    f"Poses.expressions.{name} has shape {np.shape(strength)}; expected "
                    f"({len(self.bone_transforms)},)"
                )


@dataclass(frozen=True, kw_only=True)
class Pose(Record):
    """A body's bones in one frame.

    Attributes
    ----------
    bone_transforms : (B, 4, 4) float32
        World from bone, meters.
    expressions : strengths () float32 by ARKit's names
    """

    bone_transforms: FloatArray
    expressions: Mapping[str, FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._check("bone_transforms", ("B", 4, 4))


@dataclass(frozen=True, kw_only=True)
class Vertices(Record):
    """A character's vertices in one frame.

    Attributes
    ----------
    vertices : (V, 3) float32
        World, meters.
    """

    vertices: FloatArray

    def __post_init__(self) -> None:
        self._check("vertices", ("V", 3))


@dataclass(frozen=True, kw_only=True)
class Image(Record):
    """A rendered frame, losslessly compressed.

    Attributes
    ----------
    png : (N,) uint8
        The bytes of a PNG.
    """

    png: ByteArray

    @classmethod
    def of(cls, pixels: ByteArray) -> Image:
        """Compress pixels (H, W, 3) or (H, W, 4) uint8."""
        import PIL.Image

        buffer = io.BytesIO()
        PIL.Image.fromarray(pixels).save(buffer, "png", compress_level=1)
        return cls(png=np.frombuffer(buffer.getvalue(), dtype=np.uint8))

    @property
    def pixels(self) -> ByteArray:
        """Return the frame, (H, W, 3) uint8 sRGB.

        Transparent pixels become light gray, since videos have no alpha channel.
        """
        import PIL.Image

        image: PIL.Image.Image = PIL.Image.open(io.BytesIO(self.png.tobytes()))
        if image.mode == "RGBA":
            image = PIL.Image.alpha_composite(
                PIL.Image.new("RGBA", image.size, (200, 203, 206, 255)), image
            )
        return np.asarray(image.convert("RGB"))


@functools.lru_cache(maxsize=1)
def load_character(address: str, ref: Ref[Character]) -> Character:
    """Return the character, which is kept for later frames in the same process."""
    return Store(address).get(ref, Character)
