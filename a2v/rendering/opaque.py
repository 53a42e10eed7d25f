"""Numbers that a compiled Dr.Jit kernel takes as inputs. A new value needs no new kernel."""

from __future__ import annotations

from typing import Any


def opaque_number(mi: Any, value: float) -> Any:
    """Return a float that may change without a new kernel."""
    import drjit as dr

    number = mi.Float(float(value))
    dr.make_opaque(number)
    return number


def opaque_numbers(mi: Any, values: Any) -> list[Any]:
    """Return floats that may change without a new kernel, one for each of `values`."""
    return [opaque_number(mi, value) for value in values]


def opaque_integer(mi: Any, value: int) -> Any:
    """Return an unsigned integer that may change without a new kernel."""
    import drjit as dr

    number = mi.UInt32(int(value))
    dr.make_opaque(number)
    return number
