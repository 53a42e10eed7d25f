"""Transfer poses from a true person's rig to the rig of a character.

Rotations of joints from the T-pose are transferred, so that neither errors of the fitted pose nor
other lengths of bones count as errors of the pose: each bone of the character turns as that of the
truth, and in the T-pose its limbs point in the same directions. The lengths of bones stay those of
the character. A palm is turned by its knuckles, because rigs have different twists of hands at
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
"""Limb bones, and the bones to whose heads they point."""
_KNUCKLES = ("HandMiddle1", "HandIndex1", "HandPinky1")
"""The knuckle to which a palm points, and the two ends of the row of knuckles."""
_SIDES = ("Left", "Right")


def truth_turns(bone_transforms: FloatArray, rest_transforms: FloatArray) -> FloatArray:
    """World rotations (..., B, 3, 3) of a rig's bones from its T-pose: world-from-bone (..., B, 4,
    4), and at rest (B, 4, 4)."""
    turned: FloatArray = bone_transforms[..., :3, :3].astype(np.float64) @ np.swapaxes(
        rest_transforms[:, :3, :3].astype(np.float64), -1, -2
    )
    return turned


def carried(
    body: Body,
    names: Sequence[str],
    heads: FloatArray,
    turns: FloatArray,
    corrections: FloatArray | None = None,
) -> FloatArray:
    """Put the bones of a body into the poses of the truth.

    Parameters
    ----------
    body : Body
        Of the model Anny.
    names : sequence of N str
        Bones of the truth's rig, with the names of the avatars.
    heads : (N, 3) float
        Their heads in the T-pose.
    turns : (T, N, 3, 3) float
        Rotations from there (`truth_turns`), world axes.
    corrections : (R, 3, 3) float, optional
        Rotations of `RIG_BONES` in the T-pose, before `turns`, world axes
        (`a2v.lab.evaluation.moved.limbs`).

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
    if corrections is not None:
        raised = corrections @ raised
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
    """For each of `RIG_BONES`, the truth's bone of that name or of the nearest ancestor in the
    truth's rig."""
    found = [0] * len(RIG_BONES)
    for bone, name in enumerate(RIG_BONES):
        found[bone] = names.index(name) if name in names else found[max(int(RIG_PARENTS[bone]), 0)]
    return found


def _to_t_pose(own: FloatArray, names: Sequence[str], heads: FloatArray) -> FloatArray:
    """Rotations (R, 3, 3) of `RIG_BONES` from the rest pose of a body, with heads `own` (R, 3), to
    the T-pose of the truth with `heads` (N, 3)."""
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
