"""Draw what was read in a photo."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import PARTS
from a2v.reconstruction.reading.record import Reading
from a2v.types import ByteArray

_ROOM = (245, 245, 245)
_TAKEN = (214, 39, 40)
_SKIN = (255, 187, 120)
_GLOVES = (23, 190, 207)
_HAIR = (140, 86, 75)
_ARMS = (31, 119, 180)
_LINE = 18
"""Height of a line of text, pixels."""


def draw_reading(reading: Reading) -> ByteArray:
    """Draw a reading (h + text, w, 3): parts of the body gray, skin orange, gloves cyan, hair
    brown, borders of arms by landmarks blue, background and held things red; below it the facts."""
    import cv2

    picture = np.full((*reading.shown.shape, 3), _ROOM, np.uint8)
    body = reading.shown >= 0
    picture[body] = (130 + 90 * reading.shown[body] / len(PARTS)).astype(np.uint8)[:, None]
    if reading.skin is not None:
        picture[reading.skin & body] = _SKIN
    if reading.gloves is not None:
        picture[reading.gloves & body] = _GLOVES
    if reading.hair is not None:
        size = reading.shown.shape[::-1]
        hair = cv2.resize(reading.hair.pixels.astype(np.uint8), size) > 0
        picture[hair] = _HAIR
    picture[reading.taken] = _TAKEN
    for arm in reading.arms:
        edges, _ = cv2.findContours(arm.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(picture, edges, -1, _ARMS, 1)
    facts = facts_of(reading)
    text = np.full((_LINE * len(facts) + 6, picture.shape[1], 3), 255, np.uint8)
    for number, fact in enumerate(facts, 1):
        place = (4, _LINE * number)
        cv2.putText(text, fact, place, cv2.FONT_HERSHEY_SIMPLEX, 0.42, (30, 30, 30), 1, cv2.LINE_AA)
    return np.vstack([picture, text])


def facts_of(reading: Reading) -> list[str]:
    """Return the facts of a reading in words."""
    hem = "" if reading.hem is None else f", hem at {100 * float(reading.hem[0]):.0f} cm"
    return [
        f"feet: {'bare' if reading.bare_feet else 'in shoes or unknown'}",
        f"gloves: {'no' if reading.gloves is None else 'yes'}",
        f"forearms without sleeves: {', '.join(reading.bare_forearms) or 'none'}",
        f"skirt or coat: {'yes' + hem if reading.hangs else 'no'}",
        f"long hair: {'no' if reading.hair is None else 'yes'}",
    ]
