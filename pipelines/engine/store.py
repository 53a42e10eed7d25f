"""The store: values named by their content, in one folder that all workers share.

A value is written once as ``objects/ab/cdef….npz``, named by the digest of its bytes. Nodes pass a
`Ref` of 40 characters, so keys are computed in microseconds and clusters transfer no meshes.
``calls/`` records the refs that each call returned (`pipelines.engine.memo`). Two runs may share a
folder: a file appears under its name only when it is complete, and equal content has an equal name.

If the address of the store is a URL (`pipelines.engine.remote`), each machine has its own folder in
front of the object store. A value is sent to the object store with the record of its call. It is
fetched if it is missing, and its digest is checked.
"""

from __future__ import annotations

import contextlib
import contextvars
import json
import os
import time
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from a2v.digest import Digest
from a2v.errors import A2VError, InputError
from a2v.io import atomic_path, read_bytes, user_cache_folder
from a2v.record import Record
from pipelines.engine.refs import Ref, decode, encode, refs_in
from pipelines.engine.remote import Remote, is_remote
from pipelines.engine.trust import folders_that_others_reach, is_shared, others_who_write

R = TypeVar("R", bound=Record)

MAX_CALL_BYTES = 64 << 20
"""Maximum size of the record of a call, bytes. Longer files are ignored."""
IN_USE_SECONDS = 600.0
"""`Store.trim` keeps what was used within this time, since a run may need it."""


class LostObjectError(A2VError):
    """A ref's file is missing or damaged; another run recomputes it."""


_INTACT: dict[Path, tuple[int, ...]] = {}
"""What this process has found intact, with the state of the file then: each command asks for the
same values several times, and their digests were a fifth of the time of a small job."""


def _state(path: Path) -> tuple[int, ...]:
    """What changes when somebody writes to a file; nobody can set its time of change."""
    found = path.stat()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


def _object_key(ref: Ref[Any]) -> str:
    return f"objects/{ref.digest[:2]}/{ref.digest[2:]}.npz"


class Store:
    """A folder of values named by their content, with an object store behind it if there is one.

    Parameters
    ----------
    address : folder, URL of an object store, or None for the default folder
    private : names of nodes whose results stay in this machine's folder

    Attributes
    ----------
    folder : Path
    remote : Remote or None
    address : str
        What makes the same store in another process.
    """

    def __init__(
        self, address: str | os.PathLike[str] | None = None, private: Collection[str] = ()
    ) -> None:
        self.remote = (
            Remote(os.fspath(address)) if address is not None and is_remote(address) else None
        )
        if self.remote is not None:
            self.folder = default_folder() / "copies" / Digest.of(self.remote.url)[:16]
        else:
            self.folder = Path(address) if address is not None else default_folder()
        self.address = self.remote.url if self.remote is not None else str(self.folder.absolute())
        self.private = frozenset(private)

    def __reduce__(self) -> tuple[Any, ...]:
        return Store, (self.address, self.private)

    def prepare(self) -> None:
        """Make the folder for its user alone, or check that nobody else can change an existing one.

        Stored results are trusted, so whoever writes here controls results. ``A2V_SHARED_STORE=1``
        accepts this.

        Raises
        ------
        InputError
            The folder, or one in it, belongs to another user or others can write to it.
        """
        with contextlib.suppress(OSError):  # the first write reports why it is impossible
            self.folder.mkdir(mode=0o777 if is_shared() else 0o700, parents=True)
        if is_shared() or not hasattr(os, "getuid"):
            return
        for part in folders_that_others_reach(self.folder):
            with contextlib.suppress(OSError):  # not there yet, or not readable
                if others := others_who_write(part):
                    raise InputError(
                        f"the store {part} {others}, and stored results are trusted; choose "
                        "another with --cache or A2V_CACHE, "
                        "make it writable only for you (chmod go-w), or set A2V_SHARED_STORE=1 if "
                        "you trust everyone who can write there"
                    )

    def path(self, ref: Ref[Any]) -> Path:
        """Return the path of `ref`, whether or not it exists."""
        return self.folder / "objects" / ref.digest[:2] / f"{ref.digest[2:]}.npz"

    def put(self, record: R) -> Ref[R]:
        """Store `record` and return its ref; an existing value is not written again.

        Raises
        ------
        InputError
            The folder cannot be written or the disk is full.
        """
        data = record.to_bytes()
        ref: Ref[R] = Ref(Digest.of(data))
        if not self.has(ref):
            with self._writing(self.path(ref)) as temporary:
                temporary.write_bytes(data)
        return ref

    @contextlib.contextmanager
    def _writing(self, path: Path) -> Iterator[Path]:
        try:
            with atomic_path(path) as temporary:
                yield temporary
        except InputError as error:
            raise InputError(
                f"{str(error).partition(';')[0]}; free some space or choose another store with "
                "--cache or A2V_CACHE"
            ) from error

    def get(self, ref: Ref[R], kind: type[R]) -> R:
        """Load a value that `put` stored.

        Raises
        ------
        LostObjectError
            The file is missing or damaged.
        """
        try:
            return kind.load(self.local_path(ref))
        except InputError as error:
            raise LostObjectError(
                f"the stored {kind.__name__} {ref.digest[:8]} is gone or damaged ({error}); run "
                "again"
            ) from error

    def has(self, ref: Ref[Any]) -> bool:
        """Return whether the value exists and is intact, and mark it as used.

        For a value that only the object store has, only its existence is checked.
        """
        path = self.path(ref)
        try:
            good = _INTACT.get(path) == _state(path) or Digest.of(path.read_bytes()) == ref.digest
            if good:
                os.utime(path)
                _INTACT[path] = _state(path)
        except OSError:
            good = False
        if good or self.remote is None:
            return good
        path.unlink(missing_ok=True)
        return self.remote.exists(_object_key(ref))

    def local_path(self, ref: Ref[Any]) -> Path:
        """Return the path of `ref` on this machine, after fetching it if necessary.

        A damaged object is removed from the object store.

        Raises
        ------
        LostObjectError
            The object store does not have it either, or has it damaged.
        """
        path = self.path(ref)
        if self.remote is None or path.exists():
            return path
        data = self.remote.fetch(_object_key(ref))
        if data is None or Digest.of(data) != ref.digest:
            if data is not None:
                self.remote.remove(_object_key(ref))
            raise LostObjectError(
                f"the stored value {ref.digest[:8]} "
                f"{'is gone' if data is None else 'arrived damaged'}; run again"
            )
        with atomic_path(path) as temporary:
            temporary.write_bytes(data)
        return path

    def share(self, refs: Iterable[Ref[Any]]) -> None:
        """Send missing values to the object store, if there is one."""
        if self.remote is None:
            return
        for ref in refs:
            if not self.remote.exists(_object_key(ref)):
                self.remote.put(_object_key(ref), self.local_path(ref).read_bytes())

    # --- results of calls

    def _call(self, node: str, key: str) -> Path:
        where = f"{node}@here" if node in self.private else node
        return self.folder / "calls" / where / key[:2] / f"{key[2:]}.json"

    def _call_key(self, node: str, key: str) -> str:
        return self._call(node, key).relative_to(self.folder).as_posix()

    def recall(self, node: str, key: str) -> tuple[Any, dict[str, Any]] | None:
        """Return the stored (result, facts) of a call, or None if it or a value is missing."""
        path = self._call(node, key)
        if self.remote is not None and node not in self.private and not path.exists():
            data = self.remote.fetch(self._call_key(node, key))
            if data is not None and len(data) <= MAX_CALL_BYTES:
                with atomic_path(path) as temporary:
                    temporary.write_bytes(data)
        try:
            record = json.loads(read_bytes(path, limit=MAX_CALL_BYTES))
            if record.pop("call") != [node, key]:  # moved here from another call
                return None
            result = decode(record.pop("result"))
            record.pop("given", None)
            _check_facts(record)
            os.utime(path)
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
            return None
        return (result, record) if all(self.has(ref) for ref in refs_in(result)) else None

    def remember(
        self, node: str, key: str, result: Any, facts: dict[str, Any], *, given: Iterable[Ref[Any]]
    ) -> None:
        """Record that the call `key` of `node` returned `result`: refs, or lists or arrays of them.

        `given` are the refs among its arguments, by which `pipelines.engine.forget` finds what
        depends on a photo.
        """
        digests = sorted({ref.digest for ref in given})
        with self._writing(self._call(node, key)) as temporary:
            temporary.write_text(
                json.dumps(
                    {"call": [node, key], "result": encode(result), "given": digests, **facts}
                ),
                encoding="utf-8",
            )
        if self.remote is not None and node not in self.private:
            self.share(refs_in(result))  # before the record that names them
            self.remote.put(self._call_key(node, key), self._call(node, key).read_bytes())

    # --- housekeeping

    def usage(self) -> dict[str, tuple[int, int]]:
        """Return the number of files and bytes of ``objects`` and of each node's calls."""
        found: dict[str, tuple[int, int]] = {}
        for name, pattern in [
            ("objects", "objects"),
            *((f"calls/{p.name}", f"calls/{p.name}") for p in sorted(self.folder.glob("calls/*"))),
        ]:
            sizes = [
                entry.stat().st_size
                for entry in (self.folder / pattern).rglob("*")
                if entry.is_file()
            ]
            found[name] = (len(sizes), sum(sizes))
        return found

    def trim(self, limit: int, *, everything: bool = False) -> int:
        """Remove the least recently used values until at most `limit` bytes are left.

        Return the number of removed bytes. What was used within `IN_USE_SECONDS` is kept unless
        `everything` is given. A removed value is recomputed when it is needed.
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
    """Return ``$A2V_CACHE``, else ``a2v`` in the user's cache folder."""
    if given := os.environ.get("A2V_CACHE"):
        return Path(given)
    folder = user_cache_folder()
    if folder is None:
        raise InputError(
            "there is no home folder to remember results in; choose a folder with --cache or "
            "A2V_CACHE"
        )
    return folder


def _check_facts(facts: dict[str, Any]) -> None:
    """Raise TypeError unless these are facts of a call: numbers, notes, and measures by name."""
    notes, measures = facts.get("notes") or [], facts.get("measures") or {}
    numbers = [facts.get(name, 0.0) for name in ("seconds", "cpu", "peak", "start")]
    if (
        not isinstance(notes, list)
        or not all(isinstance(text, str) for text in notes)
        or not isinstance(measures, dict)
        or not all(isinstance(value, int | float) for value in numbers)
    ):
        raise TypeError("no facts of a call")


# --- The store of the running node. It is set around every call, so nodes call `get` and `put`.

_current: contextvars.ContextVar[Store | None] = contextvars.ContextVar("store", default=None)


def current() -> Store:
    """Return the store of the running node, else the default one."""
    return _current.get() or Store()


@contextlib.contextmanager
def using(place: Store | str | os.PathLike[str] | None) -> Iterator[Store]:
    """Use a store, given itself or by its address (None: the default folder), inside the block."""
    store = place if isinstance(place, Store) else Store(place)
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
