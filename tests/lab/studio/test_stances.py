"""Poses composed by rule."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.settings import StudioSettings
from a2v.lab.studio.stances import STANCES, draw_stance
from a2v.lab.studio.studio import Studio
from a2v.types import FloatArray


def joints(avatar: Avatar, name: str, seed: int) -> dict[str, FloatArray]:
    pose, _ = draw_stance(name, np.random.default_rng(seed))
    transforms = avatar.bone_transforms(pose)
    return dict(zip(avatar.bone_names, transforms[:, :3, 3], strict=True))


@pytest.mark.parametrize("seed", range(4))
def test_stances_are_what_they_are_called(avatar: Avatar, seed: int) -> None:
    stand, squat, sit = (joints(avatar, name, seed) for name in ("standing", "squat", "sit"))
    for side in ("Left", "Right"):
        tall = stand["Hips"][1] - stand[f"{side}Foot"][1]
        assert squat["Hips"][1] - squat[f"{side}Foot"][1] < 0.85 * tall
        assert sit[f"{side}Leg"][2] > sit["Hips"][2] + 0.25  # knees before the hips
        assert sit[f"{side}Foot"][1] < sit[f"{side}Leg"][1] - 0.15
    stoop = joints(avatar, "stoop", seed)
    trunk = stoop["Neck"] - stoop["Hips"]
    assert trunk[2] > 0.5 * np.linalg.norm(trunk)
    assert stoop["LeftHand"][1] < stoop["LeftArm"][1]  # arms hang
    kick = joints(avatar, "kick", seed)
    assert (
        np.linalg.norm((kick["LeftFoot"] - kick["RightFoot"])[1:]) > 0.3
    )  # one foot before the other and higher
    assert abs(kick["LeftFoot"][1] - kick["RightFoot"][1]) > 0.1
    spread = joints(avatar, "spread", seed)
    assert spread["LeftFoot"][0] - spread["RightFoot"][0] > 0.4
    assert 65 <= abs(draw_stance("profile", np.random.default_rng(seed))[1]) <= 115


def test_the_same_number_gives_the_same_photo_whoever_else_is_there(studio: Studio) -> None:
    assert set(STANCES) == {"standing", "run", "kick", "squat", "sit", "stoop", "profile", "spread"}
    first, again = (
        studio.scene("validation", 77, avatar="Asian_F_2_Busi", stance="run") for _ in range(2)
    )
    assert np.array_equal(first.surface.vertices, again.surface.vertices)
    assert (first.avatar, first.pose) == ("Asian_F_2_Busi", "run")
    assert first.pose != studio.scene("validation", 77, avatar="Asian_F_2_Busi").pose


def test_an_old_pin_is_what_it_was(studio: Studio, data: Path) -> None:
    """Two photos of the first panels, by the numbers that they gave when these were made."""
    plain = Studio(data / "avatars", studio.library, studio.guides, StudioSettings())
    first = plain.scene("validation", 36, avatar="Asian_F_2_Busi")
    acting = plain.scene("validation", 10000, avatar="Asian_F_2_Busi", stance="run")
    made = first.surface.provenance
    assert (first.pose, acting.pose) == ("open", "run")
    wide, tall, _ = np.ptp(acting.surface.vertices, axis=0)
    # camera_distance is in the scene's own unit, which the guide's error scales (4.759665 m by
    # .952391)
    told = (
        first.yaw,
        made["camera_height"],
        made["camera_distance"],
        acting.yaw,
        float(wide / tall),
    )
    assert told == pytest.approx((7.863627, 1.887709, 4.533063, -17.471598, 0.464476), abs=1e-5)
