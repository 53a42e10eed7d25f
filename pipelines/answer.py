"""The result of a command: text for people, or one JSON object for scripts (``--json``)."""

from __future__ import annotations

import dataclasses
import json
import math
import numbers
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Answer:
    """The result of a command.

    Attributes
    ----------
    files : sequence of Path
        Written files, the main one first.
    facts : mapping
        Facts by name: JSON values, paths and dataclasses.
    notes : sequence of str
        Notes for the user.
    text : str or None
        Text for people; without it the paths of `files`, one per line.
    code : int
        The exit code.
    error : str
        One sentence about the reason if `code` is not 0.
    """

    files: Sequence[Path] = ()
    facts: Mapping[str, Any] = field(default_factory=dict)
    notes: Sequence[str] = ()
    text: str | None = None
    code: int = 0
    error: str = ""

    def for_people(self) -> str:
        """Return the text for standard output."""
        return "\n".join(map(str, self.files)) if self.text is None else self.text

    def as_json(self, command: str) -> str:
        """Return one JSON object: ``command``, ``exit_code``, ``files``, ``notes`` and the facts.

        It has ``error`` too if something is wrong.
        """
        known = {
            "command": command,
            "exit_code": self.code,
            "files": self.files,
            "notes": self.notes,
        }
        known |= {"error": self.error} if self.error else {}
        return json.dumps(plain({**known, **self.facts}), indent=2)


def failure_as_json(command: str, message: str, code: int) -> str:
    """Return one JSON object with ``command``, ``exit_code`` and the sentence ``error``."""
    return json.dumps({"command": command, "exit_code": code, "error": message}, indent=2)


def plain(value: Any) -> Any:
    """Return `value` as JSON: dataclasses and mappings as objects, paths as text."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            item.name: plain(getattr(value, item.name))
            for item in dataclasses.fields(value)
            if item.compare
        }
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    if value is None or isinstance(value, str | bool):
        return value
    if isinstance(value, numbers.Integral):  # includes numpy's scalars
        return int(value)
    if isinstance(value, numbers.Real):
        return float(value) if math.isfinite(value) else None  # JSON has neither NaN nor infinity
    return str(value)
