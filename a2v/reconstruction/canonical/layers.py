"""Closed layers of a character that hang from the body: skirts and long hair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2v.body.parts import PARTS
from a2v.types import FloatArray, IntArray, Standing


@dataclass(frozen=True, eq=False)
class Layer:
    """A closed layer: the outer side, then the inner side, with as many vertices.

    Attributes
    ----------
    vertices : (n, 3) float64
        At rest, meters.
    weights : (n, 4) float64
    bones : (n, 4) int64
    anchors : (n,) int64
        Nearest vertices of the body.
    """

    vertices: FloatArray
    weights: FloatArray
    bones: IntArray
    anchors: IntArray


def with_layer(standing: Standing, layer: Layer, part: str) -> Standing:
    """Append a layer, as a piece of the body's `part`, to the standing surface of a body."""
    parts = np.full(len(layer.vertices), PARTS.index(part))
    return Standing(
        vertices=np.concatenate([standing.vertices, layer.vertices]).astype(np.float32),
        weights=np.concatenate([standing.weights, layer.weights]).astype(np.float32),
        bones=np.concatenate([standing.bones, layer.bones]).astype(np.int32),
        anchors=np.concatenate([standing.anchors, layer.anchors]).astype(np.int32),
        parts=np.concatenate([standing.parts, parts]).astype(np.int8),
    )


def closed_faces(outer: IntArray, edges: Sequence[tuple[IntArray, bool]]) -> IntArray:
    """Return the faces (F, 3) of a closed layer.

    Parameters
    ----------
    outer : (f, 3) int
        Faces of the outer side, which use all of its vertices.
    edges : sequence of ((k,) int, bool)
        Paths of vertices along the open borders of the outer side, and whether the strip that
        joins both sides there is turned over. A closed path ends at its first vertex.
    """
    half = int(outer.max()) + 1
    rims = []
    for path, turned in edges:
        one, two = path[:-1], path[1:]
        strip = np.concatenate(
            [
                np.stack([one, two, two + half], axis=1),
                np.stack([one, two + half, one + half], axis=1),
            ]
        )
        rims.append(strip[:, ::-1] if turned else strip)
    return np.concatenate([outer, outer[:, ::-1] + half, *rims])
