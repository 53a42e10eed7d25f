from __future__ import annotations

import dataclasses
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from a2v import Body, InputError, Motion
from a2v.animation import RetargetSettings, retarget, rig_motion
from a2v.animation.contacts import find_contacts
from a2v.animation.posture import knee_bend, lean_of, standing_posture, straightened
from a2v.animation.rig import SIDES, joints_of, place, rig_of
from a2v.animation.source import heading_rotmat, source_joints, source_leg_length
from a2v.body import load_body_model, make_body
from a2v.formats import read_motion
from a2v.formats.bvh import read_bvh, write_bvh
from a2v.kinematics import CMU, HUMANACT12, Skeleton, rotvec_to_rotmat
from a2v.kinematics.resample import resample_motion
from a2v.lab.evaluation.physics import jitter
from a2v.lab.evaluation.retargeting import measure_retargeting
from tests.support.motions import clip

LIMB_BONES = [("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist")]
RAW = RetargetSettings(raw=True, smoothing=0.0)


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def rest_motion(body: Body, frames: int = 8) -> Motion:
    """HumanAct12's joints put on the rig's own rest pose."""
    rig = rig_of(body)
    joints = np.zeros((24, 3))
    spine = rig.chains["spine"]
    extra = {
        "pelvis": rig.middle("hip"),
        "spine1": rig.heads[spine[1]],
        "spine2": rig.heads[spine[3]],
        "spine3": rig.heads[spine[4]],
    }
    for index, name in enumerate(HUMANACT12.joint_names):
        joints[index] = extra.get(name, rig.joints.get(name, np.zeros(3)))
    return clip(np.tile(joints, (frames, 1, 1)), HUMANACT12, 20.0)


def feet(transforms: np.ndarray, body: Body) -> np.ndarray:
    joints = joints_of(transforms.astype(np.float64), rig_of(body))
    return np.stack(
        [joints[f"{side}_{name}"] for side in SIDES for name in ("ankle", "foot")], axis=1
    )


def depth(transforms: np.ndarray, body: Body) -> np.ndarray:
    """Return the depth (T,) below the ground of points all over the skin, meters."""
    return np.maximum(-place(rig_of(body).skin, transforms.astype(np.float64))[..., 1].min(-1), 0)


def test_rest_pose_stays_the_rest_pose(body: Body) -> None:
    result = retarget(rest_motion(body), body, settings=RAW)
    turns = result[:, :, :3, :3] @ np.swapaxes(body.rest_transforms[:, :3, :3], 1, 2)
    angle = np.degrees(np.arccos(np.clip((np.trace(turns, axis1=-2, axis2=-1) - 1) / 2, -1, 1)))
    names = np.array(body.bone_names)
    limbs = [
        i
        for i, name in enumerate(names)
        if name.startswith(("root", "spine", "upper", "lower", "clavicle", "wrist"))
    ]
    worst = limbs[int(angle[0, limbs].argmax())]
    assert angle[0, worst] < 12, names[worst]


def test_transforms_are_rigid_and_keep_bone_lengths(body: Body, cartwheel: Path) -> None:
    result = retarget(read_motion(cartwheel, fps=20), body).astype(np.float64)
    turns = result[..., :3, :3]
    np.testing.assert_allclose(
        turns @ np.swapaxes(turns, -1, -2), np.broadcast_to(np.eye(3), turns.shape), atol=1e-5
    )
    parents = body.bone_parents
    lengths = np.linalg.norm(result[:, 1:, :3, 3] - result[..., :3, 3][:, parents[1:]], axis=-1)
    rest = np.linalg.norm(
        body.rest_transforms[1:, :3, 3] - body.rest_transforms[parents[1:], :3, 3], axis=-1
    )
    np.testing.assert_allclose(lengths, np.broadcast_to(rest, lengths.shape), atol=1e-4)


def test_raw_limbs_point_where_the_motion_points(body: Body, cartwheel: Path) -> None:
    motion = read_motion(cartwheel, fps=20)
    joints = joints_of(retarget(motion, body, settings=RAW).astype(np.float64), rig_of(body))
    source = straightened(source_joints(motion), standing_posture(motion), rig_of(body))
    turn = heading_rotmat(source)
    for side in SIDES:
        for a, b in LIMB_BONES:
            wanted = unit(source[f"{side}_{b}"] - source[f"{side}_{a}"]) @ turn.T
            got = unit(joints[f"{side}_{b}"] - joints[f"{side}_{a}"])
            assert np.degrees(np.arccos(np.clip((wanted * got).sum(-1), -1, 1))).max() < 2.5, (
                side,
                a,
            )


@pytest.mark.parametrize("name", ["humanact12", "cmu"])
def test_real_clips(body: Body, real_clips: Callable[[str, int], list[Motion]], name: str) -> None:
    rows, shake = [], []
    for motion in real_clips(name, 8):
        quality = measure_retargeting(
            motion, body, retarget(motion, body, settings=RetargetSettings(level="never"))
        )
        result = retarget(motion, body)
        levelled = measure_retargeting(motion, body, result)
        rows.append(
            [
                quality.error,
                max(quality.skating, levelled.skating),
                max(quality.penetration, levelled.penetration),
            ]
        )
        scale = rig_of(body).leg_length / source_leg_length(source_joints(motion))
        arms = ("left_wrist", "right_wrist", "left_elbow", "right_elbow")
        ours, theirs = joints_of(result.astype(np.float64), rig_of(body)), source_joints(motion)
        shake.append(
            [
                jitter(np.stack([j[n] for n in arms], 1), motion.fps)
                for j in (ours, {n: theirs[n] * scale for n in arms})
            ]
        )
    error, skating, sunk = np.mean(rows, axis=0)
    assert error <= 0.02
    assert skating <= 0.05
    assert sunk <= 0.005
    assert np.mean(shake, axis=0)[0] <= 1.25 * np.mean(shake, axis=0)[1]


def standing(
    body: Body, skeleton: Skeleton, *, knee: float, lean: float, dip: float, frames: int = 24
) -> Motion:
    """Return the rig's rest pose on a skeleton whose upright people bend knees, back and feet.

    The bends are given in degrees.
    """
    rig = rig_of(body)
    hips = rig.middle("hip")
    at = {name: point - hips for name, point in rig.joints.items()}

    def turned(
        vector: np.ndarray, degrees: float
    ) -> np.ndarray:  # positive: a raised vector leans forward
        return rotvec_to_rotmat(np.deg2rad(np.array([degrees, 0.0, 0.0]))) @ vector

    joints = dict(at)
    shoulders = 0.5 * (at["left_shoulder"] + at["right_shoulder"])
    tilted = turned(shoulders, lean - lean_of(shoulders))
    for name in (
        "neck",
        "head",
        *(
            f"{side}_{joint}"
            for side in SIDES
            for joint in ("shoulder", "collar", "elbow", "wrist", "hand")
        ),
    ):
        if name in at:
            joints[name] = at[name] + tilted - shoulders
    for side in SIDES:
        shin, foot = (
            at[f"{side}_ankle"] - at[f"{side}_knee"],
            at[f"{side}_foot"] - at[f"{side}_ankle"],
        )
        joints[f"{side}_ankle"] = at[f"{side}_knee"] + turned(
            shin, knee - np.degrees(knee_bend(at, side))
        )
        joints[f"{side}_foot"] = joints[f"{side}_ankle"] + turned(
            foot, -dip + np.degrees(np.arcsin(unit(foot)[1]))
        )
    for place_of, name in ((0.5, "spine"), (0.25, "spine1"), (0.5, "spine2"), (0.75, "spine3")):
        joints[name] = tilted * place_of
    joints["pelvis"] = np.zeros(3)
    points = np.stack([joints[name] for name in skeleton.joint_names]) + hips
    return clip(np.tile(points, (frames, 1, 1)), skeleton, 20.0)


def check_stands(result: np.ndarray, body: Body, *, flat: float = 3.0) -> None:
    """Upright back, straight knees, flat soles, as the body at rest."""
    rig = rig_of(body)
    joints = {
        name: points[len(result) // 2]
        for name, points in joints_of(result.astype(np.float64), rig).items()
    }
    back, rest = (
        0.5 * (j["left_shoulder"] + j["right_shoulder"] - j["left_hip"] - j["right_hip"])
        for j in (joints, rig.joints)
    )
    assert lean_of(back) == pytest.approx(lean_of(rest), abs=3)
    for side in SIDES:
        assert np.degrees(knee_bend(joints, side)) == pytest.approx(
            np.degrees(knee_bend(rig.joints, side)), abs=7
        )
        foot = rig.bones[f"{side}_ankle"]
        assert sole_tilt(result, body, foot).max() < flat


def sole_tilt(transforms: np.ndarray, body: Body, foot: int) -> np.ndarray:
    """Angle (T,) in degrees of a sole, flat at rest, against the ground."""
    up = (transforms[:, foot, :3, :3] @ body.rest_transforms[foot, :3, :3].T)[:, 1, 1]
    return np.degrees(np.arccos(np.clip(up, -1, 1)))


# knees, backs and feet of people who stand upright: the data sets' medians, then skeletons of
# single subjects
@pytest.mark.parametrize(
    ("knee", "lean", "dip"), [(17.0, 1.0, -39.0), (20.0, -2.0, -12.0), (20.0, -2.0, 3.0)]
)
@pytest.mark.parametrize("raw", [True, False])
def test_who_stands_in_the_data_stands_in_the_body(
    body: Body, knee: float, lean: float, dip: float, raw: bool
) -> None:
    motion = standing(body, HUMANACT12 if dip < -30 else CMU, knee=knee, lean=lean, dip=dip)
    check_stands(
        retarget(motion, body, settings=RetargetSettings(raw=raw, level="never")),
        body,
        flat=6 if raw else 3,
    )


def test_feet_stay_as_far_apart_on_wider_hips(body: Body) -> None:
    motion = standing(body, CMU, knee=8.0, lean=2.0, dip=-19.0)
    joints = motion.joints.astype(np.float64).copy()
    for side, sign in (("left", -1), ("right", 1)):
        for name in ("hip", "knee", "ankle", "foot"):
            joints[:, CMU.index(f"{side}_{name}"), 0] += (
                sign * 0.035
            )  # hips narrower by 7 cm, as HumanAct12's are
    result = joints_of(
        retarget(clip(joints, CMU, 20.0), body, settings=RAW).astype(np.float64), rig_of(body)
    )
    gap = joints[0, CMU.index("left_ankle"), 0] - joints[0, CMU.index("right_ankle"), 0]
    assert (result["left_ankle"] - result["right_ankle"])[0, 0] == pytest.approx(gap, abs=0.015)
    assert (result["left_hip"] - result["right_hip"])[0, 0] > joints[
        0, CMU.index("left_hip"), 0
    ] * 2 + 0.05


def test_who_stands_in_a_bvh_file_stands_in_the_body(body: Body, tmp_path: Path) -> None:
    # a skeleton whose rest pose leans back by 9 degrees, as those of CMU's BVH files do
    motion = standing(body, CMU, knee=9.0, lean=-9.0, dip=-14.0)
    offsets = motion.joints[0] - motion.joints[0, np.maximum(motion.parents, 0)]
    rested = dataclasses.replace(motion, skeleton="custom", rest_offsets=offsets.astype(np.float64))
    assert standing_posture(rested).lean == pytest.approx(-9, abs=0.5)
    check_stands(retarget(rested, body), body)
    write_bvh(tmp_path / "standing.bvh", rested)
    check_stands(retarget(read_bvh(tmp_path / "standing.bvh"), body), body)


@pytest.mark.parametrize("name", ["humanact12", "cmu", "bvh"])
def test_feet_that_rest_on_the_ground_are_flat(
    body: Body,
    real_clips: Callable[[str, int], list[Motion]],
    data_dir: Path,
    tmp_path: Path,
    name: str,
) -> None:
    if name == "bvh":
        with zipfile.ZipFile(data_dir / "cmu_bvh.zip") as archive:
            clips = [
                resample_motion(read_bvh(archive.extract(f"cmu_bvh/{file}.bvh", tmp_path)), 30)
                for file in ("02/02_01", "08/08_02")
            ]
    else:
        clips = real_clips(name, 8)
    tilts = []
    for motion in clips:
        result = retarget(motion, body)
        joints = joints_of(result.astype(np.float64), rig_of(body))
        for side in SIDES:
            speed = (
                np.linalg.norm(np.gradient(joints[f"{side}_ankle"], axis=0), axis=-1) * motion.fps
            )
            ankle = joints[f"{side}_ankle"][:, 1]
            stands = (speed < 0.1) & (ankle < ankle.min() + 0.02)
            tilts.extend(sole_tilt(result, body, rig_of(body).bones[f"{side}_ankle"])[stands])
    assert len(tilts) > 20
    assert np.median(tilts) < 6
    assert np.quantile(tilts, 0.9) < 20


def test_a_root_that_drifts_up_comes_back_to_the_ground(
    body: Body, real_clips: Callable[[str, int], list[Motion]]
) -> None:
    motion = next(
        motion
        for motion in real_clips("cmu", 40)
        if motion.action == "Walk" and len(motion.joints) >= 40
    )
    rise = np.linspace(0, 0.8, len(motion.joints))[:, None] * np.array([0.0, 1, 0])
    risen = dataclasses.replace(
        motion,
        joints=(motion.joints + rise[:, None]).astype(np.float32),
        root=(motion.root + rise).astype(np.float32),
    )
    lowest = [
        place(rig_of(body).skin, retarget(m, body).astype(np.float64))[..., 1].min(-1)
        for m in (motion, risen)
    ]
    assert lowest[1].max() < max(0.05, lowest[0].max() + 0.02)


def test_clean_feet_stand_and_raw_feet_do_not(body: Body) -> None:
    # A person who is carried sideways while standing: feet slide by 0.3 m/s and sink by 4 cm for a
    # moment.
    motion = rest_motion(body, 40)
    slide = np.linspace(0, 0.6, 40)[:, None, None] * np.array([1.0, 0, 0]) - 0.04 * np.exp(
        -(((np.arange(40) - 20) / 2) ** 2)
    )[:, None, None] * [0, 1, 0]
    motion = dataclasses.replace(
        motion,
        joints=(motion.joints + slide).astype(np.float32),
        root=(motion.root + slide[:, 0]).astype(np.float32),
    )
    raw, clean = retarget(motion, body, settings=RetargetSettings(raw=True)), retarget(motion, body)
    path = [
        np.linalg.norm(np.diff(feet(r, body)[..., ::2], axis=0), axis=-1).sum(0).max()
        for r in (raw, clean)
    ]
    assert path[0] > 0.5
    assert path[1] < 0.1 * path[0]
    assert depth(raw, body).max() > 0.01
    assert depth(clean, body).max() < 0.005


def test_root_path_scales_with_the_legs(body: Body, data_dir: Path) -> None:
    motion = read_motion(data_dir / "motions" / "humanoid3d_run.txt")
    tall = make_body(load_body_model(), shape={"height": 0.6}, grounded=True)
    way = [retarget(motion, b)[-1, 0, 2, 3] - retarget(motion, b)[0, 0, 2, 3] for b in (body, tall)]
    legs = [rig_of(b).leg_length for b in (body, tall)]
    assert way[0] > 1
    assert way[1] / way[0] == pytest.approx(legs[1] / legs[0], rel=0.05)
    assert legs[1] > 1.03 * legs[0]


def test_arm_through_straight_does_not_flip(body: Body) -> None:
    # the elbow unbends completely and bends again while the arm swings: the twist must not jump
    motion = rest_motion(body, 41)
    joints = motion.joints.astype(np.float64).copy()
    index = HUMANACT12.index
    shoulder = joints[:, index("left_shoulder")]
    swing = np.linspace(-0.9, 0.9, 41)
    bend = 1.2 * np.abs(np.linspace(-1, 1, 41))
    upper = np.stack([np.cos(swing), np.zeros(41), np.sin(swing)], -1)
    fore = np.stack([np.cos(swing + bend), np.zeros(41), np.sin(swing + bend)], -1)
    joints[:, index("left_elbow")] = shoulder + 0.28 * upper
    joints[:, index("left_wrist")] = joints[:, index("left_elbow")] + 0.25 * fore
    joints[:, index("left_hand")] = joints[:, index("left_wrist")] + 0.08 * fore
    result = retarget(clip(joints, HUMANACT12, 20.0), body, settings=RAW)
    for name in ("upperarm01.L", "upperarm02.L", "lowerarm01.L", "wrist.L"):
        turns = result[:, body.bone_names.index(name), :3, :3]
        step = np.swapaxes(turns[:-1], 1, 2) @ turns[1:]
        angle = np.degrees(np.arccos(np.clip((np.trace(step, axis1=1, axis2=2) - 1) / 2, -1, 1)))
        assert angle.max() < 15, name


def test_left_is_left(body: Body) -> None:
    motion = rest_motion(body, 5)
    joints = motion.joints.copy()
    for name in ("left_elbow", "left_wrist", "left_hand"):
        joints[:, HUMANACT12.index(name)] = joints[:, HUMANACT12.index("left_shoulder")] + [
            0,
            0.28 + 0.1 * ("elbow" not in name),
            0,
        ]
    result = joints_of(
        retarget(clip(joints, HUMANACT12, 20.0), body, settings=RAW).astype(np.float64),
        rig_of(body),
    )
    assert result["left_elbow"][0, 1] > result["left_shoulder"][0, 1] + 0.2
    assert result["right_elbow"][0, 1] < result["right_shoulder"][0, 1]
    assert result["left_hip"][0, 0] > result["right_hip"][0, 0]


def test_unaligned_motion_keeps_its_heading(body: Body) -> None:
    motion = rest_motion(body, 3)
    turn = rotvec_to_rotmat(np.array([0, 1.0, 0]))
    turned = clip(motion.joints.astype(np.float64) @ turn.T + [2, 0, 1], HUMANACT12, 20.0)
    free = retarget(turned, body, settings=dataclasses.replace(RAW, align=False))
    held = retarget(turned, body, settings=RAW)
    np.testing.assert_allclose(free[0, 0, :3, :3], turn @ held[0, 0, :3, :3], atol=1e-4)
    assert np.hypot(*held[0, 0, [0, 2], 3]) < 0.1 < np.hypot(*free[0, 0, [0, 2], 3])


def test_tilted_cameras_are_levelled(body: Body) -> None:
    motion = rest_motion(body, 20)
    tilt = rotvec_to_rotmat(np.array([0.2, 0, 0.1]))
    tilted = clip(motion.joints.astype(np.float64) @ tilt.T, HUMANACT12, 20.0)
    pelvis = [
        retarget(m, body, settings=dataclasses.replace(RAW, level=level))[0, 0, :3, 1]
        for m, level in ((motion, "never"), (tilted, "never"), (tilted, "auto"))
    ]
    assert np.degrees(np.arccos(pelvis[1] @ pelvis[0])) > 10
    assert np.degrees(np.arccos(min(1.0, pelvis[2] @ pelvis[0]))) < 6


def test_contacts_need_low_and_slow_and_keep_hold() -> None:
    fps = 20.0
    height = np.array([0.2, 0.1, 0.03, 0.02, 0.06, 0.02, 0.02, 0.1, 0.2, 0.02, 0.02, 0.02])
    x = np.array([0, 0.1, 0.2, 0.2, 0.2, 0.2, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7])
    points = np.stack([x, height, np.zeros(12)], -1)
    on = find_contacts(height, points, fps)
    assert on[3:7].all()  # the rise to 6 cm in between does not end the contact
    assert not on[[0, 1, 7, 8]].any()
    assert not on[9:].any()  # low but fast


def test_rig_motion_round_trips_through_bvh(body: Body, cartwheel: Path, tmp_path: Path) -> None:
    transforms = retarget(read_motion(cartwheel, fps=20), body)
    motion = rig_motion(transforms, body, 20.0)
    np.testing.assert_array_equal(motion.joints, transforms[..., :3, 3])
    write_bvh(tmp_path / "m.bvh", motion)
    text = (tmp_path / "m.bvh").read_text()
    assert text.count("JOINT") + 1 == len(body.bone_names)  # the rig's own bones, no helpers
    back = read_bvh(tmp_path / "m.bvh")
    which = [motion.joint_names.index(name) for name in back.joint_names]
    np.testing.assert_allclose(back.joints, motion.joints[:, which], atol=1e-4)


def test_bad_input(body: Body) -> None:
    motion = rest_motion(body)
    batch = dataclasses.replace(
        motion, joints=motion.joints[None], rotations=motion.rotations[None], root=motion.root[None]
    )
    with pytest.raises(InputError, match="batch"):
        retarget(batch, body)
    names = tuple(name.replace("knee", "blob") for name in motion.joint_names)
    with pytest.raises(InputError, match="left_knee"):
        retarget(dataclasses.replace(motion, joint_names=names, skeleton="custom"), body)
    with pytest.raises(InputError, match="no length"):
        retarget(dataclasses.replace(motion, joints=np.zeros_like(motion.joints)), body)
    one = dataclasses.replace(
        motion, joints=motion.joints[:1], rotations=motion.rotations[:1], root=motion.root[:1]
    )
    assert np.isfinite(retarget(one, body)).all()
