"""Ask a user at a terminal to choose an action if the given words name none."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

from a2v.io import say, shorten

if TYPE_CHECKING:
    from a2v.motion.vocabulary import UnknownActionError


def offer_nearest(error: UnknownActionError) -> str:
    """Let the user at a terminal choose one of the nearest actions.

    Returns "" if the user chooses none, or if there is no terminal.
    """
    if not (sys.stdin is not None and sys.stdin.isatty() and sys.stderr.isatty()) or os.environ.get(
        "CI"
    ):
        return ""
    say(f"no action is called '{shorten(error.text, 80)}'. The nearest actions are:")
    for number, name in enumerate(error.nearest, 1):
        say(f"  {number}  {name}")
    say("Number, or Enter for none: ", end="")
    answer = sys.stdin.readline().strip()
    return (
        error.nearest[int(answer) - 1]
        if answer.isdecimal() and 1 <= int(answer) <= len(error.nearest)
        else ""
    )
