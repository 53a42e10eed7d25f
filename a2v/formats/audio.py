"""Read the sound of audio files."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.io import open_file, reading
from a2v.types import FloatArray

RATE = 16_000
"""Samples per second of what is read: speech has little above 8 kHz."""
MAX_SECONDS = 600.0


def read_sound(path: str | os.PathLike[str]) -> FloatArray:
    """Read a sound as one channel of `RATE` samples per second, (N,) float32 in [-1, 1].

    Any format that PyAV decodes: ``.wav``, ``.mp3``, ``.ogg``, ``.m4a``, ``.flac``, or the sound of
    a video.

    Raises
    ------
    InputError
        The file has no sound, cannot be decoded, or is longer than `MAX_SECONDS`.
    """
    import av

    source, parts, count = Path(path), list[FloatArray](), 0
    with (
        open_file(source) as stream,
        reading(source, "sound that can be read", "a .wav or .mp3"),
        av.open(stream) as container,
    ):
        if not container.streams.audio:
            raise InputError(f"{source} has no sound")
        resampler = av.AudioResampler(format="flt", layout="mono", rate=RATE)
        for frame in container.decode(audio=0):
            for made in resampler.resample(frame):
                parts.append(made.to_ndarray().ravel())
                count += len(parts[-1])
            if count > MAX_SECONDS * RATE:
                raise InputError(
                    f"{source} is longer than {MAX_SECONDS:g} s; cut it into several files"
                )
        parts += [made.to_ndarray().ravel() for made in resampler.resample(None)]
    sound = np.concatenate(parts) if parts else np.zeros(0, np.float32)
    if not len(sound) or not np.isfinite(sound).all():
        raise InputError(f"{source} has no sound that can be used")
    return np.clip(sound, -1, 1).astype(np.float32)
