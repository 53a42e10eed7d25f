"""The motion data sets that commands train on and measure with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from a2v.errors import InputError

if TYPE_CHECKING:
    from a2v.datasets import ActionDataset


def add_dataset_arguments(parser: Any, *, positional: bool = False, optional: bool = False) -> None:
    """The options that name a data set; `open_dataset` reads them. Where it is `optional`, `open_dataset` demands it."""
    from a2v.datasets import DATASETS
    from a2v.datasets.bvh_folder import BVHFolderSettings

    text = f"{', '.join(DATASETS[:-1])} or {DATASETS[-1]} (a folder or zip with one sub-folder of BVH files an action)"
    if positional:
        parser.add_argument("dataset", choices=DATASETS, help=text)
    else:
        parser.add_argument("--dataset", required=not optional, default=None, choices=DATASETS, help=text)
    parser.add_argument("--data", required=True, help="folder or archive that holds it")
    parser.add_argument("--bvh", type=BVHFolderSettings, default=BVHFolderSettings(), help="how BVH files are read (bvh only)")


def open_dataset(settings: Any) -> ActionDataset:
    """Load the data set of `add_dataset_arguments`, with a bar while BVH files are read.

    Raises
    ------
    InputError
        It cannot be used, or has no settings of its own and was given some.
    """
    from a2v.datasets import DATASETS, load_dataset
    from a2v.datasets.bvh_folder import BVHFolderSettings
    from pipelines.bar import bar

    if settings.dataset is None:
        raise InputError(f"no data set given; choose one with --dataset ({', '.join(DATASETS)})")
    given = settings.bvh if settings.dataset == "bvh" or settings.bvh != BVHFolderSettings() else None
    with bar("read", "file", hidden=settings.dataset != "bvh") as progress:
        return load_dataset(settings.dataset, settings.data, bvh=given, progress=progress)


def hold_out(dataset: ActionDataset, wanted: str) -> tuple[ActionDataset, ActionDataset | None]:
    """(training, held-out) part of a data set by the option --held_out.

    Parameters
    ----------
    wanted : "none", "auto", or names of subjects separated by commas
        "auto" takes subjects with about a fifth of the clips (always the same ones), or, where subjects are unknown, a fifth of
        the clips of each action.

    Raises
    ------
    InputError
        Unknown subjects, or too little data.
    """
    if wanted in ("none", ""):
        return dataset, None
    if wanted == "auto":
        return dataset.split_clips() if len(set(dataset.subjects)) < 2 else dataset.split(dataset.choose_subjects())
    return dataset.split([name.strip() for name in wanted.split(",")])
