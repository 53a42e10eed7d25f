"""Two-bone inverse kinematics of plain joints: knees and elbows bend, bones keep their lengths."""

from __future__ import annotations

import numpy as np

from a2v.kinematics.skeleton import Skeleton
from a2v.types import FloatArray

REACH = 0.999
"""Largest reach of a limb as a share of its length."""


def limb_of(skeleton: Skeleton, joint: int) -> tuple[int, int, int] | None:
    """Return shoulder, elbow and wrist, or hip, knee and ankle, of the limb that ends at a joint or
    its parent; else None."""
    tops = (*(skeleton.hips or ()), *(skeleton.shoulders or ()))
    chain = next(
        (chain for chain in skeleton.chains if joint in chain[-2:] and len(chain) > 3), None
    )
    if chain is None or chain[-4] not in tops:
        return None
    return chain[-4], chain[-3], chain[-2]


def legs_of(skeleton: Skeleton) -> tuple[tuple[int, int, int, int], ...]:
    """Return hip, knee, ankle and toe of each leg whose foot is the end of a limb."""
    found = ((limb_of(skeleton, toe), toe) for toe in skeleton.feet)
    return tuple((*limb, toe) for limb, toe in found if limb is not None and toe not in limb)


def bend_to(
    hip: FloatArray, knee: FloatArray, ankle: FloatArray, target: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return knee and ankle (..., 3), or elbow and wrist, of a limb that reaches for `target` as
    far as its length allows.

    The limb stays in the plane in which it is bent.
    """
    upper, lower = (
        np.linalg.norm(part, axis=-1, keepdims=True) for part in (knee - hip, ankle - knee)
    )
    way = target - hip
    distance = np.linalg.norm(way, axis=-1, keepdims=True)
    direction = way / np.maximum(distance, 1e-9)
    longest = np.maximum(
        REACH * (upper + lower), np.linalg.norm(ankle - hip, axis=-1, keepdims=True)
    )
    reached = np.clip(distance, np.abs(upper - lower) + 1e-6, np.minimum(longest, upper + lower))
    along = (upper**2 - lower**2 + reached**2) / (2 * reached)
    forward = knee - hip
    forward = forward - (forward * direction).sum(-1, keepdims=True) * direction
    forward /= np.maximum(np.linalg.norm(forward, axis=-1, keepdims=True), 1e-9)
    out = np.sqrt(np.maximum(upper**2 - along**2, 0))
    return hip + along * direction + out * forward, hip + reached * direction
