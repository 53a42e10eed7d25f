"""Forget a photo: remove everything that was computed from it, and values that nothing refers to.

The record of a call names the stored values among its arguments (`pipelines.engine.memo`). So
everything that depends on a photo is found by following the records from the photo's own value.
"""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from a2v.digest import Digest
from a2v.io import clear_leftovers, read_bytes
from a2v.record import Record
from pipelines.engine.refs import Ref, decode, refs_in
from pipelines.engine.store import IN_USE_SECONDS, MAX_CALL_BYTES, Store


def ref_of(record: Record) -> Ref[Any]:
    """Return the digest under which `Store.put` would store a value."""
    return Ref(Digest.of(record.to_bytes()))


@dataclass(frozen=True)
class Forgotten:
    """The removed results.

    Attributes
    ----------
    calls : int
        Records of calls that depended on the photo.
    unknown : int
        Records of an older version without dependencies; they are removed too.
    values : int
        Stored values.
    bytes : int
        Total size of these values.
    """

    calls: int = 0
    unknown: int = 0
    values: int = 0
    bytes: int = 0


@dataclass(frozen=True)
class _Call:
    path: Path
    given: (
        frozenset[Digest] | None
    )  # Digests among the arguments; None if the record does not have them.
    gave: frozenset[Digest]


def forget(
    store: Store,
    values: Iterable[Ref[Any]],
    *,
    keep: Collection[Ref[Any]] = (),
    idle: float = IN_USE_SECONDS,
) -> Forgotten:
    """Remove stored values, all calls that depend on them, and values that no other call names.

    Parameters
    ----------
    store : the store; of one with an object store behind it, what this machine's folder has a
    record of is removed there too
    values : of the photo, its mask, its keypoints; they need not be there
    keep : values that stay although no call names them, such as waiting photos
    idle : seconds; other values that no call names stay if they were used within this time, since a
        run may be about to name them

    Returns
    -------
    Forgotten
    """
    calls = list(_calls(store.folder))
    tainted = {ref.digest for ref in values}
    removed = [call for call in calls if call.given is None]
    gone = {call.path for call in removed}
    unknown = len(gone)
    while found := [
        call
        for call in calls
        if call.path not in gone and call.given is not None and call.given & tainted
    ]:
        for call in found:
            removed.append(call)
            gone.add(call.path)
            tainted |= call.gave
    left = [call for call in calls if call.path not in gone]
    named = {ref.digest for ref in keep}.union(
        *(call.gave | (call.given or frozenset()) for call in left)
    )
    suspects = tainted.union(*(call.gave | (call.given or frozenset()) for call in removed))
    for call in reversed(
        removed
    ):  # Remove the most dependent records first: after a stop the rest can still be found.
        _remove(store, call.path)
    counts = [0, 0]
    now = time.time()
    for path in (store.folder / "objects").glob("??/*.npz"):
        digest = path.parent.name + path.stem
        with contextlib.suppress(OSError):
            known = path.stat()
            if digest not in named and (digest in suspects or now - known.st_mtime >= idle):
                _remove(store, path)
                counts[0] += 1
                counts[1] += known.st_size
    for folder in (store.folder / "objects").glob("??"):
        clear_leftovers(folder)
    return Forgotten(len(gone) - unknown, unknown, counts[0], counts[1])


def _remove(store: Store, path: Path) -> None:
    path.unlink(missing_ok=True)
    if store.remote is not None and "@here" not in path.as_posix():
        store.remote.remove(path.relative_to(store.folder).as_posix())


def _calls(folder: Path) -> Iterator[_Call]:
    """Return every record of a call; an unreadable one has unknown dependencies."""
    for path in (folder / "calls").glob("*/*/*.json"):
        try:
            record = json.loads(read_bytes(path, limit=MAX_CALL_BYTES))
            gave = frozenset(ref.digest for ref in refs_in(decode(record["result"])))
            given = (
                frozenset(Digest(digest) for digest in record["given"])
                if "given" in record
                else None
            )
            yield _Call(path, given, gave)
        except Exception:  # damaged, or not a record of this store
            yield _Call(path, None, frozenset())
