"""Video files: MP4 for browsers, GIF and WebP for READMEs."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.io import atomic_path, open_file
from a2v.types import ByteArray


@dataclass(frozen=True, kw_only=True)
class VideoInfo:
    """Result of `probe_video`: size in pixels, frames per second, names of the codec and the pixel
    format."""

    width: int
    height: int
    frames: int
    fps: float
    codec: str
    pixel_format: str


_SAME_BITS = {"threads": "1", "x264-params": "asm=SSE2"}
"""Settings for reproducible bytes. With AVX-512, x264's macroblock tree reads uninitialized memory
if the width is not a multiple of 128, so the same frames give different bytes from run to run.
SSE2 is on every x86-64, takes the same time here, and gives the same bytes on all machines."""


def _checked(frames: Iterable[ByteArray]) -> Iterator[ByteArray]:
    """Yield the frames, each checked to be (H, W, 3) uint8 of one size; there must be at least
    one."""
    shape: tuple[int, ...] | None = None
    for index, frame in enumerate(frames):
        if frame.ndim != 3 or frame.shape[2] != 3 or frame.dtype != np.uint8:
            raise InputError(
                f"frame {index} has shape {frame.shape} and type {frame.dtype}; expected (height, "
                "width, 3) uint8"
            )
        if shape is not None and frame.shape != shape:
            raise InputError(
                f"frame {index} is {frame.shape[1]} x {frame.shape[0]} pixels; the first is "
                f"{shape[1]} x {shape[0]}"
            )
        shape = frame.shape
        yield frame
    if shape is None:
        raise InputError("no frames to write; render at least one")


def write_video(
    path: str | os.PathLike[str],
    frames: Iterable[ByteArray],
    fps: float,
    *,
    crf: int = 17,
    preset: str = "veryfast",
) -> None:
    """Write H.264 (yuv420p, BT.709) atomically; the same frames give the same bytes.

    The index is at the start of the file, so that it plays while it loads.

    Parameters
    ----------
    path
        Ends in ``.mp4``.
    frames : iterable of (H, W, 3) uint8
        sRGB, all of one size. An odd width or height gets its last column or row repeated, because
        yuv420p needs even ones.
    fps : float
        Frames per second.
    crf : int
        Quality: 0 lossless, 17 visually clean, 51 worst.
    preset : str
        x264's trade of time for size.

    Raises
    ------
    InputError
        No frames, frames of several sizes, an unusable `fps`, or the file cannot be written.
    """
    import av

    if not (np.isfinite(fps) and fps > 0):
        raise InputError(f"fps is {fps}; expected a positive number")
    if Path(path).suffix.lower() != ".mp4":
        raise InputError(f"{path} does not end in .mp4")
    with (
        atomic_path(path) as temporary,
        av.open(str(temporary), "w", options={"movflags": "+faststart"}) as container,
    ):
        rate = Fraction(fps).limit_denominator(1001)
        stream = container.add_stream(
            "libx264", rate=rate, options={"crf": str(crf), "preset": preset, **_SAME_BITS}
        )
        stream.pix_fmt = "yuv420p"
        context = stream.codec_context
        started = False
        for image in _checked(frames):
            even = np.pad(
                image, ((0, image.shape[0] % 2), (0, image.shape[1] % 2), (0, 0)), mode="edge"
            )
            if not started:
                stream.height, stream.width = even.shape[:2]
                # without these tags players guess the matrix from the picture size, and colors
                # shift
                (
                    context.color_primaries,
                    context.color_trc,
                    context.colorspace,
                    context.color_range,
                ) = 1, 1, 1, 1
                started = True
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(even), format="rgb24")
            frame = frame.reformat(
                format="yuv420p",
                src_colorspace="itu709",
                dst_colorspace="itu709",
                dst_color_range="MPEG",
            )
            for packet in stream.encode(frame):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)


def read_video(path: str | os.PathLike[str]) -> Iterator[ByteArray]:
    """Yield the frames (H, W, 3) uint8 sRGB of a video.

    Raises
    ------
    InputError
        The file is missing or not a video.
    """
    with _opened(path) as container:
        for frame in container.decode(video=0):
            yield frame.to_ndarray(format="rgb24", src_colorspace="itu709")


def probe_video(path: str | os.PathLike[str]) -> VideoInfo:
    """Return size, number of frames (counted by decoding), frame rate and codec of a video; raises
    as `read_video`."""
    with _opened(path) as container:
        stream = container.streams.video[0]
        frames = sum(1 for _ in container.decode(stream))
        context = stream.codec_context
        return VideoInfo(
            width=context.width,
            height=context.height,
            frames=frames,
            fps=float(stream.average_rate or 0),
            codec=context.name,
            pixel_format=str(context.pix_fmt),
        )


@contextmanager
def _opened(path: str | os.PathLike[str]) -> Iterator[Any]:
    """Open a container for decoding; errors inside become an `InputError` about the file."""
    import av

    try:
        with (
            open_file(path) as stream,
            av.open(stream, options={"protocol_whitelist": "none"}) as container,
        ):
            yield container
    except (av.FFmpegError, IndexError) as error:
        raise InputError(f"{path} is not a readable video ({error})") from error


def write_gif(
    path: str | os.PathLike[str], frames: Iterable[ByteArray], fps: float, *, colors: int = 128
) -> None:
    """Write a looping GIF with one palette of `colors` for all frames, atomically.

    One palette avoids flicker of dithered areas. For `path`, `frames`, `fps` and errors see
    `write_video`.
    """
    from PIL import Image

    pictures = _pictures(frames)
    picks = pictures[:: max(1, len(pictures) // 8)]
    mosaic = Image.fromarray(np.concatenate([np.asarray(picture)[::2, ::2] for picture in picks]))
    palette = mosaic.quantize(colors, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    indexed = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    _save_animation(path, indexed, fps, ".gif", {"disposal": 1, "optimize": False})


def write_webp(
    path: str | os.PathLike[str], frames: Iterable[ByteArray], fps: float, *, quality: int = 60
) -> None:
    """Write a looping animated WebP of a `quality` from 0 to 100, atomically; several times smaller
    than a GIF.

    For `path`, `frames`, `fps` and errors see `write_video`.
    """
    _save_animation(path, _pictures(frames), fps, ".webp", {"quality": quality, "method": 4})


_RUNGS = (
    (1.0, 1),
    (0.75, 1),
    (0.75, 2),
    (0.5, 2),
    (0.375, 2),
    (0.375, 3),
    (0.25, 3),
    (0.25, 4),
    (0.18, 4),
    (0.12, 6),
)
"""Scale and frame step of each attempt of `write_within`, in order of decreasing size."""


def write_within(
    path: str | os.PathLike[str], frames: Iterable[ByteArray], fps: float, *, megabytes: float
) -> None:
    """Write a ``.gif`` or ``.webp`` of at most `megabytes` (10^6 bytes).

    Size and frame rate are reduced as far as needed. For `path`, `frames` and `fps` see
    `write_video`; the clip keeps its duration.

    Raises
    ------
    InputError
        As for `write_video`, or the smallest attempt is still too large.
    """
    import cv2

    if not (np.isfinite(megabytes) and megabytes > 0):
        raise InputError(f"megabytes is {megabytes}; expected a positive number")
    suffix = Path(path).suffix.lower()
    if suffix not in (".gif", ".webp"):
        raise InputError(f"{path} ends in neither .gif nor .webp")
    pictures, limit, allowed = list(_checked(frames)), megabytes * 1e6, 1.0
    for scale, step in _RUNGS:
        if scale**2 / step > allowed:
            continue
        size = (
            max(1, round(pictures[0].shape[1] * scale)),
            max(1, round(pictures[0].shape[0] * scale)),
        )
        few = [
            np.asarray(cv2.resize(one, size, interpolation=cv2.INTER_AREA), np.uint8)
            for one in pictures[::step]
        ]
        with tempfile.TemporaryDirectory() as folder:
            made = Path(folder) / f"made{suffix}"
            (write_gif if suffix == ".gif" else write_webp)(
                made, few, fps * len(few) / len(pictures)
            )
            needed = made.stat().st_size
            if needed <= limit:
                with atomic_path(path) as temporary:
                    temporary.write_bytes(made.read_bytes())
                return
        allowed = (
            1.3 * scale**2 / step * limit / needed
        )  # skip attempts that are certainly too large
    raise InputError(
        f"{len(pictures)} frames do not fit into {megabytes} MB; allow more, or make a shorter or "
        "smaller video"
    )


def _pictures(frames: Iterable[ByteArray]) -> list[Any]:
    from PIL import Image

    return [Image.fromarray(frame) for frame in _checked(frames)]


def _save_animation(
    path: str | os.PathLike[str],
    pictures: list[Any],
    fps: float,
    suffix: str,
    options: dict[str, object],
) -> None:
    if not (np.isfinite(fps) and fps > 0):
        raise InputError(f"fps is {fps}; expected a positive number")
    if Path(path).suffix.lower() != suffix:
        raise InputError(f"{path} does not end in {suffix}")
    # Both formats store whole milliseconds (GIF: centiseconds). Rounding the end times of the
    # frames keeps the clip's duration.
    unit = 10 if suffix == ".gif" else 1
    ends = np.rint(np.arange(1, len(pictures) + 1) * 1000 / fps / unit).astype(int) * unit
    durations = [int(value) for value in np.diff(ends, prepend=0)]
    with atomic_path(path) as temporary:
        pictures[0].save(
            temporary,
            save_all=True,
            append_images=pictures[1:],
            duration=durations,
            loop=0,
            **options,
        )
