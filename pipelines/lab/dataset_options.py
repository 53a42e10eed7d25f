"""Options of the motion data sets for training and evaluation."""

from __future__ import annotations

from dataclasses import dataclass

from a2v.errors import InputError
from a2v.lab.datasets import DATASETS, PUBLISHED, ActionDataset, load_dataset
from a2v.lab.datasets.bvh_folder import BVHFolderSettings
from pipelines.bar import bar
from pipelines.options import option, settings

NAMES = (
    f"{', '.join(DATASETS[:-1])} or {DATASETS[-1]} (a folder or zip with one sub-folder "
    "of BVH files per action)"
)


@dataclass(frozen=True, kw_only=True)
class DataOptions:
    """A data set and its path."""

    dataset: str = option(NAMES, choices=DATASETS, metavar="NAME")
    data: str = option("folder or archive that holds it")
    full: str | None = option(
        "with cmu: a folder of CMU's whole data base, AMC and ASF or BVH; --data "
        "then holds the index (cmu_mocap.zip)",
        default=None,
        metavar="FOLDER",
        rare=True,
    )
    bvh: BVHFolderSettings = settings(BVHFolderSettings)

    def open(self) -> ActionDataset:
        """See `open_dataset`."""
        return open_dataset(self.dataset, self.data, self.bvh, full=self.full)


def open_dataset(
    name: str, data: str, bvh: BVHFolderSettings, *, full: str | None = None
) -> ActionDataset:
    """Load the data set called `name`, with a bar while BVH files are read.

    `full` is a folder of CMU's whole data base.

    Raises
    ------
    InputError
        It cannot be used, or `full` was given for another data set than CMU.
    """
    if full is not None:
        if name != "cmu":
            raise InputError(f"full is for the data set cmu, not for {name}; leave it out")
        from a2v.lab.datasets.cmu_full import load_cmu_full

        with bar("read", "file") as progress:
            return load_cmu_full(full, data, progress=progress)
    given = bvh if name == "bvh" or bvh != BVHFolderSettings() else None
    with bar("read", "file", hidden=name not in ("bvh", *PUBLISHED)) as progress:
        return load_dataset(name, data, bvh=given, progress=progress)


def hold_out(dataset: ActionDataset, wanted: str) -> tuple[ActionDataset, ActionDataset | None]:
    """Split a data set into (training, held-out) parts by the option --held-out.

    Parameters
    ----------
    wanted : "none", "auto", or names of subjects separated by commas
        "auto" takes subjects with about a fifth of the clips (always the same ones), or, if
        subjects are unknown, a fifth of the clips of each action.

    Raises
    ------
    InputError
        Unknown subjects, or too little data.
    """
    if wanted in ("none", ""):
        return dataset, None
    if wanted == "auto":
        return (
            dataset.split_clips()
            if len(set(dataset.subjects)) < 2
            else dataset.split(dataset.choose_subjects())
        )
    return dataset.split([name.strip() for name in wanted.split(",")])
