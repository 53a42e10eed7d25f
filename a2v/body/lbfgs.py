"""L-BFGS with a strong Wolfe line search (torch's), for all fits of the body."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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


def minimize(
    loss: Callable[[], Tensor],
    unknowns: Sequence[Tensor],
    *,
    steps: int,
    history: int,
    tolerance: float = 1e-9,
) -> None:
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
    """
    import torch

    _without_dynamo(torch.optim.Optimizer)
    optimizer = torch.optim.LBFGS(
        unknowns,
        max_iter=steps,
        history_size=history,
        tolerance_change=tolerance,
        line_search_fn="strong_wolfe",
    )

    def closure() -> Tensor:
        optimizer.zero_grad()
        value = loss()
        value.backward()  # type: ignore[no-untyped-call]
        return value

    optimizer.step(closure)  # type: ignore[no-untyped-call]
