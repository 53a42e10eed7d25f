"""The bank of poses and draws from it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.kinematics import rotvec_to_rotmat
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.posing import POSED_BONES
from a2v.lab.studio.quick.bank import PoseBank, joint_places, make_pose_bank, sort_poses
from a2v.lab.studio.quick.poses import draw_pose
from a2v.lab.studio.quick.settings import QuickSettings


@pytest.fixture(scope="session")
def bank(avatar: Avatar, data: Path) -> PoseBank:
    return make_pose_bank(avatar, data, clips=11, step=4)


def test_rare_poses_are_drawn_as_often_as_common_ones(avatar: Avatar) -> None:
    """Ninety-nine frames of standing and one with a raised leg."""
    rotations = np.zeros((100, len(POSED_BONES), 3), np.float16)
    rotations[:, POSED_BONES.index("Head"), 1] = np.linspace(0, 1e-2, 100)
    rotations[40, POSED_BONES.index("LeftUpLeg"), 0] = -1.5
    none = np.zeros(100, np.int8)
    kinds = sort_poses(avatar, rotations, none)
    assert kinds[40] != kinds[41]
    # all standing frames count as one kind
    bank = PoseBank(
        rotations=rotations, sets=none, splits=none, kinds=(kinds == kinds[40]).astype(np.int16)
    )

    def share(common: float) -> float:
        generator = np.random.default_rng(0)
        return float(
            np.mean(
                [bank.draw("training", generator, common)["LeftUpLeg"][0] < -1 for _ in range(400)]
            )
        )

    assert share(0.0) == pytest.approx(0.5, abs=0.08)
    assert share(1.0) < 0.04
    with pytest.raises(InputError, match="no poses of the split 'validation'"):
        bank.draw("validation", np.random.default_rng(0), 0.5)


def test_kinds_are_of_where_the_joints_are(avatar: Avatar, bank: PoseBank) -> None:
    pose = bank.draw("training", np.random.default_rng(3), 0.5)
    transforms = avatar.bone_transforms(pose)
    heads = {
        name: transforms[avatar.bone_names.index(name), :3, 3]
        for name in ("Head", "LeftUpLeg", "RightUpLeg")
    }
    found = joint_places(avatar, np.stack([pose[name] for name in POSED_BONES])[None])[0].reshape(
        -1, 3
    )
    np.testing.assert_allclose(
        found[0], heads["Head"] - (heads["LeftUpLeg"] + heads["RightUpLeg"]) / 2, atol=1e-5
    )


def test_held_out_clips_stay_apart(bank: PoseBank) -> None:
    """Of the first eleven clips the tenth is held out: only the other split draws its frames."""
    assert 0 < bank.splits.sum() < len(bank.splits) / 2
    own = {bank.rotations[index].tobytes() for index in np.flatnonzero(bank.splits)}
    generator = np.random.default_rng(0)
    for split, inside in (("validation", True), ("training", False)):
        for _ in range(30):
            pose = bank.draw(split, generator, 0.5)
            drawn = np.stack([pose[name] for name in POSED_BONES]).astype(np.float16)
            assert (drawn.tobytes() in own) is inside


def test_poses_have_no_heading_and_repeat(bank: PoseBank) -> None:
    settings = QuickSettings()
    first, second = (
        [draw_pose(bank, "training", settings, g) for _ in range(40)]
        for g in map(np.random.default_rng, (1, 1))
    )
    for one, other in zip(first, second, strict=True):
        assert set(POSED_BONES) <= set(one)
        assert all(np.array_equal(one[name], other[name]) for name in one)
        forward = rotvec_to_rotmat(one["Hips"])[:, 2]
        assert abs(np.arctan2(forward[0], forward[2])) < np.radians(20) or abs(forward[1]) > 0.8


def test_free_limbs_reach_where_recorded_ones_do_not(bank: PoseBank) -> None:
    def widest(free: float) -> float:
        settings = replace(
            QuickSettings(), natural=0.0, open=0.0, limbs=0.0, bent=0.0, curled=0.0, free=free
        )
        generator = np.random.default_rng(2)
        return float(
            np.std(
                [draw_pose(bank, "training", settings, generator)["LeftUpLeg"] for _ in range(60)],
                axis=0,
            ).max()
        )

    assert widest(1.0) > 1.5 * widest(0.0)
