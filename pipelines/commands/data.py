"""``a2v data``: check and describe a data set."""

from __future__ import annotations

from pathlib import Path
from typing import Any

HELP = "Check a motion data set's files and describe it."
EXAMPLES = """examples:
  a2v data cmu --data ../shared/data
  a2v data humanact12 --data HumanAct12.zip"""


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    parser.add_argument("dataset", help="humanact12, humanact12-fine or cmu")
    parser.add_argument("--data", required=True, help="folder or archive that holds it")


def run(settings: Any) -> int:
    """Load every clip (which checks it) and print a summary."""
    import numpy as np

    from a2v.datasets import load_dataset

    found = load_dataset(settings.dataset, Path(settings.data))
    lengths = np.array([len(joints) for joints in found.joints])
    print(f"{found.name}: {len(found)} clips, {lengths.sum()} frames at {found.fps:g} fps, {len(set(found.subjects))} subjects")
    print(f"skeleton: {found.skeleton.name}, {len(found.skeleton.parents)} joints")
    print(
        f"frames a clip: {lengths.min()} to {lengths.max()}, median {np.median(lengths):g}; {int((lengths < found.length).sum())} shorter than {found.length}"
    )
    print(f"digest: {found.digest}")
    for label, action in enumerate(found.actions):
        clips = lengths[found.labels == label]
        print(f"  {label:>2} {action:<20} {len(clips):>5} clips {clips.sum():>7} frames")
    return 0
