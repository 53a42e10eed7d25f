"""Poses from actions, composed by rules, for the benchmark; they are not used for training.

They do not come from recorded motion, so that a bank of recorded poses (`a2v.body.pose_bank`)
contains none of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from a2v.lab.studio.posing import SIDES, Pose, arm_towards, joint_noise, natural_pose
from a2v.types import FloatArray


def draw_stance(name: str, generator: np.random.Generator) -> tuple[Pose, float]:
    """Draw a pose of the class `name`, one of `STANCES`, and its turn about the vertical,
    degrees."""
    pose, yaw = STANCES[name](generator)
    return joint_noise(pose, generator), yaw


def _trunk(generator: np.random.Generator, bend: float, twist: float = 8.0) -> Pose:
    """Return a trunk bent forward by `bend` degrees, with the head half raised again."""
    turn = np.radians(np.array([bend, generator.normal(0, twist), generator.normal(0, 5)]))
    pose: Pose = {
        name: turn * share for name, share in (("Spine", 0.3), ("Spine1", 0.35), ("Spine2", 0.35))
    }
    look = np.radians(
        [generator.normal(-0.4 * bend, 8), generator.normal(0, 15), generator.normal(0, 5)]
    )
    return pose | {"Neck": 0.4 * look, "Head": 0.6 * look}


def _leg(
    side: str, sign: float, *, thigh: float, knee: float, spread: float = 5.0, foot: float = 0.0
) -> Pose:
    """Return a leg from the angles of its thigh to the front, of its knee, and of its thigh to the
    side, degrees."""
    angles = np.radians([thigh, knee, spread, foot])
    return {
        f"{side}UpLeg": np.array([-angles[0], 0.0, sign * angles[2]]),
        f"{side}Leg": np.array([angles[1], 0.0, 0.0]),
        f"{side}Foot": np.array([angles[3], 0.0, 0.0]),
    }


def _arm(
    side: str,
    sign: float,
    upper: tuple[float, float, float],
    fore: tuple[float, float, float],
    bend: float = 0.0,
) -> Pose:
    """Return an arm from the directions of its segments (left: x outward, y up, z to the front).

    They are relative to the horizon although the trunk is bent by `bend` degrees.
    """
    back = np.radians(-bend)
    tilt = np.array([[1, 0, 0], [0, np.cos(back), -np.sin(back)], [0, np.sin(back), np.cos(back)]])
    first, last = (tilt @ (np.asarray(direction) * [sign, 1, 1]) for direction in (upper, fore))
    return arm_towards(side, sign, first, last)


def _both_sides(generator: np.random.Generator) -> tuple[tuple[str, float], tuple[str, float]]:
    """Return both sides, in random order."""
    return SIDES if generator.random() < 0.5 else SIDES[::-1]


def _standing(generator: np.random.Generator) -> tuple[Pose, float]:
    return natural_pose(generator), float(generator.normal(0, 20))


def _profile(generator: np.random.Generator) -> tuple[Pose, float]:
    pose = natural_pose(generator)
    for side, sign in SIDES:  # a step
        pose |= _leg(
            side, sign, thigh=generator.normal(12 * sign, 12), knee=abs(generator.normal(8, 12))
        )
    return pose, float(generator.choice([-1, 1]) * generator.uniform(65, 115))


def _run(generator: np.random.Generator) -> tuple[Pose, float]:
    lean = generator.uniform(5, 22)
    pose = _trunk(generator, lean, 14)
    (front, first), (rear, second) = _both_sides(generator)
    pose |= _leg(front, first, thigh=generator.uniform(40, 85), knee=generator.uniform(50, 115))
    pose |= _leg(
        rear,
        second,
        thigh=generator.uniform(-35, 0),
        knee=generator.uniform(10, 100),
        foot=generator.uniform(0, 35),
    )
    for side, sign, swing in (
        (rear, second, generator.uniform(10, 60)),
        (front, first, -generator.uniform(15, 60)),
    ):
        turn, elbow = np.radians([swing, swing + generator.uniform(70, 110)])
        upper, fore = (
            (0.25, -np.cos(turn), np.sin(turn)),
            (generator.uniform(-0.3, 0.1), -np.cos(elbow), np.sin(elbow)),
        )
        pose |= _arm(side, sign, upper, fore)
    return pose, float(generator.uniform(-75, 75))


def _kick(generator: np.random.Generator) -> tuple[Pose, float]:
    pose = _trunk(generator, -generator.uniform(0, 18), 14)
    (kicking, first), (other, second) = _both_sides(generator)
    high = generator.uniform(45, 100)
    pose |= _leg(
        kicking,
        first,
        thigh=high,
        knee=generator.uniform(0, 45),
        spread=generator.uniform(0, 30),
        foot=generator.uniform(0, 30),
    )
    pose |= _leg(other, second, thigh=generator.uniform(-8, 15), knee=generator.uniform(0, 25))
    for side, sign in SIDES:
        upper = (
            generator.uniform(0.4, 1.0),
            generator.uniform(-0.9, 0.3),
            generator.uniform(-0.5, 0.6),
        )
        fore = (
            generator.uniform(-0.4, 0.8),
            generator.uniform(-0.4, 0.8),
            generator.uniform(0.0, 0.8),
        )
        pose |= _arm(side, sign, upper, fore)
    return pose, float(generator.uniform(-60, 60))


def _squat(generator: np.random.Generator) -> tuple[Pose, float]:
    knee = generator.uniform(80, 130)
    bend, thigh = generator.uniform(15, 40), knee * generator.uniform(0.7, 0.85)
    pose = _trunk(generator, bend)
    spread = generator.uniform(5, 28)
    for side, sign in SIDES:
        pose |= _leg(side, sign, thigh=thigh, knee=knee, spread=spread, foot=-(knee - thigh))
        reach = generator.uniform(-0.7, 0.2)
        pose |= _arm(
            side, sign, (0.25, reach, 1.0), (generator.uniform(-0.5, 0.0), reach + 0.2, 1.0), bend
        )
    return pose, float(generator.uniform(-50, 50))


def _sit(generator: np.random.Generator) -> tuple[Pose, float]:
    bend = generator.uniform(-10, 18)
    pose = _trunk(generator, bend)
    for side, sign in SIDES:
        thigh = generator.uniform(78, 95)
        pose |= _leg(
            side,
            sign,
            thigh=thigh,
            knee=generator.uniform(60, 105),
            spread=generator.uniform(3, 18),
        )
        fore = (generator.uniform(-0.5, 0.0), generator.uniform(-0.4, 0.3), 1.0)
        pose |= _arm(
            side, sign, (generator.uniform(0.1, 0.4), -1.0, generator.uniform(0.0, 0.4)), fore
        )
    return pose, float(generator.uniform(-70, 70))


def _stoop(generator: np.random.Generator) -> tuple[Pose, float]:
    hips, spine, knee = (
        generator.uniform(20, 55),
        generator.uniform(20, 50),
        generator.uniform(0, 35),
    )
    pose = _trunk(generator, spine)
    pose["Hips"] = np.radians([hips, 0.0, generator.normal(0, 4)])
    for side, sign in SIDES:
        pose |= _leg(
            side,
            sign,
            thigh=hips + 0.5 * knee,
            knee=knee,
            spread=generator.uniform(2, 10),
            foot=-0.5 * knee,
        )
        fore = (generator.uniform(-0.3, 0.1), -1.0, generator.uniform(0.1, 0.6))
        pose |= _arm(
            side,
            sign,
            (generator.uniform(0.05, 0.3), -1.0, generator.uniform(0.0, 0.5)),
            fore,
            hips + spine,
        )
    return pose, float(generator.uniform(-80, 80))


def _spread(generator: np.random.Generator) -> tuple[Pose, float]:
    pose = _trunk(generator, generator.normal(0, 5))
    for side, sign in SIDES:
        pose |= _leg(
            side,
            sign,
            thigh=generator.normal(5, 12),
            knee=abs(generator.normal(0, 18)),
            spread=generator.uniform(18, 42),
        )
        up = np.radians(generator.uniform(50, 150))
        upper = np.array([np.sin(up), -np.cos(up), generator.normal(0.0, 0.2)])
        fore = upper + generator.normal(0, 0.35, 3) + [0, 0, 0.1]
        pose |= arm_towards(side, sign, upper * [sign, 1, 1], fore * [sign, 1, 1])
    return pose, float(generator.normal(0, 20))


Stance = Callable[[np.random.Generator], tuple[Mapping[str, FloatArray], float]]

STANCES: Mapping[str, Stance] = MappingProxyType(
    {
        "standing": _standing,
        "run": _run,
        "kick": _kick,
        "squat": _squat,
        "sit": _sit,
        "stoop": _stoop,
        "profile": _profile,
        "spread": _spread,
    }
)
"""The classes of poses by name."""
