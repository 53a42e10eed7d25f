"""The body fitted to one of several photos.

This module is separate from `values`, because the results of frames depend on all code in `values`,
but not on the fits of bodies.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from a2v.record import Record
from a2v.types import Body, PhotoCamera

if TYPE_CHECKING:
    from a2v.body import FitResult


@dataclass(frozen=True, kw_only=True)
class Fitted(Record):
    """A body that was fitted to one of several photos, the photo's camera, and whether it fits.

    Photos whose fit is wrong are left out.
    """

    body: Body
    camera: PhotoCamera
    understood: bool = True

    @property
    def result(self) -> FitResult:
        """Return the library's form of it."""
        from a2v.body import FitResult

        return FitResult(self.body, self.camera)
