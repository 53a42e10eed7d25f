"""Place generated clips: scale bones and the root's path, level the floor, put the feet on the
ground."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import Skeleton
from a2v.kinematics.names import canonical_joints
from a2v.types import FloatArray


def ground_offset(joints: FloatArray) -> FloatArray:
    """Return the offset (N, 1, 1, 3) to subtract from joints (N, T, J, 3) so that they start above
    the origin with the lowest joint at y = 0."""
    offset = np.zeros((len(joints), 1, 1, 3), dtype=np.float32)
    offset[:, 0, 0] = joints[:, 0, 0]
    offset[:, 0, 0, 1] = joints[..., 1].min(axis=(1, 2))
    return offset


def level_floor(joints: FloatArray, window: int, piece: int | None = None) -> FloatArray:
    """Keep the floor of long clips (N, T, J, 3) at its height in their first `window` frames.

    Models learn the root's path from short clips, so that a small slope in every window adds up:
    600 frames of Run rose by 1.3 m. The lowest joint over `piece` frames (half a window by default)
    is the floor's height. Its changes are subtracted, linearly between pieces. Clips of at most
    `window` frames are returned unchanged.
    """
    frames, half = joints.shape[1], piece or window // 2
    if frames <= window or half < 1:
        return joints
    middles = np.arange(window + half // 2, frames, half)
    if not len(middles) or middles[-1] + half // 2 < frames - 1:
        middles = np.append(middles, max(window, frames - 1 - half // 2))
    at = np.concatenate([[window - 1], middles])
    lowest = joints[..., 1].min(axis=-1).astype(np.float64)
    floor = lowest[:, :window].min(axis=1)
    lift = np.zeros_like(lowest)
    # The lowest joint is at the start of a slope, so that a third of it remains after one pass.
    for _ in range(3):
        level = np.stack(
            [
                (lowest - lift)[:, max(t - half // 2, 0) : t + half // 2 + 1].min(axis=1)
                for t in middles
            ],
            axis=1,
        )
        away = np.concatenate([np.zeros((len(joints), 1)), level - floor[:, None]], axis=1)
        lift += np.stack([np.interp(np.arange(frames), at, row) for row in away])
    levelled = joints.copy()
    levelled[..., 1] -= lift[..., None].astype(joints.dtype)
    return levelled


def body_parts(skeleton: Skeleton) -> dict[str, tuple[int, ...]]:
    """Return the joints of the bones of "arms", "legs", "head", "torso" (all others) and "all";
    parts without bones are left out."""
    found = canonical_joints(skeleton.joint_names, skeleton.parents.tolist())
    ends = {"arms": ("elbow", "wrist", "hand", "thumb"), "legs": ("knee", "ankle", "foot", "toes")}
    parts = {
        part: tuple(
            found[f"{side}_{end}"]
            for side in ("left", "right")
            for end in names
            if f"{side}_{end}" in found
        )
        for part, names in ends.items()
    }
    parts["head"] = tuple(found[name] for name in ("head", "head_top") if name in found)
    limbs = {joint for part in parts.values() for joint in part}
    parts["torso"] = tuple(joint for joint in range(1, skeleton.n_joints) if joint not in limbs)
    parts["all"] = tuple(range(1, skeleton.n_joints))
    return {name: joints for name, joints in parts.items() if joints}


def leg_length(lengths: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Return the sum (...) of the legs' bone lengths (..., J), or of all bones if no legs are
    known."""
    parts = body_parts(skeleton)
    total: FloatArray = np.asarray(lengths)[..., list(parts.get("legs", parts["all"]))].sum(axis=-1)
    return total


def scale_bones(
    lengths: FloatArray, skeleton: Skeleton, factors: float | Mapping[str, float]
) -> FloatArray:
    """Scale bone lengths (J,) float32 by one factor, or by joint or part of the body.

    Parameters
    ----------
    lengths : (J,) float32
        In any unit.
    skeleton : Skeleton
    factors : float, or mapping of names to floats
        Names are joints (of the bone that ends there), "arms", "legs", "torso", "head" or "all".
        Factors of several names multiply.

    Raises
    ------
    InputError
        A factor is not within 0.1 to 10, or a name is unknown.
    """
    scaled = lengths.copy()
    parts = body_parts(skeleton)
    names = skeleton.joint_names
    for name, factor in (
        {"all": factors}.items() if isinstance(factors, float | int) else factors.items()
    ):
        if not 0.1 <= factor <= 10:
            raise InputError(f"bone_scale is {factor}; expected 0.1 to 10")
        chosen = parts.get(name) or ((names.index(name),) if name in names[1:] else ())
        if not chosen:
            raise InputError(
                f"no bone '{name}' to scale; choose from {', '.join(sorted(parts))}, or a joint: "
                f"{', '.join(names[1:])}"
            )
        scaled[list(chosen)] *= np.float32(factor)
    return scaled


def scale_path(joints: FloatArray, step: FloatArray) -> FloatArray:
    """Scale the path of the root of joints (N, T, J, 3) by `step` () or (N,): longer legs take
    longer steps."""
    root = joints[:, :, :1]
    scaled: FloatArray = joints + (np.asarray(step, np.float32).reshape(-1, 1, 1, 1) - 1) * (
        root - root[:, :1]
    )
    return scaled


def place_on_ground(joints: FloatArray, window: int) -> FloatArray:
    """Place joints (N, T, J, 3) on the ground: level floor (`level_floor`), first frame above the
    origin, lowest joint at y = 0."""
    joints = level_floor(joints, window)
    return joints - ground_offset(joints)


def to_native(
    joints: FloatArray, *, meters_per_unit: float, signs: tuple[float, float, float]
) -> FloatArray:
    """Convert world joints (..., T, J, 3), meters, to a data set's own frame and unit
    (`a2v.lab.datasets.NativeFrame`).

    The first root is at the origin.
    """
    moved = joints - joints[..., :1, :1, :]
    native: FloatArray = moved / np.float32(meters_per_unit) * np.asarray(signs, np.float32)
    return native
