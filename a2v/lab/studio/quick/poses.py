"""Poses of quick views: recorded ones of every kind, mixed, bent, and with limbs anywhere within
the limits of their joints.

Those of `a2v.lab.studio.stances` are never used: the fit is measured on them.
"""

from __future__ import annotations

import numpy as np

from a2v.lab.studio.posing import (
    SIDES,
    Pose,
    arm_towards,
    curled_fingers,
    joint_noise,
    natural_pose,
    open_pose,
    without_heading,
)
from a2v.lab.studio.quick.bank import PoseBank
from a2v.lab.studio.quick.settings import QuickSettings
from a2v.types import FloatArray

_ARM = ("Shoulder", "Arm", "ForeArm", "Hand")
"""Bones of an arm."""
_LEG = ("UpLeg", "Leg", "Foot", "ToeBase")
"""Bones of a leg."""
_MOST_BENT = np.radians(145.0)
"""Largest bend of an elbow."""


def draw_pose(
    bank: PoseBank, split: str, settings: QuickSettings, generator: np.random.Generator
) -> Pose:
    """Draw a pose without heading, with hands between open and fists."""
    kind = generator.random()
    if kind < settings.natural:
        return joint_noise(natural_pose(generator), generator)
    if kind < settings.natural + settings.open:
        return joint_noise(open_pose(generator), generator)
    pose = bank.draw(split, generator, settings.common)
    if generator.random() < settings.limbs:
        other = bank.draw(split, generator, settings.common)
        side = "Left" if generator.random() < 0.5 else "Right"
        pose |= {
            side + bone: other[side + bone] for bone in (_ARM if generator.random() < 0.5 else _LEG)
        }
    if generator.random() < settings.free:
        pose |= _free_limbs(generator)
    if generator.random() < settings.bent:
        _bend(pose, generator)
    if generator.random() < settings.curled:
        curl = generator.uniform(-0.1, 0.5)
        for bone in ("Spine", "Spine1", "Spine2"):
            pose[bone] = pose[bone] + np.array([curl, 0.0, 0.0])
    pose["Hips"] = without_heading(pose["Hips"])
    return joint_noise(pose, generator, 0.7) | curled_fingers(generator)


def _free_limbs(generator: np.random.Generator) -> Pose:
    """Draw each leg with probability 0.6 and each arm with 0.5, anywhere within the limits of the
    joints."""
    pose: Pose = {}
    for side, sign in SIDES:
        if generator.random() < 0.6:
            lift, turn, out = (
                0.6 - 2.5 * generator.random(),
                0.3 * generator.normal(),
                0.9 * generator.random() - 0.15,
            )
            pose[f"{side}UpLeg"] = np.array([lift, turn, sign * out])
            pose[f"{side}Leg"] = np.array([2.3 * generator.random(), 0.0, 0.0])
            pose[f"{side}Foot"] = np.array([generator.random() - 0.4, 0.0, 0.0])
        if generator.random() < 0.5:
            upper, fore = _arm_directions(generator)
            mirror = np.array([sign, 1.0, 1.0])
            pose |= arm_towards(side, sign, upper * mirror, fore * mirror)
    return pose


def _arm_directions(generator: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Draw directions (3,) of upper arm and forearm of a left arm.

    The arm is not far across the chest or behind the back, and the elbow bends forward.
    """
    while True:
        upper = generator.normal(size=3)
        upper /= np.linalg.norm(upper)
        if upper[0] > -0.5 and upper[2] > -0.75:
            break
    across = np.cross(upper, generator.normal(size=3))
    across /= np.linalg.norm(across)
    if across[2] < -0.4:
        across = -across
    bend = generator.uniform(0, _MOST_BENT)
    return upper, np.cos(bend) * upper + np.sin(bend) * across


def _bend(pose: Pose, generator: np.random.Generator) -> None:
    """Bend the trunk forward by up to 63 degrees, in place. The legs turn back, so that the feet
    stay about below it."""
    bend = 1.1 * generator.random()
    pose["Hips"] = pose["Hips"] + np.array([bend, 0.0, 0.0])
    for side, _ in SIDES:
        pose[f"{side}UpLeg"] = pose[f"{side}UpLeg"] - np.array(
            [bend * generator.uniform(0.6, 1.2), 0.0, 0.0]
        )
