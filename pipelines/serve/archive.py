"""A zip of many files that is made while it is sent: no copy of it is kept in memory or on disk."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path

PART = 1 << 18
"""Bytes that are read and sent at a time."""


class _Pipe(io.RawIOBase):
    """Holds what was written until it is taken; it cannot be rewound, so `zipfile` puts sizes
    behind the data."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []

    def writable(self) -> bool:
        return True

    def write(self, data: object) -> int:
        part = bytes(data)  # type: ignore[call-overload]  # bytes or a view of some
        self._parts.append(part)
        return len(part)

    def take(self) -> bytes:
        """What was written since."""
        taken, self._parts = b"".join(self._parts), []
        return taken


def zipped(folder: Path, names: Mapping[str, int]) -> Iterator[bytes]:
    """The parts of a zip with the files `names` of `folder`; files that are gone are left out."""
    pipe = _Pipe()
    with zipfile.ZipFile(
        pipe, "w"
    ) as archive:  # films, pictures and characters are compressed already
        for name in names:
            path = folder / name
            if path.is_symlink() or not path.is_file():
                continue
            with (
                path.open("rb") as source,
                archive.open(
                    zipfile.ZipInfo.from_file(path, name, strict_timestamps=False), "w"
                ) as out,
            ):
                while part := source.read(PART):
                    out.write(part)
                    yield pipe.take()
    yield pipe.take()
