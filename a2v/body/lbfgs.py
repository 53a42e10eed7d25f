"""L-BFGS with a strong Wolfe line search (torch's), for all fits of the body."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from torch import Tensor


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
        Gives a scalar that depends on `unknowns`, leaf tensors of any shapes that require
        gradients.
    steps : int
        Iterations.
    history : int
        Past steps that L-BFGS remembers.
    tolerance : float
        Stop when a step changes neither the loss nor any unknown by more.
    """
    import torch

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
