"""The head chart."""

from __future__ import annotations

import numpy as np

from a2v.body import load_body_model
from a2v.body.head_chart import (
    CENTER,
    HEIGHT,
    PARTS,
    WIDTH,
    chart_places,
    head_cells,
    sample_chart,
)
from a2v.body.parts import on_parts
from a2v.body.registry import default_rest


def test_each_cell_shows_the_place_in_its_direction() -> None:
    cells = head_cells()
    found = chart_places(cells.spread(default_rest())[cells.valid])
    row, column = np.nonzero(cells.valid)
    around = np.abs(found[:, 0] - column)
    np.testing.assert_allclose(np.minimum(around, WIDTH - around)[row > 3], 0, atol=0.02)
    np.testing.assert_allclose(found[:, 1], row, atol=0.02)


def test_a_chart_of_places_gives_back_the_places_of_the_vertices() -> None:
    """Only the folds of ears, nostrils and mouth lie below the outermost."""
    rest, cells = default_rest(), head_cells()
    model = load_body_model("anny")
    own = on_parts(np.asarray(model.parts), *PARTS) & (rest[:, 1] > 0.68)
    chart = np.where(cells.valid[..., None], cells.spread(rest), rest[own].mean(axis=0))
    away = np.linalg.norm(sample_chart(chart, chart_places(rest[own])) - rest[own], axis=1)
    assert np.median(away) < 0.003
    # eyes, teeth and tongue are no outer skin
    assert (away < 0.01).mean() > 0.6


def test_the_azimuth_goes_around_and_the_middle_looks_ahead() -> None:
    chart = np.zeros((HEIGHT, WIDTH, 1))
    chart[:, 0], chart[:, -1] = 1.0, 3.0
    behind = sample_chart(chart, np.array([[-0.5, 50.0], [WIDTH - 0.5, 50.0]]))
    np.testing.assert_allclose(behind[:, 0], 2.0, atol=1e-6)
    ahead, left = chart_places(CENTER + np.array([[0.0, 0.0, 0.1], [0.1, 0.0, 0.0]]))
    assert ahead[0] == WIDTH / 2 - 0.5
    assert left[0] == 0.75 * WIDTH - 0.5
