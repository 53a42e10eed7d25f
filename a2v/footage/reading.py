"""Read a user's video frame by frame: upright, reduced, with the true time stamps. Frames are not
kept."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.io import open_file, shorten
from a2v.types import ByteArray

SUFFIXES: tuple[str, ...] = (
    ".mp4",
    ".mov",
    ".m4v",
    ".webm",
    ".mkv",
    ".avi",
    ".mpg",
    ".mpeg",
    ".3gp",
    ".mts",
    ".ts",
    ".wmv",
    ".flv",
)
"""Suffixes of video files."""
FORMATS = "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,mpeg,mpegts,asf,flv,mpegvideo"
"""Containers that are opened. Playlists are excluded because they name other files."""
MOST_PIXELS = 8192 * 4608
"""Number of pixels of the largest frames that are decoded: 8K."""
_FRAMES = {"max_pixels": str(MOST_PIXELS)}
"""FFmpeg's option by which a codec refuses larger frames before it allocates them."""
LEAST_SIDE = 64
"""Shorter side in pixels of the smallest frames that are decoded."""
RATE = 30.0
"""Highest frame rate that is used. Frames of faster videos are skipped."""
MOST_DAMAGED = 200
"""Number of consecutive packets that cannot be decoded after which reading stops."""
LONGEST_GAP = 3600.0
"""Largest accepted time in seconds between two frames."""
_NOT = "expected a video such as .mp4, .mov or .webm"


def is_video(path: str | os.PathLike[str]) -> bool:
    """Return whether the suffix of a file is one of a video."""
    return Path(path).suffix.lower() in SUFFIXES


@dataclass(frozen=True, kw_only=True)
class Shown:
    """A frame.

    Attributes
    ----------
    time : float
        Seconds from the first frame of the video.
    image : (H, W, 3) uint8
        Upright, sRGB.
    """

    time: float
    image: ByteArray


@dataclass(kw_only=True)
class Reel:
    """An opened video.

    Attributes
    ----------
    source : str
        Name of the video in messages.
    width, height : int
        Size in pixels before the frames are reduced, upright.
    rate : float
        Frame rate according to the file; 0 if unknown.
    seconds : float
        Length in seconds according to the file; 0 if unknown.
    turned : int
        Rotation of the frames in degrees, counter-clockwise.
    damaged : list of float
        Times in seconds at which packets could not be decoded.
    """

    source: str
    width: int
    height: int
    rate: float
    seconds: float
    turned: int
    damaged: list[float]
    _container: Any
    _stream: Any
    _first: Any

    def frames(self, *, side: int, start: float = 0.0, seconds: float = np.inf) -> Iterator[Shown]:
        """Yield frames between `start` and `start` + `seconds`, at most `RATE` per second, with a
        longer side of at most `side` pixels."""
        origin: float | None = None
        due, last, count = -np.inf, -np.inf, 0
        for frame in self._decoded():
            time = self._time(frame, count)
            count += 1
            origin = time if origin is None else origin
            time -= origin
            if not np.isfinite(time) or not last < time < max(last, 0.0) + LONGEST_GAP:
                continue
            last = time
            if time >= start + seconds:
                return
            if time < start or time < due - 0.25 / RATE:
                continue
            due = max(due + 1 / RATE, time + 0.5 / RATE)
            yield Shown(time=time - start, image=self._image(frame, side))

    def _time(self, frame: Any, count: int) -> float:
        if frame.pts is not None and frame.time_base:
            return float(frame.pts * frame.time_base)
        return count / (self.rate or RATE)

    def _decoded(self) -> Iterator[Any]:
        """Decode frames in order. Damaged packets are skipped and recorded."""
        import av

        yield self._first
        self._first = None
        bad, last = 0, 0.0
        packets = self._container.demux(self._stream)
        while True:
            try:
                packet = next(packets)
                frames = packet.decode()
            except StopIteration:
                return
            except av.EOFError:
                return
            except (av.FFmpegError, ValueError):
                bad += 1
                self.damaged.append(last)
                if bad > MOST_DAMAGED:
                    return
                continue
            for frame in frames:
                bad = 0
                if frame.pts is not None and frame.time_base:
                    last = float(frame.pts * frame.time_base)
                if frame.width * frame.height > MOST_PIXELS:
                    raise InputError(
                        f"{self.source} has a frame of {frame.width} x {frame.height} pixels; "
                        "expected at most 8K"
                    )
                yield frame

    def turn(self, degrees: int) -> None:
        """Turn all pictures counterclockwise by a multiple of 90 degrees."""
        self.turned = (self.turned + degrees) % 360
        if degrees in (90, 270):
            self.width, self.height = self.height, self.width

    def _image(self, frame: Any, side: int) -> ByteArray:
        import cv2

        shrink = min(1.0, side / max(frame.width, frame.height))
        size = max(1, round(frame.width * shrink)), max(1, round(frame.height * shrink))
        small = frame.reformat(width=size[0], height=size[1], format="rgb24", interpolation="AREA")
        image: ByteArray = small.to_ndarray()
        turns = {
            90: cv2.ROTATE_90_COUNTERCLOCKWISE,
            180: cv2.ROTATE_180,
            270: cv2.ROTATE_90_CLOCKWISE,
        }
        return np.ascontiguousarray(cv2.rotate(image, turns[self.turned]) if self.turned else image)


@contextmanager
def open_reel(path: str | os.PathLike[str]) -> Iterator[Reel]:
    """Open a video. No other file is read, even if the video names one.

    Raises
    ------
    InputError
        The file is missing, is not a video, has no frames, or its frames are too large or too
        small.
    """
    import av

    source = os.fspath(path)
    with open_file(path) as stream:
        try:
            container = av.open(
                stream,
                options={
                    "format_whitelist": FORMATS,
                    "protocol_whitelist": "none",
                    **_FRAMES,  # of the codecs by which FFmpeg looks at the first frames
                },
            )
        except av.EOFError:
            raise InputError(f"{source} has no frames, or is cut off; {_NOT}") from None
        except (av.FFmpegError, ValueError, OSError) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(
                f"{source} is not a video that can be read ({shorten(reason, 80)}); {_NOT}"
            ) from None
        with container:
            yield _reel(source, container)


def _reel(source: str, container: Any) -> Reel:
    """Check the container and decode the first frame."""
    if not container.streams.video:
        if container.streams.audio:
            raise InputError(f"{source} has no pictures, only sound; {_NOT}")
        raise InputError(f"{source} has no frames; {_NOT}")
    stream = container.streams.video[0]
    context = stream.codec_context
    if context is None:
        raise InputError(
            f"{source} is in an encoding that cannot be read here; convert it to H.264"
        )
    _check_size(source, context.width, context.height)
    context.thread_count = 2
    context.options = {**context.options, **_FRAMES}
    reel = Reel(
        source=source,
        width=context.width,
        height=context.height,
        rate=float(stream.average_rate or 0),
        seconds=_seconds(container, stream),
        turned=0,
        damaged=[],
        _container=container,
        _stream=stream,
        _first=None,
    )
    first = _first_frame(container, stream)
    if first is None:
        raise InputError(f"{source} has no frames that can be decoded, of at most 8K; {_NOT}")
    _check_size(source, first.width, first.height)
    reel._first = first
    reel.turn(int(first.rotation) % 360 if int(first.rotation) % 90 == 0 else 0)
    return reel


def _check_size(source: str, width: int, height: int) -> None:
    if width * height > MOST_PIXELS:
        raise InputError(
            f"{source} has {width} x {height} pixels; expected at most 8K "
            f"({MOST_PIXELS // 1_000_000} million)"
        )
    if width and height and min(width, height) < LEAST_SIDE:
        raise InputError(
            f"{source} has {width} x {height} pixels; expected at least {LEAST_SIDE} each way"
        )


def _seconds(container: Any, stream: Any) -> float:
    if stream.duration is not None and stream.time_base:
        return max(0.0, float(stream.duration * stream.time_base))
    return max(0.0, (container.duration or 0) / 1e6)


def _first_frame(container: Any, stream: Any) -> Any:
    import av

    bad = 0
    packets = container.demux(stream)
    while bad <= MOST_DAMAGED:
        try:
            for frame in next(packets).decode():
                return frame
        except (StopIteration, av.EOFError):
            return None
        except (av.FFmpegError, ValueError):
            bad += 1
    return None
