"""Random streams of the studio: what is drawn beside a seed, a split and an index, so that one draw
never shifts another."""

from __future__ import annotations

from enum import IntEnum


class Stream(IntEnum):
    """The last number of a generator's seed; a value never changes, for shipped weights and pinned
    photos hang on it."""

    ORDER = 1
    """The order of the people."""
    PHOTO = 2
    """Light and lens of a photo."""
    THINGS = 3
    """Things in the hands, furniture, and where the picture's border cuts a person."""
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
