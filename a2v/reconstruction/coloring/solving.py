"""Steps that solve for the colors of hidden vertices, and even them."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.geometry.mesh import vertex_areas
from a2v.reconstruction.backs.seen import HANDS
from a2v.reconstruction.coloring.elsewhere import HEAD
from a2v.reconstruction.coloring.equation14 import ColorProblem, solve_colors
from a2v.reconstruction.coloring.nearest import nearest_known
from a2v.reconstruction.coloring.painting import Painting
from a2v.reconstruction.coloring.tones import (
    combed,
    even_tones,
)


def solve(painting: Painting) -> Painting:
    """Solve Eq. 14 for the colors of hidden vertices."""
    settings, known, canvas = painting.settings, painting.known, painting.canvas
    continued = painting.continued
    # the band: grazing places of the photo, and places just behind the silhouette
    reach = (
        nearest_known(painting.vertices, known & ~painting.mouth)
        if canvas is None
        else nearest_known(canvas.rest, known)
    )[0]
    band = ~known & ((painting.seen & (painting.normals[:, 2] > 0.0)) | (reach < settings.band))
    expected, near, fixed = painting.expected, painting.neighbors, painting.colors
    if continued is not None:
        expected, near, band = continued.expected, continued.neighbors, band | continued.doubtful
        fixed = np.where(continued.labels[:, None] > 0, expected, fixed)
    problem = ColorProblem(
        prior=np.clip(expected, 0, 1),
        neighbors=near,
        free=~known,
        band=band,
        lambda_nn=settings.lambda_nn,
    )
    solution = solve_colors(
        np.where(known[:, None], fixed, expected), problem, tolerance=settings.tolerance
    )
    report = {
        "iterations": solution.iterations,
        "residual": solution.residual,
        "objective": solution.objective,
        "free": int((~known).sum()),
        "band": int(band.sum()),
        "lambda_nn": settings.lambda_nn,
    }
    return dataclasses.replace(
        painting,
        colors=np.where(known[:, None], painting.colors, solution.colors),
        report={"eq14": report, **painting.report},
    )


def wear_gloves(painting: Painting) -> Painting:
    """Give hidden hands the color of the gloves."""
    canvas = painting.canvas
    if canvas is None or not canvas.gloved or canvas.hands is None or painting.continued is None:
        return painting
    colors = painting.colors.copy()
    colors[painting.hidden_hands] = canvas.hands
    return dataclasses.replace(painting, colors=colors)


def even(painting: Painting) -> Painting:
    """Shift hidden hair and skin to the tone of what is visible of them."""
    canvas, continued = painting.canvas, painting.continued
    if canvas is None or continued is None:
        return painting
    bare = painting.on(*HEAD, *(() if canvas.gloved else HANDS))
    shown = painting.known & ~painting.mouth
    area = vertex_areas(canvas.rest, painting.faces)
    colors = even_tones(painting.colors, shown, ~painting.known, continued.labels, bare, area)
    return dataclasses.replace(painting, colors=colors)


def comb(painting: Painting) -> Painting:
    """Give hidden long hair the colors of the visible hair near it, in streaks."""
    canvas, continued = painting.canvas, painting.continued
    if canvas is None or continued is None:
        return painting
    colors = combed(painting.colors, painting.known, canvas, continued.labels, painting.mouth)
    return dataclasses.replace(painting, colors=colors)
