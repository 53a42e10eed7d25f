"""Options for game engines: coarser copies and compression, and the files that they make."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from a2v.animation.engine import EngineSettings, coarser
from a2v.errors import InputError
from a2v.formats.gltf import compress_glb, demand_compression
from a2v.types import Character
from pipelines.options import option

COMPRESSED_QUALITY = 85
"""JPEG quality of the pictures in compressed files, per cent."""
QUALITY = 92
"""JPEG quality of the pictures in other files."""

Write = Callable[[Path, Character, int], None]
"""Writes a character to a .glb with pictures of a given quality."""


@dataclass(frozen=True, kw_only=True)
class EngineOptions:
    """Copies for larger distances, and smaller files."""

    lods: str = option(
        "numbers of triangles, separated by commas; each gives a coarser copy NAME_lod1.glb...",
        default="",
    )
    compress: str = option(
        "compress a .glb with glTF Transform (npm): meshopt, or draco (compresses the shape only)",
        default="none",
        choices=("none", "meshopt", "draco"),
    )

    @property
    def plain(self) -> bool:
        """Whether none of these options is given."""
        return not self.lods and self.compress == "none"

    def check(self, path: Path) -> None:
        """Check the options before a long computation.

        Raises
        ------
        InputError
            Another kind of file than .glb, or bad numbers.
        MissingDependencyError
            What compresses is not installed.
        """
        if self.plain:
            return
        if path.suffix.lower() != ".glb":
            raise InputError(
                f"--lods and --compress apply to .glb files, not to {path}; write a .glb or leave "
                "them out"
            )
        self.levels()
        if self.compress != "none":
            demand_compression()

    def levels(self) -> list[int]:
        """Return the numbers of triangles of the copies.

        Raises
        ------
        InputError
            No numbers.
        """
        parts = [part.strip() for part in self.lods.split(",") if part.strip()]
        if bad := [part for part in parts if not part.isdigit()]:
            raise InputError(
                f"--lods contains '{bad[0]}'; expected numbers of triangles separated by commas, "
                "such as 15000,8000"
            )
        return [EngineSettings(triangles=int(part)).triangles for part in parts]

    def write(self, path: Path, character: Character, write: Write) -> list[Path]:
        """Write a character and its coarser copies; return the paths, the full character first."""
        quality = QUALITY if self.compress == "none" else COMPRESSED_QUALITY
        written = []
        for number, triangles in enumerate([0, *self.levels()]):
            target = path if not number else path.with_name(f"{path.stem}_lod{number}{path.suffix}")
            made = character if not number else coarser(character, triangles)
            write(target, made, quality)
            if self.compress != "none":
                compress_glb(target, self.compress)
            written.append(target)
        return written
