"""Loading and running of ONNX files."""

from __future__ import annotations

import functools
import json
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from a2v.digest import Digest
from a2v.errors import InputError
from a2v.io import open_file, reading, shorten

WEIGHTS = Path(__file__).resolve().parent / "weights"
"""Folder of the shipped models."""
ROWS_AT_ONCE = 250
"""Number of rows per run in `run_rows`."""


def open_session(path: Path, threads: int = 1) -> Any:
    """Return the `onnxruntime.InferenceSession` of a file, on the CPU. The last few are cached.
    Raises errors of onnxruntime."""
    return _cached_session(str(path), path.stat().st_mtime_ns, threads)


def new_session(path: Path, threads: int = 1) -> Any:
    """Return a new session that is not cached, for networks so large that their memory should be
    freed."""
    import onnxruntime

    open_file(path).close()  # onnxruntime would block on a pipe
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.log_severity_level = 3
    return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])


def run_rows(
    session: Any,
    names: Sequence[str],
    feed: Mapping[str, np.ndarray],
    shared: Mapping[str, np.ndarray] | None = None,
) -> list[np.ndarray]:
    """Run a graph whose inputs and outputs all have one row per item, and return its outputs
    `names`.

    Many rows are run in parts. This takes less memory and is faster, because intermediate values
    stay in the caches.
    """
    rows = len(next(iter(feed.values())))
    parts = [
        session.run(
            names,
            {name: array[start : start + ROWS_AT_ONCE] for name, array in feed.items()}
            | dict(shared or {}),
        )
        for start in range(0, max(rows, 1), ROWS_AT_ONCE)
    ]
    return (
        parts[0]
        if len(parts) == 1
        else [np.concatenate(arrays) for arrays in zip(*parts, strict=True)]
    )


def run_file(
    path: Path,
    names: Sequence[str],
    feed: Mapping[str, np.ndarray],
    shared: Mapping[str, np.ndarray] | None = None,
) -> list[np.ndarray]:
    """`run_rows` of a file from outside.

    Raises
    ------
    InputError
        Its graph fails in any way.
    """
    with reading(path, "network that runs", "one that a2v exported"):
        return run_rows(open_session(path), names, feed, shared)


def file_digest(path: Path) -> Digest:
    """Return the digest of a file; computed again only when the file changes."""
    return _cached_digest(str(path), path.stat().st_mtime_ns)


def read_metadata(
    path: Path, formats: Collection[str], what: str, threads: int = 1
) -> dict[str, Any]:
    """Read the metadata of an ONNX file of a2v.

    A file from outside is opened by onnxruntime, which checks its graph; the session is cached for
    `open_session` with the same number of threads. A shipped file is only parsed.

    Raises
    ------
    InputError
        The file is not a `what` (such as "motion model") of a2v, or its "format" is not in
        `formats`.
    """
    try:
        if path.parent == WEIGHTS:  # a session of each motion model takes 0.7 s in all
            text = _cached_description(str(path), path.stat().st_mtime_ns)
        else:
            text = open_session(path, threads).get_modelmeta().custom_metadata_map.get("a2v", "")
        metadata = json.loads(text)
    except Exception as error:  # onnxruntime and json raise many kinds of errors for a foreign file
        raise InputError(f"{path} is not a {what} of a2v ({type(error).__name__})") from None
    if not isinstance(metadata, dict):
        raise InputError(
            f"{path} is not a {what} of a2v: its description is {shorten(metadata, 60)}"
        )
    if metadata.get("format") not in formats:
        raise InputError(
            f"{path} has the format {shorten(metadata.get('format'), 60)}; this version reads "
            f"{' and '.join(formats)}"
        )
    return dict(metadata)


@functools.lru_cache(maxsize=8)
def _cached_session(path: str, _modified: int, threads: int) -> Any:
    return new_session(Path(path), threads)


@functools.lru_cache(maxsize=32)
def _cached_description(path: str, _modified: int) -> str:
    import onnx

    model = onnx.load(path, load_external_data=False)
    return next((item.value for item in model.metadata_props if item.key == "a2v"), "")


@functools.lru_cache(maxsize=8)
def _cached_digest(path: str, _modified: int) -> Digest:
    return Digest.of_file(path)
