from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from a2v.errors import InputError
from a2v.reconstruction.coloring.equation14 import ColorProblem, color_objective, solve_colors


def problem(count: int = 60, seed: int = 0):
    """A problem of Eq. 14 on a sphere, whose prior has gross outliers on the back.

    The front half is known, a ring is the band.
    """
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    neighbors = cKDTree(points).query(points, k=6)[1][:, 1:]
    free = points[:, 2] < 0.2
    band = free & (points[:, 2] > -0.1)
    truth = 0.5 + 0.4 * points
    prior = truth + rng.normal(0, 0.03, truth.shape)
    prior[rng.random(count) < 0.15] = rng.random(3)
    return truth, prior, neighbors, free, band


def dense_optimum(truth, prior, neighbors, free, band, lambda_nn: float) -> float:
    """The minimum of Eq. 14 by a quasi-Newton method on smoothed norms.

    The norms are sqrt(r^2 + e^2), with e decreasing to 1e-7.
    """
    value = np.where(free[:, None], prior, truth)
    x = np.nonzero(free)[0]
    tail, head = np.repeat(x, neighbors.shape[1]), neighbors[x].ravel()
    data = np.nonzero(free & ~band)[0]
    weight = lambda_nn / neighbors.shape[1]

    def rounded(flat: np.ndarray, width: float) -> tuple[float, np.ndarray]:
        color = truth.copy()
        color[free] = flat.reshape(-1, 3)
        gradient = np.zeros_like(color)
        a, b = color[data] - prior[data], color[tail] - color[head]
        la, lb = np.sqrt((a**2).sum(1) + width**2), np.sqrt((b**2).sum(1) + width**2)
        np.add.at(gradient, data, a / la[:, None])
        np.add.at(gradient, tail, weight * b / lb[:, None])
        np.add.at(gradient, head, -weight * b / lb[:, None])
        return float(la.sum() + weight * lb.sum()), gradient[free].ravel()

    flat = value[free].ravel()
    for width in 10.0 ** np.arange(-1, -7.5, -0.5):
        flat = minimize(
            rounded,
            flat,
            (width,),
            jac=True,
            method="L-BFGS-B",
            options={"maxiter": 5000, "maxfun": 20000, "ftol": 1e-15, "gtol": 1e-10},
        ).x
    color = truth.copy()
    color[free] = flat.reshape(-1, 3)
    return color_objective(
        color,
        ColorProblem(prior=prior, neighbors=neighbors, free=free, band=band, lambda_nn=lambda_nn),
    )


@pytest.mark.parametrize("lambda_nn", [0.3, 1.0, 4.0])
@pytest.mark.parametrize("seed", [0, 1])
def test_agrees_with_a_dense_convex_solver(lambda_nn: float, seed: int) -> None:
    truth, prior, neighbors, free, band = problem(seed=seed)
    start = np.where(free[:, None], 0.5, truth)
    found = solve_colors(
        start,
        ColorProblem(prior=prior, neighbors=neighbors, free=free, band=band, lambda_nn=lambda_nn),
        tolerance=1e-7,
        max_iterations=20000,
    )
    best = dense_optimum(truth, prior, neighbors, free, band, lambda_nn)
    assert found.residual < 1e-7
    assert found.objective == pytest.approx(best, rel=2e-5)
    assert found.objective <= best * (1 + 1e-5)
    assert np.array_equal(found.colors[~free], truth[~free])


def test_no_direction_is_downhill() -> None:
    truth, prior, neighbors, free, band = problem(120, 3)
    found = solve_colors(
        truth,
        ColorProblem(prior=prior, neighbors=neighbors, free=free, band=band),
        tolerance=1e-7,
        max_iterations=20000,
    )
    rng = np.random.default_rng(0)
    for _ in range(200):
        step = np.zeros_like(truth)
        step[rng.choice(np.nonzero(free)[0], 3)] = rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(
            -4, -1
        )
        assert (
            color_objective(
                found.colors + step,
                ColorProblem(prior=prior, neighbors=neighbors, free=free, band=band, lambda_nn=1.0),
            )
            > found.objective - 1e-6
        )


def test_loose_tolerance_is_near_the_optimum() -> None:
    """The default of color_surface costs less than half a percent of the objective."""
    truth, prior, neighbors, free, band = problem(400, 5)
    exact = solve_colors(
        truth,
        ColorProblem(prior=prior, neighbors=neighbors, free=free, band=band),
        tolerance=1e-7,
        max_iterations=20000,
    )
    loose = solve_colors(
        truth, ColorProblem(prior=prior, neighbors=neighbors, free=free, band=band), tolerance=1e-3
    )
    assert loose.iterations < exact.iterations
    assert loose.objective < exact.objective * 1.005


def test_band_ignores_the_prior_and_limits() -> None:
    truth, prior, neighbors, free, band = problem()
    everywhere = np.where(band[:, None], 1e3, prior)
    a = solve_colors(
        truth, ColorProblem(prior=prior, neighbors=neighbors, free=free, band=band), tolerance=1e-6
    ).colors
    b = solve_colors(
        truth,
        ColorProblem(prior=everywhere, neighbors=neighbors, free=free, band=band),
        tolerance=1e-6,
    ).colors
    assert np.allclose(a, b, atol=1e-9)
    alone = solve_colors(
        truth,
        ColorProblem(
            prior=prior, neighbors=neighbors, free=free, band=np.zeros_like(band), lambda_nn=1e-6
        ),
        tolerance=1e-6,
    ).colors
    assert np.allclose(alone[free], prior[free], atol=1e-3)
    # with only neighbors that agree, the band takes their color
    flat = np.where(free[:, None], 0.1, 0.7) * np.ones((1, 3))
    filled = solve_colors(
        flat, ColorProblem(prior=prior, neighbors=neighbors, free=free, band=free), tolerance=1e-7
    ).colors
    assert np.allclose(filled, 0.7, atol=1e-3)


def test_odd_input() -> None:
    truth, prior, neighbors, free, band = problem()
    none = np.zeros_like(free)
    assert np.array_equal(
        solve_colors(
            truth, ColorProblem(prior=prior, neighbors=neighbors, free=none, band=none)
        ).colors,
        truth,
    )
    assert np.isfinite(
        solve_colors(
            truth, ColorProblem(prior=prior, neighbors=neighbors, free=~none, band=~none)
        ).colors
    ).all()  # nothing known at all
    with pytest.raises(InputError, match="prior has shape"):
        solve_colors(
            truth, ColorProblem(prior=prior[:3], neighbors=neighbors, free=free, band=band)
        )
    with pytest.raises(InputError, match="lambda_nn"):
        solve_colors(
            truth,
            ColorProblem(prior=prior, neighbors=neighbors, free=free, band=band, lambda_nn=0.0),
        )
    with pytest.raises(InputError, match="NaN"):
        solve_colors(
            truth, ColorProblem(prior=prior * np.nan, neighbors=neighbors, free=free, band=band)
        )
