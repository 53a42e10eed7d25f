"""Errors that users of the library and of the command line are meant to read."""

from __future__ import annotations

import re

MAX_MESSAGE = 1200
"""Characters of a message; of a longer one the middle is left out, since it begins with what was
given and ends with what to do."""
_LINES = re.compile(r"\s*[\n\r\v\f\x1c-\x1e\x85\u2028\u2029]\s*")


class A2VError(Exception):
    """Base of every error that a2v raises on purpose; its message is one line of at most
    `MAX_MESSAGE` characters, whatever it quotes."""

    def __init__(self, message: object = "") -> None:
        text = str(message)
        if len(text) > MAX_MESSAGE:
            text = f"{text[: MAX_MESSAGE // 2 - 1]} … {text[2 - MAX_MESSAGE // 2 :]}"
        super().__init__(_LINES.sub(" ", text))


class InputError(A2VError, ValueError):
    """The user's input cannot be used.

    The message says what was given, what was expected and what to do next, on one line; the command
    line prints it alone and exits with code 2.
    """


class MissingDependencyError(A2VError, ImportError):
    """An optional package is not installed; the message says which extra to install."""
