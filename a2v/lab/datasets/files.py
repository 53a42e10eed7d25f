"""Files of data sets, from a folder or an archive, with bounds and checks."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path, PurePosixPath

import numpy as np

from a2v.errors import InputError
from a2v.io import open_file, read_bytes, reading
from a2v.types import FloatArray

MAX_FILE_BYTES = 64 << 20
"""Largest size of a single clip; larger ones are refused before they are read."""
MAX_ARCHIVE_BYTES = 256 << 20
"""Largest unpacked size of a zip, because all its clips are kept in memory. The published sets have
24 and 46 MB."""


def check_joints(array: np.ndarray, n_joints: int, where: str) -> FloatArray:
    """Return `array` as (T, n_joints, 3) float32.

    Raises
    ------
    InputError
        Wrong shape, fewer than 2 frames, or numbers that are not finite; `where` names the file.
    """
    if array.ndim == 2 and array.shape[1] == 3 * n_joints:
        array = array.reshape(len(array), n_joints, 3)
    if array.ndim != 3 or array.shape[1:] != (n_joints, 3):
        raise InputError(
            f"{where}: joints have shape {array.shape}; expected (frames, {n_joints}, 3)"
        )
    if len(array) == 0:
        raise InputError(f"{where}: the clip has no frames")
    if len(array) == 1:
        raise InputError(
            f"{where}: the clip has 1 frame; a motion needs at least 2: remove the file"
        )
    if not np.issubdtype(array.dtype, np.floating) or not np.isfinite(array).all():
        raise InputError(
            f"{where}: joints must be finite floating-point numbers; found {array.dtype} with NaN "
            "or infinity, or integers"
        )
    return array.astype(np.float32)


class FileSource:
    """Reads files by name from a folder or, without unpacking it, from a zip archive."""

    def __init__(self, path: Path) -> None:
        self.path = path
        if path.is_dir():
            self._archive = None
        elif path.is_file():
            with reading(path, "zip archive that can be read", "a folder or a zip"):
                self._archive = zipfile.ZipFile(open_file(path))
                unpacked = sum(info.file_size for info in self._archive.infolist())
            if unpacked > MAX_ARCHIVE_BYTES:
                raise InputError(
                    f"{path} unpacks to {unpacked >> 20} MB; at most {MAX_ARCHIVE_BYTES >> 20} MB "
                    "are read: unpack it into a folder"
                )
        else:
            raise InputError(f"{path} does not exist; give the data set's folder or zip archive")

    def names(self, suffix: str) -> list[str]:
        """Return the sorted names (relative, with forward slashes) that end with `suffix`."""
        if self._archive is not None:
            names = [name for name in self._archive.namelist() if not name.endswith("/")]
        else:
            names = [
                item.relative_to(self.path).as_posix()
                for item in self.path.rglob(f"*{suffix}")
                if item.is_file()
            ]
        return sorted(
            name
            for name in names
            if name.endswith(suffix) and not PurePosixPath(name).name.startswith(".")
        )

    def read(self, name: str) -> bytes:
        """Return the content of one file.

        Raises
        ------
        InputError
            It is larger than `MAX_FILE_BYTES`, missing or damaged.
        """
        where = f"{self.path}/{name}"
        if self._archive is None:
            return read_bytes(self.path / name, limit=MAX_FILE_BYTES, empty=True)
        with reading(where, "file that can be unpacked", "one that is whole and not encrypted"):
            if name not in self._archive.NameToInfo:
                raise InputError(f"{where} does not exist")
            size = self._archive.getinfo(name).file_size
            if size > MAX_FILE_BYTES:
                raise InputError(
                    f"{where}: {size >> 20} MB is too large for a clip (limit "
                    f"{MAX_FILE_BYTES >> 20} MB)"
                )
            return self._archive.read(name)

    def read_npy(self, name: str) -> np.ndarray:
        """Read one ``.npy`` array without unpickling.

        Raises
        ------
        InputError
            As for `read`, or it is not such a file.
        """
        data = self.read(name)
        with reading(f"{self.path}/{name}", "readable .npy file"):
            array = np.load(io.BytesIO(data), allow_pickle=False)
        if not isinstance(array, np.ndarray):
            raise InputError(f"{self.path}/{name} is an archive; expected one .npy array")
        return array


def find_source(path: str | Path, *, archive: str, marker: str) -> FileSource:
    """Find the source of a data set: `path` itself, or the `archive` inside it.

    Parameters
    ----------
    path : path
    archive : str
        Name of the published zip.
    marker : str
        Suffix of the name of a file that must exist.

    Raises
    ------
    InputError
        There is no such folder or zip, or none of its files has the suffix.
    """
    root = Path(path)
    found = root / archive if root.is_dir() and (root / archive).is_file() else root
    source = FileSource(found)
    if not source.names(marker):
        raise InputError(
            f"{found} holds no *{marker} files; expected the folder or zip of the data set "
            f"({archive})"
        )
    return source
