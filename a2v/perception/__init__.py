"""From a photograph to the person in it: decoding, landmarks, mask and crop.

`decode_photo` turns bytes into upright pixels, `find_person` turns pixels into a
`a2v.types.Subject`, and `read_openpose` reads landmarks of another detector. Nothing is
downloaded: the detector is mediapipe with the models in its wheel.
"""

from a2v.perception.corrections import Corrections, read_corrections
from a2v.perception.landmarks import read_openpose
from a2v.perception.person import PerceptionSettings, corrected, find_person
from a2v.perception.photo import MAX_PIXELS, MIN_SIDE, decode_mask, decode_photo

__all__ = [
    "MAX_PIXELS",
    "MIN_SIDE",
    "Corrections",
    "PerceptionSettings",
    "corrected",
    "decode_mask",
    "decode_photo",
    "find_person",
    "read_corrections",
    "read_openpose",
]
