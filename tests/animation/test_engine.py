"""Characters for game engines have fewer triangles and the same movement."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v import Character, InputError
from a2v.animation import EngineSettings, deform, engine_ready
from a2v.animation.engine import with_triangles
from a2v.body.parts import on_parts
from a2v.rendering.matter import materials_of
from a2v.types import MATERIALS


@pytest.fixture(scope="module")
def textured(expressive: Character) -> Character:
    """Return a character with a texture in charts seen from the front and the back."""
    surface = expressive.surface
    corners = surface.vertices[surface.faces].astype(np.float64)
    front = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0
    uv = 0.25 * corners[..., :2] + np.where(front[:, None, None], [0.25, 0.02], [0.75, 0.02])
    texture = np.random.default_rng(0).integers(0, 256, (1024, 1024, 3), dtype=np.uint8)
    return dataclasses.replace(
        expressive, surface=dataclasses.replace(surface, uv=uv.astype(np.float32), texture=texture)
    )


@pytest.fixture(scope="module")
def small(textured: Character) -> Character:
    return engine_ready(textured, EngineSettings(triangles=8000, texture=512, normal_map=512))


def test_few_triangles_with_a_map(textured: Character, small: Character) -> None:
    assert 7000 < len(small.surface.faces) <= 8000
    assert small.surface.texture is not None
    assert small.surface.texture.shape == (512, 512, 3)
    assert small.surface.normal_map is not None
    assert small.surface.normal_map.shape == (512, 512, 3)
    assert small.weights.shape[1] == 4
    np.testing.assert_allclose(small.weights.sum(axis=1), 1, atol=1e-5)
    whole = engine_ready(textured, EngineSettings(triangles=0, texture=1024))
    assert len(whole.surface.faces) == len(textured.surface.faces)
    assert whole.surface.normal_map is None


def test_what_is_left_moves_as_it_did(textured: Character, small: Character) -> None:
    """Remaining vertices, their movement and all 52 expressions equal those of the whole character."""
    kept = np.array(
        [
            np.flatnonzero((textured.surface.vertices == point).all(axis=1))[0]
            for point in small.surface.vertices[::50]
        ]
    )
    moves = textured.body.bone_transforms.copy()
    moves[:, :3, 3] += 0.3
    moves[5:] = moves[5:] @ np.diag([1, 1, 1, 1]).astype(np.float32)
    np.testing.assert_array_equal(deform(small, moves)[::50], deform(textured, moves)[kept])
    before, after = textured.surface.face, small.surface.face
    assert before is not None
    assert after is not None
    assert after.names == before.names
    assert len(after.names) == 52
    for name in ("jawOpen", "eyeBlinkLeft", "mouthSmileRight", "tongueOut"):
        moved, offsets = after.target(name)
        assert len(moved) > 20
        whole = np.zeros_like(textured.surface.vertices)
        vertices, shifts = before.target(name)
        whole[vertices] = shifts
        first = {
            tuple(point): index
            for index, point in reversed(list(enumerate(textured.surface.vertices)))
        }
        own = np.array([first[tuple(point)] for point in small.surface.vertices[moved]])
        same = np.isclose(whole[own], offsets, atol=1e-7).all(axis=1)
        assert (
            same.mean() > 0.99
        )  # Lips touch: of two vertices at one place the other one may have been found.


def test_the_face_keeps_more_than_the_rest(textured: Character) -> None:
    small = with_triangles(textured, 8000)
    before, after = textured.surface.face, small.surface.face
    assert before is not None
    assert after is not None
    share = len(np.unique(after.vertices)) / len(np.unique(before.vertices))
    assert share > 1.3 * len(small.surface.vertices) / len(textured.surface.vertices)


def test_materials_are_told_apart(textured: Character) -> None:
    """Return a character with skin of one color on face and hands, and blue clothes elsewhere."""
    parts = textured.parts
    head, hands = on_parts(parts, "head"), on_parts(parts, "left_hand", "right_hand")
    colors = np.where((head | hands)[:, None], [0.8, 0.6, 0.5], [0.2, 0.3, 0.7]).astype(np.float32)
    top = head & (textured.surface.vertices[:, 1] > textured.surface.vertices[:, 1].max() - 0.06)
    colors[top] = [0.05, 0.04, 0.04]
    plain = dataclasses.replace(textured.surface, colors=colors, face=None)
    materials = materials_of(plain, head, hands)
    names = np.array(MATERIALS)[materials]
    corners = plain.faces
    assert (names[hands[corners].all(axis=1)] == "skin").mean() > 0.9
    assert (names[top[corners].all(axis=1)] == "hair").mean() > 0.6
    assert (names[~(head | hands)[corners].any(axis=1)] == "cloth").mean() > 0.95


@pytest.mark.parametrize("wrong", [{"triangles": 10}, {"texture": 100}, {"normal_map": 7}])
def test_wrong_settings_are_told(wrong: dict[str, int]) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        EngineSettings(**wrong)
