"""Whom a store trusts: whoever can write it decides what comes out."""

from __future__ import annotations

import os
import stat
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
