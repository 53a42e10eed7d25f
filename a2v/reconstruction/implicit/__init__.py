"""Pixel-aligned implicit functions: a person's surface and colors from one photo and the fitted
body.

`implicit_surface(subject, body, camera)` runs the shipped networks; `train_reconstruction` trains
them.
"""

from a2v.reconstruction.implicit.model import ImplicitModel, ImplicitPerson
from a2v.reconstruction.implicit.surface import ImplicitSettings, implicit_surface

__all__ = ["ImplicitModel", "ImplicitPerson", "ImplicitSettings", "implicit_surface"]
