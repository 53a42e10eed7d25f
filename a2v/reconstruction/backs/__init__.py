"""Continue the photo over the unseen side of the person.

`twins` finds the other side of the body, `labels` the skin, hair, garments and shoes, `rings` runs
their borders around the body, `panels` splits garments, `exemplar` has the detail that the photo
shows of each, `frames` unrolls the surface into the plane of the photo, and `matching` finds the
place in the photo that each unseen vertex continues. `continuation` combines them.
"""

from a2v.reconstruction.backs.continuation import Continuation, continue_photo, in_palette
from a2v.reconstruction.backs.labels import label_surface
from a2v.reconstruction.backs.panels import find_panels
from a2v.reconstruction.backs.rings import run_around
from a2v.reconstruction.backs.seen import KINDS, BackEvidence, Materials, seen_before
from a2v.reconstruction.backs.twins import find_twins

__all__ = [
    "KINDS",
    "BackEvidence",
    "Continuation",
    "Materials",
    "continue_photo",
    "find_panels",
    "find_twins",
    "in_palette",
    "label_surface",
    "run_around",
    "seen_before",
]
