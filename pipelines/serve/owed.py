"""Pending removals from the store, kept in a file so that a restarted server completes them."""

from __future__ import annotations

import contextlib
import re
import time
from pathlib import Path

from a2v.errors import A2VError
from a2v.io import read_bytes

MAX_BYTES = 1 << 20
_DIGEST = re.compile(r"[0-9a-f]{16,128}")


class Owed:
    """Digests of photos that were removed.

    Parameters
    ----------
    path : the file, which exists while removals are pending
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def add(self, digest: str) -> None:
        """Add a photo to the list of photos to remove, before its removal starts.

        On a full disk the list cannot be written, but an immediate removal still takes place.
        """
        with contextlib.suppress(OSError), self._path.open("a", encoding="ascii") as stream:
            stream.write(f"{digest}\n")

    def due(self, seconds: float) -> set[str] | None:
        """Return the digests if none was added for `seconds` (or the clock went back)."""
        with contextlib.suppress(OSError, A2VError):
            if not 0 <= time.time() - self._path.stat().st_mtime <= seconds:
                return set(
                    _DIGEST.findall(
                        read_bytes(self._path, limit=MAX_BYTES, empty=True).decode(
                            "ascii", "replace"
                        )
                    )
                )
        return None

    def paid(self, digests: set[str]) -> None:
        """Delete the file if all its digests are in `digests`; digests added meanwhile stay."""
        with contextlib.suppress(OSError, A2VError):
            if (
                set(
                    _DIGEST.findall(
                        read_bytes(self._path, limit=MAX_BYTES, empty=True).decode(
                            "ascii", "replace"
                        )
                    )
                )
                <= digests
            ):
                self._path.unlink()
