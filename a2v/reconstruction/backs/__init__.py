"""Backs: what the photo shows is continued over the side that it does not show.

`twins` finds the other side of the body, `labels` says what is where (skin, hair, garments, shoes),
`exemplar` what the photo tells of each, `frames` how the surface unrolls into the photo's plane,
`matching` which place each unseen vertex continues, and `continuation` puts them together.
"""

from a2v.reconstruction.backs.continuation import Continuation, continue_photo
from a2v.reconstruction.backs.labels import label_surface
from a2v.reconstruction.backs.seen import KINDS, Seen, seen_before
from a2v.reconstruction.backs.twins import find_twins

__all__ = [
    "KINDS",
    "Continuation",
    "Seen",
    "continue_photo",
    "find_twins",
    "label_surface",
    "seen_before",
]
