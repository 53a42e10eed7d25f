"""Reading checkpoints safely: only tensors and plain values, no larger than their file."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from a2v.errors import InputError
from a2v.io import open_file


def load_tensors(path: str | os.PathLike[str]) -> Any:
    """Return the result of `torch.load` for a regular file: only tensors and plain values, hardly
    larger than the file.

    Raises
    ------
    InputError
        The file is missing or not regular, or its tensors would take more memory than the file's
        size.
    Exception
        Whatever torch raises for another file.
    """
    import torch

    with open_file(path) as stream:
        size = os.fstat(stream.fileno()).st_size
        if zipfile.is_zipfile(stream):
            with zipfile.ZipFile(stream) as archive:
                _check_size(path, sum(info.file_size for info in archive.infolist()), size)
        stream.seek(0)
        content = torch.load(stream, map_location="cpu", weights_only=True)
    left, seen, total = [content], set(), 0
    while left:
        value = left.pop()
        if isinstance(value, torch.Tensor):
            total += value.numel() * value.element_size()
        elif isinstance(value, Mapping | list | tuple) and id(value) not in seen:
            seen.add(id(value))
            left += value.values() if isinstance(value, Mapping) else value
    _check_size(path, total, size)
    return content


_REPEATED = 4
"""Factor by which the tensors of a checkpoint may be larger than its file, since several may share
memory."""


def _check_size(path: str | os.PathLike[str], wanted: int, size: int) -> None:
    if wanted > _REPEATED * size + (1 << 20):
        raise InputError(
            f"{path} has {size >> 10} kB and would take {wanted >> 20} MB; it is "
            "damaged, or something else"
        )


def read_checkpoint(path: str | os.PathLike[str], needed: Iterable[str]) -> dict[str, Any]:
    """Return the content of a checkpoint; only tensors and plain values are unpickled.

    Raises
    ------
    InputError
        The file is missing, damaged, or lacks an entry of `needed`.
    """
    if not Path(path).exists():
        raise InputError(f"{path} does not exist; train first (a2v train)")
    try:
        content = load_tensors(path)
        missing = {"made_with", "seconds", *needed} - set(content)
    except InputError:
        raise
    except (
        Exception
    ):  # torch raises many kinds for a damaged file, and its message recommends unsafe reading
        raise InputError(
            f"{path} cannot be read as a checkpoint; it is damaged, or not a checkpoint"
        ) from None
    if missing:
        raise InputError(
            f"{path} is not a checkpoint of this training (it lacks "
            f"{', '.join(sorted(missing))}); give another folder"
        )
    return dict(content)
