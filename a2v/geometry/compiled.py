"""Plain loops over numpy arrays, compiled to machine code by numba at their first use."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any


@functools.cache
def compiled(loops: Callable[..., Any]) -> Callable[..., Any]:
    """Return `loops` compiled.

    The machine code is cached on disk for other processes, beside the source or in the user's cache
    folder.
    """
    import numba

    try:
        fast: Callable[..., Any] = numba.njit(cache=True)(loops)
    except RuntimeError:  # neither folder is writable
        fast = numba.njit(loops)
    return fast
