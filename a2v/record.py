"""The base of every value on an arrow: an immutable bundle of arrays that one ``.npz`` holds."""

from __future__ import annotations

import dataclasses
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
from a2v.io import read_npz, write_npz


@dataclass(frozen=True, kw_only=True)
class Record:
    """Base of the stage types: an immutable bundle of arrays that one ``.npz`` holds.

    `provenance` records what made the value (versions, seed, parameters, hashes of inputs and weights);
    it must be JSON. A subclass names in `may_hold_nan` the array fields in which NaN means "unknown".
    """

    may_hold_nan: ClassVar[frozenset[str]] = frozenset()

    provenance: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Flatten to named numpy arrays without pickles (nested records become ``outer.inner``)."""
        arrays: dict[str, np.ndarray] = {}
        for item in dataclasses.fields(self):
            value = getattr(self, item.name)
            if value is None:
                continue
            if isinstance(value, Record):
                arrays |= {f"{item.name}.{name}": array for name, array in value.to_arrays().items()}
            elif isinstance(value, np.ndarray):
                arrays[item.name] = value
            elif isinstance(value, Mapping) and value and all(isinstance(v, np.ndarray) for v in value.values()):
                arrays |= {f"{item.name}.{name}": array for name, array in value.items()}
            elif isinstance(value, str | int | float | bool):
                arrays[item.name] = np.asarray(value)
            else:  # tuples of text or numbers, JSON mappings
                arrays[item.name] = np.asarray(json.dumps(value, sort_keys=True))
        return arrays

    @classmethod
    def from_arrays(cls: type[_R], arrays: Mapping[str, np.ndarray]) -> _R:
        """The inverse of `to_arrays`.

        Raises
        ------
        InputError
            An array is missing, or has another shape or type than the class documents.
        """
        hints = get_type_hints(cls)
        values: dict[str, Any] = {}
        for item in dataclasses.fields(cls):
            name, kind = item.name, _without_none(hints[item.name])
            nested = {key[len(name) + 1 :]: array for key, array in arrays.items() if key.startswith(f"{name}.")}
            if isinstance(kind, type) and issubclass(kind, Record):
                if nested:
                    values[name] = kind.from_arrays(nested)
            elif nested:
                values[name] = nested
            elif name in arrays:
                values[name] = _decode(arrays[name], kind)
            elif item.default is dataclasses.MISSING and item.default_factory is dataclasses.MISSING:
                raise InputError(f"no array '{name}' for a {cls.__name__}; found: {', '.join(sorted(arrays)) or 'nothing'}")
        return cls(**values)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write one ``.npz`` atomically."""
        write_npz(path, self.to_arrays())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read what `save` wrote.

        Raises
        ------
        InputError
            The file is no readable ``.npz`` or not of this type; the message names the file.
        """
        try:
            return cls.from_arrays(read_npz(path))
        except InputError as error:
            message = str(error)
            raise error if str(path) in message else InputError(f"{path}: {message}") from None

    def _check(self, name: str, shape: tuple[int | str | None, ...], sizes: dict[str, int] | None = None, *, leading: bool = False) -> None:
        """Check the shape of array field `name`; letters in `shape` must agree across calls through `sizes`."""
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
            expected = ", ".join(str(sizes.get(str(want), want)) if want is not None else "any" for want in shape)
            raise InputError(f"{type(self).__name__}.{name} has shape {value.shape}; expected ({'..., ' if leading else ''}{expected})")
        if np.issubdtype(value.dtype, np.floating) and name not in self.may_hold_nan and not np.isfinite(value).all():
            raise InputError(f"{type(self).__name__}.{name} holds NaN or infinite numbers")


def _without_none(hint: Any) -> Any:
    if get_origin(hint) in (typing.Union, types.UnionType):
        return next(part for part in get_args(hint) if part is not type(None))
    return hint


def _decode(array: np.ndarray, kind: Any) -> Any:
    if kind in (str, int, float, bool):
        return kind(array.item())
    if get_origin(kind) is Literal:
        return str(array.item())
    if get_origin(kind) is tuple:
        return _to_tuple(json.loads(str(array.item())))
    if get_origin(kind) is not None and issubclass(typing.cast(type, get_origin(kind)), Mapping):
        return json.loads(str(array.item()))
    return array


def _to_tuple(value: Any) -> Any:
    return tuple(_to_tuple(item) for item in value) if isinstance(value, list) else value


_R = TypeVar("_R", bound="Record")
