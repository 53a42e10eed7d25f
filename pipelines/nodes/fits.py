"""A body as one of several photos shows it; apart from `values`, since frames depend on those and
not on how bodies are fitted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from a2v.record import Record
from a2v.types import Body, PhotoCamera

if TYPE_CHECKING:
    from a2v.body import FitResult


@dataclass(frozen=True, kw_only=True)
class Fitted(Record):
    """A body that was fitted to one of several photos, the photo's camera, and whether the photo
    was understood: others are left out."""

    body: Body
    camera: PhotoCamera
    understood: bool = True

    @property
    def result(self) -> FitResult:
        """As the library has it."""
        from a2v.body import FitResult

        return FitResult(self.body, self.camera)
