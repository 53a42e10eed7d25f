"""Gaze, breath and sway."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.animation import LifeSettings, RetargetSettings, retarget
from a2v.animation.life import STILL
from a2v.animation.rig import SIDES, joints_of, rig_of
from a2v.errors import InputError
from a2v.kinematics import rotvec_to_rotmat
from a2v.motion.edit import Edit
from a2v.motion.on_rig import retarget_edited
from a2v.types import Body
from tests.support.motions import person


def moved(body: Body, motion, **life) -> np.ndarray:
    return retarget(motion, body, settings=RetargetSettings(life=LifeSettings(**life)))


def face(transforms, body, degrees=True):
    rig = rig_of(body)
    head = rig.bones["head"]
    front = transforms[:, head, :3, :3] @ rig.rest[head].T @ np.array([0.0, 0.0, 1.0])
    return np.degrees(np.arctan2(front[:, 0], front[:, 2])), np.degrees(np.arcsin(front[:, 1]))


def turning(frames=60, fps=20.0, degrees=90.0):
    """A person who walks a quarter of a circle."""
    base = person(frames=frames, step=0.0)
    angle = np.deg2rad(degrees) * np.clip((np.arange(frames) - 20) / 20, 0, 1)
    turn = rotvec_to_rotmat(np.stack([0 * angle, angle, 0 * angle], -1))
    path = np.cumsum(np.stack([np.sin(angle), 0 * angle, np.cos(angle)], -1) * 1.2 / fps, axis=0)
    local = base.joints - base.joints[:, :1] * [1, 0, 1]
    joints = (np.einsum("tab,tjb->tja", turn, local) + path[:, None]).astype(np.float32)
    return dataclasses.replace(base, joints=joints, root=joints[:, 0], fps=fps)


def test_the_head_turns_before_the_body_and_ends_where_it_goes(body):
    motion = turning()
    plain, looking = (face(moved(body, motion, gaze=gaze), body)[0] for gaze in (0, 1))
    half = [int(np.argmax(yaw > 45)) for yaw in (plain, looking)]
    assert 2 <= half[0] - half[1] <= 12  # frames of a twentieth of a second
    assert abs(looking[-1] - 90) < 8
    assert np.abs(looking - plain).max() < 50


def test_a_gaze_that_lies_in_the_clouds_comes_down_to_the_horizon(body):
    motion = person(frames=40, step=0.05)
    joints = motion.joints.copy()
    head = motion.joint_names.index("head") if "head" in motion.joint_names else None
    assert head is not None
    joints[:, head, 2] -= 0.12  # the head lies back
    back = dataclasses.replace(motion, joints=joints)
    plain, looking = (face(moved(body, back, gaze=gaze), body)[1] for gaze in (0, 1))
    assert plain.mean() > 10
    assert -16 < looking.mean() < 6


def test_breath_moves_the_chest_and_leaves_hips_feet_and_gaze(body):
    motion = dataclasses.replace(person(frames=81, step=0.0), fps=20.0)
    settings = {"sway": 0.0, "gaze": 0.0, "palms": False, "hands": "rest"}
    plain, breathing = (
        moved(body, motion, breath=0.0, **settings),
        moved(body, motion, breath=1.0, **settings),
    )
    rig = rig_of(body)
    before, after = joints_of(plain, rig), joints_of(breathing, rig)
    for name in ("left_hip", "left_ankle", "right_foot"):
        np.testing.assert_array_equal(before[name], after[name])
    rise = after["left_shoulder"][:, 1] - before["left_shoulder"][:, 1]
    assert 0.001 < np.ptp(rise) < 0.01
    assert int(np.argmax(rise)) == pytest.approx(
        0.42 * 80, abs=2
    )  # four seconds a breath, in for less than half of them
    assert rise[0] == pytest.approx(rise[80], abs=1e-6)
    assert np.abs(face(plain, body)[1] - face(breathing, body)[1]).max() < 0.1


def test_who_stands_sways_over_feet_that_stay_and_who_walks_does_not(body):
    still = dataclasses.replace(person(frames=100, step=0.0), fps=20.0)
    rig = rig_of(body)
    plain, swaying = (
        joints_of(moved(body, still, sway=sway, breath=0.0), rig) for sway in (0.0, 1.0)
    )
    shift = swaying["pelvis"] - plain["pelvis"]
    assert 0.004 < np.abs(shift[:, [0, 2]]).max() < 0.03
    for side in SIDES:
        assert np.linalg.norm(np.diff(swaying[f"{side}_ankle"], axis=0), axis=-1).max() < 5e-4
    again = joints_of(moved(body, still, sway=1.0, breath=0.0), rig)
    np.testing.assert_array_equal(again["pelvis"], swaying["pelvis"])
    other = joints_of(moved(body, still, sway=1.0, breath=0.0, seed=1), rig)
    assert np.abs(other["pelvis"] - swaying["pelvis"]).max() > 1e-3
    walk = dataclasses.replace(person(frames=60, step=0.06), fps=20.0)
    a, b = (
        joints_of(moved(body, walk, sway=sway, breath=0.0), rig)["pelvis"] for sway in (0.0, 1.0)
    )
    np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("seconds", [1.0, 3.0, 9.0])
def test_a_cycle_closes_with_breath_and_sway(body, seconds):
    motion = dataclasses.replace(person(frames=round(20 * seconds), step=0.0), fps=20.0)
    moves = retarget_edited(motion, body, Edit(loop=True))
    steps = np.linalg.norm(
        np.diff(np.concatenate([moves, moves[:1]])[..., :3, 3], axis=0), axis=-1
    ).max(axis=1)
    assert steps[-1] <= 1.5 * max(steps[:-1].max(), 1e-5)


def test_nothing_is_added_when_nothing_is_asked_for(body):
    motion = person(frames=10, step=0.05)
    a = retarget(motion, body, settings=RetargetSettings(life=STILL))
    b = retarget(motion, body)
    assert np.abs(a - b).max() > 0.01
    np.testing.assert_array_equal(a, retarget(motion, body, settings=RetargetSettings(life=STILL)))


@pytest.mark.parametrize(
    "wrong", [{"hands": "claw"}, {"gaze": -1.0}, {"breath": 9.0}, {"cycle": -1.0}]
)
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(InputError):
        LifeSettings(**wrong)
