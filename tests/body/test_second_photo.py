"""The recommended side of a second photo."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.body import summary
from a2v.body.second_photo import DOUBTFUL, best_side, heading
from a2v.kinematics.names import LANDMARK_INDEX

LIMBS = ("left_arm", "right_arm", "left_leg", "right_leg")


def errors(**unsure: float) -> dict[str, float]:
    return dict.fromkeys(LIMBS, 0.03) | {"trunk": 1.0, "head": 1.0} | unsure


@pytest.mark.parametrize("turned", [0.0, 40.0, -80.0, 170.0])
def test_the_heading_is_that_of_the_trunk(turned: float) -> None:
    points = np.zeros((33, 3))
    for side, x in (("left", 0.2), ("right", -0.2)):
        for joint, y in (("shoulder", 1.4), ("hip", 0.9)):
            points[LANDMARK_INDEX[f"{side}_{joint}"]] = (
                x * np.cos(np.radians(turned)),
                y,
                -x * np.sin(np.radians(turned)),
            )
    assert heading(points) == pytest.approx(turned)


@pytest.mark.parametrize("limb", LIMBS)
def test_an_unsure_limb_is_best_seen_from_its_own_side(limb: str) -> None:
    unsure = errors(**{limb: 2 * DOUBTFUL})
    assert best_side(unsure, 0.0) == limb.split("_")[0]
    assert best_side(unsure, 180.0) == limb.split("_")[0]
    assert best_side(unsure, 90.0) in ("front", "back")  # in profile a limb shows its depth there


def test_without_an_unsure_limb_the_unseen_side_is_best() -> None:
    assert best_side(errors(), 10.0) == "back"
    assert best_side(errors(), 180.0) == "front"
    assert best_side(errors(), 90.0) == "left"  # turned to their left: the photo shows their right


def test_with_several_photos_the_best_side_is_one_that_none_of_them_shows() -> None:
    assert best_side(errors(), 0.0, 180.0) in ("left", "right")  # front and back are given
    assert best_side(errors(), 0.0, -90.0, 180.0) == "right"  # front, left and back are given
    unsure = errors(left_arm=2 * DOUBTFUL)
    assert best_side(unsure, 0.0, 180.0) == "left"  # a photo from behind shows no depth
    assert best_side(unsure, 0.0, -90.0) in ("back", "right")  # the photo from the left shows it


def test_the_summary_names_camera_limbs_and_photo() -> None:
    camera = {"distance": 2.5, "distance_from": "given", "field_of_view": 50.2, "height": 1.4}
    first, second, third = summary(
        {"camera": camera, "limb_errors": errors(), "second_photo": "back"}
    )
    assert first == "camera 2.5 m away, 50 degrees wide (given)"
    assert "left arm 3 cm" in second
    assert "trunk" not in second
    assert third.endswith("back")
    assert summary({}) == []
    flat = {"distance": 0.0, "distance_from": "orthographic, as given"}
    assert summary({"camera": flat}) == ["camera far away (orthographic, as given)"]
