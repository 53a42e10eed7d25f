"""Errors for users of the library and of the command line."""

from __future__ import annotations

import re

MAX_MESSAGE = 1200
"""Largest length of a message, characters. The middle of a longer one is left out, because its
start says what was given and its end what to do."""
_LINES = re.compile(r"\s*[\n\r\v\f\x1c-\x1e\x85\u2028\u2029]\s*")


class A2VError(Exception):
    """Base of every error that a2v raises on purpose.

    Its message is one line of at most `MAX_MESSAGE` characters.
    """

    def __init__(self, message: object = "") -> None:
        text = str(message)
        if len(text) > MAX_MESSAGE:
            text = f"{text[: MAX_MESSAGE // 2 - 1]} … {text[2 - MAX_MESSAGE // 2 :]}"
        super().__init__(_LINES.sub(" ", text))


class InputError(A2VError, ValueError):
    """The user's input cannot be used.

    The message says what was given, what was expected and what to do next, on one line; the command
    line prints only this line and exits with code 2.
    """


class MissingDependencyError(A2VError, ImportError):
    """An optional package is not installed. The message names the extra to install."""
