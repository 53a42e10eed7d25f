"""The second photo of the same person that would help a fit most."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from a2v.kinematics.names import LANDMARK_INDEX
from a2v.types import FloatArray

SIDES: Mapping[str, float] = MappingProxyType({"front": 0, "left": 90, "back": 180, "right": 270})
"""Angle from the person's front toward the person's left from which a camera sees each side,
degrees."""
DOUBTFUL = 0.15
"""Expected error in depth of a limb above which the user gets a note, meters. On the photos from
which the coefficients of `a2v.body.confidence` were fitted, such limbs were off by 37 cm on
average and all others by 6 (25 and 9 without a body map)."""
_FAR_LIMB = 0.5
"""Weight of a limb on the far side of the person in a photo from the side."""


def heading(landmarks: FloatArray) -> float:
    """Return the angle by which the trunk of landmarks (33, 3) is turned to its own left, degrees;
    0 faces +z."""
    points = {
        side: landmarks[[LANDMARK_INDEX[f"{side}_{joint}"] for joint in ("shoulder", "hip")]].mean(
            0
        )
        for side in ("left", "right")
    }
    across = points["left"] - points["right"]
    return math.degrees(math.atan2(-across[2], across[0]))


def best_side(errors: Mapping[str, float], turned: float, *others: float) -> str:
    """Return the one of `SIDES` from which a further photo would help most.

    A further photo reduces the error of a limb's depth in proportion to the sine of the angle to
    the first photo; for a limb on the far side, half as much. If no limb is `DOUBTFUL`, the best
    side is the one most opposite to all given photos.

    Parameters
    ----------
    errors : mapping of limb to float
        Expected errors in depth, meters (`a2v.body.confidence.limb_errors`).
    turned : float
        `heading` of the person in the first photo, degrees.
    *others : float
        `heading` of the person in each other photo. `errors` already include what these photos
        show.
    """
    known = max((abs(math.sin(math.radians(other - turned))) for other in others), default=0.0)
    limbs = {
        limb: (1 - known) * error for limb, error in errors.items() if limb.endswith(("arm", "leg"))
    }

    def apart(side: str) -> float:
        return min(-math.cos(math.radians(SIDES[side] + angle)) for angle in (turned, *others))

    if max(limbs.values(), default=0.0) <= DOUBTFUL:
        return max(SIDES, key=apart)

    def settled(side: str) -> float:
        far = {"left": "right", "right": "left"}.get(side, "-")
        weights = [_FAR_LIMB if limb.startswith(far) else 1.0 for limb in limbs]
        share = abs(math.sin(math.radians(SIDES[side] + turned)))
        return share * float(np.dot(weights, list(limbs.values())))

    return max(SIDES, key=settled)
