"""What callers in Python give: paths are checked, and signatures list the options."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable
from typing import Any, TypeVar

from a2v.errors import InputError
from a2v.io import brief

F = TypeVar("F", bound=Callable[..., Any])


def listing(keywords: type) -> Callable[[F], F]:
    """Show the names of `keywords` in the signature of a function, for `help` and notebooks."""

    def show(function: F) -> F:
        signature = inspect.signature(function)
        named = [one for one in signature.parameters.values() if one.kind != one.VAR_KEYWORD]
        kind = inspect.Parameter.KEYWORD_ONLY
        more = [inspect.Parameter(name, kind, default=...) for name in keywords.__annotations__]
        vars(function)["__signature__"] = signature.replace(parameters=[*named, *more])
        return function

    return show


def path_given(name: str, value: object, expected: str) -> str:
    """Return a path as text.

    Raises
    ------
    InputError
        It is none.
    """
    if not isinstance(value, str | os.PathLike) or not isinstance(os.fspath(value), str):
        raise InputError(f"{name} is {brief(value)}; expected {expected}")
    return os.fspath(value)
