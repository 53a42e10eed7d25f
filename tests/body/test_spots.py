"""Spots of a body's skin: places at rest, the other side, where hair grows."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.body import PARTS, load_body_model, make_body, nearest_spots
from a2v.body.spots import rest_vertices
from a2v.types import Body


@pytest.fixture(scope="module")
def body() -> Body:
    """One arm bent, one thigh lifted, turned to the side."""
    model = load_body_model()
    turns = np.zeros((model.n_bones, 3), np.float32)
    turns[0] = (0.1, 0.8, 0.0)
    turns[model.bone("lowerarm01.L")] = (0.0, -1.2, 0.0)
    turns[model.bone("upperleg01.R")] = (-0.9, 0.0, 0.1)
    return make_body(model, turns, {"weight": 0.7})


def test_the_pose_is_undone(body: Body) -> None:
    rest = make_body(load_body_model(), None, {"weight": 0.7})
    np.testing.assert_allclose(rest_vertices(body), rest.vertices, atol=1e-5)


def test_every_spot_has_a_twin_on_the_other_side(body: Body) -> None:
    spots = nearest_spots(body.vertices, body)
    twins = spots.twins(np.ones(len(body.vertices), bool), within=0.01)
    assert (twins >= 0).mean() > 0.99
    some = twins >= 0
    assert np.abs(spots.places[twins[some]] - spots.places[some] * [-1, 1, 1]).max() < 0.01
    names = np.array(PARTS)
    mirrored = np.array(
        [
            PARTS.index(name.replace("left", "x").replace("right", "left").replace("x", "right"))
            for name in names
        ]
    )
    assert (spots.parts[twins[some]] == mirrored[spots.parts[some]]).mean() > 0.98
    assert (twins[twins[some]] == np.flatnonzero(some)).mean() > 0.9


def test_a_twin_is_only_taken_from_what_is_shown_and_never_through_a_limb(body: Body) -> None:
    spots = nearest_spots(body.vertices, body)
    shown = (spots.parts == PARTS.index("right_lower_arm")) & (
        spots.normals[:, 2] > 0.2
    )  # the front of one forearm
    twins = spots.twins(shown, within=0.03)
    found = twins >= 0
    assert shown[twins[found]].all()
    assert np.isin(
        spots.parts[found],
        [PARTS.index(f"left_{name}") for name in ("upper_arm", "lower_arm", "hand")],
    ).all()
    assert found[(spots.parts == PARTS.index("left_lower_arm")) & (spots.normals[:, 2] > 0.3)].all()
    behind = (spots.parts == PARTS.index("left_lower_arm")) & (spots.normals[:, 2] < -0.3)
    assert behind.sum() > 20
    assert not found[behind].any()
    assert (spots.twins(np.zeros(len(twins), bool), within=1.0) == -1).all()


def test_hair_grows_behind_the_ears_and_on_the_crown_but_on_no_face(body: Body) -> None:
    spots = nearest_spots(body.vertices, body)
    head = spots.parts == PARTS.index("head")
    x, y, z = spots.places.T
    top, bottom = y[head].max(), y[head].min()
    high = (y - bottom) / (top - bottom)
    middle = (z[head].max() + z[head].min()) / 2
    assert spots.scalp[head & (z < middle - 0.05) & (high > 0.6)].all()
    assert spots.scalp[head & (high > 0.95)].all()
    assert not spots.scalp[(z > middle + 0.03) & (high < 0.75)].any()
    ears = head & (np.abs(x) > 0.98 * np.abs(x[head]).max())
    assert not spots.scalp[ears].any()
    assert spots.bare[head & (z > middle + 0.06) & (high > 0.1) & (high < 0.6)].all()
    assert not (spots.bare & (spots.scalp | ~head | (high > 0.85))).any()
    assert not spots.bare[ears].any()
    assert not spots.scalp[~np.isin(spots.parts, [PARTS.index("head"), PARTS.index("neck")])].any()
