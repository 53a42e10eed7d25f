"""What a look at a finished character beside its photo says."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.body import load_body_model, make_body
from a2v.reconstruction.remarks import posture, remarks
from a2v.types import Body


def posed(**turns: float) -> Body:
    """A body with bones turned about the axis from its right to its left, degrees."""
    model = load_body_model("anny")
    rotations = np.zeros((len(model.bone_names), 3), np.float32)
    for name, degrees in turns.items():
        bones = [name] if name in model.bone_names else [f"{name}.L", f"{name}.R"]
        for bone in bones:
            rotations[model.bone_names.index(bone), 0] = np.radians(degrees)
    return make_body(model, rotations, model.shape_default)


@pytest.mark.parametrize(
    ("turns", "expected"),
    [
        ({}, ""),
        ({"upperleg01": -25.0}, ""),
        ({"upperleg01": -85.0, "lowerleg01": 85.0}, "sits or crouches"),
        ({"root": -88.0}, "lies"),
    ],
)
def test_people_who_sit_or_lie_are_named(turns: dict[str, float], expected: str) -> None:
    body = posed(**turns)
    assert posture(body) == expected
    notes = remarks({"iou": 0.95, "color": 4.0}, body)
    assert [expected in note for note in notes] == ([True] if expected else [])


def test_a_character_that_is_not_like_its_photo_is_noted() -> None:
    body = posed()
    good = {"iou": 0.95, "color": 4.0}
    assert not remarks(good, body)
    assert "outlines share 70 %" in remarks(good | {"iou": 0.7}, body)[0]
    assert "colors differ by 25" in remarks(good | {"color": 25.0}, body)[0]
    assert "the head by 30" in remarks(good | {"color, head": 30.0}, body)[0]
    assert not remarks(good | {"color, head": np.nan}, body)
