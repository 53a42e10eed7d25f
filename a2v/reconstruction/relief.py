"""Combine positions and normals: a surface keeps its coarse shape and takes its relief from more
precise normals.

After Nehab et al. 2005, "Efficiently combining positions and normals for precise 3D geometry": a
linear least-squares problem over the mesh, here with one unknown per vertex, its displacement
along the normal.
"""

from __future__ import annotations

import numpy as np

from a2v.types import FloatArray, IntArray


def follow_normals(
    vertices: FloatArray,
    faces: IntArray,
    normals: FloatArray,
    trust: FloatArray,
    *,
    stiffness: float = 0.3,
    largest: float = 0.015,
) -> FloatArray:
    """Move vertices along given normals, so that the surface gets these normals.

    Minimizes ``sum over edges w (n . (p_i - p_j))^2 + stiffness * sum t^2`` with ``p = vertices + t
    normals`` and the mean normal n of an edge: each edge should lie in the plane of its normal.

    Parameters
    ----------
    vertices : (V, 3)
        Meters.
    faces : (F, 3) int
    normals : (V, 3)
        Unit normals that the surface should get.
    trust : (V,)
        From 0 (no given normal; the vertex stays) to 1.
    stiffness : float
        Cost of a displacement: larger values let only finer relief change. With edges of 8 mm, 0.3
        allows waves of up to about 15 cm, and 0.03 of half a meter.
    largest : float
        Largest displacement, meters.

    Returns
    -------
    (V, 3) float64
    """
    from scipy.sparse import coo_matrix, diags
    from scipy.sparse.linalg import cg

    vertices, normals = np.asarray(vertices, np.float64), np.asarray(normals, np.float64)
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    first, last = edges.T
    between = normals[first] + normals[last]
    between /= np.maximum(np.linalg.norm(between, axis=1, keepdims=True), 1e-9)
    weight = np.sqrt(np.minimum(trust[first], trust[last]))
    rows = np.arange(len(edges))
    values = np.concatenate(
        [
            weight * (between * normals[first]).sum(axis=1),
            -weight * (between * normals[last]).sum(axis=1),
        ]
    )
    slope = coo_matrix(
        (values, (np.tile(rows, 2), np.concatenate([first, last]))),
        shape=(len(edges), len(vertices)),
    ).tocsr()
    wrong = weight * (between * (vertices[first] - vertices[last])).sum(axis=1)
    hold = stiffness * (1 + 100 * (1 - trust))
    matrix = (slope.T @ slope + diags(hold)).tocsr()
    way, _ = cg(matrix, -(slope.T @ wrong), rtol=1e-4, maxiter=300, M=diags(1 / matrix.diagonal()))
    moved: FloatArray = vertices + np.clip(way, -largest, largest)[:, None] * normals
    return moved
