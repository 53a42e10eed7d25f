"""Parts of stick figures in matplotlib: settings, the view, the figure, the ground, and panels
without ticks.

Every picture is an orthographic view of the world (meters, y up) with equal axes: the ground at y =
0 with a grid, the figure's shadow straight below it; the person's left is red, the right blue.
"""

from __future__ import annotations

import functools
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.errors import InputError
from a2v.types import FloatArray, Motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GROUND = "#f4f4f2"
GRID = "#d9d9d4"
SHADOW = "#c9c9c4"
PATH = "#3a9d5d"

MAX_PANELS = 64
"""Largest number of figures in one animation."""


@dataclass(frozen=True)
class StickSettings:
    """How stick figures are drawn.

    Attributes
    ----------
    size : int
        Side of a panel of an animation, or height of a row of poses, pixels.
    azimuth, elevation : float
        Direction of the camera, degrees: 0 is the front (+z), positive azimuth goes toward the
        person's left (+x), positive elevation up.
    left, right, middle : str
        Colors of the person's left and right limbs and of the rest.
    bone, head : float
        Thickness of bones, radius of the head, meters.
    cell : float
        Distance between the grid's lines, meters.
    follow : float
        Extent of a path over the ground beyond which the camera of an animation follows the figure,
        meters.
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
    """Project points (..., 3) orthographically: to the right, up, and toward the camera, meters
    (..., 3).

    Parameters
    ----------
    points : (..., 3) float
        Meters, y up.
    azimuth, elevation : float
        See `StickSettings`.
    """
    a, e = np.deg2rad([azimuth, elevation])
    towards = np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])
    right = np.array([np.cos(a), 0.0, -np.sin(a)])
    up = np.cross(towards, right)
    seen: FloatArray = np.asarray(points, dtype=np.float64) @ np.stack(
        [right, up, towards], axis=-1
    )
    return seen


class FigureArtists:
    """The artists of one figure in one panel."""

    def __init__(self, ax: Axes, motion: Motion, settings: StickSettings) -> None:
        from matplotlib.collections import EllipseCollection, LineCollection

        from a2v.kinematics.names import canonical_joints, split_side

        self.settings, self.ends = settings, np.arange(1, len(motion.parents))
        self.starts = motion.parents[1:]
        colors = {"left": settings.left, "right": settings.right, "": settings.middle}
        self.colors = np.array([colors[split_side(name)[0]] for name in motion.joint_names[1:]])
        self.head = canonical_joints(motion.joint_names, motion.parents.tolist()).get("head")
        # line widths are in points, so meters are converted by the panel's scale
        width = settings.bone * _points_per_unit(ax)
        self.shadow = LineCollection(
            [], linewidths=width, colors=SHADOW, capstyle="round", zorder=2
        )
        self.bones = LineCollection([], linewidths=width, capstyle="round", zorder=4)
        across = 2 * settings.head
        self.skull = EllipseCollection(
            [across],
            [across],
            [0],
            units="xy",
            offsets=np.zeros((1, 2)),
            transOffset=ax.transData,
            facecolors=settings.middle,
            zorder=5,
        )
        self.artists: list[Any] = [self.shadow, self.bones] + (
            [self.skull] if self.head is not None else []
        )
        for artist in self.artists:
            ax.add_collection(artist, autolim=False)

    def place(
        self, joints: FloatArray, shift: tuple[float, float] = (0.0, 0.0), fade: float = 0.0
    ) -> None:
        """Show joints (J, 3), moved by `shift` in the picture's plane and faded towards white."""
        view = self.settings.azimuth, self.settings.elevation
        seen = project(joints, *view) + np.array([*shift, 0.0])
        flat = project(joints * np.array([1.0, 0.0, 1.0]), *view) + np.array([*shift, 0.0])
        order = np.argsort((seen[self.starts, 2] + seen[self.ends, 2]) / 2)  # farthest first
        self.bones.set_segments(
            list(np.stack([seen[self.starts, :2], seen[self.ends, :2]], axis=1)[order])
        )
        self.bones.set_color([faded(color, fade) for color in self.colors[order]])
        self.shadow.set_segments(
            list(np.stack([flat[self.starts, :2], flat[self.ends, :2]], axis=1))
        )
        self.shadow.set_color(faded(SHADOW, fade))
        if self.head is not None:
            self.skull.set_offsets(seen[self.head : self.head + 1, :2])
            self.skull.set_facecolor(faded(self.settings.middle, fade))
            limbs = seen[self.starts, 2].max() if len(self.starts) else 0.0
            self.skull.set_zorder(5 if seen[self.head, 2] >= limbs - 0.6 else 3)


def _points_per_unit(ax: Axes) -> float:
    """Return the number of typographic points per meter in a panel whose limits are set."""
    low, high = ax.get_xlim()
    box = ax.get_position()
    figure = ax.get_figure(root=True)
    assert figure is not None
    return float(box.width * figure.get_figwidth() * 72 / (high - low))


def faded(color: str, share: float) -> tuple[float, float, float]:
    """Blend a color toward white by `share`; RGB in [0, 1]."""
    from matplotlib.colors import to_rgb

    red, green, blue = (float(value + (1 - value) * share) for value in to_rgb(color))
    return red, green, blue


def ground_grid(low: FloatArray, high: FloatArray, settings: StickSettings) -> FloatArray:
    """Return lines (L, 2, 3) of a grid on the ground over x and z from `low` to `high` (2,)."""
    cell = settings.cell
    first, last = np.floor(low / cell) * cell, np.ceil(high / cell) * cell
    xs, zs = (np.arange(first[i], last[i] + cell / 2, cell) for i in (0, 1))
    along_z = [[(x, 0, first[1]), (x, 0, last[1])] for x in xs]
    along_x = [[(first[0], 0, z), (last[0], 0, z)] for z in zs]
    lines: FloatArray = np.array(along_z + along_x, dtype=np.float64)
    return lines


def draw_ground(
    ax: Axes, lines: FloatArray, settings: StickSettings, shift: tuple[float, float] = (0.0, 0.0)
) -> list[Any]:
    """Draw the plane under grid lines (L, 2, 3), and the lines; returns the artists."""
    from matplotlib.collections import LineCollection, PolyCollection

    flat = lines.reshape(-1, 3)
    low, high = flat.min(axis=0), flat.max(axis=0)
    corners = np.array(
        [(low[0], 0, low[2]), (high[0], 0, low[2]), (high[0], 0, high[2]), (low[0], 0, high[2])]
    )
    view = settings.azimuth, settings.elevation
    plane = PolyCollection(
        [project(corners, *view)[:, :2] + shift], facecolors=GROUND, edgecolors="none", zorder=0
    )
    grid = LineCollection(
        list(project(lines, *view)[..., :2] + shift), colors=GRID, linewidths=0.6, zorder=1
    )
    ax.add_collection(plane, autolim=False)
    ax.add_collection(grid, autolim=False)
    return [plane, grid]


def empty_axes(
    figure: Figure, box: tuple[float, float, float, float], low: FloatArray, high: FloatArray
) -> Axes:
    """Return axes without ticks at `box` (fractions of the figure) that contain `low` to `high` at
    equal scales."""
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


def new_figure(width: float, height: float) -> Figure:
    """Return a figure without pyplot (nothing stays in memory); size in inches at 100 dots per
    inch."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure: Figure = _figure_class()(figsize=(width, height), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def single_clips(motion: Motion | Sequence[Motion]) -> list[Motion]:
    """Split a clip, a batch or several motions into single clips."""
    motions = [motion] if isinstance(motion, Motion) else list(motion)
    clips = [
        item[index] if item.batch else item for item in motions for index in np.ndindex(item.batch)
    ]
    if not clips:
        raise InputError("no motion to draw")
    return clips


def titles_of(titles: Sequence[str] | None, clips: Sequence[Motion]) -> list[str]:
    """Return one title per clip, empty for None. A wrong number of titles is an `InputError`."""
    given = list(titles) if titles is not None else [""] * len(clips)
    if len(given) != len(clips):
        raise InputError(f"{len(given)} titles for {len(clips)} clips")
    return given
