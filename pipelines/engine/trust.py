"""Check who can write to a store, since its contents are trusted."""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from a2v.system import is_own_group, user_number


def others_who_write(folder: Path) -> str:
    """Return who besides this user and root may change the files of `folder`.

    It is the end of a sentence; empty if nobody may.
    """
    facts, user = folder.stat(), user_number()
    if user is None:  # Windows has neither these numbers nor these rights
        return ""
    if facts.st_uid not in (user, 0):
        return f"belongs to another user (number {facts.st_uid})"
    if facts.st_mode & stat.S_IWOTH:
        return "can be written by every user"
    if facts.st_mode & stat.S_IWGRP and not is_own_group(facts.st_gid):
        return f"can be written by a group (number {facts.st_gid})"
    return ""


def folders_that_others_reach(store: Path) -> Iterator[Path]:
    """Yield the folder of a store and its parts.

    The folders inside of those follow if others may enter the store.
    """
    yield store
    for part in (store / "objects", store / "calls"):
        yield part
        with contextlib.suppress(OSError):
            if store.stat().st_mode & part.stat().st_mode & (stat.S_IXGRP | stat.S_IXOTH):
                yield from (
                    Path(entry.path)
                    for entry in os.scandir(part)
                    if entry.is_dir(follow_symlinks=False)
                )


def is_shared() -> bool:
    """Return whether the user trusts everyone who can write the store (``A2V_SHARED_STORE=1``)."""
    return os.environ.get("A2V_SHARED_STORE") == "1"
