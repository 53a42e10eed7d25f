"""OBJ: triangles, texture coordinates, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.lab.studio.obj import MOST, parse_obj

SQUARE = "# a square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\nvt .5 0\nvt 1 0\nvt 1 1\nvn 0 0 1\nf 1/1 2/2/1 3/3 4/1\n"


def test_polygons_become_fans():
    mesh = parse_obj(SQUARE, "a.obj")
    assert mesh.count == 4
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.corners.tolist() == [[0, 1, 2], [0, 2, 0]]
    assert mesh.uv[1].tolist() == [[0.5, 0], [1, 1], [0.5, 0]]


def test_vertices_may_be_missing():
    mesh = parse_obj("vt 0 0\nvt 1 0\nvt 0 1\nf 7/1 8/2 9/3\n", "a.obj")
    assert mesh.count == 0
    assert np.array_equal(mesh.faces, [[6, 7, 8]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (SQUARE.replace("f 1/1", "f 9/1"), "faces beyond its 4 vertices"),
        (SQUARE.replace("f 1/1", "f 0/1"), "faces beyond"),
        (SQUARE.replace("f 1/1", "f 1/9"), "faces beyond"),
        (SQUARE.replace("f 1/1", "f 1"), "without texture coordinates"),
        (SQUARE.replace("f 1/1", "f 1/"), "without texture coordinates"),
        (SQUARE.replace("f 1/1", "f one/1"), "the corner 'one/1'"),
        (SQUARE.replace("f 1/1", "f 99999999999999999999/1"), "the corner '999"),
        (SQUARE.replace("vt .5 0", "vt .5"), "texture coordinate '.5'"),
        (SQUARE.replace("vt .5 0", "vt .5 nan"), "two numbers"),
        ("v 0 0 0\n", "no faces"),
        ("f 1/1 2/2\n", "no faces"),
        ("v 0 0 0\n" * (MOST + 1), "more than 200000"),
    ],
)
def test_what_is_refused(text: str, message: str):
    with pytest.raises(InputError, match=message):
        parse_obj(text, "a.obj")
