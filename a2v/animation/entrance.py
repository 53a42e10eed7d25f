"""Let a clip begin in the pose and place of the photo and blend into its action."""

from __future__ import annotations

import numpy as np

from a2v.errors import InputError
from a2v.geometry.steps import smoothstep
from a2v.kinematics import rotmat_to_rotvec, rotvec_to_rotmat
from a2v.types import Body, FloatArray, IntArray


def photo_to_world(body: Body) -> FloatArray:
    """Translation (3,) float64 from the frame of the photo's camera to the world: the root over the
    origin, the lowest point on the ground."""
    root = body.bone_transforms[0, :3, 3].astype(np.float64)
    return np.array([-root[0], -float(body.vertices[:, 1].min()), -root[2]])


def in_world(body: Body) -> FloatArray:
    """Return the bones (B, 4, 4), world from bone, of a fitted body in its pose, moved by
    `photo_to_world`."""
    moved = body.bone_transforms.astype(np.float64)
    moved[:, :3, 3] += photo_to_world(body)
    return moved


def enter_from(
    transforms: FloatArray,
    start: FloatArray,
    parents: IntArray,
    *,
    fps: float,
    seconds: float = 0.9,
) -> FloatArray:
    """Blend from the pose `start` in the first frame to the clip's own transforms after `seconds`.

    Each bone turns the short way relative to its parent and has no speed at the start. The root is
    blended too.

    Parameters
    ----------
    transforms : (T, B, 4, 4)
        World from bone.
    start : (B, 4, 4)
        World from bone of the same rig.
    parents : (B,) int
        -1 for the root; parents first.
    fps, seconds : float

    Returns
    -------
    (T, B, 4, 4) float32

    Raises
    ------
    InputError
        `start` has other bones, or `seconds` is not positive.
    """
    if start.shape != transforms.shape[1:]:
        raise InputError(
            f"the first pose has bones of shape {start.shape}; the clip's are "
            f"{transforms.shape[1:]}"
        )
    if seconds <= 0:
        raise InputError(f"{seconds} s to blend into the clip; expected more than 0")
    count = min(len(transforms), round(seconds * fps))
    if count < 1:
        return np.asarray(transforms, np.float32)
    moment = np.arange(count) / count
    share = smoothstep(moment, 0, 1)
    clip, first = (
        _local(transforms[:count].astype(np.float64), parents),
        _local(start[None].astype(np.float64), parents),
    )
    between = rotmat_to_rotvec(np.swapaxes(first[..., :3, :3], -1, -2) @ clip[..., :3, :3])
    mixed = clip.copy()
    mixed[..., :3, :3] = first[..., :3, :3] @ rotvec_to_rotmat(share[:, None, None] * between)
    mixed[..., :3, 3] = first[..., :3, 3] + share[:, None, None] * (
        clip[..., :3, 3] - first[..., :3, 3]
    )
    for bone, parent in enumerate(parents.tolist()):
        if parent >= 0:
            mixed[:, bone] = mixed[:, parent] @ mixed[:, bone]
    return np.concatenate([mixed, transforms[count:]]).astype(np.float32)


def _local(transforms: FloatArray, parents: IntArray) -> FloatArray:
    """Parent from bone (T, B, 4, 4); the root stays relative to the world."""
    local: FloatArray = np.linalg.inv(transforms[:, np.maximum(parents, 0)]) @ transforms
    local[:, parents < 0] = transforms[:, parents < 0]
    return local
