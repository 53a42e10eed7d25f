"""Continue the photo over the unseen side of the person.

`twins` finds the other side of the body, `labels` the skin, hair, garments and shoes, `exemplar`
the detail that the photo shows of each, `frames` unrolls the surface into the plane of the photo,
and `matching` finds the place in the photo that each unseen vertex continues. `continuation`
combines them.
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
