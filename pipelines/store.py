"""The store: values named by their content, in one folder that every worker sees.

A value is written once as ``objects/ab/cdef….npz``, named by the digest of its bytes; what passes between
nodes is a `Ref`, 40 characters, so keys hash in microseconds and clusters ship no meshes. ``calls/`` remembers which
call gave which refs (`pipelines.memo`). Two runs may share a folder: a file appears under its name only when it is
complete, and equal content has an equal name.
"""

from __future__ import annotations

import contextlib
import contextvars
import hashlib
import io
import json
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np

from a2v.errors import A2VError, InputError
from a2v.io import atomic_path, user_cache_folder
from a2v.record import Record

T = TypeVar("T")
R = TypeVar("R", bound=Record)

IN_USE_SECONDS = 600.0
"""`Store.trim` leaves what was read or written within this time to the runs that may be using it."""


class LostObjectError(A2VError):
    """A ref's file is missing or damaged; running again recomputes it."""


@dataclass(frozen=True)
class Ref(Generic[T]):
    """Names a stored value of type T by the digest of its bytes (40 hex digits).

    `source` is what messages call a user's file; it takes no part in equality or in keys.
    """

    digest: str
    source: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        if len(self.digest) != 40 or not set(self.digest) <= set("0123456789abcdef"):
            raise ValueError(f"'{self.digest}' is no digest")


@dataclass(frozen=True)
class File:
    """A file that enters the pipeline by its content; the path takes no part in equality or in keys."""

    path: str
    digest: str

    @classmethod
    def of(cls, path: str | os.PathLike[str], *, limit: int = 1 << 30) -> File:
        """Digest the file at `path`.

        Raises
        ------
        InputError
            It cannot be read, or is larger than `limit` bytes.
        """
        return cls(os.path.abspath(path), digest_of(read_bytes(path, limit=limit)))  # noqa: PTH100 (keeps symbolic links)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, File) and other.digest == self.digest

    def __hash__(self) -> int:
        return hash(self.digest)


def digest_of(data: bytes) -> str:
    """Forty hex digits of BLAKE2b."""
    return hashlib.blake2b(data, digest_size=20).hexdigest()


def read_bytes(path: str | os.PathLike[str], *, limit: int = 1 << 30) -> bytes:
    """Read a user's whole file.

    Raises
    ------
    InputError
        It cannot be read, is a folder, is empty or is larger than `limit` bytes.
    """
    source = Path(path)
    if source.is_dir():
        raise InputError(f"{source} is a folder; expected a file")
    try:
        with open(source, "rb") as stream:
            data = stream.read(limit + 1)
    except OSError as error:
        raise InputError(f"cannot read {source}: {error.strerror}") from error
    if not data:
        raise InputError(f"{source} is empty")
    if len(data) > limit:
        raise InputError(f"{source} is larger than {limit >> 20} MiB; expected a smaller file")
    return data


class Store:
    """A folder of content-named values."""

    def __init__(self, folder: str | os.PathLike[str] | None = None) -> None:
        self.folder = Path(folder) if folder is not None else default_folder()

    def path(self, ref: Ref[Any]) -> Path:
        """Where `ref` is or would be."""
        return self.folder / "objects" / ref.digest[:2] / f"{ref.digest[2:]}.npz"

    def put(self, record: R) -> Ref[R]:
        """Store `record` and name it; a value already there is not written again.

        Raises
        ------
        InputError
            The folder cannot be written or the disk is full.
        """
        buffer = io.BytesIO()
        arrays: dict[str, Any] = record.to_arrays()
        np.savez(buffer, **arrays)  # numpy gives every member the same date, so equal arrays are equal bytes
        data = buffer.getvalue()
        ref: Ref[R] = Ref(digest_of(data))
        if not self.has(ref):
            with atomic_path(self.path(ref)) as temporary:
                temporary.write_bytes(data)
        return ref

    def get(self, ref: Ref[R], kind: type[R]) -> R:
        """Load what `put` stored.

        Raises
        ------
        LostObjectError
            The file is missing or damaged.
        """
        try:
            return kind.load(self.path(ref))
        except InputError as error:
            raise LostObjectError(f"the stored {kind.__name__} {ref.digest[:8]} is gone or damaged ({error}); run again") from error

    def has(self, ref: Ref[Any]) -> bool:
        """Whether the value is there and whole; marks it as used."""
        path = self.path(ref)
        try:
            good = digest_of(path.read_bytes()) == ref.digest
            if good:
                os.utime(path)
        except OSError:
            return False
        return good

    # --- what calls gave

    def _call(self, node: str, key: str) -> Path:
        return self.folder / "calls" / node / key[:2] / f"{key[2:]}.json"

    def recall(self, node: str, key: str) -> tuple[Any, dict[str, Any]] | None:
        """The remembered (result, facts) of a call, or None where it is unknown or any of its values is gone."""
        path = self._call(node, key)
        try:
            record = json.loads(path.read_text())
            result = _decode(record.pop("result"))
            os.utime(path)
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return (result, record) if all(self.has(ref) for ref in refs_in(result)) else None

    def remember(self, node: str, key: str, result: Any, facts: dict[str, Any]) -> None:
        """Record that the call `key` of `node` gave `result` (refs, and lists or arrays of them)."""
        with atomic_path(self._call(node, key)) as temporary:
            temporary.write_text(json.dumps({"result": _encode(result), **facts}))

    # --- housekeeping

    def usage(self) -> dict[str, tuple[int, int]]:
        """Number of files and bytes of ``objects`` and of each node's calls."""
        found: dict[str, tuple[int, int]] = {}
        for name, pattern in [
            ("objects", "objects"),
            *((f"calls/{p.name}", f"calls/{p.name}") for p in sorted(self.folder.glob("calls/*"))),
        ]:
            sizes = [entry.stat().st_size for entry in (self.folder / pattern).rglob("*") if entry.is_file()]
            found[name] = (len(sizes), sum(sizes))
        return found

    def trim(self, limit: int, *, everything: bool = False) -> int:
        """Remove the values used longest ago until at most `limit` bytes are left; returns the bytes removed.

        What was used within `IN_USE_SECONDS` stays unless `everything`. A removed value is recomputed when it is needed.
        """
        entries = []
        for entry in (self.folder / "objects").rglob("*"):
            with contextlib.suppress(OSError):
                if entry.is_file():
                    entries.append((entry.stat().st_mtime, entry.stat().st_size, entry))
        total, removed, now = sum(size for _, size, _ in entries), 0, time.time()
        for used, size, entry in sorted(entries, key=lambda item: item[0]):
            if total - removed <= limit or (now - used < IN_USE_SECONDS and not everything):
                break
            with contextlib.suppress(OSError):
                entry.unlink()
                removed += size
        if everything:
            for entry in (self.folder / "calls").rglob("*.json"):
                entry.unlink(missing_ok=True)
        return removed


def default_folder() -> Path:
    """``$A2V_CACHE``, else ``a2v`` in the user's cache folder."""
    if given := os.environ.get("A2V_CACHE"):
        return Path(given)
    folder = user_cache_folder()
    if folder is None:
        raise InputError("there is no home folder to remember results in; choose a folder with --cache or A2V_CACHE")
    return folder


def refs_in(value: Any) -> Iterator[Ref[Any]]:
    """Every ref inside lists, tuples and object arrays."""
    if isinstance(value, Ref):
        yield value
    elif isinstance(value, list | tuple):
        for item in value:
            yield from refs_in(item)
    elif isinstance(value, np.ndarray):
        for item in value.ravel().tolist():
            yield from refs_in(item)


def _encode(value: Any) -> Any:
    if isinstance(value, Ref):
        return {"ref": value.digest}
    if isinstance(value, tuple):
        return {"tuple": [_encode(item) for item in value]}
    if isinstance(value, list):
        return {"list": [_encode(item) for item in value]}
    if isinstance(value, np.ndarray) and value.dtype == object:
        return {"array": [_encode(item) for item in value.ravel().tolist()], "shape": list(value.shape)}
    raise TypeError(f"a node returned {type(value).__name__}; expected refs, or lists, tuples or object arrays of refs")


def _decode(value: dict[str, Any]) -> Any:
    if "ref" in value:
        return Ref(value["ref"])
    if "tuple" in value:
        return tuple(_decode(item) for item in value["tuple"])
    if "list" in value:
        return [_decode(item) for item in value["list"]]
    array = np.empty(len(value["array"]), dtype=object)
    array[:] = [_decode(item) for item in value["array"]]
    return array.reshape(value["shape"])


# --- the store of the running node: set around every call, so nodes say `get(ref, Kind)` and `put(value)`

_current: contextvars.ContextVar[Store | None] = contextvars.ContextVar("store", default=None)


def current() -> Store:
    """The store in use: that of the running node, else the default one."""
    return _current.get() or Store()


@contextlib.contextmanager
def using(folder: str | os.PathLike[str] | None) -> Iterator[Store]:
    """Make `folder` the current store inside the block (None: the default folder)."""
    store = Store(folder)
    token = _current.set(store)
    try:
        yield store
    finally:
        _current.reset(token)


def put(record: R) -> Ref[R]:
    """Store `record` in the current store."""
    return current().put(record)


def get(ref: Ref[R], kind: type[R]) -> R:
    """Load `ref` from the current store as a `kind`."""
    return current().get(ref, kind)
