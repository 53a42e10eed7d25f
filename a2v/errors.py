"""Errors that users of the library and of the command line are meant to read."""

from __future__ import annotations


class A2VError(Exception):
    """Base of every error that a2v raises on purpose."""


class InputError(A2VError, ValueError):
    """The user's input cannot be used.

    The message says what was given, what was expected and what to do next, on one line; the command line
    prints it alone and exits with code 2.
    """


class MissingDependencyError(A2VError, ImportError):
    """An optional package is not installed; the message says which extra to install."""
