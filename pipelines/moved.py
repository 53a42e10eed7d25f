"""Old spellings of ``a2v motion``, which did the work of four commands before 0.1.

This module and its call in `pipelines.cli` go after one release.
"""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from a2v.errors import InputError

MOVED = {
    "--from-video": ("follow", "--video"),
    "--page": ("motion-page", "--out"),
    **{
        name: ("sample", name)
        for name in ("--native", "--interpolate", "--to-seed", "--start", "--start-frames")
    },
}
"""By option of old: the command and the option that replace it."""


def refuse_moved(arguments: Sequence[str]) -> None:
    """Refuse the arguments of ``a2v motion`` that are now another command's.

    Raises
    ------
    InputError
        There is one; the message gives the whole new command line.
    """
    pairs = [argument.partition("=") for argument in arguments]
    names = [name.replace("_", "-") for name, _, _ in pairs]
    found = {MOVED[name][0]: name for name in names if name in MOVED}
    for place, (name, (_, together, value)) in enumerate(zip(names, pairs, strict=True)):
        value = value if together else "".join(arguments[place + 1 : place + 2])
        if name == "--model" and Path(value).suffix.lower() == ".pt":
            found.setdefault("sample", f"{name} with a {Path(value).suffix}")
        if name == "--action" and set("*?") & set(value):
            found.setdefault("sample", f"{name} with a pattern")
    if not found:
        return
    command = next(one for one in ("follow", "motion-page", "sample") if one in found)
    given = [
        "".join((MOVED[name][1] if name in MOVED else pair[0], *pair[1:]))
        for name, pair in zip(names, pairs, strict=True)
    ]
    raise InputError(
        f"a2v motion has no {found[command]} any more; the same is: "
        f"a2v {command} {shlex.join(given)}"
    )
