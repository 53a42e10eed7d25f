from __future__ import annotations

import numpy as np
import pytest

from a2v.lab.studio.view import View, view_path
from a2v.lab.surface.batches import ViewReader, align_example, make_example
from tests.support.ellipsoid import RED


def test_mirroring_is_a_symmetry_of_the_example(view: View, studio) -> None:
    """The mirrored example of a mirrored world is consistent: points with negative distances stay
    inside of the mask."""
    prepared = ViewReader()(view_path(studio, "training", 0))
    seen = {True: 0, False: 0}
    for seed in range(12):
        example = make_example(prepared, np.random.default_rng(seed), 512)
        inside = example.points["distance"] < -0.02
        pixels = np.floor((example.points["place"] + 1) / 2 * 512).astype(int)
        assert (example.photo[3, pixels[inside, 1], pixels[inside, 0]] > 0.5).all()
        there = example.guide[8] > 0
        columns = np.broadcast_to(np.arange(256), (256, 256))[there]
        slope = np.corrcoef(columns, example.guide[0][there])[0, 1]
        assert slope > 0.5  # normals still point to the right on the right
        seen[bool(example.mirrored)] += 1
        color = example.photo[:3, 256, 256] + 0.5
        assert color[0] > color[1]
        assert np.abs(color * 255 / RED).max() < 1.3
    assert min(seen.values()) > 0


@pytest.mark.parametrize("seed", range(6))
def test_points_follow_the_predicted_depth(studio, seed: int) -> None:
    """If the maps show a person 7 cm nearer, its points are sampled 7 cm nearer; mirrored or not."""
    prepared = ViewReader()(view_path(studio, "training", 0))
    example = make_example(prepared, np.random.default_rng(seed), 256)
    rows, columns = prepared.nearest.astype(int)
    true = prepared.depth.astype(np.float32)[:, rows, columns]
    there = example.points["position"][:, 2]
    stay = align_example(prepared, example, true[..., ::-1] if example.mirrored else true)
    assert np.abs(stay["depth"] - there).max() < 5e-3
    moved = align_example(
        prepared, example, (true[..., ::-1] if example.mirrored else true) + np.float32(0.07)
    )
    assert np.abs(moved["depth"] - there - 0.07).max() < 5e-3
    front = there > 0.2
    assert (moved["guide_distance"][front] > stay["guide_distance"][front] + 0.03).all()
    right = example.points["place"][:, 0] > 0.15
    assert (stay["guide_normals"][right][:, 0] > 0).mean() > 0.95


def test_parts_of_the_frame_hold_their_pixels(studio) -> None:
    prepared = ViewReader()(view_path(studio, "training", 1))
    example = make_example(prepared, np.random.default_rng(3), 64, crop=256)
    left, top = example.part["corner"].astype(int)
    assert example.part["photo"].shape == (4, 256, 256)
    assert example.part["normals"].shape == (6, 128, 128)
    half = example.photo[3, top // 2 : (top + 256) // 2, left // 2 : (left + 256) // 2]
    assert np.abs(example.part["photo"][3, ::2, ::2] - half).mean() < 0.02
