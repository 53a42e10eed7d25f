"""Fingers and palms."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.animation import RetargetSettings, retarget
from a2v.animation.hands import (
    FINGERS,
    HAND_POSES,
    Hand,
    finger_bones,
    hands_of,
    pose_hands,
    turn_bones,
    turn_palms,
)
from a2v.animation.life import STILL
from a2v.animation.rig import SIDES, Rig, rig_of
from a2v.geometry.vectors import unit
from a2v.kinematics import rotvec_to_rotmat
from a2v.kinematics.skeleton import subtree
from a2v.types import Body
from tests.support.motions import person


@pytest.fixture(scope="module")
def rig(body: Body) -> Rig:
    return rig_of(body)


@pytest.fixture(scope="module")
def still(body: Body) -> np.ndarray:
    return retarget(person(frames=5), body, settings=RetargetSettings(raw=True, life=STILL)).astype(
        np.float64
    )


def in_hand(transforms, rig, hand, points):
    """World points (T, 3) in the hand's frame at rest."""
    turned = transforms[:, hand.wrist, :3, :3] @ rig.rest[hand.wrist].T
    return np.einsum("tba,tb->ta", turned, points - transforms[:, hand.wrist, :3, 3])


def test_fingers_are_found_under_the_names_of_several_rigs(body):
    for side in SIDES:
        fingers = finger_bones(body.bone_names, side)
        assert set(fingers) == set(FINGERS)
        assert all(len(bones) == 3 for bones in fingers.values())
    smpl = [
        f"left_{name}{place}"
        for name in ("index", "middle", "pinky", "ring", "thumb")
        for place in (1, 2, 3)
    ]
    assert finger_bones(smpl, "left")["little"] == [6, 7, 8]
    assert finger_bones(smpl, "right") == {}
    assert finger_bones(
        [f"LeftHand{name}{place}" for name in ("Index", "Pinky") for place in (1, 2, 3, 4)], "left"
    )["index"] == [0, 1, 2]


def test_both_hands_close_towards_their_palms_and_alike(body, rig, still):
    reach = {}
    for pose in HAND_POSES:
        posed = pose_hands(still, rig, body.bone_names, [(pose, pose)])
        for side in SIDES:
            hand = Hand.of(rig, body.bone_names, side)
            tip = in_hand(posed, rig, hand, posed[:, hand.fingers["middle"][2], :3, 3])[0]
            reach[pose, side] = np.array([tip @ hand.along, tip @ hand.palm])
    for side in SIDES:
        order = [
            reach[pose, side][0] for pose in ("flat", "graceful", "relaxed", "hold", "grip", "fist")
        ]
        assert order == sorted(order, reverse=True)  # ever closer to the wrist
        assert (
            reach["grip", side][1] > reach["relaxed", side][1] > reach["flat", side][1]
        )  # ever farther out of the palm
        np.testing.assert_array_equal(
            pose_hands(still, rig, body.bone_names, [("rest", "rest")]), still
        )
    for pose in HAND_POSES:
        np.testing.assert_allclose(reach[pose, "left"], reach[pose, "right"], atol=4e-3)


def test_the_thumb_lies_on_the_index_fingers_side_and_over_a_fist(body, rig, still):
    for side in SIDES:
        hand = Hand.of(rig, body.bone_names, side)
        across = unit(rig.heads[hand.fingers["index"][0]] - rig.heads[hand.fingers["little"][0]])
        tips = {}
        for pose in ("relaxed", "fist"):
            posed = pose_hands(still, rig, body.bone_names, [(pose, pose)])
            bones = hand.fingers["thumb"]
            tips[pose] = unit(
                np.diff(
                    [in_hand(posed, rig, hand, posed[:, bone, :3, 3])[0] for bone in bones], axis=0
                )[1]
            )
        assert tips["relaxed"] @ across > 0.1
        assert tips["fist"] @ across < -0.3
        assert tips["fist"] @ hand.palm > 0.5


def test_bones_keep_their_lengths_and_wrists_their_places(body, rig, still):
    posed = turn_palms(
        pose_hands(still, rig, body.bone_names, [("fist", "hold")]), rig, body.bone_names, 10.0
    )
    rows = np.flatnonzero(rig.parents >= 0)
    lengths = [
        np.linalg.norm(x[:, rows, :3, 3] - x[:, rig.parents[rows], :3, 3], axis=-1)
        for x in (posed, still)
    ]
    np.testing.assert_allclose(*lengths, atol=1e-7)
    for side in SIDES:
        wrist = rig.bones[f"{side}_wrist"]
        assert np.abs(posed[:, wrist, :3, 3] - still[:, wrist, :3, 3]).max() < 4e-3
    arms = {bone for side in SIDES for bone in subtree(rig.parents, rig.chains[f"{side}_elbow"][0])}
    other = [bone for bone in range(len(rig.parents)) if bone not in arms]
    np.testing.assert_array_equal(posed[:, other], still[:, other])


def test_palms_that_face_the_front_come_back_to_the_thighs(body, rig):
    rest = np.broadcast_to(
        body.rest_transforms.astype(np.float64), (9, *body.rest_transforms.shape)
    ).copy()
    shown = {}
    for side in SIDES:  # arms that hang, their palms turned to the front
        hand = Hand.of(rig, body.bone_names, side)
        upper = unit(rig.joints[f"{side}_wrist"] - rig.joints[f"{side}_shoulder"])
        axis = np.cross(upper, [0, -1, 0])
        arm = subtree(rig.parents, rig.bones[f"{side}_shoulder"])
        turn = rotvec_to_rotmat(unit(axis) * np.arcsin(np.linalg.norm(axis)))
        turn_bones(rest, arm, np.broadcast_to(turn, (9, 3, 3)))
        palm = turn @ hand.palm
        front = np.arctan2(np.cross([palm[0], palm[2]], [0.0, 1.0]), palm[2])
        turn_bones(
            rest, arm, np.broadcast_to(rotvec_to_rotmat(np.array([0.0, -front, 0.0])), (9, 3, 3))
        )
        shown[side] = (rest[:, hand.wrist, :3, :3] @ rig.rest[hand.wrist].T @ hand.palm)[0]
        assert shown[side][2] > 0.8
    turned = turn_palms(rest, rig, body.bone_names, 30.0)
    for side in SIDES:
        hand = Hand.of(rig, body.bone_names, side)
        palm = (turned[:, hand.wrist, :3, :3] @ rig.rest[hand.wrist].T @ hand.palm)[4]
        assert palm[2] < 0.2
        assert palm[0] * (-1 if side == "left" else 1) > 0.8


@pytest.mark.parametrize(
    ("action", "poses"),
    [
        ("Walk", ("relaxed", "relaxed")),
        ("boxing_left_right", ("fist", "fist")),
        ("lift_dumbbell_righthand", ("relaxed", "grip")),
        ("phone_call_lefthand", ("hold", "relaxed")),
        ("Wash windows", ("flat", "flat")),
        ("Sweep the floor", ("grip", "grip")),
        ("Ballet", ("graceful", "graceful")),
        ("", ("relaxed", "relaxed")),
    ],
)
def test_hands_suit_the_action(action, poses):
    assert hands_of(action) == poses


def test_a_rig_without_fingers_keeps_its_hands(body, rig, still):
    names = tuple(name.replace("finger", "thing") for name in body.bone_names)
    np.testing.assert_array_equal(pose_hands(still, rig, names, [("fist", "fist")]), still)
    np.testing.assert_array_equal(turn_palms(still, rig, names, 10.0), still)


def test_hands_go_from_one_actions_pose_to_the_next_ones(body, rig):
    motion = dataclasses.replace(
        person(frames=40),
        action="Walk,Sweep the floor,Macho",
        action_starts=np.array([0.0, 1.0, 2.5]),
    )
    single = [
        dataclasses.replace(person(frames=40), action=name) for name in motion.action.split(",")
    ]
    made = retarget(motion, body)
    assert motion.fps == 10
    for own, frames in zip(
        single, (slice(0, 6), slice(13, 21), slice(28, 40)), strict=True
    ):  # away from the changes; the gaze of one action fades a little farther into the next
        np.testing.assert_allclose(made[frames], retarget(own, body)[frames], atol=5e-3)
    knuckle = rig.bones["left_wrist"], Hand.of(rig, body.bone_names, "left").fingers["middle"][1]
    bend = np.linalg.norm(made[:, knuckle[0], :3, 3] - made[:, knuckle[1], :3, 3], axis=-1)
    assert np.abs(np.diff(bend)).max() < 0.5 * np.ptp(bend)  # continuous
    unknown = retarget(dataclasses.replace(motion, action_starts=None), body)
    np.testing.assert_allclose(unknown[28:], retarget(single[0], body)[28:], atol=2e-5)  # relaxed
