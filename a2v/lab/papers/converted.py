"""The user's checkpoints as ONNX files: converted once into the cache, part by part, and run by
onnxruntime."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.errors import InputError
from a2v.io import atomic_path, cache_folders, is_ours
from a2v.sessions import file_digest, new_session
from a2v.types import FloatArray

if TYPE_CHECKING:
    from a2v.lab.papers.models import Part

FORMAT = 1
"""Version of the conversion; increased when the graphs of a checkpoint change."""
KINDS: Mapping[str, Sequence[str]] = {
    "geometry": ("features", "points"),
    "color": ("features", "points"),
    "pifuhd": ("front", "back", "coarse", "fine", "points"),
    "pamir": ("features", "volume", "points"),
    "pamir-texture": ("features", "volume", "points"),
}
"""Names of the parts of PIFu's ``net_G`` and ``net_C``, of PIFuHD and of PaMIR, as `Part` has
them."""
CHUNK = 16_384
"""Points per call, which bounds memory."""


class Converted:
    """A checkpoint's parts as ONNX files, which are written if they are not in the cache.

    A part is opened when it runs and closed afterwards, except the points' part: PIFuHD's networks
    of normals are 0.7 GB each.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    path : path
        The checkpoint.
    pixels : int
        Side of the picture that PIFu and PIFuHD's coarse level see.
    threads : int
        Threads of onnxruntime; 0 for its default.

    Raises
    ------
    InputError
        The checkpoint is not one of `kind`, or no cache folder is writable.
    """

    def __init__(self, kind: str, path: str | Path, pixels: int, *, threads: int = 0) -> None:
        self._threads, self._points = threads, None  # opened on first use
        name = f"papers/{file_digest(Path(path))[:32]}-{kind}-{pixels}-{FORMAT}"
        self._files = _found(name, KINDS[kind]) or _convert(kind, path, pixels, name)

    def run(self, part: str, **given: FloatArray) -> FloatArray:
        """Return a part's result for inputs by name."""
        found: FloatArray = new_session(self._files[part], self._threads).run(None, given)[0]
        return found

    @property
    def features(self) -> int:
        """Side of the first input map of the part "points", pixels."""
        return int(self._session().get_inputs()[0].shape[1])

    def at(self, points: FloatArray, **maps: FloatArray) -> FloatArray:
        """Return the result of the part "points" for points (N, 3), float32, in the networks' cube,
        and maps by name."""
        session = self._session()
        parts = [
            session.run(None, maps | {"points": points[start : start + CHUNK]})[0]
            for start in range(0, len(points), CHUNK)
        ]
        found: FloatArray = np.concatenate(parts)
        return found

    def _session(self) -> Any:
        if self._points is None:
            self._points = new_session(self._files["points"], self._threads)
        return self._points


def _found(name: str, parts: Sequence[str]) -> dict[str, Path]:
    """Return the files of parts in the first folder of the cache that has all of them and is ours,
    or none."""
    for folder in cache_folders():
        files = {part: folder / name / f"{part}.onnx" for part in parts}
        if all(file.is_file() and is_ours(file) for file in files.values()):
            return files
    return {}


def _convert(kind: str, path: str | Path, pixels: int, name: str) -> dict[str, Path]:
    """Write the parts into the first writable folder of the cache."""
    import torch

    from a2v.lab.papers.models import PIFuColor, PIFuGeometry, PIFuHD
    from a2v.lab.papers.pamir import PamirGeometry, PamirTexture

    networks: Mapping[
        str,
        Callable[[str | Path], PIFuGeometry | PIFuColor | PIFuHD | PamirGeometry | PamirTexture],
    ]
    networks = {
        "geometry": PIFuGeometry,
        "color": PIFuColor,
        "pifuhd": PIFuHD,
        "pamir": PamirGeometry,
        "pamir-texture": PamirTexture,
    }
    network = networks[kind](path)
    target = _writable(name)
    with torch.no_grad():
        return {
            part.name: _write(part, target / f"{part.name}.onnx") for part in network.parts(pixels)
        }


def _writable(name: str) -> Path:
    """Return the folder `name` in the first writable folder of the cache."""
    for folder in cache_folders():
        with contextlib.suppress(OSError):
            (folder / name).mkdir(parents=True, exist_ok=True)
            if os.access(folder / name, os.W_OK):
                return folder / name
    raise InputError(
        "the checkpoint's ONNX files cannot be written to any cache folder; set A2V_CACHE to a "
        "writable one"
    )


def _write(part: Part, path: Path) -> Path:
    """Trace one part and write it."""
    import onnx
    import torch

    from a2v.tracing import to_onnx

    count = torch.export.Dim("points", min=2)
    given = tuple(
        torch.zeros(64, 3) if shape is None else torch.zeros(1, *shape)
        for shape in part.inputs.values()
    )
    free = [{0: count} if shape is None else None for shape in part.inputs.values()]
    proto = to_onnx(part.network.eval(), given, list(part.inputs), ["found"], free)
    with atomic_path(path) as temporary:
        onnx.save(proto, temporary)
    return path
