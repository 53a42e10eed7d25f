"""Stick figures with matplotlib: rows of poses, poses along a path, and animations.

Every picture is an orthographic view of the world (metres, y up) with equal axes: the ground at y = 0 with a grid, the
figure's shadow straight below it and the root's path on it; the person's left is red, the right blue.
"""

from __future__ import annotations

import dataclasses
import functools
import io
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.types import ByteArray, FloatArray, Motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GROUND, GRID, SHADOW, PATH = "#f4f4f2", "#d9d9d4", "#c9c9c4", "#3a9d5d"

MAX_PANELS = 64
"""Most figures in one animation."""


@dataclass(frozen=True)
class StickSettings:
    """How stick figures are drawn.

    Attributes
    ----------
    size : int
        Pixels a panel of an animation; height of a row of poses.
    azimuth, elevation : float
        From where the camera looks, degrees: 0 is the front (from +z), positive azimuth goes to the person's left (+x),
        positive elevation up.
    left, right, middle : str
        Colours of the person's left and right limbs and of the rest.
    bone, head : float
        Thickness of bones, radius of the head, metres.
    cell : float
        Distance of the grid's lines, metres.
    follow : float
        Extent of a path over the ground beyond which the camera of an animation goes with the figure, metres.
    """

    size: int = 256
    azimuth: float = 30.0
    elevation: float = 15.0
    left: str = "#d1495b"
    right: str = "#2e6f95"
    middle: str = "#4a4a4a"
    bone: float = 0.045
    head: float = 0.1
    cell: float = 0.5
    follow: float = 2.5

    def __post_init__(self) -> None:
        if not 32 <= self.size <= 2048:
            raise InputError(f"size is {self.size}; expected 32 to 2048 pixels")
        if not -90 <= self.elevation <= 90:
            raise InputError(f"elevation is {self.elevation}; expected -90 to 90 degrees")


def project(points: FloatArray, azimuth: float, elevation: float) -> FloatArray:
    """Orthographic view of points (..., 3): to the right, up, and towards the camera, metres (..., 3).

    Parameters
    ----------
    points : (..., 3) float
        Metres, y up.
    azimuth, elevation : float
        See `StickSettings`.
    """
    a, e = np.deg2rad([azimuth, elevation])
    towards = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
    right = np.array([np.cos(a), 0.0, -np.sin(a)])
    up = np.cross(towards, right)
    seen: FloatArray = np.asarray(points, dtype=np.float64) @ np.stack([right, up, towards], axis=-1)
    return seen


class _Figure:
    """The artists of one figure in one panel."""

    def __init__(self, ax: Axes, motion: Motion, settings: StickSettings) -> None:
        from matplotlib.collections import EllipseCollection, LineCollection

        from a2v.kinematics.names import canonical_joints, split_side

        self.settings, self.ends = settings, np.arange(1, len(motion.parents))
        self.starts = motion.parents[1:]
        colours = {"left": settings.left, "right": settings.right, "": settings.middle}
        self.colours = np.array([colours[split_side(name)[0]] for name in motion.joint_names[1:]])
        self.head = canonical_joints(motion.joint_names, motion.parents.tolist()).get("head")
        # line widths are in points: metres by the panel's scale
        width = settings.bone * _points_per_unit(ax)
        self.shadow = LineCollection([], linewidths=width, colors=SHADOW, capstyle="round", zorder=2)
        self.bones = LineCollection([], linewidths=width, capstyle="round", zorder=4)
        across = 2 * settings.head
        self.skull = EllipseCollection(
            [across], [across], [0], units="xy", offsets=np.zeros((1, 2)), transOffset=ax.transData, facecolors=settings.middle, zorder=5
        )
        self.artists: list[Any] = [self.shadow, self.bones] + ([self.skull] if self.head is not None else [])
        for artist in self.artists:
            ax.add_collection(artist, autolim=False)

    def place(self, joints: FloatArray, shift: tuple[float, float] = (0.0, 0.0), fade: float = 0.0) -> None:
        """Show joints (J, 3), moved by `shift` in the picture's plane and faded towards white."""
        view = self.settings.azimuth, self.settings.elevation
        seen = project(joints, *view) + np.array([*shift, 0.0])
        flat = project(joints * np.array([1.0, 0.0, 1.0]), *view) + np.array([*shift, 0.0])
        order = np.argsort((seen[self.starts, 2] + seen[self.ends, 2]) / 2)  # the farthest first
        self.bones.set_segments(list(np.stack([seen[self.starts, :2], seen[self.ends, :2]], axis=1)[order]))
        self.bones.set_color([_faded(colour, fade) for colour in self.colours[order]])
        self.shadow.set_segments(list(np.stack([flat[self.starts, :2], flat[self.ends, :2]], axis=1)))
        self.shadow.set_color(_faded(SHADOW, fade))
        if self.head is not None:
            self.skull.set_offsets(seen[self.head : self.head + 1, :2])
            self.skull.set_facecolor(_faded(self.settings.middle, fade))
            limbs = seen[self.starts, 2].max() if len(self.starts) else 0.0
            self.skull.set_zorder(5 if seen[self.head, 2] >= limbs - 0.6 else 3)


def _points_per_unit(ax: Axes) -> float:
    """Typographic points of one metre in a panel whose limits are set."""
    low, high = ax.get_xlim()
    box = ax.get_position()
    figure = ax.get_figure(root=True)
    assert figure is not None
    return float(box.width * figure.get_figwidth() * 72 / (high - low))


def _faded(colour: str, share: float) -> tuple[float, float, float]:
    from matplotlib.colors import to_rgb

    red, green, blue = (float(value + (1 - value) * share) for value in to_rgb(colour))
    return red, green, blue


def _grid(low: FloatArray, high: FloatArray, settings: StickSettings) -> FloatArray:
    """Lines (L, 2, 3) of a grid on the ground over x and z from `low` to `high` (2,)."""
    cell = settings.cell
    first, last = np.floor(low / cell) * cell, np.ceil(high / cell) * cell
    xs, zs = (np.arange(first[i], last[i] + cell / 2, cell) for i in (0, 1))
    along_z = [[(x, 0, first[1]), (x, 0, last[1])] for x in xs]
    along_x = [[(first[0], 0, z), (last[0], 0, z)] for z in zs]
    lines: FloatArray = np.array(along_z + along_x, dtype=np.float64)
    return lines


def _draw_ground(ax: Axes, lines: FloatArray, settings: StickSettings, shift: tuple[float, float] = (0.0, 0.0)) -> list[Any]:
    """The plane under grid lines (L, 2, 3) and the lines; returns the artists."""
    from matplotlib.collections import LineCollection, PolyCollection

    flat = lines.reshape(-1, 3)
    low, high = flat.min(axis=0), flat.max(axis=0)
    corners = np.array([(low[0], 0, low[2]), (high[0], 0, low[2]), (high[0], 0, high[2]), (low[0], 0, high[2])])
    view = settings.azimuth, settings.elevation
    plane = PolyCollection([project(corners, *view)[:, :2] + shift], facecolors=GROUND, edgecolors="none", zorder=0)
    grid = LineCollection(list(project(lines, *view)[..., :2] + shift), colors=GRID, linewidths=0.6, zorder=1)
    ax.add_collection(plane, autolim=False)
    ax.add_collection(grid, autolim=False)
    return [plane, grid]


def _empty_axes(figure: Figure, box: tuple[float, float, float, float], low: FloatArray, high: FloatArray) -> Axes:
    """Axes without ticks at `box` (fractions of the figure) whose limits hold `low` to `high` at equal scales."""
    ax = figure.add_axes(box)
    ax.set_axis_off()
    across, up = box[2] * figure.get_figwidth(), box[3] * figure.get_figheight()
    middle, size = (low + high) / 2, high - low
    scale = max(size[0] / across, size[1] / up)
    ax.set_xlim(middle[0] - scale * across / 2, middle[0] + scale * across / 2)
    ax.set_ylim(middle[1] - scale * up / 2, middle[1] + scale * up / 2)
    return ax


@functools.lru_cache(maxsize=1)
def _figure_class() -> Any:
    from matplotlib.figure import Figure

    class StickFigure(Figure):
        """A figure that notebooks show without pyplot."""

        def _repr_png_(self) -> bytes:
            stream = io.BytesIO()
            self.savefig(stream, format="png", dpi=self.dpi)
            return stream.getvalue()

    return StickFigure


def _new_figure(width: float, height: float) -> Figure:
    """A figure of its own (no pyplot, so nothing stays in memory), inches at 100 dots."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure: Figure = _figure_class()(figsize=(width, height), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def _clips(motion: Motion | Sequence[Motion]) -> list[Motion]:
    """Single clips of a clip, a batch or several motions."""
    motions = [motion] if isinstance(motion, Motion) else list(motion)
    clips = [item[index] if item.batch else item for item in motions for index in np.ndindex(item.batch)]
    if not clips:
        raise InputError("no motion to draw")
    return clips


def _titles(titles: Sequence[str] | None, clips: Sequence[Motion]) -> list[str]:
    given = list(titles) if titles is not None else [""] * len(clips)
    if len(given) != len(clips):
        raise InputError(f"{len(given)} titles for {len(clips)} clips")
    return given


def plot_rows(
    motion: Motion | Sequence[Motion],
    *,
    poses: int = 8,
    titles: Sequence[str] | None = None,
    given: int = 0,
    settings: StickSettings | None = None,
) -> Figure:
    """A row of poses a clip, evenly spaced in time, each above its own spot of the ground.

    Parameters
    ----------
    motion : Motion or several
        A clip, a batch, or clips of any lengths and skeletons.
    poses : int
        Columns.
    titles : sequence of str or None
        Text at the left of each row.
    given : int
        The first frames of each clip, drawn paler: those that an outpainting was given.
    settings : StickSettings or None

    Returns
    -------
    matplotlib Figure
        ``settings.size`` pixels a row.

    Raises
    ------
    InputError
        No motion, or a number out of range.
    """
    settings = settings or StickSettings()
    clips = _clips(motion)
    if not 1 <= poses <= 60 or len(clips) > 4 * MAX_PANELS:
        raise InputError(f"{poses} poses of {len(clips)} clips; expected 1 to 60 poses and at most {4 * MAX_PANELS} clips")
    names = _titles(titles, clips)
    picks = [np.linspace(0, clip.frames - 1, poses).round().astype(int) for clip in clips]
    ground = np.array([1.0, 0.0, 1.0])
    shown = [clip.joints[at] - clip.root[at][:, None] * ground for clip, at in zip(clips, picks, strict=True)]
    seen = np.concatenate([project(joints, settings.azimuth, settings.elevation)[..., :2].reshape(-1, 2) for joints in shown])
    spot = _grid(np.array([-0.4, -0.4]), np.array([0.4, 0.4]), dataclasses.replace(settings, cell=0.4))
    tile = project(spot, settings.azimuth, settings.elevation)[..., :2].reshape(-1, 2)
    margin = settings.head + 0.02
    low, high = np.minimum(seen.min(0) - margin, tile.min(0) - 0.03), np.maximum(seen.max(0) + margin, tile.max(0) + 0.03)
    pitch = high[0] - low[0]
    row = settings.size / 100
    label = 1.1 if any(names) else 0.0
    cell = row * pitch / (high[1] - low[1])
    width, foot = label + cell * poses, 0.2
    figure = _new_figure(width, row * len(clips) + foot)
    total = figure.get_figheight()
    for index, (clip, joints, at) in enumerate(zip(clips, shown, picks, strict=True)):
        box = (label / width, (total - row * (index + 1)) / total, cell * poses / width, row / total)
        ax = _empty_axes(figure, box, low, high + np.array([pitch * (poses - 1), 0]))
        for column, frame in enumerate(at):
            shift = (pitch * column, 0.0)
            _draw_ground(ax, spot, settings, shift)
            _Figure(ax, clip, settings).place(joints[column], shift, fade=0.55 if frame < given else 0.0)
            if index == len(clips) - 1:
                place = (label + cell * (column - low[0] / pitch)) / width
                figure.text(place, 0.06 / total, f"{frame / clip.fps:.1f} s", ha="center", fontsize=7, color="#777777")
        if names[index]:
            figure.text(0.1 / width, box[1] + box[3] / 2, _wrapped(names[index]), va="center", fontsize=8)
    return figure


def _wrapped(text: str, width: int = 14) -> str:
    import textwrap

    return "\n".join(textwrap.wrap(text.replace("_", " "), width))


def plot_path(motion: Motion, *, poses: int = 8, given: int = 0, settings: StickSettings | None = None, title: str = "") -> Figure:
    """Poses of one clip where they are, with the root's path on the ground; earlier poses are paler.

    Parameters
    ----------
    motion : Motion
        One clip.
    poses : int
    given : int
        The first frames, whose path is drawn black: those that an outpainting was given.
    settings : StickSettings or None
    title : str

    Raises
    ------
    InputError
        A batch, or a number out of range.
    """
    settings = settings or StickSettings()
    if motion.batch:
        raise InputError(f"plot_path takes one clip; this Motion is a batch of shape {motion.batch}: index it first")
    if not 1 <= poses <= 60:
        raise InputError(f"{poses} poses; expected 1 to 60")
    view = settings.azimuth, settings.elevation
    at = np.linspace(0, motion.frames - 1, poses).round().astype(int)
    flat = motion.joints[..., [0, 2]].reshape(-1, 2)
    lines = _grid(flat.min(0) - 0.4, flat.max(0) + 0.4, settings)
    seen = np.concatenate([project(motion.joints[at], *view)[..., :2].reshape(-1, 2), project(lines, *view)[..., :2].reshape(-1, 2)])
    low, high = seen.min(0) - 0.1, seen.max(0) + 0.15
    height = settings.size / 100 * 1.4
    width = float(np.clip(height * (high[0] - low[0]) / (high[1] - low[1]), 2.0, 12.0))
    figure = _new_figure(width, height + (0.25 if title else 0))
    ax = _empty_axes(figure, (0, 0, 1, height / figure.get_figheight()), low, high)
    _draw_ground(ax, lines, settings)
    path = project(motion.root * np.array([1.0, 0.0, 1.0]), *view)
    ax.plot(path[:, 0], path[:, 1], color=PATH, linewidth=1.5, zorder=3)
    if given:
        ax.plot(path[:given, 0], path[:given, 1], color="black", linewidth=2.5, zorder=3)
    depth = np.argsort(path[at, 2])
    for place, pose in enumerate(depth):
        drawn = _Figure(ax, motion, settings)
        drawn.place(motion.joints[at[pose]], fade=0.6 * (1 - (pose + 1) / poses))
        for artist in drawn.artists[1:]:
            artist.set_zorder(4 + 2 * place + (artist is drawn.skull))
    if title:
        figure.text(0.5, 1 - 0.17 / figure.get_figheight(), title, ha="center", fontsize=9)
    return figure


def animate(
    motion: Motion | Sequence[Motion],
    *,
    titles: Sequence[str] | None = None,
    columns: int | None = None,
    settings: StickSettings | None = None,
) -> Iterator[ByteArray]:
    """Frames (H, W, 3) uint8 of one moving figure, or of several in a grid; shorter clips hold their last pose.

    The camera stands still, or goes along with a figure whose path is longer than ``settings.follow``.

    Parameters
    ----------
    motion : Motion or several
        At one frame rate.
    titles : sequence of str or None
        Text above each figure.
    columns : int or None
        Figures a row; None makes the grid about twice as wide as high.
    settings : StickSettings or None

    Raises
    ------
    InputError
        No motion, more than `MAX_PANELS` clips, or clips of several frame rates.
    """
    settings = settings or StickSettings()
    clips = _clips(motion)
    if len(clips) > MAX_PANELS:
        raise InputError(f"{len(clips)} clips to animate; expected at most {MAX_PANELS}")
    if len({clip.fps for clip in clips}) > 1:
        raise InputError(f"clips of {', '.join(sorted({f'{clip.fps:g}' for clip in clips}))} frames a second; resample them to one rate")
    names = _titles(titles, clips)
    across = columns or int(np.ceil(np.sqrt(2 * len(clips)))) if len(clips) > 2 else len(clips)
    down = -(-len(clips) // across)
    side = settings.size / 100
    head = 0.24 if any(names) else 0.0
    figure = _new_figure(across * side, down * (side + head))
    panels = []
    for index, clip in enumerate(clips):
        row, column = divmod(index, across)
        box = (column / across, 1 - (row + 1) / down, 1 / across, side / (side + head) / down)
        panels.append(_Panel(figure, box, clip, settings))
        if names[index]:
            place = box[0] + box[2] / 2, box[1] + box[3] + 0.3 * head / figure.get_figheight()
            figure.text(*place, names[index].replace("_", " "), ha="center", fontsize=8)
    return _frames(figure, panels, max(clip.frames for clip in clips))


def _frames(figure: Figure, panels: Sequence[_Panel], count: int) -> Iterator[ByteArray]:
    """Draw what stands still once, then only what moves."""
    canvas: Any = figure.canvas
    moving = [artist for panel in panels for artist in panel.moving]
    for artist in moving:
        artist.set_animated(True)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    for frame in range(count):
        canvas.restore_region(still)
        for panel in panels:
            panel.show(frame)
            for artist in sorted(panel.moving, key=lambda item: item.get_zorder()):
                panel.ax.draw_artist(artist)
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


class _Panel:
    """One moving figure with its ground and path."""

    def __init__(self, figure: Figure, box: tuple[float, float, float, float], clip: Motion, settings: StickSettings) -> None:
        from matplotlib.collections import LineCollection

        self.clip, self.settings = clip, settings
        view = settings.azimuth, settings.elevation
        ground = np.array([1.0, 0.0, 1.0])
        root = clip.root * ground
        follows = float(np.ptp(root, axis=0).max()) > settings.follow
        # the camera's path is smoother than the person's, so that the person still sways
        self.centre = _smooth(root, 1.2 * clip.fps) if follows else np.tile((root.min(0) + root.max(0)) / 2, (clip.frames, 1))
        local = clip.joints - self.centre[:, None]
        seen = project(local, *view)[..., :2].reshape(-1, 2)
        margin = settings.head + 0.03
        low, high = np.minimum(seen.min(0) - margin, [-0.7, -0.4]), np.maximum(seen.max(0) + margin, [0.7, 1.3])
        self.ax = _empty_axes(figure, box, low, high)
        flat = clip.joints[..., [0, 2]].reshape(-1, 2)
        reach = 1.0 if follows else 0.5
        self.lines = _grid(flat.min(0) - reach, flat.max(0) + reach, settings)
        self.path = root
        self.ground = _draw_ground(self.ax, self.lines - self.centre[0], settings)
        self.track = LineCollection([], colors=[_faded(PATH, 0.65), PATH], linewidths=1.5, zorder=3)
        self.ax.add_collection(self.track, autolim=False)
        self.person = _Figure(self.ax, clip, settings)
        self.moving = [*(self.ground if follows else []), self.track, *self.person.artists]
        self.follows = follows

    def show(self, frame: int) -> None:
        """Show one frame; the last one stays."""
        frame = min(frame, self.clip.frames - 1)
        view, centre = (self.settings.azimuth, self.settings.elevation), self.centre[frame]
        if self.follows:
            lines = self.lines - centre
            flat = lines.reshape(-1, 3)
            low, high = flat.min(axis=0), flat.max(axis=0)
            corners = np.array([(low[0], 0, low[2]), (high[0], 0, low[2]), (high[0], 0, high[2]), (low[0], 0, high[2])])
            self.ground[0].set_verts([project(corners, *view)[:, :2]])
            self.ground[1].set_segments(list(project(lines, *view)[..., :2]))
        path = project(self.path - centre, *view)[:, :2]
        self.track.set_segments([path, path[: frame + 1]])
        self.person.place(self.clip.joints[frame] - centre)


def _smooth(path: FloatArray, frames: float) -> FloatArray:
    """A path (T, 3) without what is quicker than about `frames`."""
    from scipy.ndimage import gaussian_filter1d

    smoothed: FloatArray = gaussian_filter1d(np.asarray(path, dtype=np.float64), frames / 4, axis=0, mode="nearest")
    return smoothed


def save_stick_figures(
    path: str | os.PathLike[str],
    motion: Motion | Sequence[Motion],
    *,
    titles: Sequence[str] | None = None,
    given: int = 0,
    settings: StickSettings | None = None,
) -> None:
    """Write rows of poses (``.png``, ``.svg``) or an animation (``.mp4``, ``.gif``, ``.webp``), atomically, by the path's suffix.

    Raises
    ------
    InputError
        Another suffix, or as for `plot_rows`, `animate` and the writers of videos.
    """  # fmt: skip
    from a2v.rendering.video import write_gif, write_video, write_webp

    suffix = Path(path).suffix.lower()
    writers: dict[str, Any] = {".mp4": write_video, ".gif": write_gif, ".webp": write_webp}
    if suffix in writers:
        clips = _clips(motion)
        writers[suffix](path, animate(clips, titles=titles, settings=settings), clips[0].fps)
    elif suffix in (".png", ".svg"):
        save_figure(path, plot_rows(motion, titles=titles, given=given, settings=settings))
    else:
        raise InputError(f"cannot draw {path}; expected a name that ends in .png, .svg, .mp4, .gif or .webp")


def save_figure(path: str | os.PathLike[str], figure: Figure) -> None:
    """Write a matplotlib figure atomically, at its own number of dots."""
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=figure.dpi)
