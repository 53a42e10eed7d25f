"""Whom a store trusts: whoever can write it decides what comes out."""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from a2v.system import is_own_group, user_number


def others_who_write(folder: Path) -> str:
    """Who besides this user and root may change the files of `folder`, as the end of a sentence;
    empty where nobody may."""
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
    """A store's folder and its parts; the folders inside those too where others may enter the
    store."""
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
    """Whether the user says that whoever can write the store is trusted
    (``A2V_SHARED_STORE=1``)."""
    return os.environ.get("A2V_SHARED_STORE") == "1"
