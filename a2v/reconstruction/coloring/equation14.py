"""Eq. 14 of the journal paper: colors of the unseen side, by a convex program.

    min over c of  sum_{x in O} [ ||c_x - c_x^p||_2 + lambda_nn / |N_x| * sum_{x' in N_x} ||c_x -
    c_x'||_2 ]

The norms are not squared, so a few wrong prior colors do not bleed; in the transition band only the
second term counts. It is solved by ADMM (Boyd et al. 2011): one sparse factorization, then
only back-substitutions and shrinkages.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.geometry.mesh import factored
from a2v.types import BoolArray, FloatArray, IntArray

_RELAXED = 1.6
"""Over-relaxation of ADMM."""
_SINGLE = 1e-5
"""Smallest tolerance that is reached in single precision."""
_RIDGE = 1e-3
"""Weight of the starting color of patches that nothing else fixes; far less is lost in single
precision."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ColorProblem:
    """The problem of Eq. 14.

    Attributes
    ----------
    prior : (V, 3)
        c^p; used where ``free & ~band``.
    neighbors : (V, N) int
        N_x; rows of fixed vertices are not used.
    free : (V,) bool
        O and the band: vertices whose colors are unknown.
    band : (V,) bool
        Free vertices of the transition band: second term only.
    lambda_nn : float
        Weight of the neighbors.
    """

    prior: FloatArray
    neighbors: IntArray
    free: BoolArray
    band: BoolArray
    lambda_nn: float = 1.0


@dataclass(frozen=True)
class ColorSolution:
    """The result of `solve_colors`.

    Attributes
    ----------
    colors : (V, 3) float64
        Colors; the fixed ones unchanged.
    iterations : int
    residual : float
        The larger one of the final relative primal and dual residuals.
    objective : float
        Value of Eq. 14.
    """

    colors: FloatArray
    iterations: int
    residual: float
    objective: float


@dataclass(frozen=True, eq=False)
class _Programme:
    """Eq. 14 as ``sum_k weight_k ||(operator x - target)_k||_2`` over the colors x (n, 3) of the
    free vertices.

    Rows: first `pairs` of neighbors, then the prior's. ``normal`` is ``operator.T operator``, plus
    the diagonal `ridge` for colors without any constraint.
    """

    operator: Any
    target: FloatArray
    weight: FloatArray
    pairs: int
    normal: Any
    ridge: Any
    start: FloatArray


def color_objective(colors: FloatArray, problem: ColorProblem) -> float:
    """Value of Eq. 14 at `colors` (V, 3)."""
    free = problem.free
    data = np.linalg.norm(colors - problem.prior, axis=1)[free & ~problem.band].sum()
    smooth = (
        np.linalg.norm(colors[free][:, None] - colors[problem.neighbors[free]], axis=2)
        .mean(axis=1)
        .sum()
    )
    return float(data + problem.lambda_nn * smooth)


def solve_colors(
    colors: FloatArray,
    problem: ColorProblem,
    *,
    tolerance: float = 1e-4,
    max_iterations: int = 2000,
) -> ColorSolution:
    """Minimize Eq. 14.

    Parameters
    ----------
    colors : (V, 3)
        Known colors of vertices that are not `free`; a starting point for the others.
    problem : ColorProblem
    tolerance : float
        Stop when both relative residuals are below it.
    max_iterations : int

    Raises
    ------
    InputError
        Arrays that do not fit each other, NaN, or lambda_nn not positive.
    """
    _check(colors, problem)
    free = problem.free
    if not free.any():
        return ColorSolution(np.array(colors, np.float64), 0, 0.0, 0.0)
    value, iteration, residual = _minimise(_programme(colors, problem), tolerance, max_iterations)
    result = np.array(colors, np.float64)
    result[free] = value
    return ColorSolution(result, iteration, residual, color_objective(result, problem))


def _check(colors: FloatArray, problem: ColorProblem) -> None:
    prior, neighbors, free, band, lambda_nn = (
        problem.prior,
        problem.neighbors,
        problem.free,
        problem.band,
        problem.lambda_nn,
    )
    count = len(colors)
    for name, array, shape in (
        ("prior", prior, (count, 3)),
        ("free", free, (count,)),
        ("band", band, (count,)),
    ):
        if array.shape != shape:
            raise InputError(f"{name} has shape {array.shape}; expected {shape}")
    if neighbors.ndim != 2 or len(neighbors) != count or neighbors.shape[1] < 1:
        raise InputError(f"neighbors has shape {neighbors.shape}; expected ({count}, N)")
    if not (np.isfinite(lambda_nn) and lambda_nn > 0):
        raise InputError(f"lambda_nn is {lambda_nn}; expected a positive number")
    if not np.isfinite(colors[~free]).all() or not np.isfinite(prior[free & ~band]).all():
        raise InputError("fixed colors or the prior hold NaN; expected finite numbers")


def _programme(colors: FloatArray, problem: ColorProblem) -> _Programme:
    """Eq. 14 in matrices."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    free, neighbors = problem.free, problem.neighbors
    count, unknowns = len(colors), int(free.sum())
    number = np.full(count, -1)
    number[free] = np.arange(unknowns)
    anchored = np.nonzero(free & ~problem.band)[0]
    low, high, times = _neighbor_pairs(neighbors, free)
    rows = np.arange(len(low))
    difference = sp.csr_matrix((np.ones(len(low)), (rows, low)), (len(low), count)) - sp.csr_matrix(
        (np.ones(len(low)), (rows, high)), (len(low), count)
    )
    known = np.where(free[:, None], 0.0, np.nan_to_num(colors)).astype(np.float64)
    pick = sp.csr_matrix(
        (np.ones(len(anchored)), (np.arange(len(anchored)), number[anchored])),
        (len(anchored), unknowns),
    )
    operator = sp.vstack([difference[:, free], pick]).tocsr()

    # A patch without any fixed neighbor or prior may have any color. A small weight on its starting
    # color decides.
    normal = (operator.T @ operator).tocsc()
    parts, label = connected_components(normal, directed=False)
    tied = np.zeros(parts, bool)
    tied[label[number[anchored]]] = True
    touching = (free[low] != free[high]).nonzero()[0]
    tied[label[number[np.where(free[low[touching]], low[touching], high[touching])]]] = True
    return _Programme(
        operator=operator,
        target=np.concatenate([-(difference @ known), problem.prior[anchored]]),
        weight=np.concatenate(
            [times * (problem.lambda_nn / neighbors.shape[1]), np.ones(len(anchored))]
        ),
        pairs=len(low),
        normal=normal,
        ridge=sp.diags(np.where(tied[label], 0.0, _RIDGE)),
        start=np.nan_to_num(np.asarray(colors, np.float64)[free], nan=0.5),
    )


def _neighbor_pairs(neighbors: IntArray, free: BoolArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return both ends (P,) of the pairs (x, x') of Eq. 14, and the number of occurrences of each
    pair.

    Equal pairs become one norm with the summed weight.
    """
    count = len(neighbors)
    tail = np.repeat(np.nonzero(free)[0], neighbors.shape[1])
    head = neighbors[free].ravel().astype(np.int64)
    keep = tail != head
    pair, times = np.unique(
        np.minimum(tail, head)[keep] * count + np.maximum(tail, head)[keep], return_counts=True
    )
    return pair // count, pair % count, times


def _minimise(
    program: _Programme, tolerance: float, max_iterations: int
) -> tuple[FloatArray, int, float]:
    """Colors (n, 3) of the free vertices by over-relaxed ADMM, the number of iterations, and the
    final residual.

    Arrays of the rows are (3, rows) and written in place: new ones cost more than the arithmetic.
    """
    kind: Any = np.float32 if tolerance >= _SINGLE else np.float64
    operator = program.operator.astype(kind)
    transposed = operator.T.tocsr()
    factor = factored((program.normal + program.ridge).astype(kind))
    target, weight = np.ascontiguousarray(program.target.T, kind), program.weight.astype(kind)
    pull = np.ascontiguousarray((program.ridge @ program.start).T, kind)
    value = np.ascontiguousarray(program.start.T, kind)
    slack = _columns(operator, value) - target
    dual, previous, argument = np.zeros_like(slack), np.empty_like(slack), np.empty_like(slack)
    rho, residual, iteration = 10.0, np.inf, 0
    norm_target = np.linalg.norm(target) + 1.0
    anchors = np.arange(len(weight)) >= program.pairs
    for iteration in range(1, max_iterations + 1):
        np.add(target, slack, out=argument)
        argument -= dual
        value = factor.solve((_columns(transposed, argument) + pull).T).T
        gap = _columns(operator, value)
        gap -= target
        slack, previous = previous, slack
        np.multiply(gap, _RELAXED, out=argument)
        np.multiply(previous, 1 - _RELAXED, out=slack)
        argument += slack
        argument += dual
        length = np.sqrt(np.einsum("ij,ij->j", argument, argument))
        np.maximum(length, 1e-30, out=length)
        np.multiply(argument, np.maximum(0.0, 1.0 - (weight / rho) / length), out=slack)
        np.subtract(argument, slack, out=dual)
        if iteration % 10 == 0 or iteration == max_iterations:
            size = max(
                float(np.linalg.norm(slack)), float(np.linalg.norm(gap)), 1e-3 * float(norm_target)
            )
            primal = float(np.linalg.norm(gap - slack)) / size
            moved = float(np.linalg.norm(_columns(transposed, slack - previous)))
            backward = moved / max(
                float(np.linalg.norm(_columns(transposed, np.where(anchors, dual, 0.0)))), 1e-3
            )
            residual = max(primal, backward)
            if residual < tolerance:
                break
            if (
                iteration % 50 == 0 and iteration <= 600
            ):  # balance the two residuals; the factorization does not depend on rho
                if primal > 5 * backward:
                    rho, dual = rho * 2, dual / 2
                elif backward > 5 * primal:
                    rho, dual = rho / 2, dual * 2
    return value.T.astype(np.float64), iteration, residual


def _columns(matrix: Any, rows: FloatArray) -> FloatArray:
    """Return the products (3, m) of a sparse matrix (m, n) with the `rows` (3, n)."""
    return np.stack([matrix @ row for row in rows])
