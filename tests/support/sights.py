"""Photos of people who surely wear a skirt, or surely none."""

from __future__ import annotations

import dataclasses

from a2v.reconstruction.canonical import Sight


def with_skirt(sight: Sight, hangs: bool) -> Sight:
    """The same photo, read with or without a skirt whose hem the surface gives."""
    reading = dataclasses.replace(sight.reading, hangs=hangs, hem=None)
    return dataclasses.replace(sight, given=reading)
