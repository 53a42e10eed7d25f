"""Arms keep out of the trunk."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.animation import RetargetSettings, retarget
from a2v.animation.clearance import arm_depth, clear_arms
from a2v.animation.hands import turn_bones
from a2v.animation.rig import Rig, rig_of
from a2v.animation.smooth_turns import smooth_turns
from a2v.body import load_body_model, make_body
from a2v.kinematics import rotvec_to_rotmat
from a2v.kinematics.skeleton import subtree
from a2v.motion import MotionModel
from a2v.motion.direct import make_motion
from a2v.motion.prompts import Step
from a2v.motion.timeline import Take
from a2v.types import Body
from tests.support.motions import person

FPS = 30.0


@pytest.fixture(scope="module")
def rig(body: Body) -> Rig:
    return rig_of(body)


def swung(body: Body, rig: Rig, side: str, degrees: float, frames: int = 60) -> np.ndarray:
    """Return the body at rest with one arm that swings in by `degrees` in mid-clip."""
    transforms = np.broadcast_to(
        body.rest_transforms.astype(np.float64), (frames, *body.rest_transforms.shape)
    ).copy()
    t = np.arange(frames) / FPS
    angle = (
        np.deg2rad(degrees)
        * np.exp(-(((t - t.mean()) / 0.25) ** 2))
        * (-1 if side == "left" else 1)
    )
    turn_bones(
        transforms,
        subtree(rig.parents, rig.bones[f"{side}_shoulder"]),
        rotvec_to_rotmat(angle[:, None] * np.array([0.0, 0.0, 1.0])),
    )
    return transforms


@pytest.mark.parametrize(("side", "column"), [("left", 0), ("right", 1)])
def test_an_arm_that_swings_into_the_trunk_stays_outside(body, rig, side, column):
    inwards = next(
        angle
        for angle in range(20, 80, 4)
        if arm_depth(swung(body, rig, side, angle), rig)[:, column].max() > 0.05
    )
    before = swung(body, rig, side, inwards)
    after = clear_arms(before, rig, FPS)
    assert arm_depth(after, rig).max() < 0.012
    arm = subtree(rig.parents, rig.bones[f"{side}_shoulder"])
    other = [bone for bone in range(len(rig.parents)) if bone not in arm]
    np.testing.assert_array_equal(after[:, other], before[:, other])
    np.testing.assert_array_equal(after[:5], before[:5])  # long before the arm comes near
    rows = [bone for bone in arm if bone != arm[0]]
    lengths = [
        np.linalg.norm(x[:, rows, :3, 3] - x[:, rig.parents[rows], :3, 3], axis=-1)
        for x in (before, after)
    ]
    np.testing.assert_allclose(*lengths, atol=1e-9)
    wrist = rig.bones[f"{side}_wrist"]
    jerk = [np.abs(np.diff(x[:, wrist, :3, 3], n=2, axis=0)).max() for x in (before, after)]
    assert jerk[1] < 1.5 * jerk[0]  # as smooth as it was


def test_arms_that_are_free_are_not_touched(body, rig):
    still = swung(body, rig, "left", 0.0)
    assert arm_depth(still, rig).max() == 0
    assert clear_arms(still, rig, FPS) is still


def test_an_arm_is_turned_no_farther_than_an_arm_would_give_way(body, rig):
    before = swung(body, rig, "left", 140.0)  # through the whole trunk
    after = clear_arms(before, rig, FPS)
    bone = rig.bones["left_shoulder"]
    turned = after[:, bone, :3, :3] @ np.swapaxes(before[:, bone, :3, :3], 1, 2)
    angle = np.arccos(np.clip((np.trace(turned, axis1=1, axis2=2) - 1) / 2, -1, 1))
    assert 0.1 < angle.max() < 1.21


@pytest.mark.parametrize(("action", "seed"), [("Run", 0), ("Salsa", 0)])
@pytest.mark.parametrize("weight", [0.5, 0.9])
def test_generated_clips_keep_their_arms_out_on_slim_and_broad_people(action, seed, weight):
    broad = make_body(load_body_model(), shape={"weight": weight}, grounded=True)
    own = rig_of(broad)
    motion = make_motion(
        MotionModel.load("cmu-fine"), [Step(action=action)], Take(frames=120, fps=FPS, seed=seed)
    )
    before = retarget(motion, broad, settings=RetargetSettings(clear_arms=False)).astype(np.float64)
    after = clear_arms(before, own, FPS)
    within = [(arm_depth(moves, own).max(axis=1) > 0.02).mean() for moves in (before, after)]
    assert within[0] > 0.1
    assert within[1] <= 0.02
    wrists = [own.bones["left_wrist"], own.bones["right_wrist"]]
    jolts = [
        np.linalg.norm(np.diff(moves[:, wrists][..., :3, 3], n=2, axis=0), axis=-1)
        for moves in (before, after)
    ]
    assert np.quantile(jolts[1], 0.95) < 1.4 * np.quantile(jolts[0], 0.95)


def test_turns_are_the_smallest_that_bring_points_out_and_come_and_go_smoothly():
    slopes, missing = np.zeros((60, 1, 3)), np.full((60, 1), -1.0)
    slopes[28:33, 0, 0], missing[28:33] = (
        0.3,
        0.06,
    )  # a radian about the first axis moves the point by 0.3 m
    turned = smooth_turns(slopes, missing, np.zeros((60, 3)), FPS)
    assert (0.3 * turned[28:33, 0] > 0.055).all()
    assert np.abs(turned[:, 1:]).max() == 0
    assert np.abs(turned[:8, 0]).max() < 0.02
    assert np.abs(np.diff(turned[:, 0], n=2)).max() < 0.03
    out = smooth_turns(slopes, np.where(missing > 0, -0.01, missing), np.zeros((60, 3)), FPS)
    assert np.abs(out).max() == 0  # nothing is missing


def test_motions_are_carried_over_so_and_raw_ones_are_not(body, rig):
    motion = person(frames=12)
    joints = motion.joints.copy()
    names = motion.joint_names
    left = [
        i
        for i, name in enumerate(names)
        if "left" in name.lower()
        and any(part in name.lower() for part in ("elbow", "wrist", "hand"))
    ]
    assert left
    shoulder = next(
        i for i, name in enumerate(names) if "left" in name.lower() and "shoulder" in name.lower()
    )
    for step, joint in enumerate(left, 1):  # the arm hangs, and crosses the trunk
        joints[:, joint] = joints[:, shoulder] + step * np.array([-0.09, -0.24, 0.0], np.float32)
    crossing = dataclasses.replace(motion, joints=joints)
    depth = {
        name: arm_depth(retarget(crossing, body, settings=settings).astype(np.float64), rig)[
            :, 0
        ].max()
        for name, settings in (
            ("clear", RetargetSettings()),
            ("off", RetargetSettings(clear_arms=False)),
            ("raw", RetargetSettings(raw=True)),
        )
    }
    assert depth["off"] > 0.03
    assert depth["raw"] > 0.03
    assert depth["clear"] < 0.4 * depth["off"]
