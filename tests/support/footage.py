"""Small videos of the sample person sliding through the picture."""

from __future__ import annotations

import functools
import struct
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np

from a2v.footage import FollowSettings

SAMPLE = Path(__file__).parent.parent.parent / "a2v" / "samples" / "person.jpg"
SIZE = (320, 240)
QUICK = FollowSettings(face=False, steps=25)
"""Settings for videos of a few frames."""


@functools.lru_cache
def person(tall: int = 200) -> np.ndarray:
    """The sample person on gray, `tall` pixels tall."""
    photo = cv2.imread(str(SAMPLE))[..., ::-1]
    return np.asarray(cv2.resize(photo, (tall, tall), interpolation=cv2.INTER_AREA))


def picture(across: float | None, *, others: Sequence[float] = (), wall: int = 0) -> np.ndarray:
    """A room (240, 320, 3) with the person `across` pixels from the left; None: nobody.

    `others` are further people, `wall` is the number of another room.
    """
    room = np.random.default_rng(wall).integers(60, 200, (24, 32, 3)).astype(np.uint8)
    image = cv2.GaussianBlur(cv2.resize(room, SIZE, interpolation=cv2.INTER_NEAREST), (0, 0), 1.5)
    for at, tall in [(one, 130) for one in others] + ([] if across is None else [(across, 200)]):
        figure = person(tall)
        left, top = round(at - tall / 2), 230 - tall
        inner = figure[:, tall // 4 : -tall // 4]
        first = left + tall // 4
        low, high = max(first, 0), min(first + inner.shape[1], SIZE[0])
        image[top : top + tall, low:high] = inner[:, low - first : high - first]
    return np.asarray(image)


def write_clip(
    path: Path, images: Sequence[np.ndarray], times: Sequence[float] | None = None, *, fps: int = 15
) -> Path:
    """Write pictures, at `times` in seconds or evenly."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(
            "libx264", rate=fps, options={"crf": "18", "preset": "ultrafast", "bf": "0"}
        )
        stream.height, stream.width = images[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        stream.codec_context.time_base = Fraction(1, 1000)
        for index, image in enumerate(images):
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image), format="rgb24")
            frame.pts = round(1000 * (index / fps if times is None else times[index]))
            frame.time_base = Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def turned(source: Path, target: Path) -> Path:
    """Return the same file with a rotation tag of 90 degrees clockwise, as phones write it."""
    data = bytearray(source.read_bytes())
    at = data.find(b"tkhd") + 4 + 4 + (32 if data[data.find(b"tkhd") + 4] else 20) + 16
    data[at : at + 36] = struct.pack(">9i", 0, 1 << 16, 0, -(1 << 16), 0, 0, 0, 0, 1 << 30)
    target.write_bytes(data)
    return target
