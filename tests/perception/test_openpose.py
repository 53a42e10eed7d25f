from __future__ import annotations

import json

import pytest

from a2v.errors import InputError
from a2v.kinematics.names import BLAZEPOSE
from a2v.perception import read_openpose


def person(points: int, scale: float = 100.0) -> dict[str, object]:
    """Point i of the layout lies at (10 + scale * i, 20 + 2 * scale * i) with confidence 0.9."""
    return {
        "pose_keypoints_2d": [
            x for i in range(points) for x in (10 + scale * i, 20 + 2 * scale * i, 0.9)
        ]
    }


@pytest.mark.parametrize(
    ("points", "places"),
    [
        (
            25,
            {
                "nose": 0,
                "left_shoulder": 5,
                "right_hip": 9,
                "left_ankle": 14,
                "left_heel": 21,
                "right_foot_index": 22,
            },
        ),
        (
            18,
            {
                "nose": 0,
                "left_shoulder": 5,
                "right_hip": 8,
                "left_ankle": 13,
                "right_eye": 14,
                "left_ear": 17,
            },
        ),
    ],
)
def test_layouts(points: int, places: dict[str, int]) -> None:
    landmarks = read_openpose(json.dumps({"people": [person(points)]}))
    assert landmarks.shape == (33, 3)
    for name, index in places.items():
        assert landmarks[BLAZEPOSE.index(name)] == pytest.approx(
            [10 + 100 * index, 20 + 200 * index, 0.9]
        )
    assert (landmarks[BLAZEPOSE.index("mouth_left")] == 0).all()


def test_largest_person_is_taken() -> None:
    landmarks = read_openpose(
        json.dumps({"people": [person(25, 1.0), person(25, 7.0), person(25, 3.0)]}).encode()
    )
    assert landmarks[BLAZEPOSE.index("left_shoulder"), 0] == pytest.approx(45)


def test_normalised_coordinates_need_the_photo() -> None:
    data = json.dumps(
        {"people": [{"pose_keypoints_2d": [x for i in range(25) for x in (i / 30, i / 40, 0.8)]}]}
    )
    with pytest.raises(InputError, match="pixels"):
        read_openpose(data)
    assert read_openpose(data, photo_size=(300, 400))[
        BLAZEPOSE.index("left_shoulder"), :2
    ] == pytest.approx([50, 50])


@pytest.mark.parametrize(
    "data",
    [
        "",
        "{",
        "[]",
        "{}",
        '{"people": 3}',
        '{"people": []}',
        '{"people": [{}]}',
        '{"people": [3]}',
        '{"people": [{"pose_keypoints_2d": [1, 2]}]}',
        '{"people": [{"pose_keypoints_2d": [1, 2, 3]}]}',
        json.dumps({"people": [{"pose_keypoints_2d": ["a"] * 75}]}),
        json.dumps({"people": [{"pose_keypoints_2d": [float("nan")] * 75}]}),
        json.dumps({"people": [{"pose_keypoints_2d": [0.0] * 75}]}),
        json.dumps({"people": [{"pose_keypoints_2d": [10**400] * 75}]}),
        "[" * 100_000,
    ],
)
def test_malformed_files(data: str) -> None:
    with pytest.raises(InputError, match=r"pose\.json"):
        read_openpose(data, name="pose.json")
