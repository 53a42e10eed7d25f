"""Solve for the displacements of the whole body from the observed ones: one sparse system."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.geometry.mesh import cotangent_weights, factored, laplacian, vertex_areas
from a2v.types import BoolArray, FloatArray, IntArray

_TWIN = 0.3
"""Weight of the displacement of the mirrored vertex, for vertices without an observation."""
_USUAL = 0.02
"""Weight of the usual displacement of the part."""
_STIFF = 0.004
"""Length of the membrane term, meters. A thin plate alone overshoots where nothing is observed."""


@dataclass(frozen=True, eq=False)
class RestMesh:
    """The mesh at rest, before it is displaced.

    Attributes
    ----------
    vertices : (V, 3) float64
        Meters.
    faces : (F, 3) int
    parts : (V,) int
        Index into `a2v.body.PARTS`.
    twin : (V,) int
        The mirrored vertex.
    """

    vertices: FloatArray
    faces: IntArray
    parts: IntArray
    twin: IntArray


def solve_offsets(
    mesh: RestMesh, offset: FloatArray, weight: FloatArray, *, fixed: BoolArray, smoothing: float
) -> FloatArray:
    """Solve for displacements (V,) float64, meters, near the observed ones and smooth over the
    body.

    Minimizes sum A c (d - o)^2 + l^4 |D d|^2 + s^2 |G d|^2, with areas A, certainties c, the
    Laplacian D and the gradient G of the body at rest.

    Parameters
    ----------
    mesh : RestMesh
    offset, weight : (V,)
        Observed displacements, meters, and their weights.
    fixed : (V,) bool
        Vertices whose displacement is 0.
    smoothing : float
        l, meters.
    """
    from scipy.sparse import diags

    known = (weight > 0) & ~fixed
    o, c = offset.copy(), weight.copy()
    lent = ~known & ~fixed & known[mesh.twin]
    o[lent], c[lent] = offset[mesh.twin[lent]], _TWIN * weight[mesh.twin[lent]]
    for part in np.unique(mesh.parts):
        mine = mesh.parts == part
        usual = np.median(offset[mine & known]) if (mine & known).sum() > 20 else 0.0
        rest_of = mine & (c == 0) & ~fixed
        o[rest_of], c[rest_of] = max(float(usual), 0.0), _USUAL
    o[fixed], c[fixed] = 0.0, 100.0
    area = vertex_areas(mesh.vertices, mesh.faces) + 1e-10
    stiff = laplacian(cotangent_weights(mesh.vertices, mesh.faces))
    plate = stiff @ diags(1 / area) @ stiff
    system = diags(area * (c + 1e-6)) + smoothing**4 * plate + _STIFF**2 * stiff
    return np.asarray(factored(system).solve(area * c * o))
