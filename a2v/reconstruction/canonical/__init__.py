"""Build a character in the rest pose of the body, in which no parts touch: the refined mesh of the
body, displaced to the dressed surface."""

from a2v.reconstruction.canonical.build import canonical_person
from a2v.reconstruction.canonical.face import face_note
from a2v.reconstruction.canonical.settings import CharacterSettings, is_canonical
from a2v.reconstruction.canonical.several import Sight

__all__ = [
    "CharacterSettings",
    "Sight",
    "canonical_person",
    "face_note",
    "is_canonical",
]
