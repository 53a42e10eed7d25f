"""Plots of motions: rows of poses, and poses along a path."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from a2v.errors import InputError
from a2v.rendering.stickfigure.artists import (
    MAX_PANELS,
    PATH,
    FigureArtists,
    StickSettings,
    draw_ground,
    empty_axes,
    ground_grid,
    new_figure,
    project,
    single_clips,
    titles_of,
)
from a2v.types import FloatArray, IntArray, Motion

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_rows(
    motion: Motion | Sequence[Motion],
    *,
    poses: int = 8,
    titles: Sequence[str] | None = None,
    given: int = 0,
    settings: StickSettings | None = None,
) -> Figure:
    """Plot a row of poses per clip, evenly spaced in time, each above its own part of the ground.

    Parameters
    ----------
    motion : Motion or several
        A clip, a batch, or clips of any lengths and skeletons.
    poses : int
        Columns.
    titles : sequence of str or None
        Text at the left of each row.
    given : int
        Number of first frames of each clip that an outpainting was given; they are paler.
    settings : StickSettings or None

    Returns
    -------
    matplotlib Figure
        ``settings.size`` pixels per row.

    Raises
    ------
    InputError
        No motion, or a number out of range.
    """
    settings = settings or StickSettings()
    clips = single_clips(motion)
    if not 1 <= poses <= 60 or len(clips) > 4 * MAX_PANELS:
        raise InputError(
            f"{poses} poses of {len(clips)} clips; expected 1 to 60 poses and at most "
            f"{4 * MAX_PANELS} clips"
        )
    names = titles_of(titles, clips)
    picks = [np.linspace(0, clip.frames - 1, poses).round().astype(int) for clip in clips]
    shown = [_above_origin(clip, at) for clip, at in zip(clips, picks, strict=True)]
    spot = ground_grid(
        np.array([-0.4, -0.4]), np.array([0.4, 0.4]), dataclasses.replace(settings, cell=0.4)
    )
    low, high = _bounds(shown, spot, settings)
    pitch, row, label = high[0] - low[0], settings.size / 100, 1.1 if any(names) else 0.0
    cell = row * pitch / (high[1] - low[1])
    width, foot = label + cell * poses, 0.2
    figure = new_figure(width, row * len(clips) + foot)
    total = figure.get_figheight()
    for index, (clip, joints, at) in enumerate(zip(clips, shown, picks, strict=True)):
        box = (
            label / width,
            (total - row * (index + 1)) / total,
            cell * poses / width,
            row / total,
        )
        ax = empty_axes(figure, box, low, high + np.array([pitch * (poses - 1), 0]))
        for column, frame in enumerate(at):
            shift = (pitch * column, 0.0)
            draw_ground(ax, spot, settings, shift)
            FigureArtists(ax, clip, settings).place(
                joints[column], shift, fade=0.55 if frame < given else 0.0
            )
            if index == len(clips) - 1:
                place = (label + cell * (column - low[0] / pitch)) / width
                _write_time(figure, place, 0.06 / total, frame / clip.fps)
        if names[index]:
            figure.text(
                0.1 / width, box[1] + box[3] / 2, _wrapped(names[index]), va="center", fontsize=8
            )
    return figure


def _above_origin(clip: Motion, at: IntArray) -> FloatArray:
    """Return joints (P, J, 3) of the frames `at` (P,), meters, shifted so that the root is above
    the origin."""
    return np.asarray(clip.joints[at] - clip.root[at][:, None] * np.array([1.0, 0.0, 1.0]))


def _write_time(figure: Figure, x: float, y: float, seconds: float) -> None:
    """Write a time under a pose; `x` (its center) and `y` are fractions of the figure."""
    figure.text(x, y, f"{seconds:.1f} s", ha="center", fontsize=7, color="#777777")


def _bounds(
    shown: Sequence[FloatArray], spot: FloatArray, settings: StickSettings
) -> tuple[FloatArray, FloatArray]:
    """Return the least and greatest corners (2,) of a pose's panel, meters.

    The panel contains every pose (P, J, 3) and the ground's grid (L, 2, 3) under it.
    """
    view = settings.azimuth, settings.elevation
    seen = np.concatenate([project(joints, *view)[..., :2].reshape(-1, 2) for joints in shown])
    tile = project(spot, *view)[..., :2].reshape(-1, 2)
    margin = settings.head + 0.02
    return np.minimum(seen.min(0) - margin, tile.min(0) - 0.03), np.maximum(
        seen.max(0) + margin, tile.max(0) + 0.03
    )


def _wrapped(text: str, width: int = 14) -> str:
    import textwrap

    return "\n".join(textwrap.wrap(text.replace("_", " "), width))


def plot_path(
    motion: Motion,
    *,
    poses: int = 8,
    given: int = 0,
    settings: StickSettings | None = None,
    title: str = "",
) -> Figure:
    """Plot poses of one clip at their positions, with the root's path on the ground.

    Earlier poses are paler.

    Parameters
    ----------
    motion : Motion
        One clip.
    poses : int
    given : int
        Number of first frames that an outpainting was given; their path is black.
    settings : StickSettings or None
    title : str

    Raises
    ------
    InputError
        A batch, or a number out of range.
    """
    settings = settings or StickSettings()
    if motion.batch:
        raise InputError(
            f"plot_path takes one clip; this Motion is a batch of shape {motion.batch}: index it "
            "first"
        )
    if not 1 <= poses <= 60:
        raise InputError(f"{poses} poses are requested; expected 1 to 60")
    view = settings.azimuth, settings.elevation
    at = np.linspace(0, motion.frames - 1, poses).round().astype(int)
    flat = motion.joints[..., [0, 2]].reshape(-1, 2)
    lines = ground_grid(flat.min(0) - 0.4, flat.max(0) + 0.4, settings)
    seen = np.concatenate(
        [
            project(motion.joints[at], *view)[..., :2].reshape(-1, 2),
            project(lines, *view)[..., :2].reshape(-1, 2),
        ]
    )
    low, high = seen.min(0) - 0.1, seen.max(0) + 0.15
    height = settings.size / 100 * 1.4
    width = float(np.clip(height * (high[0] - low[0]) / (high[1] - low[1]), 2.0, 12.0))
    figure = new_figure(width, height + (0.25 if title else 0))
    ax = empty_axes(figure, (0, 0, 1, height / figure.get_figheight()), low, high)
    draw_ground(ax, lines, settings)
    path = project(motion.root * np.array([1.0, 0.0, 1.0]), *view)
    ax.plot(path[:, 0], path[:, 1], color=PATH, linewidth=1.5, zorder=3)
    if given:
        ax.plot(path[:given, 0], path[:given, 1], color="black", linewidth=2.5, zorder=3)
    depth = np.argsort(path[at, 2])
    for place, pose in enumerate(depth):
        drawn = FigureArtists(ax, motion, settings)
        drawn.place(motion.joints[at[pose]], fade=0.6 * (1 - (pose + 1) / poses))
        for artist in drawn.artists[1:]:
            artist.set_zorder(4 + 2 * place + (artist is drawn.skull))
    if title:
        figure.text(0.5, 1 - 0.17 / figure.get_figheight(), title, ha="center", fontsize=9)
    return figure
