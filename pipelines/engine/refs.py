"""Refs: names of stored values by their content, and their form in the record of a call."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import numpy as np

from a2v.digest import Digest
from a2v.io import read_bytes

T = TypeVar("T")


@dataclass(frozen=True)
class Ref(Generic[T]):
    """Name of a stored value of type T: the digest of its bytes.

    `source` is the name of a user's file in messages. It is not part of equality or of keys.
    """

    digest: Digest
    source: str = field(default="", compare=False)


@dataclass(frozen=True)
class File:
    """A file that enters the pipeline by its content.

    Its path is not part of equality or of keys.
    """

    path: str
    digest: Digest

    @classmethod
    def of(cls, path: str | os.PathLike[str], *, limit: int = 1 << 30) -> File:
        """Return the ref of the file at `path`.

        Raises
        ------
        InputError
            It cannot be read, or is larger than `limit` bytes.
        """
        return cls(os.path.abspath(path), Digest.of(read_bytes(path, limit=limit)))  # noqa: PTH100 (keeps symbolic links)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, File) and other.digest == self.digest

    def __hash__(self) -> int:
        return hash(self.digest)


def refs_in(value: Any) -> Iterator[Ref[Any]]:
    """Yield every ref in lists, tuples and object arrays."""
    if isinstance(value, Ref):
        yield value
    elif isinstance(value, list | tuple):
        for item in value:
            yield from refs_in(item)
    elif isinstance(value, np.ndarray):
        for item in value.ravel().tolist():
            yield from refs_in(item)


def encode(value: Any) -> Any:
    """Write refs, and lists, tuples and object arrays of them, as JSON; `decode` reads them.

    Raises
    ------
    TypeError
        `value` holds something else.
    """
    if isinstance(value, Ref):
        return {"ref": value.digest}
    if isinstance(value, tuple):
        return {"tuple": [encode(item) for item in value]}
    if isinstance(value, list):
        return {"list": [encode(item) for item in value]}
    if isinstance(value, np.ndarray) and value.dtype == object:
        return {
            "array": [encode(item) for item in value.ravel().tolist()],
            "shape": list(value.shape),
        }
    raise TypeError(
        f"a node returned {type(value).__name__}; expected refs, or lists, tuples or object arrays "
        "of refs"
    )


def decode(value: dict[str, Any]) -> Any:
    """Read refs, and lists, tuples and object arrays of them, from a record."""
    if "ref" in value:
        return Ref(Digest(value["ref"]))
    if "tuple" in value:
        return tuple(decode(item) for item in value["tuple"])
    if "list" in value:
        return [decode(item) for item in value["list"]]
    array = np.empty(len(value["array"]), dtype=object)
    array[:] = [decode(item) for item in value["array"]]
    return array.reshape(value["shape"])
