"""Color a surface by a list of steps (`steps`), each of which makes a new `Painting`."""

from a2v.reconstruction.coloring.painting import ColorEvidence, ColoringStep, Painting
from a2v.reconstruction.coloring.settings import ColorSettings
from a2v.reconstruction.coloring.steps import STEPS, color_surface, finished

__all__ = [
    "STEPS",
    "ColorEvidence",
    "ColorSettings",
    "ColoringStep",
    "Painting",
    "color_surface",
    "finished",
]
