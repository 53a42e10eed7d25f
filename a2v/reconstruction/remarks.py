"""Notes for the user about a finished character, by a look at it beside its photo."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from a2v.types import Body, FloatArray

OUTLINE = 0.21
"""Share of the common outline that may differ between character and photo, in the same colors."""
COLOR = 22.0
"""Mean CIELAB difference that they may have in the same outline."""
HEAD = 29.0
"""Mean CIELAB difference that their heads may have, all else alike."""
LYING = 60.0
"""Angle of the trunk from the vertical, degrees, beyond which a person lies."""
SITTING = 55.0
"""Angle of both thighs from the vertical, degrees, beyond which a person sits or crouches."""


def mismatch(compared: Mapping[str, float]) -> float:
    """Return how unlike its photo a character is, by `Reposed.compared`; from 1 on, users are
    told. The divisors are from our real photos and their grades by eye (docs/results/photos.md).
    """
    head = float(np.nan_to_num(compared.get("color, head", 0.0)))
    return (1 - compared["iou"]) / OUTLINE + compared["color"] / COLOR + head / HEAD


def remarks(compared: Mapping[str, float], body: Body) -> list[str]:
    """Return notes about a character.

    Parameters
    ----------
    compared : mapping
        The character beside its photo (`Reposed.compared`).
    body : Body
        In the pose of the photo.
    """
    found = []
    if mismatch(compared) > 1:
        said = (
            f"their outlines share {100 * compared['iou']:.0f} %, their colors differ by "
            f"{compared['color']:.0f}"
        )
        if np.isfinite(head := compared.get("color, head", np.nan)):
            said += f", those of the head by {head:.0f}"
        found.append(
            f"the character does not match the photo ({said}): expect a wrong shape or colors; try "
            "another photo, or give --mask and --keypoints"
        )
    if pose := posture(body):
        found.append(
            f"the person {pose} in the photo: hidden sides of legs and trunk are guessed; a photo "
            "of the standing person works better"
        )
    return found


def posture(body: Body) -> str:
    """Return "lies", or "sits or crouches", for a body of Anny in such a pose; empty for others."""
    if body.model != "anny":
        return ""

    def place(bone: str) -> FloatArray:
        return np.asarray(body.bone_transforms[body.bone_names.index(bone), :3, 3], np.float64)

    hips = (place("upperleg01.L") + place("upperleg01.R")) / 2
    if _from_vertical(place("neck01") - hips) > LYING:
        return "lies"
    thighs = [
        _from_vertical(place(f"upperleg01.{side}") - place(f"lowerleg01.{side}")) for side in "LR"
    ]
    return "sits or crouches" if min(thighs) > SITTING else ""


def _from_vertical(way: FloatArray) -> float:
    """Angle of a direction (3,) from y, degrees."""
    return float(np.degrees(np.arccos(np.clip(way[1] / max(np.linalg.norm(way), 1e-9), -1, 1))))
