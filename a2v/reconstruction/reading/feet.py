"""Find bare feet in the photo."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import PARTS
from a2v.reconstruction.reading.skin import like_skin, photo_and_tone, within_mask
from a2v.types import Body, Camera, IntArray, Subject

_BARE_FEET = 0.85
"""Feet are bare if at least this fraction of each foot's pixels, and of the shins' above the
ankles, have the face's skin color. Shoes of that color are more common than bare feet without
such shins."""
_ANKLE = 0.12
"""Shins up to this height above the ankle are compared, meters."""
_FEW = 30
"""Smallest number of pixels of a foot, and of a shin."""


def bare_feet(subject: Subject, body: Body, camera: Camera, shown: IntArray, step: int) -> bool:
    """Return whether the photo shows feet without shoes; False if it does not show enough.

    Parameters
    ----------
    body : Body
        Fitted.
    shown : (h, w) int
        Part that the posed body shows on every `step`-th pixel; -1 for none.
    """
    found = photo_and_tone(subject, shown.shape)
    if found is None:
        return False
    lab, tone = found
    like = like_skin(lab, tone)
    mask = within_mask(subject, shown.shape)
    seen = 0
    for side, letter in (("left", ".L"), ("right", ".R")):
        ankle = body.bone_transforms[body.bone_names.index(f"foot{letter}"), :3, 3]
        lowest = camera.project(ankle[None].astype(np.float64))[0, 1] / step
        rows = np.arange(shown.shape[0])[:, None]
        near = (rows > lowest - _ANKLE * camera.scale / step) & mask
        parts = [near & (shown == PARTS.index(f"{side}_{part}")) for part in ("foot", "shin")]
        if min(part.sum() for part in parts) < _FEW:
            continue
        seen += 1
        if min(like[part].mean() for part in parts) < _BARE_FEET:
            return False
    return seen > 0
