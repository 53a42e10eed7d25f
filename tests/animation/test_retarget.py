from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from a2v import Body, InputError, Motion
from a2v.animation import RetargetSettings, read_bvh, read_motion, retarget, rig_motion, write_bvh
from a2v.animation.contacts import find_contacts
from a2v.animation.retarget import source_joints, source_leg_length
from a2v.animation.rig import SIDES, joints_of, place, rig_of
from a2v.body import load_body_model, make_body
from a2v.evaluation.physics import foot_skating, jitter
from a2v.kinematics import HUMANACT12, rotvec_to_rotmat

from .conftest import clip

LIMBS = [("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist")]
RAW = RetargetSettings(raw=True, smoothing=0.0)


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def rest_motion(body: Body, frames: int = 8) -> Motion:
    """HumanAct12's joints put on the rig's own rest pose."""
    rig = rig_of(body)
    joints = np.zeros((24, 3))
    spine = rig.chains["spine"]
    extra = {"pelvis": rig.middle("hip"), "spine1": rig.heads[spine[1]], "spine2": rig.heads[spine[3]], "spine3": rig.heads[spine[4]]}
    for index, name in enumerate(HUMANACT12.joint_names):
        joints[index] = extra.get(name, rig.joints.get(name, np.zeros(3)))
    return clip(np.tile(joints, (frames, 1, 1)), HUMANACT12, 20.0)


def ideal(motion: Motion, body: Body) -> dict[str, np.ndarray]:
    """Joints relative to the middle of the hips that have the motion's bone directions and the body's bone lengths."""
    rig = rig_of(body)
    source = source_joints(motion)
    turn = alignment(source)
    source = {name: points @ turn.T for name, points in source.items()}
    hips = 0.5 * (source["left_hip"] + source["right_hip"])
    shoulders = 0.5 * (source["left_shoulder"] + source["right_shoulder"])
    torso = unit(shoulders - hips) * np.linalg.norm(rig.middle("shoulder") - rig.middle("hip"))
    out: dict[str, np.ndarray] = {}
    for side in SIDES:
        out[f"{side}_hip"] = unit(source[f"{side}_hip"] - hips) * rig.length("left_hip", "right_hip") / 2
        out[f"{side}_shoulder"] = torso + unit(source[f"{side}_shoulder"] - shoulders) * rig.length("left_shoulder", "right_shoulder") / 2
        for a, b in LIMBS:
            step = unit(source[f"{side}_{b}"] - source[f"{side}_{a}"])
            out[f"{side}_{b}"] = out[f"{side}_{a}"] + step * rig.length(f"{side}_{a}", f"{side}_{b}")
    return out


def alignment(source: dict[str, np.ndarray]) -> np.ndarray:
    across = source["left_hip"][0] - source["right_hip"][0] + 0.5 * (source["left_shoulder"][0] - source["right_shoulder"][0])
    return rotvec_to_rotmat(np.array([0, np.arctan2(across[2], across[0]), 0]))


def joint_error(motion: Motion, body: Body, settings: RetargetSettings) -> float:
    """Mean distance in metres of the retargeted joints from `ideal`."""
    joints = joints_of(retarget(motion, body, settings=settings).astype(np.float64), rig_of(body))
    wanted = ideal(motion, body)
    middle = 0.5 * (joints["left_hip"] + joints["right_hip"])
    return float(np.mean([np.linalg.norm(joints[name] - middle - wanted[name], axis=-1).mean() for name in wanted]))


def feet(transforms: np.ndarray, body: Body) -> np.ndarray:
    joints = joints_of(transforms.astype(np.float64), rig_of(body))
    return np.stack([joints[f"{side}_{name}"] for side in SIDES for name in ("ankle", "foot")], axis=1)


def depth(transforms: np.ndarray, body: Body) -> np.ndarray:
    """Depth (T,) under the ground of points all over the skin, metres."""
    return np.maximum(-place(rig_of(body).skin, transforms.astype(np.float64))[..., 1].min(-1), 0)


def test_rest_pose_stays_the_rest_pose(body: Body) -> None:
    result = retarget(rest_motion(body), body, settings=RAW)
    turns = result[:, :, :3, :3] @ np.swapaxes(body.rest_transforms[:, :3, :3], 1, 2)
    angle = np.degrees(np.arccos(np.clip((np.trace(turns, axis1=-2, axis2=-1) - 1) / 2, -1, 1)))
    names = np.array(body.bone_names)
    limbs = [i for i, name in enumerate(names) if name.startswith(("root", "spine", "upper", "lower", "clavicle", "wrist"))]
    worst = limbs[int(angle[0, limbs].argmax())]
    assert angle[0, worst] < 12, names[worst]


def test_transforms_are_rigid_and_keep_bone_lengths(body: Body, cartwheel: Path) -> None:
    result = retarget(read_motion(cartwheel, fps=20), body).astype(np.float64)
    turns = result[..., :3, :3]
    np.testing.assert_allclose(turns @ np.swapaxes(turns, -1, -2), np.broadcast_to(np.eye(3), turns.shape), atol=1e-5)
    parents = body.bone_parents
    lengths = np.linalg.norm(result[:, 1:, :3, 3] - result[..., :3, 3][:, parents[1:]], axis=-1)
    rest = np.linalg.norm(body.rest_transforms[1:, :3, 3] - body.rest_transforms[parents[1:], :3, 3], axis=-1)
    np.testing.assert_allclose(lengths, np.broadcast_to(rest, lengths.shape), atol=1e-4)


def test_raw_limbs_point_where_the_motion_points(body: Body, cartwheel: Path) -> None:
    motion = read_motion(cartwheel, fps=20)
    joints = joints_of(retarget(motion, body, settings=RAW).astype(np.float64), rig_of(body))
    source = source_joints(motion)
    turn = alignment(source)
    for side in SIDES:
        for a, b in LIMBS:
            wanted = unit(source[f"{side}_{b}"] - source[f"{side}_{a}"]) @ turn.T
            got = unit(joints[f"{side}_{b}"] - joints[f"{side}_{a}"])
            assert np.degrees(np.arccos(np.clip((wanted * got).sum(-1), -1, 1))).max() < 2.0, (side, a)


@pytest.mark.parametrize("name", ["humanact12", "cmu"])
def test_real_clips(body: Body, real_clips: Callable[[str, int], list[Motion]], name: str) -> None:
    errors, skating, sunk, shake = [], [], [], []
    for motion in real_clips(name, 20):
        result = retarget(motion, body)
        errors.append(joint_error(motion, body, RetargetSettings(level="never")))
        skating.append(foot_skating(feet(result, body), motion.fps))
        sunk.append(depth(result, body).mean())
        scale = rig_of(body).leg_length / source_leg_length(source_joints(motion))
        arms = ("left_wrist", "right_wrist", "left_elbow", "right_elbow")
        ours, theirs = joints_of(result.astype(np.float64), rig_of(body)), source_joints(motion)
        shake.append([jitter(np.stack([j[n] for n in arms], 1), motion.fps) for j in (ours, {n: theirs[n] * scale for n in arms})])
    assert np.mean(errors) <= 0.02
    assert np.mean(skating) <= 0.05
    assert np.mean(sunk) <= 0.005
    assert np.mean(shake, axis=0)[0] <= 1.25 * np.mean(shake, axis=0)[1]


def test_clean_feet_stand_and_raw_feet_do_not(body: Body) -> None:
    # a person who is carried sideways while standing: feet slide by 0.3 m/s and sink by 4 cm for a moment
    motion = rest_motion(body, 40)
    slide = np.linspace(0, 0.6, 40)[:, None, None] * np.array([1.0, 0, 0]) - 0.04 * np.exp(-(((np.arange(40) - 20) / 2) ** 2))[
        :, None, None
    ] * [0, 1, 0]
    motion = dataclasses.replace(
        motion, joints=(motion.joints + slide).astype(np.float32), root=(motion.root + slide[:, 0]).astype(np.float32)
    )
    raw, clean = retarget(motion, body, settings=RetargetSettings(raw=True)), retarget(motion, body)
    path = [np.linalg.norm(np.diff(feet(r, body)[..., ::2], axis=0), axis=-1).sum(0).max() for r in (raw, clean)]
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
        joints[:, HUMANACT12.index(name)] = joints[:, HUMANACT12.index("left_shoulder")] + [0, 0.28 + 0.1 * ("elbow" not in name), 0]
    result = joints_of(retarget(clip(joints, HUMANACT12, 20.0), body, settings=RAW).astype(np.float64), rig_of(body))
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
    assert on[3:7].all()  # the rise to 6 cm in between does not let go
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
    batch = dataclasses.replace(motion, joints=motion.joints[None], rotations=motion.rotations[None], root=motion.root[None])
    with pytest.raises(InputError, match="batch"):
        retarget(batch, body)
    names = tuple(name.replace("knee", "blob") for name in motion.joint_names)
    with pytest.raises(InputError, match="left_knee"):
        retarget(dataclasses.replace(motion, joint_names=names, skeleton="custom"), body)
    with pytest.raises(InputError, match="no length"):
        retarget(dataclasses.replace(motion, joints=np.zeros_like(motion.joints)), body)
    one = dataclasses.replace(motion, joints=motion.joints[:1], rotations=motion.rotations[:1], root=motion.root[:1])
    assert np.isfinite(retarget(one, body)).all()
