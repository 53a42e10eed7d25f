"""Paths from words, tables and drawings."""

from __future__ import annotations

from pathlib import Path as File

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.motion.ways import read_path

POINTS = [[0, 0], [0, 3], [3, 3]]
DRAWN = "<svg xmlns='http://www.w3.org/2000/svg'>{}</svg>"


def test_points_are_the_same_in_words_csv_and_yaml(tmp_path: File) -> None:
    (tmp_path / "p.csv").write_text("x;z\n0;0\n0;3\n3;3\n")
    (tmp_path / "p.yaml").write_text("- [0, 0]\n- [0, 3]\n- [3, 3.0]\n")
    for text in ("0,0 0,3 3,3", str(tmp_path / "p.csv"), str(tmp_path / "p.yaml")):
        np.testing.assert_array_equal(read_path(text).points, POINTS)


def test_a_drawing_is_a_path_in_centimeters_from_its_first_point(tmp_path: File) -> None:
    drawing = tmp_path / "p.svg"
    for shape in (
        "<polyline points='50,20 50,320 350,320'/>",
        "<g><path d='M50 20 v300 h300'/></g>",
    ):
        drawing.write_text(DRAWN.format(shape))
        np.testing.assert_allclose(read_path(str(drawing)).points, POINTS, atol=1e-9)
    drawing.write_text(DRAWN.format("<circle cx='500' cy='70' r='200'/>"))
    round_trip = read_path(str(drawing))
    assert abs(round_trip.lengths[-1] - 4 * np.pi) < 0.05
    np.testing.assert_allclose(
        np.linalg.norm(round_trip.points - round_trip.points.mean(0), axis=1), 2, atol=0.1
    )
    drawing.write_text(DRAWN.format("<path d='M0 0 Q 0 200 200 200'/>"))
    curve = read_path(str(drawing))
    np.testing.assert_allclose(curve.points[8], [0.5, 1.5], atol=1e-9)  # the middle of a parabola


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("p.csv", "x,z\n0,0\na,b\n", "not a point of a path"),
        ("p.yaml", "walk", "not a path"),
        ("p.yaml", "- [1, 2, 3]\n- [1, 2, 4]", "expected 2 to"),
        ("p.svg", "<svg", "not a drawing"),
        ("p.svg", "<svg xmlns='http://www.w3.org/2000/svg'/>", "draws no line"),
        ("p.svg", "<!DOCTYPE svg [<!ENTITY a 'b'>]><svg>&a;</svg>", "entities"),
    ],
)
def test_what_is_no_path_is_explained(tmp_path: File, name: str, text: str, words: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=words):
        read_path(str(tmp_path / name))
