"""Files at the edge: atomic writes, bounded reads and digests.

Every file that a2v writes appears under its final name only when it is complete.
"""

from __future__ import annotations

import csv
import hashlib
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError

MAX_ARCHIVE_BYTES = 4 << 30
"""Refuse to unpack more than this from one ``.npz`` (a zip bomb would otherwise fill the memory)."""


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside `path` (same suffix) that is renamed to `path` on success.

    On any exception, Ctrl-C included, the temporary file is removed and `path` is left as it was.

    Raises
    ------
    InputError
        The folder cannot be created or written, or the disk is full.
    """
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{target.stem}-", suffix=target.suffix, dir=target.parent)
        os.close(handle)
    except OSError as error:
        raise InputError(f"cannot write {target}: {error.strerror}; choose another output folder") from error
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(target)
    except OSError as error:
        if error.filename is None or Path(error.filename) in (temporary, target):
            raise InputError(f"cannot write {target}: {error.strerror or error}; free some space or choose another folder") from error
        raise
    finally:
        temporary.unlink(missing_ok=True)


def user_cache_folder() -> Path | None:
    """The folder ``a2v`` in the user's cache folder (``$XDG_CACHE_HOME``, else ``~/.cache``); None for a user without a home."""
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "a2v"
    except RuntimeError:
        return None


def _umask() -> int:
    """The process's umask (it can only be read by setting it)."""
    mask = os.umask(0o022)
    os.umask(mask)
    return mask


def write_npz(path: str | os.PathLike[str], arrays: Mapping[str, Any], *, compress: bool = False) -> None:
    """Write `arrays` (numpy arrays or what becomes one without pickling) to one ``.npz``, atomically."""
    checked = {name: np.asarray(value) for name, value in arrays.items()}
    for name, value in checked.items():
        if value.dtype.hasobject:
            raise TypeError(f"array '{name}' holds Python objects; only plain numbers and text are stored")
    with atomic_path(path) as temporary, open(temporary, "wb") as stream:
        (np.savez_compressed if compress else np.savez)(stream, **checked)


def write_csv(path: str | os.PathLike[str], rows: Sequence[Mapping[str, Any]]) -> None:
    """Write `rows` as one CSV table with the columns of all of them, in the order in which they first appear."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    with atomic_path(path) as temporary, open(temporary, "w", newline="") as stream:
        writer = csv.DictWriter(stream, names)
        writer.writeheader()
        writer.writerows(rows)


def read_npz(path: str | os.PathLike[str]) -> dict[str, np.ndarray]:
    """Read every array of an ``.npz`` without unpickling anything.

    Raises
    ------
    InputError
        The file is missing, is no ``.npz``, is truncated, holds pickled objects or is larger than
        `MAX_ARCHIVE_BYTES` unpacked.
    """
    source = Path(path)
    try:
        with np.load(source, allow_pickle=False) as archive:
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise InputError(f"{source} holds a single array; expected an .npz archive")
            infos = archive.zip.infolist() if archive.zip is not None else []
            if sum(info.file_size for info in infos) > MAX_ARCHIVE_BYTES:
                raise InputError(f"{source} unpacks to more than {MAX_ARCHIVE_BYTES >> 30} GiB; refusing to read it")
            return {name: archive[name] for name in archive.files}
    except FileNotFoundError as error:
        raise InputError(f"{source} does not exist") from error
    except IsADirectoryError as error:
        raise InputError(f"{source} is a folder; expected an .npz file") from error
    except InputError:
        raise
    except Exception as error:  # numpy and zipfile raise many kinds for a broken archive
        raise InputError(f"{source} is not a readable .npz file ({error})") from error


def sha256(data: bytes | str | os.PathLike[str]) -> str:
    """Hex SHA-256 of bytes, or of the file at a path."""
    digest = hashlib.sha256()
    if isinstance(data, bytes):
        digest.update(data)
    else:
        with open(data, "rb") as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()
