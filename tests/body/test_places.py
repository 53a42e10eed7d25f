"""Canonical places of the body's outer skin."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from a2v.body import load_body_model, make_body
from a2v.body.places import canonical_places
from a2v.body.skin import outer_skin


def test_places_are_the_outer_skins_own_in_its_order() -> None:
    """A posed body's skin has its places by `vertex_ids`, and the unposed one's are an affine map
    of its vertices."""
    body = make_body(load_body_model())
    found = canonical_places()
    skin, _, _ = outer_skin(body)
    np.testing.assert_array_equal(body.vertices[found.vertex_ids], skin.astype(body.vertices.dtype))
    assert (np.diff(found.vertex_ids) > 0).all()
    assert len(found.vertex_ids) < len(body.vertices)
    for axis in range(3):
        slope, start = np.polyfit(skin[:, axis], found.places[:, axis], 1)
        np.testing.assert_allclose(slope * skin[:, axis] + start, found.places[:, axis], atol=1e-4)
    np.testing.assert_allclose(found.places.min(axis=0), -1, atol=1e-6)
    np.testing.assert_allclose(found.places.max(axis=0), 1, atol=1e-6)


def test_places_mirror_with_the_sign_of_x_and_are_kept() -> None:
    found = canonical_places()
    gap, _ = cKDTree(found.places).query(found.places * np.array([-1, 1, 1], np.float32))
    assert np.quantile(gap, 0.99) < 0.01
    assert canonical_places() is found
    assert not found.places.flags.writeable
