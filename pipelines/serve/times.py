"""The measured times of the stages on this machine."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping
from pathlib import Path

from a2v.errors import A2VError
from a2v.io import atomic_path, read_bytes


class Times:
    """The measured times of the stages on this machine, in a file of `folder`."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "times.json"

    def read(self) -> dict[str, float]:
        """Return seconds per unit by node; empty without a readable file."""
        with contextlib.suppress(Exception):
            found = json.loads(read_bytes(self._path, limit=1 << 16))
            return {str(name): float(value) for name, value in found.items()}
        return {}

    def learn(self, seconds: Mapping[str, float]) -> None:
        """Mix new times into the file; on a full disk the earlier ones stay."""
        if not seconds:
            return
        known = self.read()
        mixed = known | {
            name: (value + known.get(name, value)) / 2 for name, value in seconds.items()
        }
        with contextlib.suppress(A2VError), atomic_path(self._path) as temporary:
            temporary.write_text(
                json.dumps({name: round(value, 4) for name, value in mixed.items()}),
                encoding="utf-8",
            )
