"""Edit clips for game engines: in place, a seamless cycle, mirrored, faster or slower, root motion.

All edits use the path over the ground (`ground_trajectory`): position of the root and heading of
the person, with and without the sway of a step.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from a2v.errors import InputError
from a2v.face import other_side
from a2v.kinematics import inverse_kinematics, quat_to_rotvec, rotvec_to_quat
from a2v.kinematics.even_paths import evened_cycle
from a2v.kinematics.foot_contacts import PlantSettings
from a2v.kinematics.from_joints import with_joints
from a2v.kinematics.ground import SWAY_SECONDS, GroundTrajectory, ground_trajectory
from a2v.kinematics.names import canonical_joints, split_side
from a2v.kinematics.planting import plant_feet
from a2v.kinematics.resample import resample_motion
from a2v.kinematics.transforms import bone_lengths, forward_kinematics
from a2v.motion.settling import skeleton_of_motion
from a2v.types import FloatArray, IntArray, Motion

LEAST_LOOP_SECONDS = 0.8
"""Shortest cycle that `make_loop` looks for."""
FADE_SECONDS = 0.4
"""Seconds over which the end of a cycle fades into the frames before its start."""
SEAM_SECONDS = 1 / 30
"""Width in seconds over which the root of a cycle in place is smoothed. Without it, the jerk at the
seam of a cycle that turns was 1.4 times the largest inside (Crossover walk, seed 0); with it,
0.7 times."""
# : Smallest mean speed of a cycle, relative to the upper quartile of the clip's.
LIVELY = 0.7
# : Weight of accelerations at the start and the end of a cycle.
JOLT = 0.1
#: Weight of velocities relative to positions where a cycle is closed, seconds.
VELOCITY_SECONDS = 0.3


@dataclass(frozen=True, kw_only=True)
class Edit:
    """The edits of a finished clip.

    Attributes
    ----------
    speed : float
        Tempo: 2 is twice as fast.
    mirror : bool
        Swap left and right.
    loop : bool
        Make a seamless cycle of the clip.
    in_place : bool
        Remove travel and turning; the sway of steps stays.
    """

    speed: float = 1.0
    mirror: bool = False
    loop: bool = False
    in_place: bool = False

    def __post_init__(self) -> None:
        check_speed(self.speed)


def edited(motion: Motion, edit: Edit) -> Motion:
    """Apply `edit` to a clip or batch.

    Raises
    ------
    InputError
        A loop or a clip in place is requested of a batch; see the functions for each.
    """
    if (edit.loop or edit.in_place) and motion.batch:
        raise InputError("loop and in-place are for one clip; leave --count out")
    made = change_speed(motion, edit.speed)
    made = mirror_motion(made) if edit.mirror else made
    if edit.loop:
        made = _standing(make_loop(made))
    return put_in_place(made, loop=edit.loop) if edit.in_place else made


def _standing(loop: Motion) -> Motion:
    """Plant the feet of a cycle: three rounds are planted and the middle one is kept, so that it
    closes."""
    rounds = repeat_loop(loop, 3)
    joints = plant_feet(
        rounds.joints, skeleton_of_motion(loop), loop.fps, settings=PlantSettings(settled=False)
    )[loop.frames : 2 * loop.frames]
    return _from_joints(loop, joints.astype(np.float64))


def put_in_place(motion: Motion, *, loop: bool = False) -> Motion:
    """Remove travel and turning from a clip; the sway of hips and shoulders stays. A `loop` stays a
    loop.

    Raises
    ------
    InputError
        See `ground_trajectory`.
    """
    path = ground_trajectory(motion)
    away = np.linalg.inv((path if loop else path.smooth(motion.fps)).transforms())
    if loop:
        steps = _steps(path)
        away = (
            _closed_walk(steps - _smooth_cyclic(steps, SWAY_SECONDS * motion.fps)).transforms()
            @ away
        )
    placed = _moved(motion, away)
    if not loop:
        return placed
    root = placed.root.astype(np.float64)
    off = evened_cycle(root, SEAM_SECONDS * motion.fps) - root
    return _from_joints(placed, placed.joints + off[:, None])


def repeat_loop(loop: Motion, rounds: int) -> Motion:
    """Repeat a cycle: each round continues from the end of the one before.

    Raises
    ------
    InputError
        See `ground_trajectory`.
    """
    path = ground_trajectory(loop)
    local = _transformed(np.linalg.inv(path.transforms()), loop.joints.astype(np.float64))
    walked = _walk(np.tile(_steps(path), (rounds, 1)))
    begin = path.transforms()[0]
    return _from_joints(
        loop, _transformed(begin @ walked.transforms(), np.tile(local, (rounds, 1, 1)))
    )


def mirror_motion(motion: Motion) -> Motion:
    """Exchange left and right: mirror the clip (or batch) across x = 0.

    Raises
    ------
    InputError
        A joint of one side has no twin.
    """
    twin = _twins(motion)
    joints = motion.joints[..., twin, :].astype(np.float64) * (-1, 1, 1)
    return dataclasses.replace(
        _from_joints(motion, joints), expressions=other_side(motion.expressions)
    )


def change_speed(motion: Motion, speed: float) -> Motion:
    """Play a clip `speed` times as fast at its own frame rate.

    Raises
    ------
    InputError
        `speed` is not from 0.1 to 10.
    """
    return retimed(motion, fps=motion.fps, speed=speed)


def retimed(motion: Motion, *, fps: float, speed: float = 1.0) -> Motion:
    """Resample a clip or batch to another frame rate, `speed` times as fast.

    Raises
    ------
    InputError
        A number is out of range.
    """
    check_speed(speed)
    quick = motion
    if speed != 1:
        starts = None if motion.action_starts is None else motion.action_starts / speed
        quick = dataclasses.replace(motion, fps=motion.fps * speed, action_starts=starts)
    return resample_motion(quick, fps)


def check_speed(speed: float) -> None:
    """Check a tempo.

    Raises
    ------
    InputError
        `speed` is not from 0.1 to 10.
    """
    if not 0.1 <= speed <= 10:
        raise InputError(f"speed is {speed:g}; expected 0.1 to 10 times the recorded one")


def make_loop(
    motion: Motion, *, in_place: bool = False, least_seconds: float = LEAST_LOOP_SECONDS
) -> Motion:
    """Make a seamless cycle of a clip: after the last frame the first one follows smoothly.

    The two moments that are most similar in pose and velocity are found, independent of their place
    on the ground. Towards the second moment, the clip fades into the frames before the first. A
    cycle that travels continues from its end, in its final direction.

    Parameters
    ----------
    motion : Motion
        One clip, longer than `least_seconds` and the fade.
    in_place : bool
        Remove travel and turning: the cycle closes exactly at its start.
    least_seconds : float
        Shortest cycle.

    Raises
    ------
    InputError
        The clip is too short, or hips and shoulders are not found in its skeleton.
    """
    fade, least = (
        max(2, round(FADE_SECONDS * motion.fps)),
        max(4, round(least_seconds * motion.fps)),
    )
    if motion.frames < fade + least + 2:
        raise InputError(
            f"{motion.frames} frames are too few for a loop, which needs {fade + least + 2} or "
            f"more at {motion.fps:g} fps; give a longer motion, such as --seconds 5"
        )
    skeleton = skeleton_of_motion(motion)
    path = ground_trajectory(motion)
    local = _transformed(np.linalg.inv(path.transforms()), motion.joints.astype(np.float64))
    moved = _steps(path)
    start, end = _closest_moments(local, moved, motion.fps, fade, least)
    weight = _smoothstep(np.arange(1, fade + 1) / (fade + 1))
    inner, before = np.arange(start, end), np.arange(start - fade, start)
    quats = rotvec_to_quat(inverse_kinematics(local, skeleton))
    turned = quats[inner].copy()
    turned[-fade:] = _blend(quats[end - fade : end], quats[before], weight[:, None, None])
    height = local[inner, 0, 1]
    height[-fade:] += weight * (local[before, 0, 1] - height[-fade:])
    steps = moved[inner]
    steps[-fade:] += weight[:, None] * (moved[before] - steps[-fade:])
    walked = _walk(steps)
    lengths = np.median(bone_lengths(local, skeleton), axis=0)
    root = np.stack([np.zeros(len(inner)), height, np.zeros(len(inner))], axis=-1)
    joints = forward_kinematics(
        quat_to_rotvec(turned), root, np.tile(lengths, (len(inner), 1)), skeleton
    )
    loop = dataclasses.replace(
        _from_joints(motion, _transformed(walked.transforms(), joints)), action_starts=None
    )
    return put_in_place(loop, loop=True) if in_place else loop


def _closest_moments(
    local: FloatArray, steps: FloatArray, fps: float, fade: int, least: int
) -> tuple[int, int]:
    """Find start and end (exclusive) of the cycle: the two frames that are most similar in pose,
    velocity and travel.

    Moments of low acceleration are better than the middle of a leap. A standing person matches
    itself best, so a cycle must move nearly as much as the moving part of the clip.
    """
    pose = local.reshape(len(local), -1)
    velocity = np.gradient(pose, axis=0) * (fps * VELOCITY_SECONDS)
    travel = (
        np.gradient(np.cumsum(steps, axis=0), axis=0)
        * (fps * VELOCITY_SECONDS)
        * np.sqrt(local.shape[1])
    )
    features = np.concatenate([pose, velocity, travel], axis=1)
    squares = (features**2).sum(1)
    cost = squares[:, None] + squares[None] - 2 * features @ features.T
    jolt = JOLT * (np.gradient(velocity, axis=0) ** 2).sum(1) * (fps * VELOCITY_SECONDS) ** 2
    cost += jolt[:, None] + jolt[None]
    frames = np.arange(len(local))
    far = frames[None] - frames[:, None] >= least
    cost = np.where(far & (frames[:, None] >= fade), cost, np.inf)
    speed = np.linalg.norm(velocity, axis=1) + np.linalg.norm(travel, axis=1)
    passed = np.concatenate([[0.0], np.cumsum(speed)])[: len(local)]
    mean = (passed[None] - passed[:, None]) / np.maximum(frames[None] - frames[:, None], 1)
    wanted = min(
        LIVELY * float(np.quantile(speed, 0.75)), 0.9 * float(mean[np.isfinite(cost)].max())
    )
    cost = np.where(mean >= wanted, cost, np.inf)
    start, end = np.unravel_index(int(np.argmin(cost)), cost.shape)
    return int(start), int(end)


def _steps(path: GroundTrajectory) -> FloatArray:
    """Return the steps from each frame to the next in its own axes (T, 3): sideways, ahead (meters)
    and turn (radians)."""
    moved = np.diff(path.position, axis=0, append=2 * path.position[-1:] - path.position[-2:-1])
    turned = np.diff(path.heading, append=2 * path.heading[-1] - path.heading[-2])
    cos, sin = np.cos(path.heading), np.sin(path.heading)
    return np.stack(
        [cos * moved[:, 0] - sin * moved[:, 1], sin * moved[:, 0] + cos * moved[:, 1], turned],
        axis=-1,
    )


def _walk(steps: FloatArray) -> GroundTrajectory:
    """Return the path that starts at the origin along +z and takes `steps` (T, 3); the inverse of
    `_steps`."""
    heading = np.concatenate([[0.0], np.cumsum(steps[:-1, 2])])
    cos, sin = np.cos(heading), np.sin(heading)
    moved = np.stack(
        [cos * steps[:, 0] + sin * steps[:, 1], -sin * steps[:, 0] + cos * steps[:, 1]], axis=-1
    )
    return GroundTrajectory(
        np.concatenate([np.zeros((1, 2)), np.cumsum(moved[:-1], axis=0)]), heading
    )


def _closed_walk(steps: FloatArray) -> GroundTrajectory:
    """Return the path of `steps` (T, 3) whose turns cancel, bent evenly so that it ends at its
    start.

    The sideways steps of a swaying person do not sum to zero.
    """
    walked = _walk(np.concatenate([steps, np.zeros((1, 3))]))
    drift = np.linspace(0, 1, len(steps) + 1)[:, None] * walked.position[-1]
    return GroundTrajectory((walked.position - drift)[:-1], walked.heading[:-1])


def _smooth_cyclic(values: FloatArray, sigma: float) -> FloatArray:
    smooth: FloatArray = gaussian_filter1d(values, sigma, axis=0, mode="wrap")
    return smooth


def _smoothstep(x: FloatArray) -> FloatArray:
    eased: FloatArray = x * x * x * (x * (6 * x - 15) + 10)
    return eased


def _blend(one: FloatArray, other: FloatArray, weight: FloatArray) -> FloatArray:
    """Interpolate unit quaternions between `one` and `other` (..., 4) along the shorter arc."""
    other = np.where((one * other).sum(-1, keepdims=True) < 0, -other, other)
    mixed = (1 - weight) * one + weight * other
    unit: FloatArray = mixed / np.linalg.norm(mixed, axis=-1, keepdims=True)
    return unit


def _transformed(transforms: FloatArray, points: FloatArray) -> FloatArray:
    """Apply one transform (T, 4, 4) per frame to points (T, J, 3)."""
    moved: FloatArray = (
        points @ transforms[:, :3, :3].transpose(0, 2, 1) + transforms[:, None, :3, 3]
    )
    return moved


def _moved(motion: Motion, transforms: FloatArray) -> Motion:
    return _from_joints(motion, _transformed(transforms, motion.joints.astype(np.float64)))


def _from_joints(motion: Motion, joints: FloatArray) -> Motion:
    """Replace the joints (..., T, J, 3) of `motion`."""
    return with_joints(motion, joints, skeleton_of_motion(motion))


def _twins(motion: Motion) -> IntArray:
    """Return the index of each joint's twin on the other side; its own index on the axis."""
    found = canonical_joints(motion.joint_names, motion.parents.tolist())
    named = {index: name for name, index in found.items()}
    whole = [split_side(named.get(index, joint)) for index, joint in enumerate(motion.joint_names)]
    twin = np.arange(len(whole))
    for index, (side, base) in enumerate(whole):
        if side:
            other = ("right" if side == "left" else "left", base)
            if other not in whole:
                raise InputError(
                    f"joint '{motion.joint_names[index]}' has no twin on the other side; the clip "
                    "cannot be mirrored"
                )
            twin[index] = whole.index(other)
    return twin
