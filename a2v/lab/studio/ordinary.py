"""Ordinary poses of photographed people: hands touch the body, legs touch each other, hands hold a
phone or a bag.

Rules compose them for one avatar, whose hands must reach its own body. They are not used for
training, only in a benchmark (`a2v evaluate moved`). A pose has rotation vectors by bone, in the
world's axes of the T-pose, as in `a2v.lab.studio.posing`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from a2v.body.parts import on_parts
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.posing import SIDES, Pose, arm_towards, joint_noise, natural_pose
from a2v.lab.studio.stances import STANCES
from a2v.lab.studio.things.held import Held, held_of
from a2v.types import FloatArray

NOISE = 0.35
"""Factor on the usual joint noise (`joint_noise`). With more noise hands would leave the touched
surface."""
_YAW = 14.0
"""Standard deviation of the turn about the vertical of photographed people, degrees."""
_COLLAR = -0.12
"""Turn of the collar bone, radians, below a hanging arm (`arm_towards`)."""
_NEAR_COLUMN = 0.05
"""Largest sideways distance of vertices that determine how far the body extends to the front,
meters."""
_NEAR_ROW = 0.03
"""Largest vertical distance of these vertices, meters."""

Drawn = tuple[Pose, float, Held | None]
"""A pose, the turn about the vertical in degrees, and the held object."""


def draw_ordinary(name: str, avatar: Avatar, generator: np.random.Generator) -> Drawn:
    """Draw a pose of the class `name`, one of `ORDINARY`, for an avatar, with its turn and the held
    object."""
    pose, yaw, held = ORDINARY[name](avatar, generator)
    return joint_noise(pose, generator, NOISE) | (held.pose if held else {}), yaw, held


def arm_reaching(avatar: Avatar, side: str, target: FloatArray, elbow: FloatArray) -> Pose:
    """Return rotations that put the wrist of one arm at a point.

    The elbow follows from the triangle of upper arm and forearm.

    Parameters
    ----------
    avatar : Avatar
    side : str
        "Left" or "Right".
    target : (3,)
        Position of the wrist, meters, in the frame of the T-pose; it moves with the chest. If the
        point is out of reach, the arm is stretched towards it.
    elbow : (3,)
        Direction of the elbow from the line between shoulder and wrist.
    """
    collar, shoulder, fore, hand = (
        _head(avatar, side + bone) for bone in ("Shoulder", "Arm", "ForeArm", "Hand")
    )
    sign = dict(SIDES)[side]
    lift = sign * _COLLAR
    turn = np.array([[np.cos(lift), -np.sin(lift), 0], [np.sin(lift), np.cos(lift), 0], [0, 0, 1]])
    start = collar + turn @ (shoulder - collar)
    upper, lower = float(np.linalg.norm(fore - shoulder)), float(np.linalg.norm(hand - fore))
    way = target - start
    reach = float(np.clip(np.linalg.norm(way), abs(upper - lower) + 1e-3, 0.995 * (upper + lower)))
    along = way / max(float(np.linalg.norm(way)), 1e-9)
    out = elbow - (elbow @ along) * along
    out = out / max(float(np.linalg.norm(out)), 1e-9)
    share = (upper**2 - lower**2 + reach**2) / (2 * reach)
    bend = share * along + np.sqrt(max(upper**2 - share**2, 0.0)) * out
    return arm_towards(side, sign, bend, reach * along - bend)


def _head(avatar: Avatar, bone: str) -> FloatArray:
    return np.asarray(avatar.rest_transforms[avatar.bone_names.index(bone), :3, 3], np.float64)


def _rest(avatar: Avatar) -> FloatArray:
    return np.asarray(np.einsum("vk,vki->vi", avatar.weights, avatar.influences), np.float64)


def _front(avatar: Avatar, x: float, y: float) -> float:
    """Return the extent to the front (z) of trunk and head of the T-pose at a place, meters."""
    rest = _rest(avatar)[on_parts(avatar.parts, "torso", "head", "neck")]
    near = (np.abs(rest[:, 0] - x) < _NEAR_COLUMN) & (np.abs(rest[:, 1] - y) < _NEAR_ROW)
    return float(rest[near, 2].max()) if near.any() else 0.1


def _flank(avatar: Avatar, y: float) -> float:
    """Return the extent to the side of trunk and thighs at a height, meters."""
    rest = _rest(avatar)[on_parts(avatar.parts, "torso", "left_thigh", "right_thigh")]
    near = np.abs(rest[:, 1] - y) < _NEAR_ROW
    return float(np.abs(rest[near, 0]).max()) if near.any() else 0.18


def _side(generator: np.random.Generator) -> tuple[str, float]:
    return SIDES[int(generator.integers(2))]


def _yaw(generator: np.random.Generator) -> float:
    return float(generator.normal(0, _YAW))


def _hanging(generator: np.random.Generator, side: str, sign: float) -> Pose:
    """Return a hanging arm that touches the thigh."""
    out, ahead, bend = np.radians(
        [generator.uniform(6, 13), generator.normal(2, 5), generator.uniform(4, 16)]
    )
    upper = np.array([sign * np.sin(out), -np.cos(out), np.sin(ahead)])
    return arm_towards(
        side, sign, upper, upper + np.array([-sign * 0.5 * np.sin(out), 0, np.tan(bend)])
    )


def _standing(generator: np.random.Generator) -> Pose:
    """Return a standing person with hanging arms."""
    pose = natural_pose(generator)
    for side, sign in SIDES:
        pose |= _hanging(generator, side, sign)
    return pose


def _sides(avatar: Avatar, generator: np.random.Generator) -> Drawn:
    return _standing(generator), _yaw(generator), None


def _aside(avatar: Avatar, generator: np.random.Generator) -> Drawn:
    pose, (_, sign) = _standing(generator), _side(generator)
    look = np.radians([generator.normal(0, 8), sign * generator.uniform(45, 80), 0.0])
    return pose | {"Neck": 0.4 * look, "Head": 0.6 * look}, _yaw(generator), None


def _hips(avatar: Avatar, generator: np.random.Generator) -> Drawn:
    pose, both = _standing(generator), generator.random() < 0.6
    first, _ = _side(generator)
    height = float(_head(avatar, "Hips")[1]) + generator.uniform(0.02, 0.09)
    for side, sign in SIDES:
        if both or side == first:
            target = np.array(
                [sign * (_flank(avatar, height) + 0.02), height, generator.uniform(-0.02, 0.05)]
            )
            pose |= arm_reaching(avatar, side, target, np.array([sign, 0.0, -0.4]))
    return pose, _yaw(generator), None


def _crossed(avatar: Avatar, generator: np.random.Generator) -> Drawn:
    pose, (over, _) = _standing(generator), _side(generator)
    shoulder, hips = float(_head(avatar, "LeftArm")[1]), float(_head(avatar, "Hips")[1])
    for side, sign in SIDES:
        height = (
            shoulder
            - generator.uniform(0.4, 0.5) * (shoulder - hips)
            + (0.03 if side == over else -0.03)
        )
        x = -sign * generator.uniform(0.06, 0.1)
        deep = _front(avatar, x, height) + (0.085 if side == over else 0.035)
        pose |= arm_reaching(
            avatar, side, np.array([x, height, deep]), np.array([0.7 * sign, -1.0, 0.3])
        )
    return pose, _yaw(generator), None


def _face(avatar: Avatar, generator: np.random.Generator) -> Drawn:
    pose, (side, sign) = _standing(generator), _side(generator)
    head, place = _head(avatar, "Head"), str(generator.choice(["chin", "cheek", "hair"]))
    reach = 0.9 * float(
        np.linalg.norm(_head(avatar, f"{side}HandMiddle1") - _head(avatar, f"{side}Hand"))
    )
    across, up = {"chin": (0.03, 0.02), "cheek": (0.07, 0.07), "hair": (0.1, 0.17)}[place]
    height = float(head[1]) + up
    target = np.array(
        [
            sign * across,
            height - reach,
            _front(avatar, sign * min(across, 0.06), height) + (0.0 if place == "hair" else 0.03),
        ]
    )
    return (
        pose | arm_reaching(avatar, side, target, np.array([0.8 * sign, -1.0, 0.2])),
        _yaw(generator),
        None,
    )


def _pockets(avatar: Avatar, generator: np.random.Generator) -> Drawn:
    pose, both = _standing(generator), generator.random() < 0.6
    first, _ = _side(generator)
    height = float(_head(avatar, "Hips")[1]) + generator.uniform(-0.01, 0.03)
    for side, sign in SIDES:
        if both or side == first:
            target = np.array([sign * (_flank(avatar, height) - 0.01), height, 0.04])
            pose |= arm_reaching(avatar, side, target, np.array([sign, 0.0, -0.7]))
    return pose, _yaw(generator), None


def _leg_across(avatar: Avatar, side: str, x: float, ahead: float) -> Pose:
    """Return a straight leg whose ankle is at the column `x`, meters, `ahead` degrees to the front;
    the sole stays level."""
    sign = dict(SIDES)[side]
    hip, ankle = _head(avatar, f"{side}UpLeg"), _head(avatar, f"{side}Foot")
    tall = float(hip[1] - ankle[1])
    inwards = np.arctan2(float(ankle[0]) - x, tall) * sign
    return {
        f"{side}UpLeg": np.array([-np.radians(ahead), 0.0, -sign * inwards]),
        f"{side}Leg": np.zeros(3),
        f"{side}Foot": np.array([np.radians(ahead), 0.0, sign * inwards]),
    }


def _feet_together(avatar: Avatar, generator: np.random.Generator) -> Drawn:
    pose = _standing(generator) | {"Hips": np.zeros(3)}
    for side, sign in SIDES:
        pose |= _leg_across(avatar, side, sign * 0.045, float(generator.normal(0, 2)))
    return pose, _yaw(generator), None


def _feet_crossed(avatar: Avatar, generator: np.random.Generator) -> Drawn:
    pose, (before, sign) = _standing(generator) | {"Hips": np.zeros(3)}, _side(generator)
    behind = "Right" if before == "Left" else "Left"
    pose |= _leg_across(
        avatar, before, -sign * generator.uniform(0.03, 0.08), float(generator.uniform(6, 10))
    )
    pose |= _leg_across(avatar, behind, sign * 0.01, float(generator.uniform(-4, 0)))
    return pose, _yaw(generator), None


def _phone(avatar: Avatar, generator: np.random.Generator) -> Drawn:
    pose, held = _standing(generator), held_of("slab", generator)
    side = next(iter(held.things))
    sign, shoulder = dict(SIDES)[side], float(_head(avatar, f"{side}Arm")[1])
    height = shoulder - generator.uniform(0.1, 0.3)
    target = np.array(
        [sign * 0.08, height, _front(avatar, sign * 0.08, height) + generator.uniform(0.12, 0.25)]
    )
    pose |= arm_reaching(avatar, side, target, np.array([0.6 * sign, -1.0, -0.2]))
    fingers = {
        name: turn
        for name, turn in held.pose.items()
        if "Hand" in name and not name.endswith("Hand")
    }
    return pose, _yaw(generator), Held(held.kind, held.things, fingers, held.hangs)


def _bag(avatar: Avatar, generator: np.random.Generator) -> Drawn:
    return _standing(generator), _yaw(generator), held_of("bag", generator)


def _walk(avatar: Avatar, generator: np.random.Generator) -> Drawn:
    pose, (front, _) = _standing(generator), _side(generator)
    for side, sign in SIDES:
        ahead = side == front
        thigh, knee = (
            (generator.uniform(18, 30), generator.uniform(5, 15))
            if ahead
            else (-generator.uniform(12, 22), generator.uniform(8, 40))
        )
        bend = np.radians([thigh, knee])
        pose |= {
            f"{side}UpLeg": np.array([-bend[0], 0.0, sign * 0.03]),
            f"{side}Leg": np.array([bend[1], 0.0, 0.0]),
            f"{side}Foot": np.array([0.5 * (bend[0] - bend[1]), 0.0, 0.0]),
        }
        swing = np.radians(-generator.uniform(12, 25) if ahead else generator.uniform(12, 25))
        upper = np.array([sign * 0.15, -np.cos(swing), np.sin(swing)])
        pose |= arm_towards(
            side, sign, upper, upper + np.array([0.0, 0.0, generator.uniform(0.1, 0.4)])
        )
    return pose, float(generator.uniform(-50, 50)), None


def _by_stance(name: str) -> Callable[[Avatar, np.random.Generator], Drawn]:
    """Return the draw function of a class of `STANCES`."""

    def draw(avatar: Avatar, generator: np.random.Generator) -> Drawn:
        pose, yaw = STANCES[name](generator)
        return dict(pose), yaw, None

    return draw


ORDINARY: Mapping[str, Callable[[Avatar, np.random.Generator], Drawn]] = MappingProxyType(
    {
        "sides": _sides,
        "aside": _aside,
        "hips": _hips,
        "crossed": _crossed,
        "face": _face,
        "pockets": _pockets,
        "feet_together": _feet_together,
        "feet_crossed": _feet_crossed,
        "phone": _phone,
        "bag": _bag,
        "walk": _walk,
        "sit": _by_stance("sit"),
        "squat": _by_stance("squat"),
    }
)
"""The classes of poses by name."""
