"""Stick figures drawn by matplotlib: rows of poses, poses along a path, and animations.

Every picture is an orthographic view of the world (meters, y up) with equal axes: the ground at y =
0 with a grid, the figure's shadow straight below it and the root's path on it; the person's left is
red, the right blue.
"""

from a2v.rendering.stickfigure.animation import animate
from a2v.rendering.stickfigure.artists import StickSettings, project
from a2v.rendering.stickfigure.files import DRAWN_FORMATS, save_figure, save_stick_figures
from a2v.rendering.stickfigure.plots import plot_path, plot_rows

__all__ = [
    "DRAWN_FORMATS",
    "StickSettings",
    "animate",
    "plot_path",
    "plot_rows",
    "project",
    "save_figure",
    "save_stick_figures",
]
