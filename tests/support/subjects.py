"""People whose photo shows only what a test defines."""

from __future__ import annotations

import numpy as np

from a2v.types import FloatArray, Subject


def blank_subject(
    side: int = 8, *, face: FloatArray | None = None, hands: FloatArray | None = None
) -> Subject:
    """A black photo of `side` pixels that is all person."""
    return Subject(
        image=np.zeros((side, side, 3), np.uint8),
        mask=np.ones((side, side), np.float32),
        keypoints=np.zeros((33, 3), np.float32),
        keypoints_3d=np.zeros((33, 3), np.float32),
        crop=(0, 0, side, side),
        photo_size=(side, side),
        face=face,
        hands=hands,
    )
