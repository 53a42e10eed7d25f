"""Animated stick figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.errors import InputError
from a2v.rendering.stickfigure.artists import (
    MAX_PANELS,
    PATH,
    FigureArtists,
    StickSettings,
    draw_ground,
    empty_axes,
    faded,
    ground_grid,
    new_figure,
    project,
    single_clips,
    titles_of,
)
from a2v.types import ByteArray, FloatArray, Motion

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def animate(
    motion: Motion | Sequence[Motion],
    *,
    titles: Sequence[str] | None = None,
    columns: int | None = None,
    settings: StickSettings | None = None,
) -> Iterator[ByteArray]:
    """Yield frames (H, W, 3) uint8 of one moving figure, or of several in a grid.

    Shorter clips hold their last pose. The camera stands still, or follows a figure whose path is
    longer than ``settings.follow``.

    Parameters
    ----------
    motion : Motion or several
        At one frame rate.
    titles : sequence of str or None
        Text above each figure.
    columns : int or None
        Figures per row; None makes the grid about twice as wide as high.
    settings : StickSettings or None

    Raises
    ------
    InputError
        No motion, more than `MAX_PANELS` clips, or clips of several frame rates.
    """
    settings = settings or StickSettings()
    clips = single_clips(motion)
    if len(clips) > MAX_PANELS:
        raise InputError(f"{len(clips)} clips to animate; expected at most {MAX_PANELS}")
    if len({clip.fps for clip in clips}) > 1:
        raise InputError(
            "the clips have different rates, "
            f"{', '.join(sorted({f'{clip.fps:g}' for clip in clips}))} frames per second; "
            "resample them to one rate"
        )
    names = titles_of(titles, clips)
    across = columns or int(np.ceil(np.sqrt(2 * len(clips)))) if len(clips) > 2 else len(clips)
    down = -(-len(clips) // across)
    side = settings.size / 100
    head = 0.24 if any(names) else 0.0
    figure = new_figure(across * side, down * (side + head))
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
    """Draw the still parts once, then only the moving ones."""
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

    def __init__(
        self,
        figure: Figure,
        box: tuple[float, float, float, float],
        clip: Motion,
        settings: StickSettings,
    ) -> None:
        from matplotlib.collections import LineCollection

        self.clip, self.settings = clip, settings
        view = settings.azimuth, settings.elevation
        ground = np.array([1.0, 0.0, 1.0])
        root = clip.root * ground
        follows = float(np.ptp(root, axis=0).max()) > settings.follow
        # the camera's path is smoother than the person's, so that the sway of the person stays
        # visible
        self.center = (
            _smooth(root, 1.2 * clip.fps)
            if follows
            else np.tile((root.min(0) + root.max(0)) / 2, (clip.frames, 1))
        )
        local = clip.joints - self.center[:, None]
        seen = project(local, *view)[..., :2].reshape(-1, 2)
        margin = settings.head + 0.03
        low, high = (
            np.minimum(seen.min(0) - margin, [-0.7, -0.4]),
            np.maximum(seen.max(0) + margin, [0.7, 1.3]),
        )
        self.ax = empty_axes(figure, box, low, high)
        flat = clip.joints[..., [0, 2]].reshape(-1, 2)
        reach = 1.0 if follows else 0.5
        self.lines = ground_grid(flat.min(0) - reach, flat.max(0) + reach, settings)
        self.path = root
        self.ground = draw_ground(self.ax, self.lines - self.center[0], settings)
        self.track = LineCollection([], colors=[faded(PATH, 0.65), PATH], linewidths=1.5, zorder=3)
        self.ax.add_collection(self.track, autolim=False)
        self.person = FigureArtists(self.ax, clip, settings)
        self.moving = [*(self.ground if follows else []), self.track, *self.person.artists]
        self.follows = follows

    def show(self, frame: int) -> None:
        """Show one frame; after the end, the last one."""
        frame = min(frame, self.clip.frames - 1)
        view, center = (self.settings.azimuth, self.settings.elevation), self.center[frame]
        if self.follows:
            lines = self.lines - center
            flat = lines.reshape(-1, 3)
            low, high = flat.min(axis=0), flat.max(axis=0)
            corners = np.array(
                [
                    (low[0], 0, low[2]),
                    (high[0], 0, low[2]),
                    (high[0], 0, high[2]),
                    (low[0], 0, high[2]),
                ]
            )
            self.ground[0].set_verts([project(corners, *view)[:, :2]])
            self.ground[1].set_segments(list(project(lines, *view)[..., :2]))
        path = project(self.path - center, *view)[:, :2]
        self.track.set_segments([path, path[: frame + 1]])
        self.person.place(self.clip.joints[frame] - center)


def _smooth(path: FloatArray, frames: float) -> FloatArray:
    """Low-pass a path (T, 3): removes changes faster than about `frames`."""
    from scipy.ndimage import gaussian_filter1d

    smoothed: FloatArray = gaussian_filter1d(
        np.asarray(path, dtype=np.float64), frames / 4, axis=0, mode="nearest"
    )
    return smoothed
