"""Data sets of views: writing them by several processes, their index, and resuming."""

from __future__ import annotations

import dataclasses
import json
import os
import time
from collections.abc import Mapping
from functools import lru_cache, partial
from pathlib import Path

from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.studio.settings import VERSION, StudioSettings
from a2v.studio.studio import Studio
from a2v.studio.view import read_index, view_path
from a2v.studio.workers import check_counts, work_through
from a2v.types import Progress
from a2v.version import __version__


def write_views(
    folder: str | os.PathLike[str],
    data: str | os.PathLike[str],
    counts: Mapping[str, int],
    *,
    settings: StudioSettings | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> float:
    """Fill a data set's folder with views; those that are there already are kept.

    Parameters
    ----------
    folder : path
        ``views/<split>/000123.npz`` each, ``index.json``, ``guide.npz``, ``poses.npz``.
    data : path
        Folder with ``avatars/`` and the motion data.
    counts : mapping of split to int
        Views in all of each split.
    settings : StudioSettings
    workers : int
        Processes, each on one core.
    progress : Progress, optional
        Over new views; at the first time the guides of the folder are made before.

    Returns
    -------
    float
        Views a second, 0 where there was nothing left to do.

    Raises
    ------
    InputError
        An unknown split, bad numbers, or a folder that other settings made.
    """
    settings = settings or StudioSettings()
    folder = Path(folder)
    check_counts(counts, workers)
    _write_index(folder, settings)
    _open_studio(str(folder), str(data), settings)  # makes poses and guides, before workers do
    todo = [(split, index) for split, count in counts.items() for index in range(count) if not view_path(folder, split, index).exists()]
    started = time.perf_counter()
    write = partial(_write, str(folder), str(data), settings)
    # blocks of one avatar stay together
    for done, _ in enumerate(work_through(write, todo, workers, together=settings.same_avatar), 1):
        if progress:
            progress(done, len(todo))
    return len(todo) / (time.perf_counter() - started) if todo else 0.0


@lru_cache(maxsize=1)
def _open_studio(folder: str, data: str, settings: StudioSettings) -> Studio:
    """The studio of a process, opened once."""
    return Studio.open(folder, data, settings)


def _write(folder: str, data: str, settings: StudioSettings, view: tuple[str, int]) -> None:
    _open_studio(folder, data, settings).view(*view).save(view_path(folder, *view))


def _write_index(folder: Path, settings: StudioSettings) -> None:
    """Write ``index.json``, or check that the folder was made by the same settings."""
    plain = json.loads(json.dumps(dataclasses.asdict(settings)))
    path = folder / "index.json"
    if path.exists():
        found = read_index(folder)
        older = found.get("settings")
        # folders from before there was a choice
        settled = {"people": "avatars", "varied": 0.0, **older} if isinstance(older, dict) else older
        if settled != plain or found.get("version") != VERSION:
            raise InputError(f"{folder} was made by other settings or another version (see its index.json); choose another --out")
        return
    content = {
        "version": VERSION,
        "a2v": __version__,
        "settings": plain,
        "validation": "variation.VALIDATION_IDENTITIES and VALIDATION_OUTFITS",
    }
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1))
