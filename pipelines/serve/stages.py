"""Write a shape per finished stage of a person, which the stage shows while the next one runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from a2v.io import atomic_path
from a2v.types import Body, FloatArray, IntArray, Reconstruction, Surface
from pipelines.engine.run import Early, Outcome

_CLAY = 0.55

Shape = tuple[FloatArray, IntArray, FloatArray]
"""Vertices (V, 3) in meters, triangles (F, 3) and colors (V, 3)."""


def shapes(folder: Path, tell: Callable[[str], None]) -> Early:
    """Return callbacks that write the shape of each finished stage into `folder`.

    `tell` is called with the name of the stage. Cached stages are not written, since they take no
    time.
    """

    def stage(name: str, node: str) -> Callable[[Outcome], None]:
        def write(outcome: Outcome) -> None:
            if outcome.nodes[node].cached < outcome.nodes[node].calls:
                with atomic_path(folder / STAGES[name]) as temporary:
                    temporary.write_bytes(packed(*_SHAPES[name](outcome)))
                tell(name)

        return write

    return {
        "photo_body": stage("body", "photo_body"),
        "surface": stage("surface", "surface"),
        "colored_surface": stage("textured", "colored_surface"),
    }


def packed(vertices: FloatArray, faces: IntArray, colors: FloatArray) -> bytes:
    """Return the numbers of vertices and triangles (uint32), vertices (float32), triangles
    (uint32) and colors (uint8), little-endian."""
    counts = np.array([len(vertices), len(faces)], "<u4")
    levels = np.round(255 * np.clip(colors, 0, 1)).astype(np.uint8)
    return b"".join(
        part.tobytes() for part in (counts, vertices.astype("<f4"), faces.astype("<u4"), levels)
    )


def _of_surface(surface: Surface) -> Shape:
    return surface.vertices, surface.faces, surface.colors


def _of_body(body: Body) -> Shape:
    return body.vertices, body.faces, np.full((len(body.vertices), 3), _CLAY, np.float32)


def _plain(surface: Surface) -> Shape:
    return surface.vertices, surface.faces, np.full((len(surface.vertices), 3), _CLAY, np.float32)


STAGES: Mapping[str, str] = {
    "body": "stage_body.bin",
    "surface": "stage_surface.bin",
    "textured": "stage_textured.bin",
}
"""File names of the stages' shapes, by stage."""
_SHAPES: Mapping[str, Callable[[Outcome], Shape]] = {
    "body": lambda seen: _of_body(seen.get("photo_body", Body)),
    "surface": lambda seen: _plain(seen.get("surface", Reconstruction).surface),
    "textured": lambda seen: _of_surface(seen.get("colored_surface", Surface)),
}
