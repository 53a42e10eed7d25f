"""Random streams of the studio. Each kind of draw has its own generator, so that one draw never
changes another."""

from __future__ import annotations

from enum import IntEnum


class Stream(IntEnum):
    """The last number of a generator's seed. Values must not change: shipped weights and fixed
    photos depend on them."""

    ORDER = 1
    """The order of the people."""
    PHOTO = 2
    """Light and lens of a photo."""
    THINGS = 3
    """Objects in the hands, furniture, and the position of the picture's border if it cuts a
    person."""
    BACKDROP = 4
    """The photograph behind a person."""
    AGAIN = 5
    """Pose and camera of another photo of the same person."""
    PERSON = 7
    """Body and clothes of a person of MakeHuman."""
    QUICK_BLOCK = 11
    """The person and the views of a block of quick views."""
    ROOM = 13
    """A room, and the person in it."""
