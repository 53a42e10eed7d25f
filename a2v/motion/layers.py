"""Layers: the arms, head and trunk of one action over the legs of another, on the library's
skeleton.

Bones of the upper action are turned with the chest (the trunk: with the pelvis) of the lower one,
so legs, hips and contacts of the lower action stay as they are. A part of the body is taken over
only if the upper action uses it: where it differs from the relaxed idle pose. `layers.csv` says
which actions of the models, and which seats, can be layered; for clips it is measured.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path

import numpy as np

from a2v.geometry.steps import smoothstep
from a2v.geometry.vectors import unit
from a2v.kinematics import Skeleton
from a2v.kinematics.skeleton import subtree
from a2v.kinematics.transforms import bone_vectors
from a2v.motion.clips import RELAXED, clip_library
from a2v.motion.names import plain_name
from a2v.types import FloatArray

TABLE = Path(__file__).with_name("layers.csv")
STAYS = 0.12
"""Largest way of feet and pelvis in a clip that only uses the upper body, meters."""
STANDS = 0.12
"""Largest height difference in meters of its pelvis from that of the idle pose."""
USED = 0.1
"""Distance in meters of a joint from its idle place, relative to the chest, from which a clip uses
that part of the body."""
LEANS = np.deg2rad(9.0)
"""Angle by which the trunk must bend from idle to be used."""
EASE_SECONDS = 0.3
"""Seconds over which a layer begins and ends."""


@cache
def _table() -> list[tuple[str, str]]:
    with TABLE.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return [("*".join(map(plain_name, row["action"].split("*"))), row["body"]) for row in rows]


@cache
def _body(action: str) -> str:
    """Return what an action is in layers: "upper", "seat" or "" for the whole body."""
    name = plain_name(action)
    for pattern, body in _table():
        if fnmatchcase(name, pattern):
            return body
    library = clip_library()
    if action not in library.actions:
        return ""
    index = library.index(action)
    clip, joints = library.clips[index], library.joints[index]
    if clip.air or clip.pace or action == RELAXED:
        return ""
    names = library.skeleton.joint_names
    idle = library.joints[library.index(RELAXED)][0]
    feet = joints[:, [names.index("foot_l"), names.index("foot_r"), names.index("pelvis")]]
    moves = np.ptp(feet, axis=0).max()
    drop = np.abs(joints[:, 0, 1] - idle[0, 1]).max()
    return "upper" if moves < STAYS and drop < STANDS else ""


def is_upper(action: str) -> bool:
    """Return whether an action only needs the upper body, so that it can be laid over another."""
    return _body(action) == "upper"


def sits(action: str) -> bool:
    """Return whether the person of an action has a seat or stays crouched: the lower layer."""
    return _body(action) == "seat"


@dataclass(frozen=True)
class _Parts:
    """Joints of the library's skeleton by part of the body."""

    trunk: list[int]
    head: list[int]
    arms: dict[str, list[int]]


def _parts(skeleton: Skeleton) -> _Parts:
    names, parents = skeleton.joint_names, skeleton.parents.tolist()
    arms = {
        side: sorted(subtree(parents, names.index(f"clavicle_{side[0]}")))
        for side in ("left", "right")
    }
    head = sorted(subtree(parents, names.index("neck_01")))
    trunk = [names.index(name) for name in names if name.startswith("spine_")]
    return _Parts(trunk, head, arms)


def _frames(
    joints: FloatArray, skeleton: Skeleton, across: tuple[str, str], ends: tuple[str, str]
) -> FloatArray:
    """Orientation (T, 3, 3) of a part of the trunk, with columns left, up and ahead."""
    names = skeleton.joint_names
    left = unit(joints[:, names.index(across[0])] - joints[:, names.index(across[1])])
    up = joints[:, names.index(ends[1])] - joints[:, names.index(ends[0])]
    up = unit(up - (up * left).sum(-1, keepdims=True) * left)
    return np.stack([left, up, np.cross(left, up)], axis=-1)


def chest_of(joints: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Orientation (T, 3, 3) of the chest of joints (T, J, 3)."""
    return _frames(joints, skeleton, ("upperarm_l", "upperarm_r"), ("spine_02", "neck_01"))


def pelvis_of(joints: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Orientation (T, 3, 3) of the pelvis of joints (T, J, 3)."""
    return _frames(joints, skeleton, ("thigh_l", "thigh_r"), ("pelvis", "spine_01"))


def used_parts(over: FloatArray, skeleton: Skeleton) -> list[str]:
    """Parts of the body that joints (T, J, 3) use: "trunk", "head", "left", "right"."""
    library, names = clip_library(), skeleton.joint_names
    idle = library.joints[library.index(RELAXED)][:1]
    own, rest = chest_of(over, skeleton), chest_of(idle, skeleton)
    away = np.einsum("tba,tjb->tja", own, over - over[:, [names.index("spine_03")]])
    at_rest = np.einsum("tba,tjb->tja", rest, idle - idle[:, [names.index("spine_03")]])
    used = []
    turned = (
        np.einsum("tba,tbc->tac", pelvis_of(over, skeleton), chest_of(over, skeleton))
        @ (pelvis_of(idle, skeleton)[0].T @ rest[0]).T
    )
    angle = np.arccos(np.clip((np.trace(turned, axis1=1, axis2=2) - 1) / 2, -1, 1))
    if angle.max() > LEANS:
        used.append("trunk")
    for part, name in (("head", "head_front"), ("left", "hand_l"), ("right", "hand_r")):
        far = np.linalg.norm(away[:, names.index(name)] - at_rest[:, names.index(name)], axis=-1)
        if far.max() > (0.5 * USED if part == "head" else USED):
            used.append(part)
    return used


def layered(base: FloatArray, over: FloatArray, parts: list[str], fps: float) -> FloatArray:
    """Lay parts of `over` over `base`.

    Parameters
    ----------
    base, over : (T, J, 3) float
        On the library's skeleton, meters.
    parts : list of str
        Of "trunk", "head", "left", "right" (arms).
    fps : float

    Returns
    -------
    (T, J, 3) float64
        Pelvis and legs of `base`; bones keep its lengths.
    """
    skeleton = clip_library().skeleton
    own = _parts(skeleton)
    made, donor = base.astype(np.float64), over.astype(np.float64)
    times = np.arange(len(made)) / fps
    share = smoothstep(times, 0.0, EASE_SECONDS)[:, None, None]
    if "trunk" in parts:
        turn = pelvis_of(made, skeleton) @ pelvis_of(donor, skeleton).transpose(0, 2, 1)
        trunk = [*own.trunk, *own.head, *own.arms["left"], *own.arms["right"]]
        # a bent trunk carries arms and head along
        before = chest_of(made, skeleton)
        made = _mixed(made, donor, own.trunk, turn, share, skeleton)
        after = chest_of(made, skeleton)
        carried = after @ before.transpose(0, 2, 1)
        rest = [joint for joint in trunk if joint not in own.trunk]
        made = _mixed(made, made, rest, carried, np.ones_like(share), skeleton)
    turn = chest_of(made, skeleton) @ chest_of(donor, skeleton).transpose(0, 2, 1)
    limbs = [
        joint
        for part, joints in (("head", own.head), *own.arms.items())
        if part in parts
        for joint in joints
    ]
    return _mixed(made, donor, limbs, turn, share, skeleton)


def _mixed(
    base: FloatArray,
    donor: FloatArray,
    bones: list[int],
    turn: FloatArray,
    share: FloatArray,
    skeleton: Skeleton,
) -> FloatArray:
    """Turn the `bones` of `donor` by `turn` (T, 3, 3) and mix them into `base` by `share`
    (T, 1, 1)."""
    vectors, others = bone_vectors(base, skeleton), bone_vectors(donor, skeleton)
    wanted = np.einsum("tab,tjb->tja", turn, others[:, bones])
    lengths = np.linalg.norm(vectors[:, bones], axis=-1, keepdims=True)
    mixed = vectors[:, bones] + share * (wanted - vectors[:, bones])
    vectors[:, bones] = (
        mixed * lengths / np.maximum(np.linalg.norm(mixed, axis=-1, keepdims=True), 1e-9)
    )
    made: FloatArray = np.einsum("jb,tbx->tjx", skeleton.path_matrix, vectors) + base[:, :1]
    return made
