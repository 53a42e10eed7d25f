"""A mesh with a color per vertex, passed between the stages of coloring."""

from __future__ import annotations

from dataclasses import dataclass

from a2v.types import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class ColoredMesh:
    """A surface while it is being colored.

    Attributes
    ----------
    vertices : (V, 3) float64
        Meters, in the flat frame of the photo's camera.
    faces : (F, 3) int64
    normals : (V, 3)
        Unit normals of the vertices.
    colors : (V, 3)
        sRGB in [0, 1].
    """

    vertices: FloatArray
    faces: IntArray
    normals: FloatArray
    colors: FloatArray
