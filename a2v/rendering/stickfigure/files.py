"""Files of stick figures."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from a2v.errors import InputError
from a2v.formats.registry import MotionFormat
from a2v.io import atomic_path
from a2v.rendering.stickfigure.animation import animate
from a2v.rendering.stickfigure.artists import StickSettings, single_clips
from a2v.rendering.stickfigure.plots import plot_rows
from a2v.rendering.video import write_gif, write_video, write_webp
from a2v.types import Motion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_VIDEOS: dict[str, Callable[..., None]] = {
    ".mp4": write_video,
    ".gif": write_gif,
    ".webp": write_webp,
}
_PICTURES = (".png", ".svg")


def save_stick_figures(
    path: str | os.PathLike[str],
    motion: Motion | Sequence[Motion],
    *,
    titles: Sequence[str] | None = None,
    given: int = 0,
    settings: StickSettings | None = None,
) -> None:
    """Write rows of poses (``.png``, ``.svg``) or an animation (``.mp4``, ``.gif``, ``.webp``),
    atomically, by the path's suffix.

    Raises
    ------
    InputError
        Another suffix, or an error of `plot_rows`, `animate` or the video writers.
    """
    suffix = Path(path).suffix.lower()
    if suffix in _VIDEOS:
        clips = single_clips(motion)
        _VIDEOS[suffix](path, animate(clips, titles=titles, settings=settings), clips[0].fps)
    elif suffix in _PICTURES:
        save_figure(path, plot_rows(motion, titles=titles, given=given, settings=settings))
    else:
        raise InputError(
            f"cannot draw {path}; expected a name that ends in .png, .svg, .mp4, .gif or .webp"
        )


def draw_motion(path: str | os.PathLike[str], motion: Motion) -> None:
    """Draw a clip or batch (N,) by `save_stick_figures`. Titles are the clips' actions; the given
    frames of an outpainting are paler."""
    titles = motion.action.split("|") if "|" in motion.action else None
    save_stick_figures(path, motion, titles=titles, given=motion.given_frames or 0)


DRAWN_FORMATS: tuple[MotionFormat, ...] = (
    MotionFormat(suffixes=(*_VIDEOS, *_PICTURES), write=draw_motion, batches=True),
)
"""Formats that show motions."""


def save_figure(path: str | os.PathLike[str], figure: Figure) -> None:
    """Write a matplotlib figure atomically, at its own dots per inch."""
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=figure.dpi)
