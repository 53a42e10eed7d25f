"""The expressions of a surface; one of the types of `a2v.types`."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from a2v.errors import InputError
from a2v.record import Record

FloatArray = NDArray[np.floating[Any]]
IntArray = NDArray[np.integer[Any]]

FACE_KINDS: tuple[str, ...] = ("skin", "eye", "mouth", "tongue", "teeth")
"""Kinds of the vertices of a `Face`; "mouth" is the skin behind the lips."""


@dataclass(frozen=True, kw_only=True)
class Face(Record):
    """Expressions of a surface, and the vertices of its face that come from the body model.

    Attributes
    ----------
    names : tuple of N str
        ARKit's names: "eyeBlinkLeft" (the person's left), "jawOpen"...
    starts : (N + 1,) int32
        Expression i moves ``vertices[starts[i]:starts[i + 1]]``.
    vertices : (M,) int32
        Vertices of the surface, ascending within an expression.
    offsets : (M, 3) float32
        Their offsets at full strength, meters, in the surface's pose.
    patch : (K,) int32
        Vertices of the surface that come from the body model.
    twins : (K,) int32
        The body's vertex for each of `patch`; for a tooth, a nearby one.
    kinds : (K,) uint8
        Kind of each of `patch`, an index into `FACE_KINDS`.
    landmarks : (478, 3) float32
        Mediapipe's landmarks of the photo's face: u, v in its pixels, and depth.
    """

    names: tuple[str, ...]
    starts: IntArray
    vertices: IntArray
    offsets: FloatArray
    patch: IntArray
    twins: IntArray
    kinds: IntArray
    landmarks: FloatArray

    def __post_init__(self) -> None:
        sizes: dict[str, int] = {"N1": len(self.names) + 1}
        self._check("starts", ("N1",), sizes)
        self._check("vertices", ("M",), sizes)
        self._check("offsets", ("M", 3), sizes)
        self._check("patch", ("K",), sizes)
        self._check("twins", ("K",), sizes)
        self._check("kinds", ("K",), sizes | {"kinds": len(FACE_KINDS)}, below="kinds")
        self._check("landmarks", (478, 3))
        steps = np.diff(self.starts)
        if (steps < 0).any() or int(self.starts[0]) != 0 or int(self.starts[-1]) != sizes["M"]:
            raise InputError(
                f"Face.starts runs from {self.starts[0]} to {self.starts[-1]}; expected 0 to "
                f"{sizes['M']}, in ascending order"
            )

    def check_vertices(self, count: int) -> None:
        """Raise an `InputError` if a vertex index is not below `count`, the surface's number of
        vertices."""
        for name, used in (("vertices", self.vertices), ("patch", self.patch)):
            if used.size and not 0 <= int(used.min()) <= int(used.max()) < count:
                raise InputError(
                    f"Face.{name} has indices {used.min()} to {used.max()}; expected 0 to "
                    f"{count - 1}"
                )

    def kept(self, number: IntArray) -> Face:
        """Return the expressions of a surface after vertices were removed.

        `number` (V,) is the new index of each vertex, -1 for removed ones.
        """
        left = number[self.vertices] >= 0
        counts = np.concatenate([[0], np.cumsum(left)])
        own = number[self.patch] >= 0
        return dataclasses.replace(
            self,
            starts=counts[self.starts].astype(np.int32),
            vertices=number[self.vertices[left]].astype(np.int32),
            offsets=self.offsets[left],
            patch=number[self.patch[own]].astype(np.int32),
            twins=self.twins[own],
            kinds=self.kinds[own],
        )

    def target(self, name: str) -> tuple[IntArray, FloatArray]:
        """Return the vertices (n,) and offsets (n, 3) of the expression `name`.

        Raises
        ------
        InputError
            There is no such expression.
        """
        if name not in self.names:
            raise InputError(f"unknown expression '{name}'; choose from {', '.join(self.names)}")
        own = slice(*(int(at) for at in self.starts[self.names.index(name) :][:2]))
        return self.vertices[own], self.offsets[own]

    def mixed(self, weights: Mapping[str, float]) -> tuple[IntArray, FloatArray]:
        """Mix expressions by `weights` (by name): returns the moved vertices (n,) and their offsets
        (n, 3) float64, meters."""
        parts = [
            (vertices, weight * offsets.astype(np.float64))
            for name, weight in weights.items()
            if weight
            for vertices, offsets in [self.target(name)]
        ]
        if not parts:
            return np.zeros(0, np.int64), np.zeros((0, 3))
        vertices, index = np.unique(
            np.concatenate([part for part, _ in parts]), return_inverse=True
        )
        offsets = np.zeros((len(vertices), 3))
        np.add.at(offsets, index, np.concatenate([part for _, part in parts]))
        return vertices, offsets


def other_side(expressions: Mapping[str, FloatArray] | None) -> dict[str, FloatArray] | None:
    """Mirror expressions: strengths by ARKit's names, with left and right exchanged."""
    if expressions is None:
        return None
    swap = {"Left": "Right", "Right": "Left"}
    return {
        re.sub("(Left|Right)$", lambda side: swap[side[0]], name): strength
        for name, strength in expressions.items()
    }
