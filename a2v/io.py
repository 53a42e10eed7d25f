"""Files at the edge: atomic writes, bounded reads and digests.

Every file that a2v writes appears under its final name only when it is complete.
"""

from __future__ import annotations

import contextlib
import csv
import hashlib
import json
import os
import re
import reprlib
import stat
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from a2v.errors import A2VError, InputError
from a2v.system import WINDOWS, file_mask, lock, user_number

MAX_ARCHIVE_BYTES = 1 << 30
"""Refuse to unpack more than this from one ``.npz`` (a zip bomb would otherwise fill the
memory)."""


_MARK = "-a2v"
"""In the names of temporary files, before eight random characters."""
_UNFINISHED: set[Path] = set()
"""The temporary files that this process is writing."""


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
        handle, name = tempfile.mkstemp(
            prefix=f".{target.stem[:32]}{_MARK}", suffix=target.suffix, dir=target.parent
        )
        lock(handle)
    except OSError as error:
        raise InputError(
            f"cannot write {target}: {error.strerror}; choose another output folder"
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
    """Keep other runs from writing into an existing `folder` inside the block: files of two runs
    would stand beside each other.

    The claim ends with the process, killed or not, and leaves no file. Where folders cannot be
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
    """Remove what this process is writing; for a process that is about to end without unwinding its
    stack."""
    for path in tuple(_UNFINISHED):
        path.unlink(missing_ok=True)


def clear_leftovers(folder: str | os.PathLike[str]) -> None:
    """Remove the temporary files of `atomic_path` in `folder` whose process was killed; those that
    are being written stay."""
    for path in Path(folder).glob(f".*{_MARK}????????*"):
        with contextlib.suppress(OSError):
            handle = os.open(path, os.O_RDWR)
            try:
                if lock(handle):
                    path.unlink()
            finally:
                os.close(handle)


def user_cache_folder() -> Path | None:
    """The folder ``a2v`` in the user's cache folder (``$XDG_CACHE_HOME``, else ``~/.cache``); None
    for a user without a home."""
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "a2v"
    except RuntimeError:
        return None


def cache_folders() -> Iterator[Path]:
    """Folders to look in and to write to, best first: ``A2V_CACHE``, the user's cache folder, the
    temporary folder."""
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
    """Whether a file of `cache_folders` is the user's own: another one could have planted it in the
    shared temporary folder."""
    user = user_number()
    return user is None or path.stat().st_uid in (user, 0)


def write_npz(
    path: str | os.PathLike[str], arrays: Mapping[str, Any], *, compress: bool = False
) -> None:
    """Write `arrays` (numpy arrays or what becomes one without pickling) to one ``.npz``,
    atomically."""
    checked = {name: np.asarray(value) for name, value in arrays.items()}
    for name, value in checked.items():
        if value.dtype.hasobject:
            raise TypeError(
                f"array '{name}' holds Python objects; only plain numbers and text are stored"
            )
    with atomic_path(path) as temporary, open(temporary, "wb") as stream:
        (np.savez_compressed if compress else np.savez)(stream, **checked)


def write_csv(path: str | os.PathLike[str], rows: Sequence[Mapping[str, Any]]) -> None:
    """Write `rows` as one CSV table with the columns of all of them, in the order in which they
    first appear; UTF-8, as are all texts.

    Bytes of names that are no UTF-8, which Python keeps as halves of surrogate pairs, are written
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
    """Open a user's file for reading bytes; only regular files, since a pipe may wait for ever and
    a device may never end.

    Raises
    ------
    InputError
        It is missing, cannot be read, is a folder, or is no regular file.
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
            f"{source} is no regular file but a pipe or a device; copy what it gives into a file "
            "first"
        )
    return stream


def _open_at_once(name: str, flags: int) -> int:
    """Open without waiting for somebody who writes to a pipe."""
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))


def read_bytes(path: str | os.PathLike[str], *, limit: int = 1 << 30, empty: bool = False) -> bytes:
    """Read a user's whole file.

    Raises
    ------
    InputError
        It cannot be read (`open_file`), is larger than `limit` bytes, or has none, unless it may be
        `empty`.
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
    """Where data from outside becomes ours: whatever goes wrong in the block is the file's fault
    and becomes one `InputError`.

    Parameters
    ----------
    source : what messages call the file
    what : what it turns out not to be ("readable .npz")
    expected : what it should have been

    Raises
    ------
    InputError
        As it was raised in the block, or naming `source`, what went wrong and what was `expected`.
    """
    try:
        yield
    except A2VError:
        raise
    except Exception as error:  # parsers raise every kind for what they did not foresee
        hint = f"; expected {expected}" if expected else ""
        raise InputError(
            f"{source} is no {what} ({type(error).__name__}: {shorten(error)}){hint}"
        ) from error


def parse_json(data: bytes, source: object, expected: str) -> Any:
    """The value of JSON in UTF-8, a byte-order mark or not.

    Raises
    ------
    InputError
        It is no JSON, too deep, or has numbers of thousands of digits.
    """
    try:
        return json.loads(data.decode("utf-8-sig"))
    except json.JSONDecodeError as error:
        raise InputError(
            f"{source}:{error.lineno}: {error.msg}, so this is no JSON; expected {expected}, is "
            "the file truncated?"
        ) from None
    except UnicodeDecodeError:
        raise InputError(f"{source} is no text file; expected {expected}") from None
    except (ValueError, RecursionError, MemoryError) as error:
        raise InputError(
            f"{source} cannot be read as JSON ({shorten(error)}); expected {expected}"
        ) from None


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
    except Exception as error:  # numpy and zipfile raise many kinds for a broken archive
        raise InputError(f"{source} is not a readable .npz file ({shorten(error)})") from error


def shorten(value: object, length: int = 200) -> str:
    """At most `length` characters of what a message quotes: text as it is, an error by its message
    or kind, else `reprlib`'s form.

    `reprlib` looks only at the first items of the first levels, so what explodes when it is written
    out whole stays small.
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
    """`value` as `reprlib` writes it, on one line of at most 120 characters: text in quotation
    marks, two levels of what is nested."""
    writer = reprlib.Repr()
    writer.maxlevel = 2
    try:
        text = " ".join(writer.repr(value).split())
        return text if len(text) <= 120 else f"{text[:119]}…"
    except ValueError:  # a number of thousands of digits
        return f"a {type(value).__name__} of absurd size"


_UNPRINTABLE = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)
"""Control characters but tab and line feed, marks and overrides of the writing direction, and
halves of surrogate pairs."""


def printable(text: str) -> str:
    """`text` as it may go to a terminal: characters that would steer it are written as escapes, so
    ESC becomes ``\\x1b``."""
    return _UNPRINTABLE.sub(lambda found: ascii(found.group())[1:-1], text)


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
