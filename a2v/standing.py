"""A surface in the body's rest pose, with its binding; one of the types of `a2v.types`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from a2v.record import Record

FloatArray = NDArray[np.floating[Any]]
IntArray = NDArray[np.integer[Any]]


@dataclass(frozen=True, kw_only=True)
class Standing(Record):
    """A surface in the rest pose of its body, in which no parts touch, with its skinning weights.

    Attributes
    ----------
    vertices : (V, 3) float32
        Meters.
    weights : (V, 4) float32
        Skinning weights, largest first, rows sum to 1.
    bones : (V, 4) int32
    anchors : (V,) int32
        The body's vertex that corresponds to each vertex.
    parts : (V,) int8
        Index into `a2v.body.PARTS`.
    """

    vertices: FloatArray
    weights: FloatArray
    bones: IntArray
    anchors: IntArray
    parts: IntArray

    def __post_init__(self) -> None:
        sizes: dict[str, int] = {}
        self._check("vertices", ("V", 3), sizes)
        self._check("weights", ("V", 4), sizes)
        self._check("bones", ("V", 4), sizes)
        self._check("anchors", ("V",), sizes)
        self._check("parts", ("V",), sizes)
