"""Check that a canonical character has a face, and let bad faces fall back by steps."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

from a2v.reconstruction.face.look_again import Glance, look_again
from a2v.reconstruction.face.settings import FEATURES, FaceSettings
from a2v.types import Reconstruction, Surface

OFF = 0.2
"""Largest distance of a feature from its place, in distances of the eyes' outer corners, with which
a face is sound."""


def sound_face(
    drafted: Reconstruction,
    colored: Surface,
    face: FaceSettings,
    rebuilt: Callable[[FaceSettings], tuple[Reconstruction, Surface]],
) -> tuple[Reconstruction, Surface]:
    """Return a canonical person with a face that a detector finds again, with its features where
    they belong (`look_again`), and the same person colored.

    Parameters
    ----------
    drafted : Reconstruction
    colored : Surface
        The same person, colored.
    face : FaceSettings
        With which it was made.
    rebuilt : callable
        Makes the person again with other settings, and colors it.

    Returns
    -------
    Reconstruction, Surface
        `drafted` itself if its face is sound, or if it has none by request; else the person with
        the first of `FEATURES` whose face is sound.
    """
    if colored.face is None or colored.standing is None:
        return drafted, colored
    made = drafted
    features = str(drafted.surface.provenance.get("features", "photo"))
    for lower in FEATURES[FEATURES.index(features) + 1 :]:
        if is_sound(look_again(colored, colored.standing.vertices, colored.standing.parts)):
            return made, colored
        made, colored = rebuilt(dataclasses.replace(face, features=lower))
    return made, colored


def is_sound(looks: dict[str, Glance]) -> bool:
    """Return whether all looks found a face with its features where they belong."""
    return all(glance.worst < OFF for glance in looks.values())
