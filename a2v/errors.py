"""Errors for users of the library and of the command line."""

from __future__ import annotations

import re

MAX_MESSAGE = 1200
"""Largest length of a message, characters. The middle of a longer one is left out, because its
start says what was given and its end what to do."""
_LINES = re.compile(r"\s*[\n\r\v\f\x1c-\x1e\x85\u2028\u2029]\s*")
_UNPRINTABLE = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)
"""Control characters except tab and line feed, marks and overrides of the writing direction, and
halves of surrogate pairs."""


def printable(text: str) -> str:
    """Return `text` safe for a terminal, a page and a message.

    Control characters are written as escapes, so ESC becomes ``\x1b``. Every text that came from
    outside passes through here: messages of errors, `a2v.io.say`, answers of commands and of the
    page.
    """
    return _UNPRINTABLE.sub(lambda found: ascii(found.group())[1:-1], text)


class A2VError(Exception):
    """Base of every error that a2v raises on purpose.

    Its message is one line of at most `MAX_MESSAGE` characters, and `printable`.
    """

    def __init__(self, message: object = "") -> None:
        text = printable(_LINES.sub(" ", str(message)))
        if len(text) > MAX_MESSAGE:
            text = f"{text[: MAX_MESSAGE // 2 - 1]} … {text[2 - MAX_MESSAGE // 2 :]}"
        super().__init__(text)


class InputError(A2VError, ValueError):
    """The user's input cannot be used.

    The message says what was given, what was expected and what to do next, on one line; the command
    line prints only this line and exits with code 2.
    """


class MissingDependencyError(A2VError, ImportError):
    """An optional package is not installed. The message names the extra to install."""
