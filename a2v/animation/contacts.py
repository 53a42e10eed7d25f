"""Find when a foot is in contact with the ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.animation.curves import runs, speed_of
from a2v.types import BoolArray, FloatArray


@dataclass(frozen=True)
class ContactSettings:
    """Thresholds of foot contacts, and smoothness of the correction.

    Attributes
    ----------
    height_on : float
        Height of heel or toes over the ground under which a contact starts, meters.
    height_off : float
        Height of heel or toes over which a contact ends, meters.
    speed_on : float
        Speed of heel or toes under which a contact starts, meters per second.
    speed_off : float
        Speed of heel or toes over which a contact ends, meters per second.
    clearance : float
        Meters of air under a foot that moves fast (over 0.5 m/s) without a contact.
    blend : float
        Seconds over which a foot turns flat and a pelvis is lowered.
    shortest : float
        Seconds; shorter contacts are dropped, shorter gaps are filled.
    flight : float
        Seconds: a longer time without contact is drift, not a jump, and is moved back to the
        ground; 0 disables this.
    follow_ground : float
        Seconds over which a slowly drifting ground level is followed (HumanAct12's floors are not
        level); 0 for a rigid one.
    """

    height_on: float = 0.04
    height_off: float = 0.075
    speed_on: float = 0.45
    speed_off: float = 0.9
    clearance: float = 0.03
    blend: float = 0.12
    shortest: float = 0.09
    flight: float = 0.8
    follow_ground: float = 0.5


def find_contacts(
    heights: FloatArray,
    points: FloatArray,
    fps: float,
    settings: ContactSettings = ContactSettings(),
) -> BoolArray:
    """Return the frames (T,) in which a point stands on the ground, by height and speed with
    hysteresis.

    Parameters
    ----------
    heights : (T,) float
        Meters over the ground.
    points : (T, 3) float
        Positions whose speed is compared, meters.
    fps : float
    """
    speed = speed_of(points, fps)
    sure = (heights < settings.height_on) & (speed < settings.speed_on)
    maybe = (heights < settings.height_off) & (speed < settings.speed_off)
    on = np.zeros(len(heights), dtype=bool)
    for start, end in runs(maybe):
        inside = np.flatnonzero(sure[start:end])
        if len(inside):  # from the first certain frame until the contact is clearly over
            on[start + inside[0] : end] = True
    least = max(1, round(settings.shortest * fps))
    for start, end in runs(~on):
        if (
            start > 0
            and end < len(on)
            and end - start <= least
            and (heights[start:end] < settings.height_off).all()
        ):
            on[start:end] = True
    for start, end in runs(on):
        if end - start < min(least, len(on)):
            on[start:end] = False
    return on
