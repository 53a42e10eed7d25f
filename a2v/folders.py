"""Folders that are made only where their owner has not removed them."""

from __future__ import annotations

import os
from pathlib import Path

from a2v.errors import InputError


def owner_mark(folder: Path) -> Path:
    """Return the file beside `folder` that marks it: the folders inside have one owner, such as
    those of ``photos`` and ``jobs`` of the page. The owner makes and removes them; nobody else
    makes them again."""
    return folder.parent / f".{folder.name}.owned"


def make_folder(folder: str | os.PathLike[str]) -> None:
    """Make a folder and those above it, except directly inside an owned folder (`owner_mark`).

    So what was removed stays away: whoever still writes there is refused, also a process that
    outlived its task.

    Raises
    ------
    InputError
        It, or one above it, was removed by its owner.
    OSError
        It cannot be made.
    """
    missing, at = list[Path](), Path(folder).absolute()
    while not at.is_dir() and at != at.parent:
        missing.append(at)
        at = at.parent
    if missing and owner_mark(at).exists():
        raise InputError(f"{missing[-1].name} was removed; nothing more is written for it")
    for one in reversed(missing):  # one by one, because one above may be removed at any moment
        one.mkdir(exist_ok=True)
