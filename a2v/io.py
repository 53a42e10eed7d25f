"""Reading and writing of users' files: atomic writes, bounded reads and digests.

Every file that a2v writes appears under its final name only when it is complete.
"""

from __future__ import annotations

import contextlib
import csv
import hashlib
import json
import os
import reprlib
import stat
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from a2v.errors import A2VError, InputError, printable
from a2v.folders import make_folder
from a2v.system import WINDOWS, file_mask, lock, user_number

MAX_ARCHIVE_BYTES = 1 << 30
"""Largest unpacked size of one ``.npz``. A zip bomb would otherwise fill the memory."""


_MARK = "-a2v"
"""Mark in the names of temporary files, in front of eight random characters."""
_UNFINISHED: set[Path] = set()
"""The temporary files that this process is writing."""


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside `path` (same suffix) that is renamed to `path` on success.

    On any exception, Ctrl-C included, the temporary file is removed and `path` is left as it was.

    Raises
    ------
    InputError
        The folder cannot be created or written, was removed (`make_folder`), or the disk is full.
    """
    target = Path(path)
    try:
        make_folder(target.parent)
        handle, name = tempfile.mkstemp(
            prefix=f".{target.stem[:32]}{_MARK}", suffix=target.suffix, dir=target.parent
        )
        lock(handle)
    except (OSError, UnicodeError) as error:  # UnicodeError: half a character in the name
        raise InputError(
            f"cannot write {target}: {getattr(error, 'strerror', None) or error}; choose another "
            "output folder"
        ) from error
    temporary = Path(name)
    _UNFINISHED.add(temporary)
    try:
        yield temporary
        temporary.chmod(0o666 & ~file_mask())
        temporary.replace(target)
    except OSError as error:
        if error.filename is None or Path(error.filename) in (temporary, target):
            raise InputError(
                f"cannot write {target}: {error.strerror or error}; free some space or choose "
                "another folder"
            ) from error
        raise
    finally:
        os.close(handle)
        temporary.unlink(missing_ok=True)
        _UNFINISHED.discard(temporary)


@contextmanager
def claim(folder: str | os.PathLike[str]) -> Iterator[None]:
    """Keep other runs from writing into an existing `folder` inside the block, so that files of two
    runs do not mix.

    The claim ends with the process, even a killed one, and leaves no file. Where folders cannot be
    locked (Windows), nothing is claimed.

    Raises
    ------
    InputError
        Another process has claimed it.
    """
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:
        yield
        return
    try:
        if not lock(handle) and not WINDOWS:
            raise InputError(
                f"another run is writing to {folder}; wait for it, or choose another --out"
            )
        yield
    finally:
        os.close(handle)


def discard_unfinished() -> None:
    """Remove the files that this process is writing. For a process that is about to end without
    unwinding its stack."""
    for path in tuple(_UNFINISHED):
        path.unlink(missing_ok=True)


def clear_leftovers(folder: str | os.PathLike[str]) -> None:
    """Remove temporary files of `atomic_path` in `folder` whose process was killed. Files in
    progress are kept."""
    for path in Path(folder).glob(f".*{_MARK}????????*"):
        with contextlib.suppress(OSError):
            handle = os.open(path, os.O_RDWR)
            try:
                if lock(handle):
                    path.unlink()
            finally:
                os.close(handle)


def user_cache_folder() -> Path | None:
    """Return the folder ``a2v`` in the user's cache folder; None for a user without a home.

    The cache folder is ``$XDG_CACHE_HOME``, else ``~/.cache``.
    """
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "a2v"
    except RuntimeError:
        return None


def cache_folders() -> Iterator[Path]:
    """Yield folders for caches, best first: ``A2V_CACHE``, the user's cache folder, the temporary
    folder."""
    if named := os.environ.get("A2V_CACHE"):
        yield Path(named)
    if folder := user_cache_folder():
        yield folder
    if os.environ.get("XDG_CACHE_HOME"):
        with contextlib.suppress(RuntimeError):  # no home folder
            yield Path.home() / ".cache" / "a2v"
    user = user_number()
    yield Path(tempfile.gettempdir()) / f"a2v-{'user' if user is None else user}"


def is_ours(path: Path) -> bool:
    """Return whether a file of `cache_folders` belongs to the user. Another user could have planted
    it in the shared temporary folder."""
    user = user_number()
    return user is None or path.stat().st_uid in (user, 0)


def write_npz(
    path: str | os.PathLike[str], arrays: Mapping[str, Any], *, compress: bool = False
) -> None:
    """Write `arrays` to one ``.npz``, atomically; their values need no pickling."""
    checked = {name: np.asarray(value) for name, value in arrays.items()}
    for name, value in checked.items():
        if value.dtype.hasobject:
            raise TypeError(
                f"array '{name}' holds Python objects; only plain numbers and text are stored"
            )
    with atomic_path(path) as temporary, open(temporary, "wb") as stream:
        (np.savez_compressed if compress else np.savez)(stream, **checked)


def write_csv(path: str | os.PathLike[str], rows: Sequence[Mapping[str, Any]]) -> None:
    """Write `rows` as one CSV table in UTF-8, with the columns of all rows in the order of their
    first appearance.

    Bytes of names that are not UTF-8, which Python keeps as halves of surrogate pairs, are written
    as escapes.
    """
    names = list(dict.fromkeys(name for row in rows for name in row))
    with (
        atomic_path(path) as temporary,
        open(temporary, "w", newline="", encoding="utf-8", errors="backslashreplace") as stream,
    ):
        writer = csv.DictWriter(stream, names)
        writer.writeheader()
        writer.writerows(rows)


def open_file(path: str | os.PathLike[str]) -> BinaryIO:
    """Open a user's file for reading bytes. It must be a regular file: a pipe may block for ever,
    and a device may never end.

    Raises
    ------
    InputError
        It is missing, cannot be read, is a folder, or is not a regular file.
    """
    source = Path(path)
    try:
        stream = open(source, "rb", opener=_open_at_once)  # noqa: SIM115 - the caller closes it
    except FileNotFoundError:
        raise InputError(f"{source} does not exist") from None
    except IsADirectoryError:
        raise InputError(f"{source} is a folder; expected a file") from None
    except (OSError, ValueError) as error:  # ValueError: a name with a zero byte
        raise InputError(
            f"cannot read {source}: {getattr(error, 'strerror', None) or error}"
        ) from None
    if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
        stream.close()
        raise InputError(
            f"{source} is not a regular file but a pipe or a device; copy its content "
            "into a file first"
        )
    return stream


def _open_at_once(name: str, flags: int) -> int:
    """Open a file without blocking on a pipe that nobody writes to."""
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))


def read_bytes(path: str | os.PathLike[str], *, limit: int = 1 << 30, empty: bool = False) -> bytes:
    """Read the whole of a user's file.

    Raises
    ------
    InputError
        It cannot be read (`open_file`), is larger than `limit` bytes, or is empty although `empty`
        is False.
    """
    with open_file(path) as stream:
        try:
            data = stream.read(limit + 1)
        except OSError as error:
            raise InputError(f"cannot read {path}: {error.strerror}") from error
    if not data and not empty:
        raise InputError(f"{path} is empty")
    if len(data) > limit:
        size = f"{limit >> 20} MiB" if limit >> 20 else f"{limit >> 10} kB"
        raise InputError(f"{path} is larger than {size}; expected a smaller file")
    return data


@contextmanager
def reading(source: object, what: str, expected: str = "") -> Iterator[None]:
    """Turn any error of the block, which parses a file from outside, into one `InputError` about
    the file.

    Parameters
    ----------
    source : what messages call the file
    what : kind of file that was expected ("readable .npz")
    expected : advice in the message on the expected content

    Raises
    ------
    InputError
        An `InputError` of the block unchanged; for any other error, a message with `source`, the
        error and `expected`.
    """
    try:
        yield
    except A2VError:
        raise
    except Exception as error:  # parsers raise errors of every kind for unforeseen data
        hint = f"; expected {expected}" if expected else ""
        raise InputError(
            f"{source} is not a {what} ({type(error).__name__}: {shorten(error)}){hint}"
        ) from error


def parse_json(data: bytes, source: object, expected: str) -> Any:
    """Parse JSON in UTF-8, with or without a byte-order mark.

    Raises
    ------
    InputError
        It is not JSON, is nested too deeply, or has numbers of thousands of digits.
    """
    try:
        return json.loads(data.decode("utf-8-sig"))
    except json.JSONDecodeError as error:
        raise InputError(
            f"{source}:{error.lineno}: {error.msg}, so this is not JSON; expected {expected}, is "
            "the file truncated?"
        ) from None
    except UnicodeDecodeError:
        raise InputError(f"{source} is not a text file; expected {expected}") from None
    except (ValueError, RecursionError, MemoryError) as error:
        raise InputError(
            f"{source} cannot be read as JSON ({shorten(error)}); expected {expected}"
        ) from None


def read_npz(path: str | os.PathLike[str]) -> dict[str, np.ndarray]:
    """Read every array of an ``.npz`` without unpickling anything.

    Raises
    ------
    InputError
        The file is missing, is not an ``.npz``, is truncated, holds pickled objects or is larger
        than `MAX_ARCHIVE_BYTES` unpacked.
    """
    source = Path(path)
    try:
        with open_file(source) as stream, np.load(stream, allow_pickle=False) as archive:
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise InputError(f"{source} holds a single array; expected an .npz archive")
            infos = archive.zip.infolist() if archive.zip is not None else []
            if sum(info.file_size for info in infos) > MAX_ARCHIVE_BYTES:
                raise InputError(
                    f"{source} unpacks to more than {MAX_ARCHIVE_BYTES >> 30} GiB; refusing to "
                    "read it"
                )
            return {name: archive[name] for name in archive.files}
    except InputError:
        raise
    except Exception as error:  # numpy and zipfile raise many kinds of errors for a broken archive
        raise InputError(f"{source} is not a readable .npz file ({shorten(error)})") from error


def digest_of_arrays(*arrays: np.ndarray) -> np.ndarray:
    """Return the SHA-256 (32,) uint8 of the types, shapes and values of arrays, as a key of what is
    computed from them."""
    sha = hashlib.sha256()
    for array in arrays:
        sha.update(f"{array.dtype.str}{array.shape}".encode())
        sha.update(array.tobytes())
    return np.frombuffer(sha.digest(), np.uint8)


def shorten(value: object, length: int = 200) -> str:
    """Shorten a value that a message quotes to at most `length` characters.

    Text is quoted itself, an error by its message or kind, and anything else in `reprlib`'s form.
    `reprlib` looks only at the first items of the first levels, so that huge nested values stay
    cheap.
    """
    if isinstance(value, BaseException):
        text = str(value) or type(value).__name__
    elif isinstance(value, str):
        text = value[: length + 1]
    else:
        text = brief(value)
    text = " ".join(text[: 4 * length].split())
    return text if len(text) <= length else f"{text[: length - 1]}…"


def brief(value: object) -> str:
    """Return `value` in `reprlib`'s form on one line of at most 120 characters.

    Text is in quotation marks, and nested values show two levels.
    """
    writer = reprlib.Repr()
    writer.maxlevel = 2
    try:
        text = " ".join(writer.repr(value).split())
        return text if len(text) <= 120 else f"{text[:119]}…"
    except ValueError:  # a number of thousands of digits
        return f"a {type(value).__name__} of absurd size"


def say(text: str = "", *, end: str = "\n", first: str = "") -> None:
    """Print `printable` text on standard error, after `first`, which may hold control characters.

    Nothing else in a2v writes there (`tests/test_one_way.py`).
    """
    print(f"{first}{printable(text)}", end=end, file=sys.stderr, flush=True)


def sha256(data: bytes | str | os.PathLike[str]) -> str:
    """Return the hex SHA-256 of bytes, or of the file at a path."""
    digest = hashlib.sha256()
    if isinstance(data, bytes):
        digest.update(data)
    else:
        with open_file(data) as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()
