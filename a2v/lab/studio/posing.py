"""Poses of the studio's people: natural standing, T- and A-poses, and frames of recorded actions.

A pose maps bone names to rotation vectors for `Avatar.bone_transforms`: in the world's axes of the
T-pose, relative to the parent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import rotmat_to_rotvec, rotvec_to_rotmat
from a2v.lab.studio.avatars import Avatar
from a2v.record import Record
from a2v.types import Body, FloatArray

Pose = dict[str, FloatArray]

SIDES = (("Left", 1.0), ("Right", -1.0))
POSED_BONES: tuple[str, ...] = (
    "Hips",
    "Spine",
    "Spine1",
    "Spine2",
    "Neck",
    "Head",
    *(
        f"{side}{bone}"
        for side, _ in SIDES
        for bone in ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase")
    ),
)
"""Bones that recorded actions turn."""

_NOISE = {
    "Hips": 1.5,
    "Spine": 1.5,
    "Spine1": 1.5,
    "Spine2": 1.5,
    "Neck": 3.0,
    "Head": 4.0,
    "Shoulder": 2.0,
    "Arm": 3.5,
    "ForeArm": 4.0,
    "Hand": 7.0,
    "UpLeg": 2.5,
    "Leg": 2.0,
    "Foot": 3.0,
    "ToeBase": 2.0,
}
"""Standard deviation of the noise about each axis, degrees."""


def natural_pose(generator: np.random.Generator) -> Pose:
    """Draw a pose of someone who stands for a photograph: arms hanging, folded to the hips or half
    raised, weight on one or both legs."""
    pose: Pose = {}
    lean = generator.normal(0, 1, 3) * np.radians(
        [3.0, 4.0, 2.5]
    )  # forward, about the spine, sideways
    for name, share in (("Spine", 0.3), ("Spine1", 0.35), ("Spine2", 0.35)):
        pose[name] = lean * share
    look = generator.normal(0, 1, 3) * np.radians([6.0, 14.0, 4.0])
    pose["Neck"], pose["Head"] = 0.4 * look, 0.6 * look
    both = generator.random() < 0.65  # both arms have the same style
    first = _arm_style(generator)
    for side, sign in SIDES:
        style = first if both or side == "Left" else _arm_style(generator)
        pose |= _arm(generator, side, sign, style)
        pose |= _fingers(generator, side, sign)
    pose |= _legs(generator)
    return pose


def open_pose(generator: np.random.Generator) -> Pose:
    """Draw a pose between A- and T-pose: straight arms 40 to 95 degrees from the body."""
    pose: Pose = {}
    raised = generator.uniform(40, 95)
    for side, sign in SIDES:
        up = np.radians(raised + generator.normal(0, 5))
        forward = np.radians(generator.normal(3, 6))
        upper = np.array([sign * np.sin(up), -np.cos(up), np.sin(forward)])
        pose |= arm_towards(
            side, sign, upper, upper + np.array([0, 0, abs(generator.normal(0.05, 0.06))])
        )
        pose |= _fingers(generator, side, sign, most=20.0)
    pose |= _legs(generator)
    return pose


def joint_noise(
    pose: Mapping[str, FloatArray], generator: np.random.Generator, scale: float = 1.0
) -> Pose:
    """Add a little noise to every joint of a pose: `scale` times a few degrees."""
    noisy = {name: np.asarray(rotvec, np.float64) for name, rotvec in pose.items()}
    for name in POSED_BONES:
        spread = _NOISE[name.removeprefix("Left").removeprefix("Right")]
        noisy[name] = noisy.get(name, np.zeros(3)) + scale * np.radians(
            spread
        ) * generator.standard_normal(3)
    return noisy


def _arm_style(generator: np.random.Generator) -> str:
    return str(generator.choice(["hanging", "hips", "forward", "raised"], p=[0.7, 0.14, 0.1, 0.06]))


def _arm(generator: np.random.Generator, side: str, sign: float, style: str) -> Pose:
    """Return one arm from the directions of upper arm and forearm in the frame of the chest (left
    arm; the right one is mirrored)."""
    if style == "hanging":
        out, forward = np.radians(
            [
                generator.uniform(10, 55) if generator.random() < 0.7 else generator.uniform(8, 22),
                generator.normal(0, 9),
            ]
        )
        bend, inwards = np.radians([abs(generator.normal(14, 14)), generator.uniform(-5, 35)])
        upper = np.array(
            [np.sin(out), -np.cos(out) * np.cos(forward), np.cos(out) * np.sin(forward)]
        )
        # the forearm turns forward from the upper arm, and inward with it
        ahead = np.array([-np.sin(inwards), 0.15, np.cos(inwards)])
        fore = np.cos(bend) * upper + np.sin(bend) * _unit(ahead - (ahead @ upper) * upper)
    elif style == "hips":
        out, back = np.radians([generator.uniform(38, 58), generator.uniform(0, 25)])
        upper = np.array([np.sin(out), -np.cos(out), -np.sin(back)])
        fore = np.array(
            [
                -generator.uniform(0.75, 1.0),
                -generator.uniform(0.25, 0.6),
                generator.uniform(0.2, 0.55),
            ]
        )
    elif style == "forward":
        out, forward = np.radians([generator.uniform(8, 35), generator.uniform(-5, 25)])
        upper = np.array([np.sin(out), -np.cos(out), np.sin(forward)])
        fore = np.array([generator.uniform(-0.75, 0.2), generator.uniform(-0.5, 0.7), 1.0])
    else:
        out = np.radians(generator.uniform(60, 120))
        upper = np.array([np.sin(out), -np.cos(out), generator.uniform(-0.1, 0.3)])
        fore = np.array(
            [generator.uniform(-0.4, 0.7), generator.uniform(0.2, 1.0), generator.uniform(0.1, 0.5)]
        )
    mirror = np.array([sign, 1.0, 1.0])
    pose = arm_towards(side, sign, upper * mirror, fore * mirror)
    # the palm mostly faces the thigh, sometimes the back or the front
    pose[f"{side}Hand"] = np.radians(
        [generator.normal(0, 22), generator.normal(0, 8), sign * generator.normal(-5, 10)]
    )
    return pose


def arm_towards(side: str, sign: float, upper: FloatArray, fore: FloatArray) -> Pose:
    """Return rotations that point the `side`'s upper arm along `upper` (3,) and its forearm along
    `fore` (3,).

    Directions are in the axes of the chest, rotations from the T-pose. `sign` is 1 for the left arm
    and -1 for the right one.
    """
    rest = np.array([sign, 0.0, 0.0])
    rest_axis = np.array([0.0, -sign, 0.0])  # axis about which the forearm bends forward
    upper, fore = _unit(np.asarray(upper, np.float64)), _unit(np.asarray(fore, np.float64))
    # an arm without twist bends about the axis that is moved by the swing from the T-pose
    swing = _frame(upper, np.array([0.0, 0.0, 1.0])) @ _frame(rest, np.array([0.0, 0.0, 1.0])).T
    bent = np.cross(upper, fore)
    weight = np.clip(np.linalg.norm(bent) / 0.2, 0, 1)
    axis = weight * _unit(bent) + (1 - weight) * (swing @ rest_axis)
    arm = _frame(upper, axis) @ _frame(rest, rest_axis).T
    forearm = _frame(fore, axis) @ _frame(rest, rest_axis).T
    # the collarbone rises with an arm above the shoulder
    lift = sign * 0.3 * max(0.0, float(np.arcsin(np.clip(upper[1], -1, 1))) + 0.35) - sign * 0.12
    collar = rotvec_to_rotmat(np.array([0.0, 0.0, lift]))
    return {
        f"{side}Shoulder": np.array([0.0, 0.0, lift]),
        f"{side}Arm": rotmat_to_rotvec(collar.T @ arm),
        f"{side}ForeArm": rotmat_to_rotvec(arm.T @ forearm),
    }


def _fingers(generator: np.random.Generator, side: str, sign: float, most: float = 45.0) -> Pose:
    curl = generator.uniform(2, most)
    pose: Pose = {}
    for finger in ("Index", "Middle", "Ring", "Pinky"):
        own = np.radians(np.clip(curl + generator.normal(0, 5), 0, 80))
        for joint in (1, 2, 3):
            pose[f"{side}Hand{finger}{joint}"] = np.array([0.0, 0.0, -sign * own])
    return pose


def curled_fingers(generator: np.random.Generator, most: float = 80.0) -> Pose:
    """Draw both hands, each between open and a fist (`most` degrees per joint)."""
    pose: Pose = {}
    for side, sign in SIDES:
        pose |= _fingers(generator, side, sign, most=most)
    return pose


def _legs(generator: np.random.Generator) -> Pose:
    pose: Pose = {}
    roll = np.radians(generator.normal(0, 2.5))
    pose["Hips"] = np.array([0.0, 0.0, roll])
    relaxed = generator.choice(["Left", "Right", ""])
    spread = abs(generator.normal(6, 4))
    for side, sign in SIDES:
        out = np.radians(max(0.0, spread + generator.normal(0, 1.5)))
        outward = np.radians(abs(generator.normal(6, 7)))
        knee = np.radians(
            abs(generator.normal(0, 4)) + (generator.uniform(5, 32) if side == relaxed else 0.0)
        )
        thigh = 0.55 * knee + np.radians(generator.normal(0, 3))
        pose[f"{side}UpLeg"] = np.array([-thigh, sign * outward, sign * out - roll])
        pose[f"{side}Leg"] = np.array([knee, 0.0, 0.0])
        pose[f"{side}Foot"] = np.array([-(knee - thigh), 0.0, -sign * out])  # the sole stays level
    return pose


@dataclass(frozen=True, kw_only=True)
class PoseLibrary(Record):
    """Poses of recorded actions.

    Attributes
    ----------
    bones : tuple of J str
        Names of the bones.
    rotations : (P, J, 3) float32
        Rotation vectors, radians, as `Avatar.bone_transforms` takes them.
    actions : tuple of P str
    """

    bones: tuple[str, ...]
    rotations: FloatArray
    actions: tuple[str, ...]

    def __post_init__(self) -> None:
        self._check("rotations", ("P", len(self.bones), 3))

    def pose(self, index: int) -> Pose:
        """Return pose `index`, with relaxed fingers."""
        return {
            name: self.rotations[index, place].astype(np.float64)
            for place, name in enumerate(self.bones)
        }


def avatar_body(
    avatar: Avatar, pose: Mapping[str, Sequence[float] | FloatArray] | None = None
) -> Body:
    """Return an avatar's rig and mesh as a `Body` in the given pose (default: its T-pose), for
    `retarget` and `bind`."""
    transforms = avatar.bone_transforms(pose)
    dense = np.zeros((len(avatar.weights), len(avatar.bone_names)), np.float32)
    np.add.at(dense, (np.arange(len(dense))[:, None], avatar.bones), avatar.weights)
    return Body(
        model="avatar",
        parameters={},
        vertices=avatar.skin(transforms),
        faces=avatar.faces,
        bone_names=avatar.bone_names,
        bone_parents=avatar.bone_parents,
        bone_transforms=transforms,
        rest_transforms=avatar.rest_transforms,
        bone_tails=transforms[:, :3, 3],
        weights=dense,
        parts=avatar.parts,
    )


def local_rotations(avatar: Avatar, transforms: FloatArray) -> FloatArray:
    """Return the rotation vectors (..., B, 3) with which `bone_transforms` gives world-from-bone
    transforms (..., B, 4, 4)."""
    rest = avatar.rest_transforms[:, :3, :3].astype(np.float64)
    world_rotmat = transforms[..., :3, :3].astype(np.float64) @ np.swapaxes(rest, -1, -2)
    local_rotmat = world_rotmat.copy()
    for bone, parent in enumerate(avatar.bone_parents):
        if parent >= 0:
            local_rotmat[..., bone, :, :] = (
                np.swapaxes(world_rotmat[..., parent, :, :], -1, -2) @ world_rotmat[..., bone, :, :]
            )
    return np.asarray(rotmat_to_rotvec(local_rotmat))


def action_poses(
    avatar: Avatar, data: str, *, clips: int = 250, frames: int = 3, seed: int = 0
) -> PoseLibrary:
    """Return frames of CMU's and HumanAct12's clips on the rig of the avatars.

    Parameters
    ----------
    avatar : Avatar
        The poses are made for its proportions; all avatars share the rig.
    data : path
        Folder that holds ``cmu_mocap.zip`` and ``humanact12.zip``; one of them suffices.
    clips : int
        Number of clips of each data set, drawn evenly over the actions.
    frames : int
        Number of frames of each clip.

    Raises
    ------
    InputError
        Neither data set exists.
    """
    from a2v.animation.life import STILL
    from a2v.animation.retarget import RetargetSettings, retarget
    from a2v.lab.datasets import load_dataset

    generator = np.random.default_rng(seed)
    body = avatar_body(avatar)
    slots = [avatar.bone_names.index(name) for name in POSED_BONES]
    rotations: list[FloatArray] = []
    actions: list[str] = []
    problems: list[str] = []
    for name in ("cmu", "humanact12"):
        try:
            found = load_dataset(name, data)
        except InputError as error:
            problems.append(str(error))
            continue
        labels = generator.permutation(
            np.repeat(np.arange(len(found.actions)), -(-clips // len(found.actions)))
        )[:clips]
        for label in labels:
            motion = found.motion(int(generator.choice(np.flatnonzero(found.labels == label))))
            chosen = np.sort(
                generator.choice(motion.frames, min(frames, motion.frames), replace=False)
            )
            transforms = retarget(motion, body, settings=RetargetSettings(raw=True, life=STILL))[
                chosen
            ]
            local = local_rotations(avatar, transforms)[:, slots]
            # a person's heading is drawn separately for every photograph: the root keeps only its
            # tilt
            local[:, 0] = np.stack([without_heading(rotvec) for rotvec in local[:, 0]])
            rotations.append(local)
            actions += [motion.action] * len(chosen)
    if not rotations:
        raise InputError(f"no recorded motions for action poses: {'; '.join(problems)}")
    return PoseLibrary(
        bones=POSED_BONES,
        rotations=np.concatenate(rotations).astype(np.float32),
        actions=tuple(actions),
    )


def without_heading(rotvec: FloatArray) -> FloatArray:
    """Remove the part about the vertical from a rotation vector (3,), radians."""
    rotmat = rotvec_to_rotmat(rotvec)
    heading = float(np.arctan2(rotmat[0, 2], rotmat[2, 2]))
    return np.asarray(rotmat_to_rotvec(rotvec_to_rotmat(np.array([0.0, -heading, 0.0])) @ rotmat))


def _unit(vector: FloatArray) -> FloatArray:
    """Scale a vector (3,) to length 1.

    For a single vector the norm differs from `a2v.geometry.vectors.unit` in the last bit, and seeds
    depend on it.
    """
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-12))


def _frame(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return a rotation whose first column is along `first`, and whose second column is as near as
    possible to `second`."""
    x = _unit(first)
    z = _unit(np.cross(x, second))
    return np.stack([x, np.cross(z, x), z], axis=-1)
