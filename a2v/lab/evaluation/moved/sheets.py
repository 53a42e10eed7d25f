"""Draw moved people: the photo, the character in T-pose and in motion, and the truth below it."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.lab.evaluation.framed import framed_surface
from a2v.lab.evaluation.moved.cases import POSES, MovedCase
from a2v.lab.evaluation.moved.measures import Moved
from a2v.types import ByteArray

T_TURNS: tuple[float, ...] = (0.0, 90.0, 180.0)
"""Turns of the pictures of the T-pose, degrees."""
FRAME_TURN = 25.0
"""Turn of the pictures of frames, degrees."""
_BORDER = 1.1


def moved_rows(case: MovedCase, moved: Moved, *, size: int = 220) -> ByteArray:
    """Draw a picture (2 size, W, 3): photo, T-pose from three sides, frames of motion from the
    front and (the last two) from behind; the truth below."""
    import cv2

    rows = []
    for true in (False, True):
        pictures = (
            [cv2.resize(case.image, (size, size), interpolation=cv2.INTER_AREA)]
            if not true
            else [np.full((size, size, 3), 235, np.uint8)]
        )
        for pose in range(len(moved.vertices)):
            surface = (
                dataclasses.replace(case.surface, vertices=case.vertices[pose])
                if true
                else moved.surface(pose)
            )
            turns = (
                T_TURNS if pose == 0 else (FRAME_TURN + (180.0 if pose >= len(POSES) - 2 else 0.0),)
            )
            pictures += [
                framed_surface(surface, case.vertices[pose], turn, size, border=_BORDER)
                for turn in turns
            ]
        rows.append(np.hstack(pictures))
    label = f"{case.index} {case.name} {case.stance}"
    cv2.putText(rows[1], label, (6, size // 2), cv2.FONT_HERSHEY_SIMPLEX, 0.32, (40, 40, 40))
    return np.vstack(rows)
