"""Write the motion of a rig with SMPL's joints in the layout of AMASS."""

from __future__ import annotations

import os

import numpy as np

from a2v.errors import InputError
from a2v.formats.characters import check_clips, parent_from_bone
from a2v.formats.conventions import y_up_rotmat
from a2v.formats.smpl.skeleton import NAMES, PELVIS
from a2v.io import write_npz
from a2v.kinematics import rotmat_to_rotvec
from a2v.types import Body, FloatArray

JOINTS = 52
"""Joints of SMPL-H: 22 of the body, and 15 of each hand's fingers."""


def write_smpl_motion(
    path: str | os.PathLike[str], body: Body, transforms: FloatArray, fps: float
) -> None:
    """Write a clip as AMASS's ``.npz`` of SMPL-H: rotation vectors ``poses`` (T, 156), ``trans``
    (T, 3), ``betas`` of the average body, ``gender`` and ``mocap_framerate``; meters, z up.

    A further array, ``rest_joints`` (52, 3), has the joints of this body at rest, y up: with it
    `read_smpl_motion` finds the same joints again, and other programs show the average body.

    Parameters
    ----------
    path : path
        Written atomically.
    body : Body
        On the rig "smpl": SMPL-H's joints in T pose, whose axes at rest are the world's.
    transforms : (T, 52, 4, 4) float
        World from bone, meters, y up.
    fps : float

    Raises
    ------
    InputError
        Another rig, or transforms of the wrong shape or not finite.
    """
    if tuple(body.bone_names[:22]) != NAMES[:22] or len(body.bone_names) != JOINTS:
        raise InputError(
            f"AMASS's layout needs SMPL's joints, which the rig '{body.model}' lacks; change the "
            "rig to smpl first"
        )
    moves, rate = check_clips({"motion": (transforms, fps)}, JOINTS)["motion"]
    rest = body.rest_transforms.astype(np.float64)
    turned = moves.copy()
    turned[..., :3, :3] = moves[..., :3, :3] @ np.swapaxes(rest[:, :3, :3], 1, 2)
    local = parent_from_bone(turned, body.bone_parents)[..., :3, :3]
    up = y_up_rotmat("z").T
    local[:, 0] = up @ local[:, 0]
    poses = rotmat_to_rotvec(local)
    joints = rest[:, :3, 3] - rest[0, :3, 3] + PELVIS
    arrays = {
        "poses": poses.reshape(len(moves), 3 * JOINTS),
        "trans": moves[:, 0, :3, 3] @ up.T - PELVIS,
        "betas": np.zeros(16),
        "gender": "neutral",
        "mocap_framerate": rate,
        "dmpls": np.zeros((len(moves), 8)),
        "rest_joints": joints,
    }
    write_npz(path, arrays)
