"""Create a zip while sending it, with no copy of it in memory or on disk."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path

PART = 1 << 18
"""Bytes per read and send."""


class _Pipe(io.RawIOBase):
    """A buffer of written bytes. It cannot seek, so `zipfile` writes sizes after the data."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []

    def writable(self) -> bool:
        return True

    def write(self, data: object) -> int:
        part = bytes(data)  # type: ignore[call-overload]  # bytes or a view of some
        self._parts.append(part)
        return len(part)

    def take(self) -> bytes:
        """Return and clear the bytes written since the last call."""
        taken, self._parts = b"".join(self._parts), []
        return taken


def zipped(folder: Path, names: Mapping[str, int]) -> Iterator[bytes]:
    """Yield the parts of a zip of the files `names` in `folder`; missing files are left out."""
    pipe = _Pipe()
    with zipfile.ZipFile(
        pipe, "w"
    ) as archive:  # videos, images and characters are already compressed
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
