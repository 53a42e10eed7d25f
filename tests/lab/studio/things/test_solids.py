"""Solids are closed with outward faces, and their texture is apart from the person's."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.geometry.rays import RayScene
from a2v.lab.studio.texture import texture_at
from a2v.lab.studio.things.paint import draw_patterns
from a2v.lab.studio.things.solids import TILE, Thing, ball, box, joined, rod, turned, with_thing
from a2v.types import Surface


def volume(thing: Thing) -> float:
    """Of a closed solid with outward faces; negative if they point inwards."""
    return float(np.linalg.det(thing.vertices[thing.faces]).sum() / 6)


@pytest.mark.parametrize(
    ("thing", "expected"),
    [
        (box(0.2, 0.5, 0.1), 0.01),
        (rod(0.1, -0.2, 0.4, sides=64), np.pi * 0.01 * 0.6),
        (rod(0.1, 0, 0.3, tip=0.05, sides=64), np.pi * 0.3 * (0.01 + 0.005 + 0.0025) / 3),
        (ball(0.2), 4 / 3 * np.pi * 0.008),
    ],
)
def test_solids_are_closed_and_face_outwards(thing: Thing, expected: float) -> None:
    moved = thing.moved(
        [3.0, -2.0, 1.0], np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    )
    assert volume(thing) == pytest.approx(expected, rel=0.12)
    assert volume(moved) == pytest.approx(
        volume(thing), rel=1e-6
    )  # only a closed one weighs the same wherever it is
    assert thing.uv.min() >= 0
    assert thing.uv.max() <= 1


def test_joined_things_keep_their_patterns() -> None:
    both = joined([box(1, 1, 1, 2), ball(0.5, 3).moved([2, 0, 0])])
    assert volume(both) == pytest.approx(volume(box(1, 1, 1)) + volume(ball(0.5)))
    assert set(both.patterns[:12]) == {2}
    assert set(both.patterns[12:]) == {3}
    assert set(both.painted(1).patterns) == {1}
    assert turned([(1.0, 0.0), (1.0, 1.0)]).faces.max() < 2 * 15


def test_a_thing_beside_a_person_shows_its_pattern_and_the_person_their_texture() -> None:
    generator = np.random.default_rng(0)
    texture = generator.integers(0, 255, (256, 4 * TILE, 3)).astype(np.uint8)
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    uv = (square[:, :2] + 1) / 2
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    person = Surface(
        vertices=square,
        faces=faces,
        colors=np.zeros((4, 3), np.float32),
        uv=uv[faces].astype(np.float32),
        texture=texture,
    )
    normals = np.tile(np.array([0, 0, 1], np.float32), (4, 1))
    patterns = [np.full((TILE, TILE, 3), value, np.uint8) for value in (10, 60, 120, 240)]
    whole, turned_ = with_thing(person, normals, box(0.5, 0.5, 0.2, 3).moved([3.0, 0, 0]), patterns)
    rays = RayScene(whole.vertices, whole.faces)
    x, y = np.meshgrid(np.linspace(-0.9, 0.9, 9), np.linspace(-0.9, 0.9, 9))
    starts = np.stack([x.ravel(), y.ravel(), np.full(81, 2.0)], axis=-1).astype(np.float32)
    down = np.array([0, 0, -1], np.float32)
    hits, alone = rays.cast(starts, down), RayScene(square, faces).cast(starts, down)
    assert np.allclose(
        texture_at(whole, hits.face, hits.barycentric),
        texture_at(person, alone.face, alone.barycentric),
        atol=2e-3,
    )  # coordinates are scaled, so the last bits differ
    on_box = rays.cast(np.array([[3.0, 0.1, 2.0], [2.8, -0.2, 2.0]], np.float32), down)
    assert on_box.hit.all()
    assert (on_box.face >= len(faces)).all()
    assert np.allclose(
        texture_at(whole, on_box.face, on_box.barycentric),
        (240 / 255 + 0.055) ** 2.4 / 1.055**2.4,
        atol=1e-3,
    )
    front = np.abs(turned_[4:] - [0, 0, 1]).max(axis=1) < 1e-6
    assert front.sum() == 4  # each side of a box has normals of its own


def test_patterns_differ_and_repeat() -> None:
    first, again = (draw_patterns(np.random.default_rng(4), 12) for _ in range(2))
    assert all(np.array_equal(one, other) for one, other in zip(first, again, strict=True))
    assert len({one.tobytes() for one in first}) == 12
    assert {one.shape for one in first} == {(TILE, TILE, 3)}
    assert max(float(one.std(axis=(0, 1)).max()) for one in first) > 20  # some are patterned
