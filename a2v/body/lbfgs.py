"""Minimization for all fits of the body: L-BFGS with a strong Wolfe line search (torch's) in the
coordinates in which the objective is round.

The curvature of an objective of pose, shape and camera spans five orders of magnitude. In its own
coordinates L-BFGS stops far from the minimum, at a place that rounding decides. `metric_of` finds
the scales and directions in which every unit costs the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torch import Tensor


_DYNAMO = "__dynamo_disable"
"""Attribute in which torch stores a version of a function that its compiler skips."""


def _without_dynamo(optimizer: Any) -> None:
    """Keep PyTorch from importing its compiler (about 2 s) for the class of an `optimizer`.

    Two of the class's methods are wrapped so that the compiler skips them. At its first call, the
    wrapper imports the compiler, unless the method already has the attribute `_DYNAMO`. Nothing
    here is compiled, so the attribute is set to the method itself. If another version of PyTorch
    wraps in another way, it imports the compiler as usual.
    """
    for name in ("add_param_group", "zero_grad"):
        method = getattr(getattr(optimizer, name), "__wrapped__", None)
        if method is not None and not hasattr(method, _DYNAMO):
            setattr(method, _DYNAMO, method)


GRADIENT = 1e-3
"""Largest component of the gradient at the end of a minimization in a `Metric`: the unknowns are
then within about a thousandth of their own uncertainty of the minimum."""


@dataclass(frozen=True)
class Metric:
    """Coordinates in which an objective is round: ``unknowns = start + axes @ y``.

    Attributes
    ----------
    axes : (n, n) float64
        Symmetric. A unit of `y` changes the objective by one half in every direction.
    """

    axes: Tensor


def metric_of(
    loss: Callable[[], Tensor], unknowns: Sequence[Tensor], *, least: float = 1.0
) -> Metric:
    """Compute the `Metric` of `loss` at the present `unknowns`, from its Hessian.

    Directions of negative curvature count by its size. Curvatures below `least` count as `least`,
    so that a direction in which the objective is flat stays bounded.
    """
    import torch

    flat = _flat(
        torch.autograd.grad(loss(), unknowns, create_graph=True, allow_unused=True), unknowns
    )
    count = len(flat)
    rows = torch.autograd.grad(
        flat,
        unknowns,
        grad_outputs=torch.eye(count, dtype=flat.dtype),
        is_grads_batched=True,
        allow_unused=True,
    )
    hessian = torch.cat(
        [
            flat.new_zeros(count, one.numel()) if row is None else row.reshape(count, -1)
            for row, one in zip(rows, unknowns, strict=True)
        ],
        dim=1,
    ).detach()
    curvature, directions = torch.linalg.eigh((hessian + hessian.T) / 2)
    scales = curvature.abs().clamp_min(least).rsqrt()
    return Metric((directions * scales) @ directions.T)


def minimize(
    loss: Callable[[], Tensor],
    unknowns: Sequence[Tensor],
    *,
    steps: int,
    history: int,
    tolerance: float = 1e-9,
    metric: Metric | None = None,
    gradient: float = GRADIENT,
) -> float:
    """Lower `loss` in place by at most `steps` iterations.

    Parameters
    ----------
    loss : callable
        Returns a scalar that depends on `unknowns`, leaf tensors of any shapes that require
        gradients.
    steps : int
        Iterations.
    history : int
        Past steps that L-BFGS remembers.
    tolerance : float
        Stop when a step changes neither the loss nor any unknown by more.
    metric : Metric, optional
        Of about the same objective at about the same place.
    gradient : float
        With a metric, the usual stop: the largest component of the gradient is below it.

    Returns
    -------
    float
        Largest change of an unknown, in the coordinates of `metric`.
    """
    import torch

    _without_dynamo(torch.optim.Optimizer)
    sizes = [one.numel() for one in unknowns]
    start = torch.cat([one.detach().reshape(-1) for one in unknowns])
    own = torch.zeros_like(start, requires_grad=True)
    axes = None if metric is None else metric.axes
    optimizer = torch.optim.LBFGS(
        [own],
        max_iter=steps,
        history_size=history,
        tolerance_grad=1e-7 if metric is None else gradient,
        tolerance_change=tolerance,
        line_search_fn="strong_wolfe",
    )

    def place() -> None:
        with torch.no_grad():
            change = own if axes is None else axes @ own
            for one, part in zip(unknowns, torch.split(start + change, sizes), strict=True):
                one.copy_(part.view_as(one))

    def closure() -> Tensor:
        place()
        value = loss()
        flat = _flat(torch.autograd.grad(value, unknowns, allow_unused=True), unknowns)
        own.grad = flat if axes is None else axes @ flat
        return value.detach()

    optimizer.step(closure)  # type: ignore[no-untyped-call]
    place()
    return float(own.detach().abs().max())


def _flat(parts: Sequence[Tensor | None], unknowns: Sequence[Tensor]) -> Tensor:
    """Return derivatives by `unknowns` as one vector; None is zero."""
    import torch

    return torch.cat(
        [
            (torch.zeros_like(one) if part is None else part).reshape(-1)
            for part, one in zip(parts, unknowns, strict=True)
        ]
    )
