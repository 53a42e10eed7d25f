"""Folders of quick views: several processes write shards, with an index; an interrupted run can be
resumed."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from functools import lru_cache, partial
from pathlib import Path

from a2v.lab.studio.index import keep_index
from a2v.lab.studio.quick.people import QuickStudio, prepare_folder
from a2v.lab.studio.quick.settings import SHARD, VERSION, QuickSettings
from a2v.lab.studio.quick.views import shard_path
from a2v.lab.studio.workers import check_counts, work_through
from a2v.types import Progress


def write_quick_views(
    folder: str | os.PathLike[str],
    data: str | os.PathLike[str],
    counts: Mapping[str, int],
    *,
    settings: QuickSettings | None = None,
    workers: int = 1,
    progress: Progress | None = None,
    preparing: Progress | None = None,
) -> float:
    """Fill a folder with quick views; existing shards are kept.

    Parameters
    ----------
    folder : path
        Gets ``<split>/00012.npz`` for each shard, ``index.json``, ``bank.npz`` and ``guide.npz``.
    data : path
        Folder with ``avatars/``, the motion data and MakeHuman's archive.
    counts : mapping of split to int
        Total number of views of each split, rounded up to whole shards of 64.
    settings : QuickSettings
    workers : int
        Number of processes, each on one core.
    progress : Progress, optional
        Counts new shards.
    preparing : Progress, optional
        Counts the clips of the bank of poses, if it has to be made.

    Returns
    -------
    float
        Views per second, 0 if there was nothing left to do.

    Raises
    ------
    InputError
        An unknown split, invalid numbers, missing data, or a folder made with other settings.
    """
    settings, folder = settings or QuickSettings(), Path(folder)
    check_counts(counts, workers)
    todo = [
        (split, number)
        for split, count in counts.items()
        for number in range(-(-count // SHARD))
        if not shard_path(folder, split, number).exists()
    ]
    keep_index(folder, settings, VERSION)
    if not todo:
        return 0.0
    prepare_folder(folder, data, preparing)
    started = time.perf_counter()
    write = partial(_write, str(folder), str(data), settings)
    for done, _ in enumerate(work_through(write, todo, workers), 1):
        if progress:
            progress(done, len(todo))
    return SHARD * len(todo) / (time.perf_counter() - started)


@lru_cache(maxsize=1)
def _open_studio(folder: str, data: str, settings: QuickSettings) -> QuickStudio:
    """Return the studio of a process, opened once."""
    return QuickStudio.open(folder, data, settings)


def _write(folder: str, data: str, settings: QuickSettings, shard: tuple[str, int]) -> None:
    _open_studio(folder, data, settings).shard(*shard).save(shard_path(folder, *shard))
