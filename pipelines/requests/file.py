"""Request for a file of a character."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TypeVar

from pipelines.engines import EngineOptions
from pipelines.poses import PoseOptions
from pipelines.requests.fields import Request
from pipelines.rigs import AvatarOptions, RigOptions

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class FileRequest(Request, PoseOptions, RigOptions, AvatarOptions, EngineOptions):
    """Options of ``a2v character`` for exported files."""

    @property
    def posing(self) -> PoseOptions:
        """Return the pose."""
        return self._part(PoseOptions)

    @property
    def rigging(self) -> RigOptions:
        """Return the options for the tools that open the file."""
        return self._part(RigOptions)

    @property
    def avatar(self) -> AvatarOptions:
        """Return what a ``.vrm`` says of its author and license."""
        return self._part(AvatarOptions)

    @property
    def engine(self) -> EngineOptions:
        """Return the options for game engines."""
        return self._part(EngineOptions)

    def _part(self, kind: type[T]) -> T:
        names = [item.name for item in dataclasses.fields(kind)]  # type: ignore[arg-type]
        return kind(**{name: getattr(self, name) for name in names})
