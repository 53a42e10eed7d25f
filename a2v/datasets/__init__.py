"""Loaders of motion data sets; every clip can be had as a `Motion`."""

from __future__ import annotations

from pathlib import Path

from a2v.datasets.base import ActionDataset, ClipSampler, NativeFrame
from a2v.datasets.cmu import load_cmu
from a2v.datasets.humanact12 import load_humanact12
from a2v.errors import InputError

DATASETS = ("humanact12", "humanact12-fine", "cmu")


def load_dataset(name: str, path: str | Path) -> ActionDataset:
    """Load the data set called `name` (one of `DATASETS`) from `path`.

    Raises
    ------
    InputError
        Unknown name, or the files cannot be used.
    """
    if name == "cmu":
        return load_cmu(path)
    if name in ("humanact12", "humanact12-fine"):
        return load_humanact12(path, grain="coarse" if name == "humanact12" else "fine")
    raise InputError(f"unknown data set '{name}'; choose from {', '.join(DATASETS)}")


__all__ = ["DATASETS", "ActionDataset", "ClipSampler", "NativeFrame", "load_cmu", "load_dataset", "load_humanact12"]
