"""Color a surface by a list of steps (`steps`), each of which makes a new `Painting`."""

from a2v.reconstruction.coloring.painting import ColorEvidence, Painting, Step
from a2v.reconstruction.coloring.settings import ColorSettings
from a2v.reconstruction.coloring.steps import STEPS, color_surface, finished

__all__ = [
    "STEPS",
    "ColorEvidence",
    "ColorSettings",
    "Painting",
    "Step",
    "color_surface",
    "finished",
]
