"""Poses of a true person's rig carried over to the rig of a character.

What is carried are rotations of joints from the T-pose, so that neither the errors of the fitted
pose nor other lengths of bones count as errors of the pose: each bone of the character turns as the
truth's bone does, and in the T-pose its limbs point where the truth's do. Lengths of bones stay the
character's own. A palm is turned by its knuckles, for rigs disagree about the twist of a hand at
rest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import rotvec_to_rotmat, swing_between
from a2v.lab.studio.makehuman.hm08 import RAISED, RIG_BONES, RIG_PARENTS, rig_bone, rig_heads
from a2v.types import Body, FloatArray

_ENDS = {"Arm": "ForeArm", "ForeArm": "Hand", "UpLeg": "Leg", "Leg": "Foot"}
"""Bones of limbs, and the bones whose heads they point at."""
_KNUCKLES = ("HandMiddle1", "HandIndex1", "HandPinky1")
"""What a palm points at, and the two ends of its row of knuckles."""
_SIDES = ("Left", "Right")


def truth_turns(bone_transforms: FloatArray, rest_transforms: FloatArray) -> FloatArray:
    """World rotations (..., B, 3, 3) of a rig's bones from its T-pose: world-from-bone (..., B, 4,
    4), and at rest (B, 4, 4)."""
    turned: FloatArray = bone_transforms[..., :3, :3].astype(np.float64) @ np.swapaxes(
        rest_transforms[:, :3, :3].astype(np.float64), -1, -2
    )
    return turned


def carried(body: Body, names: Sequence[str], heads: FloatArray, turns: FloatArray) -> FloatArray:
    """A body's bones where the truth's are.

    Parameters
    ----------
    body : Body
        Anny's.
    names : sequence of N str
        Bones of the truth's rig, which has the avatars' names.
    heads : (N, 3) float
        Their heads in the T-pose.
    turns : (T, N, 3, 3) float
        How they turn from there (`truth_turns`), world axes.

    Returns
    -------
    (T, B, 4, 4) float64
        World from bone of the body, meters; its root is at the origin.

    Raises
    ------
    InputError
        The truth's rig has no hips.
    """
    if "Hips" not in names:
        raise InputError(f"the rig has no bone 'Hips'; its bones: {', '.join(names)}")
    rest = body.rest_transforms.astype(np.float64)
    own = np.array([RIG_BONES.index(rig_bone(name)) for name in body.bone_names])
    raised = _to_t_pose(rig_heads(body.bone_names, rest[:, :3, 3]), names, heads)
    source = _sources(names)
    turned = turns[:, source][:, own] @ raised[own]
    made = np.tile(np.eye(4), (len(turns), len(rest), 1, 1))
    made[..., :3, :3] = turned @ rest[:, :3, :3]
    for bone, parent in enumerate(body.bone_parents.tolist()):
        if parent >= 0:
            made[:, bone, :3, 3] = made[:, parent, :3, 3] + turned[:, parent] @ (
                rest[bone, :3, 3] - rest[parent, :3, 3]
            )
    return made


def _sources(names: Sequence[str]) -> list[int]:
    """For each of `RIG_BONES` the truth's bone of that name, or of its nearest ancestor that the
    truth has."""
    found = [0] * len(RIG_BONES)
    for bone, name in enumerate(RIG_BONES):
        found[bone] = names.index(name) if name in names else found[max(int(RIG_PARENTS[bone]), 0)]
    return found


def _to_t_pose(own: FloatArray, names: Sequence[str], heads: FloatArray) -> FloatArray:
    """Rotations (R, 3, 3) of `RIG_BONES` from where a body rests, with heads `own` (R, 3), to the
    truth's T-pose with `heads` (N, 3)."""
    place = {name: np.asarray(heads[index], np.float64) for index, name in enumerate(names)}
    mine = dict(zip(RIG_BONES, own, strict=True))
    turns = np.tile(np.eye(3), (len(RIG_BONES), 1, 1))
    for bone, name in enumerate(RIG_BONES):
        side = next((prefix for prefix in _SIDES if name.startswith(prefix)), "")
        stem = name.removeprefix(side)
        if stem == "Shoulder":
            turns[bone] = rotvec_to_rotmat(
                np.array([0.0, 0.0, RAISED if side == "Left" else -RAISED])
            )
        elif stem in _ENDS and side + _ENDS[stem] in place:
            end = side + _ENDS[stem]
            turns[bone] = rotvec_to_rotmat(
                swing_between(mine[end] - mine[name], place[end] - place[name])
            )
        elif stem == "Hand" and all(side + knuckle in place for knuckle in _KNUCKLES):
            turns[bone] = _palm(place, side) @ _palm(mine, side).T
        elif stem.startswith("Hand") and int(RIG_PARENTS[bone]) >= 0:
            turns[bone] = turns[RIG_PARENTS[bone]]
    return turns


def _palm(heads: dict[str, FloatArray], side: str) -> FloatArray:
    """Axes (3, 3) of a palm as columns: towards the middle knuckle, out of the palm's plane, and
    across."""
    middle, first, last = (heads[side + knuckle] for knuckle in _KNUCKLES)
    ahead = middle - heads[f"{side}Hand"]
    ahead = ahead / np.linalg.norm(ahead)
    out = np.cross(ahead, last - first)
    out = out / np.linalg.norm(out)
    return np.stack([ahead, out, np.cross(ahead, out)], axis=-1)
