"""Folders of views: several processes write them, with an index; an interrupted run can be
resumed."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from functools import lru_cache, partial
from pathlib import Path
from types import MappingProxyType

from a2v.lab.studio.index import keep_index
from a2v.lab.studio.settings import VERSION, StudioSettings
from a2v.lab.studio.studio import Studio
from a2v.lab.studio.view import view_path
from a2v.lab.studio.workers import check_counts, work_through
from a2v.types import Progress

OLDER: Mapping[str, object] = MappingProxyType(
    {
        "people": "avatars",
        "varied": 0.0,
        "things": 0.0,
        "furniture": 0.0,
        "cut": 0.0,
        "photographs": 0.0,
        "backgrounds": "",
    }
)
"""Values of settings that older folders do not list: those with which they were made."""


def write_views(
    folder: str | os.PathLike[str],
    data: str | os.PathLike[str],
    counts: Mapping[str, int],
    *,
    settings: StudioSettings | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> float:
    """Fill a data set's folder with views; existing ones are kept.

    Parameters
    ----------
    folder : path
        Gets ``views/<split>/000123.npz`` for each view, ``index.json``, ``guide.npz``,
        ``poses.npz``.
    data : path
        Folder with ``avatars/`` and the motion data.
    counts : mapping of split to int
        Total number of views of each split.
    settings : StudioSettings
    workers : int
        Number of processes, each on one core.
    progress : Progress, optional
        Counts new views. In a new folder the guides are made first.

    Returns
    -------
    float
        Views per second, 0 if there was nothing left to do.

    Raises
    ------
    InputError
        An unknown split, invalid numbers, or a folder made with other settings.
    """
    settings = settings or StudioSettings()
    folder = Path(folder)
    check_counts(counts, workers)
    keep_index(folder, settings, VERSION, older=OLDER)
    # makes poses and guides, before the workers start
    _open_studio(str(folder), str(data), settings)
    todo = [
        (split, index)
        for split, count in counts.items()
        for index in range(count)
        if not view_path(folder, split, index).exists()
    ]
    started = time.perf_counter()
    write = partial(_write, str(folder), str(data), settings)
    # views of one avatar are made together
    for done, _ in enumerate(work_through(write, todo, workers, together=settings.same_avatar), 1):
        if progress:
            progress(done, len(todo))
    return len(todo) / (time.perf_counter() - started) if todo else 0.0


@lru_cache(maxsize=1)
def _open_studio(folder: str, data: str, settings: StudioSettings) -> Studio:
    """Return the studio of a process, opened once."""
    return Studio.open(folder, data, settings)


def _write(folder: str, data: str, settings: StudioSettings, view: tuple[str, int]) -> None:
    _open_studio(folder, data, settings).view(*view).save(view_path(folder, *view))
