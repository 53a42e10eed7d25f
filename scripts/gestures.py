"""Gestures of our own for the library of clips: wave, clap, kick and others, as keyed poses.

``scripts/make_clips.py`` bakes them. A key places wrists from the shoulder and ankles from the hip
of their side: meters, x outwards, y up, z ahead. Directions have the same axes. All values are
eased between keys.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2v.geometry.steps import smoothstep
from a2v.geometry.vectors import unit
from a2v.kinematics import Skeleton, rotvec_to_rotmat

FPS = 30.0
SIDES = {"l": 1.0, "r": -1.0}

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Arm:
    """Place of an arm; None leaves that of the idle pose."""

    wrist: Vector
    along: Vector
    palm: Vector
    elbow: Vector = (0.6, -1.0, -0.3)
    hand: str = "open"


@dataclass(frozen=True)
class Key:
    """A pose at a time, seconds; angles in degrees, forward is positive."""

    time: float
    r: Arm | None = None
    l: Arm | None = None  # noqa: E741
    foot: Vector | None = None
    sink: float = 0.0
    spine: float = 0.0
    neck: float = 0.0
    shrug: float = 0.0


def both(time: float, arm: Arm, **other: float) -> Key:
    """Return a key with symmetric arms."""
    return Key(time, arm, arm, **other)


def _wave(sway: float) -> Arm:
    return Arm((0.2 + sway, 0.24, 0.2), (0.3 + 4 * sway, 1.0, 0.1), (0, 0, 1), (1.0, -0.9, 0))


_CLAP = Arm((-0.155, -0.2, 0.34), (-0.12, 0.45, 1.0), (-1, 0, 0.1), (0.8, -1.0, -0.2))
_APART = Arm((-0.01, -0.2, 0.32), (-0.1, 0.45, 1.0), (-1, 0, 0.2), (0.8, -1.0, -0.2))
_FACE = Arm((-0.12, 0.03, 0.29), (-0.2, 1.0, -0.15), (0, 0, -1), (0.7, -1.0, 0.4))
_EYES = Arm((-0.085, 0.03, 0.29), (-0.2, 1.0, -0.15), (0, 0, -1), (0.7, -1.0, 0.4))
_SHRUG = Arm((0.16, -0.3, 0.2), (0.75, 0.05, 0.65), (0, 1, -0.1), (0.3, -1.0, -0.4))
_UP = Arm((0.14, 0.46, 0.06), (0.1, 1.0, 0.0), (-0.6, 0, 0.8), (1.0, 0.0, -0.2), "fist")
_LOW = Arm((0.14, 0.3, 0.1), (0.05, 1.0, 0.05), (-0.6, 0, 0.8), (1.0, -0.3, -0.2), "fist")
_BELLY = Arm((-0.12, -0.42, 0.2), (-1.0, -0.1, 0.25), (0, 0, -1), (1.0, -0.6, -0.3))
_AHEAD = Arm((0.0, -0.02, 0.5), (-0.05, 0.0, 1.0), (0, -1, 0), (0.6, -1.0, 0))
_GUARD = Arm((-0.02, -0.08, 0.25), (-0.1, 0.75, 0.6), (-1, 0, 0), (0.6, -1.0, 0), "fist")

GESTURES: dict[str, tuple[Sequence[Key], bool]] = {
    "own-wave": ([Key(0), *(Key(0.45 + 0.26 * k, _wave(0.07 if k % 2 else -0.07)) for k in range(7)), Key(2.6)], False),
    "own-wave-both": ([Key(0), *(both(0.45 + 0.26 * k, _wave(0.07 if k % 2 else -0.07)) for k in range(7)), Key(2.6)], False),
    "own-clap": ([both(0.16 * k, _APART if k % 2 else _CLAP) for k in range(14)] + [both(0.16 * 14, _CLAP)], True),
    "own-point": ([Key(0), *(Key(t, Arm((-0.02, 0.0, 0.53), (-0.05, 0.02, 1.0), (0, -1, 0), hand="point")) for t in (0.5, 1.7)), Key(2.3)], False),
    "own-thumbs-up": ([Key(0), *(Key(t, Arm((-0.02, -0.14, 0.38), (-0.2, 0.1, 1.0), (-1, 0, -0.2), hand="thumb")) for t in (0.45, 1.6)), Key(2.1)], False),
    "own-salute": ([Key(0), *(Key(t, Arm((-0.01, 0.15, 0.15), (-0.75, 0.62, 0.0), (-0.1, -0.75, 0.55), (1.0, -0.25, 0.1))) for t in (0.45, 1.6)), Key(2.1)], False),
    "own-shrug": ([Key(0), *(both(t, _SHRUG, shrug=0.05, neck=-4) for t in (0.4, 1.0)), Key(1.6)], False),
    "own-cheer": ([Key(0), *(both(0.4 + 0.25 * k, _UP if k % 2 == 0 else _LOW, spine=-4, neck=-10) for k in range(9)), Key(2.9)], False),
    "own-facepalm": ([Key(0), *(Key(t, _FACE, neck=n, spine=6) for t, n in ((0.5, 22), (1.0, 26), (1.8, 24))), Key(2.5)], False),
    "own-cry": ([both(0.25 * k, _EYES, neck=30, spine=14 + (3 if k % 2 else 0)) for k in range(9)], True),
    "own-laugh": ([Key(0.2 * k, _BELLY, spine=-8 + (9 if k % 2 else 0), neck=-12 + (8 if k % 2 else 0)) for k in range(13)], True),
    "own-kick": (
        [Key(0, _GUARD, _GUARD), Key(0.35, _GUARD, _GUARD, foot=(0.02, -0.6, 0.28), spine=-4), Key(0.55, _LOW, _GUARD, foot=(0.0, -0.12, 0.8), spine=-14),
         Key(0.7, _LOW, _GUARD, foot=(0.0, -0.14, 0.79), spine=-13), Key(1.0, _GUARD, _GUARD, foot=(0.02, -0.62, 0.25)), Key(1.4, _GUARD, _GUARD)], False,
    ),
    "own-squat": ([both(0, _AHEAD), both(0.95, _AHEAD, sink=0.36, spine=30, neck=-14), both(1.1, _AHEAD, sink=0.36, spine=30, neck=-14), both(2.1, _AHEAD)], True),
    "own-hands-up": ([Key(0), *(both(t, Arm((0.2, 0.3, 0.08), (0.05, 1.0, 0.05), (0, 0, 1), (1.0, -0.6, 0))) for t in (0.5, 2.6)), Key(3.2)], False),
}  # fmt: skip
"""File names to keys, and whether the gesture is a cycle."""


class Puppet:
    """The idle pose of the library's skeleton, and functions that move it.

    Parameters
    ----------
    skeleton : Skeleton
    idle : (J, 3) float
        Stands, faces +z.
    hands : dict of str to (J, 3) float
        Poses whose fingers are open, and a fist.
    """

    def __init__(self, skeleton: Skeleton, idle: np.ndarray, hands: dict[str, np.ndarray]) -> None:
        self.names, self.parents, self.idle = skeleton.joint_names, skeleton.parents.tolist(), idle
        self.hands = {
            side: {name: self._hand(pose, side) for name, pose in hands.items()} for side in SIDES
        }
        for side, known in self.hands.items():
            index, thumb = (
                np.array([finger in self.names[at] for at in self.below(f"hand_{side}")])
                for finger in ("index", "thumb")
            )
            known["point"] = np.where(index[:, None], known["open"], known["fist"])
            known["thumb"] = np.where(thumb[:, None], known["open"], known["fist"])

    def at(self, name: str) -> int:
        """Return the index of a joint."""
        return self.names.index(name)

    def below(self, name: str) -> list[int]:
        """Return the joints below a joint."""
        found = {self.at(name)}
        for joint, parent in enumerate(self.parents):
            if parent in found:
                found.add(joint)
        return sorted(found - {self.at(name)})

    def _axes(self, along: np.ndarray, palm: np.ndarray, side: str) -> np.ndarray:
        along = unit(along)
        palm = unit(palm - (palm @ along) * along)
        return np.stack([along, palm, np.cross(palm, along) * SIDES[side]])

    def _hand(self, pose: np.ndarray, side: str) -> np.ndarray:
        """Return the fingers of a pose from the wrist: along the hand, out of the palm, to the
        thumb."""
        wrist, index, middle, little = (
            pose[self.at(f"{name}_{side}")]
            for name in ("hand", "index_01", "middle_01", "pinky_01")
        )
        across = np.cross(index - wrist, little - wrist) * -SIDES[side]
        return (pose[self.below(f"hand_{side}")] - wrist) @ self._axes(
            middle - wrist, across, side
        ).T

    def pose(self, key: Key) -> np.ndarray:
        """Return the joints (J, 3) of a key."""
        pose = self.idle.copy()
        pose[..., 1] -= key.sink
        for name, angle in (
            ("spine_01", key.spine / 2),
            ("spine_03", key.spine / 2),
            ("neck_01", key.neck),
        ):
            moved = self.below(name)
            pose[moved] = (
                pose[self.at(name)]
                + (pose[moved] - pose[self.at(name)])
                @ rotvec_to_rotmat(np.array([np.deg2rad(angle), 0, 0])).T
            )
        for side, arm in (("r", key.r), ("l", key.l)):
            pose[self.below(f"clavicle_{side}")] += [0, key.shrug, 0]
            if arm is not None:
                self._reach_arm(pose, arm, side)
            if key.sink:
                self._reach_leg(pose, side, self.idle[self.at(f"foot_{side}")])
        if key.foot is not None:
            self._reach_leg(pose, "r", pose[self.at("thigh_r")] + np.array(key.foot) * [-1, 1, 1])
        return pose

    def _reach_arm(self, pose: np.ndarray, arm: Arm, side: str) -> None:
        flip = np.array([SIDES[side], 1, 1])
        shoulder, elbow, wrist = (
            self.at(f"{name}_{side}") for name in ("upperarm", "lowerarm", "hand")
        )
        pose[elbow], pose[wrist] = self._bent(
            pose,
            (shoulder, elbow, wrist),
            pose[shoulder] + np.array(arm.wrist) * flip,
            np.array(arm.elbow) * flip,
        )
        axes = self._axes(np.array(arm.along) * flip, np.array(arm.palm) * flip, side)
        pose[self.below(f"hand_{side}")] = pose[wrist] + self.hands[side][arm.hand] @ axes

    def _reach_leg(self, pose: np.ndarray, side: str, ankle: np.ndarray) -> None:
        joints = tuple(self.at(f"{name}_{side}") for name in ("thigh", "calf", "foot"))
        below = self.below(f"foot_{side}")
        foot = self.idle[below] - self.idle[joints[2]]
        lifted = np.clip((ankle[2] - pose[joints[0]][2]) / 0.8, 0, 1)
        pose[joints[1]], pose[joints[2]] = self._bent(
            pose, joints, ankle, np.array([SIDES[side] * 0.15, 0.2, 1.0])
        )
        pose[below] = pose[joints[2]] + foot @ rotvec_to_rotmat(np.array([-0.9 * lifted, 0, 0])).T

    def _bent(
        self, pose: np.ndarray, joints: tuple[int, int, int], target: np.ndarray, pole: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return middle and end of a limb that reaches for the target, with its middle towards the
        pole."""
        first, middle, last = (self.idle[joint] for joint in joints)
        upper, lower = np.linalg.norm(middle - first), np.linalg.norm(last - middle)
        way = target - pose[joints[0]]
        reach = min(np.linalg.norm(way), 0.995 * (upper + lower))
        along = unit(way)
        height = (upper**2 + reach**2 - lower**2) / (2 * reach)
        aside = unit(pole - (pole @ along) * along)
        return pose[joints[0]] + height * along + np.sqrt(
            max(upper**2 - height**2, 0)
        ) * aside, pose[joints[0]] + reach * along

    def play(self, keys: Sequence[Key]) -> np.ndarray:
        """Return the joints (T, J, 3) at `FPS`, eased from key to key."""
        poses, times = (
            np.stack([self.pose(key) for key in keys]),
            np.array([key.time for key in keys]),
        )
        at = np.arange(round(times[-1] * FPS) + 1) / FPS
        before = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
        share = smoothstep((at - times[before]) / (times[before + 1] - times[before]), 0.0, 1.0)
        return poses[before] + share[:, None, None] * (poses[before + 1] - poses[before])
