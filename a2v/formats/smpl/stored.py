"""Read the arrays of npz, npy, pickle and torch files without running anything that they name."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.formats.arrays_pickle import read_arrays_pickle
from a2v.io import MAX_ARCHIVE_BYTES, open_file, read_bytes

MAX_BYTES = 512 << 20


def load_arrays(source: Path, kept: Collection[str]) -> Any:
    """Return the array or the dict of arrays of a file; of an archive, those with names in `kept`.
    Nothing that the file names is imported or called.

    Raises
    ------
    InputError
        It is broken, too large, or not such a file.
    """
    with open_file(source) as stream:
        head = stream.read(7)
    if head.startswith(b"PK"):
        with open_file(source) as stream, zipfile.ZipFile(stream) as archive:
            infos = archive.infolist()
            if sum(info.file_size for info in infos) > MAX_ARCHIVE_BYTES:
                raise InputError(
                    f"{source} unpacks to more than {MAX_ARCHIVE_BYTES >> 30} GiB; refusing to "
                    "read it"
                )
            if any(info.filename.endswith("/data.pkl") for info in infos):
                return _tensors(source)
        with open_file(source) as stream, np.load(stream, allow_pickle=False) as content:
            return {name: content[name] for name in content.files if name in kept}
    data = read_bytes(source, limit=MAX_BYTES)
    if not head.startswith(b"\x93NUMPY"):
        return read_arrays_pickle(data, str(source))
    wide = head[6] > 1  # the format's version 2 counts its header by four bytes
    start = (12 if wide else 10) + int.from_bytes(data[8 : 12 if wide else 10], "little")
    if b"'|O'" in data[:start]:
        return read_arrays_pickle(data[start:], str(source))
    return np.load(io.BytesIO(data), allow_pickle=False)


def _tensors(source: Path) -> Any:
    """Return the arrays of a file of torch, whose unpacked size is known to be bounded."""
    import torch

    with open_file(source) as stream:
        content = torch.load(stream, map_location="cpu", weights_only=True)
    left = [MAX_ARCHIVE_BYTES // 8]

    def plain(value: Any, depth: int = 0) -> Any:
        if isinstance(value, torch.Tensor):
            left[0] -= value.numel()
            if left[0] < 0:
                raise InputError(f"{source} has more numbers than are read")
            return value.detach().numpy() if value.layout == torch.strided else None
        if isinstance(value, Mapping) and depth < 4:
            return {key: plain(inner, depth + 1) for key, inner in value.items()}
        return value

    return plain(content)
