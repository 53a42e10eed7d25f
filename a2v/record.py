"""The base of the types that stages exchange: an immutable bundle of arrays in one ``.npz``."""

from __future__ import annotations

import dataclasses
import functools
import io
import json
import os
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, TypeVar, get_args, get_origin, get_type_hints

import numpy as np
from typing_extensions import Self

from a2v.errors import InputError
from a2v.io import parse_json, read_npz, reading, shorten, write_npz


@dataclass(frozen=True, kw_only=True)
class Record:
    """Base of the stage types: an immutable bundle of arrays, stored in one ``.npz``.

    `provenance` records what made the value (versions, seed, parameters, hashes of inputs and
    weights); it must be JSON. A subclass names in `may_hold_nan` the array fields in which NaN
    means "unknown".
    """

    may_hold_nan: ClassVar[frozenset[str]] = frozenset()

    provenance: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Flatten to named numpy arrays without pickles; nested records become ``outer.inner``."""
        arrays: dict[str, np.ndarray] = {}
        for item in dataclasses.fields(self):
            value = getattr(self, item.name)
            if value is None:
                continue
            if isinstance(value, Record):
                arrays |= {
                    f"{item.name}.{name}": array for name, array in value.to_arrays().items()
                }
            elif isinstance(value, np.ndarray):
                arrays[item.name] = value
            elif (
                isinstance(value, Mapping)
                and value
                and all(isinstance(v, np.ndarray) for v in value.values())
            ):
                arrays |= {f"{item.name}.{name}": array for name, array in value.items()}
            elif isinstance(value, str | int | float | bool):
                arrays[item.name] = np.asarray(value)
            else:  # tuples of text or numbers, JSON mappings
                arrays[item.name] = np.asarray(json.dumps(value, sort_keys=True))
        return arrays

    @classmethod
    def from_arrays(cls: type[_R], arrays: Mapping[str, np.ndarray]) -> _R:
        """Build a record from arrays; the inverse of `to_arrays`.

        Raises
        ------
        InputError
            An array is missing, or has another shape or type than the class documents.
        """
        hints = _hints(cls)  # type: ignore[arg-type]  # mypy takes classes for unhashable
        values: dict[str, Any] = {}
        for item in dataclasses.fields(cls):
            name, kind = item.name, _without_none(hints[item.name])
            nested = {
                key[len(name) + 1 :]: array
                for key, array in arrays.items()
                if key.startswith(f"{name}.")
            }
            if isinstance(kind, type) and issubclass(kind, Record):
                if nested:
                    values[name] = kind.from_arrays(nested)
            elif nested:
                values[name] = {
                    key: _plain_array(array, "biufUS", f"{cls.__name__}.{name}.{key}")
                    for key, array in nested.items()
                }
            elif name in arrays:
                values[name] = _decode(arrays[name], kind, f"{cls.__name__}.{name}")
            elif (
                item.default is dataclasses.MISSING and item.default_factory is dataclasses.MISSING
            ):
                raise InputError(
                    f"no array '{name}' for a {cls.__name__}; found: "
                    f"{', '.join(sorted(arrays)) or 'nothing'}"
                )
        return cls(**values)

    def to_bytes(self) -> bytes:
        """Return the bytes that `save` writes. Equal arrays give equal bytes, since numpy gives
        every archive member the same date."""
        buffer = io.BytesIO()
        arrays: dict[str, Any] = self.to_arrays()
        np.savez(buffer, **arrays)
        return buffer.getvalue()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write one ``.npz`` atomically."""
        write_npz(path, self.to_arrays())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a file of `save`.

        Raises
        ------
        InputError
            The file is not a readable ``.npz`` or not of this type; the message names the file.
        """
        try:
            with reading(path, f"{cls.__name__} that a2v wrote"):
                return cls.from_arrays(read_npz(path))
        except InputError as error:
            message = str(error)
            raise error if str(path) in message else InputError(f"{path}: {message}") from None

    def _check(
        self,
        name: str,
        shape: tuple[int | str | None, ...],
        sizes: dict[str, int] | None = None,
        *,
        leading: bool = False,
        below: str = "",
        least: int = 0,
    ) -> None:
        """Check the shape of array field `name`; letters in `shape` must agree across calls through
        `sizes`.

        If `below` names one of the `sizes`, the values are indices: at least `least` and less than
        that size.
        """
        if getattr(self, name) is None:  # an optional field
            return
        value = np.asarray(getattr(self, name))
        sizes = {} if sizes is None else sizes
        dims = value.shape[value.ndim - len(shape) :] if leading else value.shape
        good = len(dims) == len(shape) and value.ndim >= len(shape)
        for got, want in zip(dims, shape, strict=False):
            if isinstance(want, str):
                good &= sizes.setdefault(want, got) == got
            elif want is not None:
                good &= got == want
        if not good:
            expected = ", ".join(
                str(sizes.get(str(want), want)) if want is not None else "any" for want in shape
            )
            raise InputError(
                f"{type(self).__name__}.{name} has shape {value.shape}; expected "
                f"({'..., ' if leading else ''}{expected})"
            )
        if (
            np.issubdtype(value.dtype, np.floating)
            and name not in self.may_hold_nan
            and not np.isfinite(value).all()
        ):
            raise InputError(f"{type(self).__name__}.{name} holds NaN or infinite numbers")
        if below and value.size and (int(value.min()) < least or int(value.max()) >= sizes[below]):
            found = f"{int(value.min())} to {int(value.max())}"
            raise InputError(
                f"{type(self).__name__}.{name} has indices {found}; expected {least} to "
                f"{sizes[below] - 1}"
            )


_hints = functools.cache(get_type_hints)


def _without_none(hint: Any) -> Any:
    if get_origin(hint) in (typing.Union, types.UnionType):
        return next(part for part in get_args(hint) if part is not type(None))
    return hint


_KINDS = {str: "US", bool: "b", int: "iu", float: "iuf"}
"""Letters of numpy's kinds that can hold a single value of each type."""
_NUMBERS: tuple[tuple[Any, str], ...] = (
    (np.uint8, "u"),
    (np.integer, "iu"),
    (np.floating, "iuf"),
    (np.bool_, "b"),
)


def _decode(array: np.ndarray, kind: Any, what: str) -> Any:
    """Decode a field of type `kind` from its array. `what` names the field in the `InputError` for
    a wrong array."""
    origin = get_origin(kind)
    if kind in _KINDS:
        return kind(_single(array, _KINDS[kind], what))
    if origin is Literal:
        value = str(_single(array, "US", what))
        if value not in get_args(kind):
            raise InputError(
                f"{what} is {shorten(value)}; expected {' or '.join(map(str, get_args(kind)))}"
            )
        return value
    if origin is tuple:
        return _to_tuple(_json(array, list, what, _item_of(kind)))
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return _json(array, dict, what, None)
    return _plain_array(array, _letters(kind), what)


def _single(array: np.ndarray, kinds: str, what: str) -> Any:
    if array.size != 1 or array.dtype.kind not in kinds:
        raise InputError(
            f"{what} is an array of shape {array.shape} and type {array.dtype}; expected a single "
            f"{_named(kinds)}"
        )
    return array.item()


def _plain_array(array: np.ndarray, kinds: str, what: str) -> np.ndarray:
    if array.dtype.kind not in kinds:
        raise InputError(f"{what} has the type {array.dtype}; expected {_named(kinds)}s")
    return array


def _named(kinds: str) -> str:
    return {"US": "text", "b": "truth value", "iu": "whole number", "u": "byte"}.get(
        kinds, "number"
    )


def _letters(hint: Any) -> str:
    """Return the numpy kinds that an array field's type allows."""
    scalar = get_args(get_args(hint)[1])[0] if len(get_args(hint)) == 2 else None
    scalar = get_origin(scalar) or scalar
    return next(
        (
            letters
            for base, letters in _NUMBERS
            if isinstance(scalar, type) and issubclass(scalar, base)
        ),
        "biuf",
    )


def _item_of(hint: Any) -> type | None:
    """Return the type of the items of a tuple of equal items; None if they differ or are tuples."""
    kinds = {part for part in get_args(hint) if part is not Ellipsis}
    kind = kinds.pop() if len(kinds) == 1 else None
    return kind if isinstance(kind, type) and kind in _KINDS else None


def _json(array: np.ndarray, kind: type, what: str, item: type | None) -> Any:
    value: Any = parse_json(str(_single(array, "US", what)).encode(), what, "JSON that a2v wrote")
    named = "a list" if kind is list else "an object"
    if not isinstance(value, dict | list) or type(value) is not kind:
        raise InputError(f"{what} is {shorten(value, 60)}; expected {named}")
    if item is not None and not all(
        isinstance(part, item if item is not float else int | float) for part in value
    ):
        raise InputError(f"{what} is {shorten(value, 60)}; expected {named} of {item.__name__}")
    return value


def _to_tuple(value: Any) -> Any:
    return tuple(_to_tuple(item) for item in value) if isinstance(value, list) else value


_R = TypeVar("_R", bound="Record")
