"""Plain loops over numpy arrays as machine code, by numba, when they are first needed."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any


@functools.cache
def compiled(loops: Callable[..., Any]) -> Callable[..., Any]:
    """`loops` compiled; what was compiled is kept on disk for other processes, beside the source or
    in the user's cache folder."""
    import numba

    try:
        fast: Callable[..., Any] = numba.njit(cache=True)(loops)
    except RuntimeError:  # neither folder can be written
        fast = numba.njit(loops)
    return fast
