"""Loaders of motion data sets; every clip converts to a `Motion`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from a2v.errors import InputError
from a2v.lab.datasets.base import ActionDataset, ClipSampler, NativeFrame
from a2v.lab.datasets.cmu import load_cmu
from a2v.lab.datasets.cmu_fine import load_cmu_fine
from a2v.lab.datasets.humanact12 import load_humanact12
from a2v.types import Progress

if TYPE_CHECKING:
    from a2v.lab.datasets.bvh_folder import BVHFolderSettings

PUBLISHED = ("amass", "babel", "humanml3d", "100style")
"""Sets that are read by their published layouts (`a2v.lab.datasets.published`)."""
DATASETS = ("humanact12", "humanact12-fine", "cmu", "cmu-fine", "ntu_vibe", *PUBLISHED, "bvh")


def load_dataset(
    name: str,
    path: str | Path,
    *,
    bvh: BVHFolderSettings | None = None,
    progress: Progress | None = None,
) -> ActionDataset:
    """Load the data set called `name` (one of `DATASETS`) from `path`.

    Parameters
    ----------
    name : str
        "bvh" is a folder (or zip) of BVH files with one subfolder per action.
    path : path
    bvh : BVHFolderSettings
        Rate, window, units and axis ("bvh" only).
    progress : Progress
        Called after each file of "bvh", and each clip of `PUBLISHED`; the others load in seconds.

    Raises
    ------
    InputError
        Unknown name, settings that do not apply, or the files cannot be used.
    """
    if name == "bvh":
        from a2v.lab.datasets.bvh_folder import load_bvh_folder

        return load_bvh_folder(path, bvh, progress=progress)
    if bvh is not None:
        raise InputError(
            f"{name} has a fixed rate, length and unit; settings of them are for 'bvh' only"
        )
    if name in PUBLISHED:
        from a2v.lab.datasets.published import LOADERS

        return LOADERS[name](path, progress=progress)
    if name == "cmu":
        return load_cmu(path)
    if name == "cmu-fine":
        return load_cmu_fine(path)
    if name == "ntu_vibe":
        from a2v.lab.datasets.ntu_vibe import load_ntu_vibe

        return load_ntu_vibe(path)
    if name in ("humanact12", "humanact12-fine"):
        return load_humanact12(path, grain="coarse" if name == "humanact12" else "fine")
    raise InputError(f"unknown data set '{name}'; choose from {', '.join(DATASETS)}")


__all__ = [
    "DATASETS",
    "ActionDataset",
    "ClipSampler",
    "NativeFrame",
    "load_cmu",
    "load_cmu_fine",
    "load_dataset",
    "load_humanact12",
]
