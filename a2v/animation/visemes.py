"""Mouth shapes of speech from ARKit's expressions: the 15 visemes of Oculus by programs' names.

``visemes.csv`` lists them with their sounds and the articulation of these: place and manner of
consonants, height, frontness and rounding of vowels, as on the chart of the International Phonetic
Association. The grouping of sounds is that of Oculus' reference. The strengths were chosen for this
project: the jaw is lower for more open vowels, lips are rounded or spread like the vowel, and lips
or teeth touch if they do in the sound.
"""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.types import Character, Face

NAMINGS: tuple[str, ...] = ("oculus", "vrchat")
"""Naming schemes: Oculus and Ready Player Me (with their five other shapes), or VRChat."""


@cache
def visemes(naming: str) -> Mapping[str, Mapping[str, float]]:
    """Return the shapes by the names of `naming`, as strengths of ARKit's expressions.

    Raises
    ------
    InputError
        Unknown naming.
    """
    if naming not in NAMINGS:
        raise InputError(f"unknown visemes '{naming}'; choose from {', '.join(NAMINGS)}")
    with open(Path(__file__).with_name("visemes.csv"), encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    parts = {row[naming]: row["shapes"].split() for row in rows if row[naming]}
    return {
        name: dict(zip(words[::2], map(float, words[1::2]), strict=True))
        for name, words in parts.items()
    }


def add_visemes(character: Character, naming: str) -> Character:
    """Append the shapes of `naming` to a character's face; a character without a face is unchanged.

    Raises
    ------
    InputError
        Unknown naming.
    """
    shapes, face = visemes(naming), character.surface.face
    if face is None:
        return character
    return dataclasses.replace(
        character, surface=dataclasses.replace(character.surface, face=_with_shapes(face, shapes))
    )


def _with_shapes(face: Face, shapes: Mapping[str, Mapping[str, float]]) -> Face:
    """Append shapes to a face, each made of its existing shapes."""
    known = {
        name: {part: strength for part, strength in parts.items() if part in face.names}
        for name, parts in shapes.items()
    }
    made = {
        name: face.mixed(strengths) for name, strengths in known.items() if name not in face.names
    }
    counts = [len(vertices) for vertices, _ in made.values()]
    return dataclasses.replace(
        face,
        names=(*face.names, *made),
        starts=np.concatenate([face.starts, face.starts[-1] + np.cumsum(counts)]).astype(np.int32),
        vertices=np.concatenate(
            [face.vertices, *(vertices for vertices, _ in made.values())]
        ).astype(np.int32),
        offsets=np.concatenate([face.offsets, *(offsets for _, offsets in made.values())]).astype(
            np.float32
        ),
    )
