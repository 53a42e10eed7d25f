"""Eq. 14 of the journal paper: colours for the side that nobody saw, by a convex programme.

    min over c of  sum_{x in O} [ ||c_x - c_x^p||_2 + lambda_nn / |N_x| * sum_{x' in N_x} ||c_x - c_x'||_2 ]

The norms are not squared, so a few wrong prior colours do not bleed; in the transition band only the second term counts. Solved by
ADMM (Boyd et al. 2011): one sparse factorisation (`splu`), then only back-substitutions and shrinkages.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.types import BoolArray, FloatArray, IntArray


@dataclass(frozen=True)
class ColorSolution:
    """What `solve_colors` found.

    Attributes
    ----------
    colors : (V, 3) float64
        Colours; the fixed ones unchanged.
    iterations : int
    residual : float
        Larger of the relative primal and dual residuals at the end.
    objective : float
        Value of Eq. 14.
    """

    colors: FloatArray
    iterations: int
    residual: float
    objective: float


def color_objective(
    colors: FloatArray, prior: FloatArray, neighbors: IntArray, free: BoolArray, band: BoolArray, lambda_nn: float
) -> float:
    """Value of Eq. 14 at `colors` (V, 3); the other parameters as for `solve_colors`."""
    data = np.linalg.norm(colors - prior, axis=1)[free & ~band].sum()
    smooth = np.linalg.norm(colors[free][:, None] - colors[neighbors[free]], axis=2).mean(axis=1).sum()
    return float(data + lambda_nn * smooth)


def solve_colors(
    colors: FloatArray,
    prior: FloatArray,
    neighbors: IntArray,
    free: BoolArray,
    band: BoolArray,
    *,
    lambda_nn: float = 1.0,
    tolerance: float = 1e-4,
    max_iterations: int = 2000,
) -> ColorSolution:
    """Minimise Eq. 14.

    Parameters
    ----------
    colors : (V, 3)
        Known colours where not `free`; a starting point where free.
    prior : (V, 3)
        c^p, read where ``free & ~band``.
    neighbors : (V, N) int
        N_x; rows of fixed vertices are not read.
    free : (V,) bool
        O and the band: vertices whose colours are sought.
    band : (V,) bool
        Free vertices of the transition band: second term only.
    lambda_nn : float
        Weight of the neighbours.
    tolerance : float
        Stop when both relative residuals are below it.

    Raises
    ------
    InputError
        Arrays that do not fit each other, NaN, or lambda_nn not positive.
    """
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components
    from scipy.sparse.linalg import splu

    count = len(colors)
    for name, array, shape in (("prior", prior, (count, 3)), ("free", free, (count,)), ("band", band, (count,))):
        if array.shape != shape:
            raise InputError(f"{name} has shape {array.shape}; expected {shape}")
    if neighbors.ndim != 2 or len(neighbors) != count or neighbors.shape[1] < 1:
        raise InputError(f"neighbors has shape {neighbors.shape}; expected ({count}, N)")
    if not (np.isfinite(lambda_nn) and lambda_nn > 0):
        raise InputError(f"lambda_nn is {lambda_nn}; expected a positive number")
    if not np.isfinite(colors[~free]).all() or not np.isfinite(prior[free & ~band]).all():
        raise InputError("fixed colours or the prior hold NaN; expected finite numbers")
    if not free.any():
        return ColorSolution(np.array(colors, np.float64), 0, 0.0, 0.0)

    number = np.full(count, -1)
    number[free] = np.arange(int(free.sum()))
    unknowns = int(free.sum())
    anchored = np.nonzero(free & ~band)[0]

    # Directed pairs (x, x') with equal ends are merged: one norm with the summed weight.
    tail = np.repeat(np.nonzero(free)[0], neighbors.shape[1])
    head = neighbors[free].ravel().astype(np.int64)
    keep = tail != head
    low, high = np.minimum(tail, head)[keep], np.maximum(tail, head)[keep]
    pair, times = np.unique(low * count + high, return_counts=True)
    low, high = pair // count, pair % count
    edge_weight = times * (lambda_nn / neighbors.shape[1])

    rows = np.arange(len(pair))
    terms = len(pair) + len(anchored)
    difference = sp.csr_matrix((np.ones(len(pair)), (rows, low)), (len(pair), count)) - sp.csr_matrix(
        (np.ones(len(pair)), (rows, high)), (len(pair), count)
    )
    known = np.where(free[:, None], 0.0, np.nan_to_num(colors)).astype(np.float64)
    pick = sp.csr_matrix((np.ones(len(anchored)), (np.arange(len(anchored)), number[anchored])), (len(anchored), unknowns))
    operator = sp.vstack([difference[:, free], pick]).tocsr()
    target = np.concatenate([-(difference @ known), prior[anchored]])
    weight = np.concatenate([edge_weight, np.ones(len(anchored))])

    # A patch without any fixed neighbour or prior may have any colour: a whisper of the start decides.
    normal = (operator.T @ operator).tocsc()
    parts, label = connected_components(normal, directed=False)
    tied = np.zeros(parts, bool)
    tied[label[number[anchored]]] = True
    touching = (free[low] != free[high]).nonzero()[0]
    tied[label[number[np.where(free[low[touching]], low[touching], high[touching])]]] = True
    ridge = sp.diags(np.where(tied[label], 0.0, 1e-6))
    start = np.nan_to_num(np.asarray(colors, np.float64)[free], nan=0.5)
    factor = splu((normal + ridge).tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    pull = ridge @ start

    value = start
    slack = operator @ value - target
    dual = np.zeros_like(slack)
    rho, residual, iteration = 10.0, np.inf, 0
    norm_target = np.linalg.norm(target) + 1.0
    transposed = operator.T.tocsr()
    for iteration in range(1, max_iterations + 1):
        value = factor.solve(np.ascontiguousarray(transposed @ (target + slack - dual) + pull))
        gap = operator @ value - target
        relaxed = 1.6 * gap + (1 - 1.6) * slack  # over-relaxation
        argument = relaxed + dual
        length = np.linalg.norm(argument, axis=1)
        previous = slack
        slack = argument * np.maximum(0.0, 1.0 - (weight / rho) / np.maximum(length, 1e-300))[:, None]
        dual = argument - slack
        if iteration % 10 == 0 or iteration == max_iterations:
            size = max(float(np.linalg.norm(slack)), float(np.linalg.norm(gap)), 1e-3 * float(norm_target))
            primal = float(np.linalg.norm(gap - slack)) / size
            moved = float(np.linalg.norm(transposed @ (slack - previous)))
            dual_scale = float(np.linalg.norm(transposed @ np.where(np.arange(terms)[:, None] >= len(pair), dual, 0.0)))
            backward = moved / max(dual_scale, 1e-3)
            residual = max(primal, backward)
            if residual < tolerance:
                break
            if iteration % 50 == 0 and iteration <= 600:  # balance the two; the factorisation does not depend on rho
                if primal > 5 * backward:
                    rho, dual = rho * 2, dual / 2
                elif backward > 5 * primal:
                    rho, dual = rho / 2, dual * 2
    result = np.array(colors, np.float64)
    result[free] = value
    return ColorSolution(result, iteration, residual, color_objective(result, prior, neighbors, free, band, lambda_nn))
