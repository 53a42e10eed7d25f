"""Reconstruct the person in the photo as a closed, colored surface.

All backends give an `a2v.types.Surface`. `body_prior_surface` pushes a fitted body out to the
silhouette. `extract_surface` makes a closed mesh from any signed distance field. `color_surface`
colors visible places from the photo and the others by Eq. 14 (`solve_colors`). Heavy packages are
imported at their first use.
"""

from a2v.reconstruction.body_prior import SurfaceSettings, body_prior_surface
from a2v.reconstruction.coloring import ColorEvidence, ColorSettings, color_surface
from a2v.reconstruction.coloring.equation14 import ColorSolution, solve_colors
from a2v.reconstruction.extraction import ExtractionSettings, extract_surface
from a2v.reconstruction.face import FaceSettings, add_face
from a2v.reconstruction.hands import HandSettings, add_hands
from a2v.reconstruction.implicit import ImplicitSettings, implicit_surface
from a2v.reconstruction.sheet import surface_sheet

__all__ = [
    "ColorEvidence",
    "ColorSettings",
    "ColorSolution",
    "ExtractionSettings",
    "FaceSettings",
    "HandSettings",
    "ImplicitSettings",
    "SurfaceSettings",
    "add_face",
    "add_hands",
    "body_prior_surface",
    "color_surface",
    "extract_surface",
    "implicit_surface",
    "solve_colors",
    "surface_sheet",
]
