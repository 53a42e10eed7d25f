"""Read a photo once, by a list of readers."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from a2v.body.parts import PARTS
from a2v.reconstruction.reading.arms import (
    arms_by_landmarks,
    bare_forearms,
    bare_hands,
    gloves,
    tone_of_hands,
)
from a2v.reconstruction.reading.feet import bare_feet
from a2v.reconstruction.reading.hair import long_hair
from a2v.reconstruction.reading.held import held_things
from a2v.reconstruction.reading.record import ARMS, Reading
from a2v.reconstruction.reading.shown import STEP, body_shown
from a2v.reconstruction.reading.skirt import find_skirt
from a2v.reconstruction.reading.surroundings import like_surroundings
from a2v.reconstruction.rules import READING, left_out
from a2v.types import Body, Camera, Subject, Surface


@dataclass(frozen=True, eq=False)
class Source:
    """What is read.

    Attributes
    ----------
    subject : Subject
    body : Body
        Fitted to the photo, in its pose.
    camera : Camera
    surface : Surface
        Reconstructed from the photo, in its pose.
    """

    subject: Subject
    body: Body
    camera: Camera
    surface: Surface

    @property
    def scale(self) -> float:
        """Pixels of the maps per meter."""
        return self.camera.scale / STEP


class Reader(Protocol):
    """A function that adds to a reading what it finds."""

    __name__: str

    def __call__(self, source: Source, reading: Reading, /) -> Reading:
        """Return the reading with what was found."""
        ...


@dataclass(frozen=True)
class ReadingSettings:
    """Settings of the reading.

    Attributes
    ----------
    without : str
        Readers to leave out (`a2v.reconstruction.rules.READING`), separated by commas.
    """

    without: str = ""

    def __post_init__(self) -> None:
        left_out(self.without, READING)

    @property
    def readers(self) -> tuple[Reader, ...]:
        """The readers that are used."""
        off = left_out(self.without, READING)
        return tuple(reader for reader in READERS if reader.__name__ not in off)


def show_body(source: Source, reading: Reading) -> Reading:
    """See which part of the fitted body is in each pixel."""
    shown = body_shown(source.body, source.subject, source.camera)
    return dataclasses.replace(reading, shown=shown.astype(np.int8))


def place_arms(source: Source, reading: Reading) -> Reading:
    """Place forearms and hands by the landmarks, where these are better than the fit."""
    height, width = reading.shown.shape
    arms, better = arms_by_landmarks(
        source.subject, source.body, source.camera, (height, width), STEP
    )
    bits = sum(
        (arms[PARTS.index(name)].astype(np.uint8) << bit for bit, name in enumerate(ARMS)),
        np.zeros(reading.shown.shape, np.uint8),
    )
    return dataclasses.replace(reading, found_arms=bits, better=better)


def find_gloves(source: Source, reading: Reading) -> Reading:
    """Find gloves on the hands."""
    worn = gloves(source.subject, reading.arms, reading.shown, source.scale)
    return dataclasses.replace(reading, gloves=worn)


def find_skin(source: Source, reading: Reading) -> Reading:
    """Find the pixels with the skin of bare hands and face."""
    if reading.gloves is not None:
        return reading
    return dataclasses.replace(reading, skin=bare_hands(source.subject, reading.arms))


def tone_hands(source: Source, reading: Reading) -> Reading:
    """Find the color of the hands."""
    tone = tone_of_hands(source.subject.image, reading.like_hands, reading.arms)
    return dataclasses.replace(reading, hands=tone)


def find_bare_forearms(source: Source, reading: Reading) -> Reading:
    """Find forearms without sleeves."""
    bare = bare_forearms(source.subject, reading.arms, reading.skin, reading.shown)
    return dataclasses.replace(reading, bare_forearms=bare)


def find_surroundings(source: Source, reading: Reading) -> Reading:
    """Find pixels of the mask that show the background."""
    found = like_surroundings(source.subject, reading.shown, source.scale)
    return dataclasses.replace(reading, taken=reading.taken | found)


def find_held_things(source: Source, reading: Reading) -> Reading:
    """Find pixels of the mask that show a held object."""
    found = held_things(source.subject, reading.shown, source.scale)
    return dataclasses.replace(reading, taken=reading.taken | found)


def find_bare_feet(source: Source, reading: Reading) -> Reading:
    """Find out whether the feet are bare."""
    bare = bare_feet(source.subject, source.body, source.camera, reading.shown, STEP)
    return dataclasses.replace(reading, bare_feet=bare)


def find_skirts(source: Source, reading: Reading) -> Reading:
    """Find a skirt, a dress or a long coat."""
    hangs, hem = find_skirt(source.surface, source.subject, source.body, source.camera)
    return dataclasses.replace(reading, hangs=hangs, hem=None if hem is None else np.array(hem))


def find_long_hair(source: Source, reading: Reading) -> Reading:
    """Find long hair."""
    hair = long_hair(source.subject, source.body, source.camera)
    return dataclasses.replace(reading, hair=hair)


READERS: tuple[Reader, ...] = (
    show_body,
    place_arms,
    find_gloves,
    find_skin,
    tone_hands,
    find_bare_forearms,
    find_surroundings,
    find_held_things,
    find_bare_feet,
    find_skirts,
    find_long_hair,
)
"""What is found in a photo, in this order."""


def read_photo(source: Source, readers: Sequence[Reader] = READERS) -> Reading:
    """Read a photo once. The build of the character and its coloring read this record."""
    height, width = source.subject.mask.shape
    size = (height // STEP, width // STEP)
    reading = Reading(
        shown=np.full(size, -1, np.int8),
        found_arms=np.zeros(size, np.uint8),
        better=np.zeros(len(PARTS), bool),
        taken=np.zeros(size, bool),
    )
    for reader in readers:
        reading = reader(source, reading)
    return reading
