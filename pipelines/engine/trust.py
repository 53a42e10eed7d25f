"""Whom a store trusts: whoever can write it decides what comes out."""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterator
from pathlib import Path


def others_who_write(folder: Path) -> str:
    """Who besides this user and root may change the files of `folder`, as the end of a sentence; empty where nobody may."""
    facts = folder.stat()
    if facts.st_uid not in (os.getuid(), 0):
        return f"belongs to another user (number {facts.st_uid})"
    if facts.st_mode & stat.S_IWOTH:
        return "can be written by every user"
    if facts.st_mode & stat.S_IWGRP and not _own_group(facts.st_gid):
        return f"can be written by a group (number {facts.st_gid})"
    return ""


def folders_that_others_reach(store: Path) -> Iterator[Path]:
    """A store's folder and its parts; the folders inside those too where others may enter the store."""
    yield store
    for part in (store / "objects", store / "calls"):
        yield part
        with contextlib.suppress(OSError):
            if store.stat().st_mode & part.stat().st_mode & (stat.S_IXGRP | stat.S_IXOTH):
                yield from (Path(entry.path) for entry in os.scandir(part) if entry.is_dir(follow_symlinks=False))


def _own_group(number: int) -> bool:
    """Whether a group is root's, or the private one that many systems give each user."""
    import grp
    import pwd

    if number == 0 or number != os.getgid():
        return number == 0
    try:
        group, user = grp.getgrgid(number), pwd.getpwuid(os.getuid()).pw_name
    except KeyError:  # a number without a name, as in containers
        return True
    return group.gr_name == user and set(group.gr_mem) <= {user}


def is_shared() -> bool:
    """Whether the user says that whoever can write the store is trusted (``A2V_SHARED_STORE=1``)."""
    return os.environ.get("A2V_SHARED_STORE") == "1"
