"""``a2v data``: check and describe a data set."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.datasets import DATASETS
from pipelines.motion_data import NAMES, DataOptions
from pipelines.options import option

HELP = "Check a motion data set's files and describe it."
EXAMPLES = """examples:
  a2v data cmu --data ../shared/data
  a2v data humanact12 --data HumanAct12.zip
  a2v data bvh --data my_actions                            my_actions/walk/*.bvh, my_actions/jump/*.bvh...
  a2v data bvh --data my_actions --bvh.fps 30 --bvh.units centimetres"""


@dataclass(frozen=True, kw_only=True)
class Options(DataOptions):
    """What the command takes."""

    dataset: str = option(NAMES, names=("dataset",), choices=DATASETS)


def run(options: Options) -> int:
    """Load every clip (which checks it) and print a summary."""
    found = options.open()
    lengths = np.array([len(joints) for joints in found.joints])
    print(f"{found.name}: {len(found)} clips, {lengths.sum()} frames at {found.fps:g} fps, {len(set(found.subjects))} subjects")
    print(f"skeleton: {found.skeleton.name}, {len(found.skeleton.parents)} joints")
    print(
        f"frames a clip: {lengths.min()} to {lengths.max()}, median {np.median(lengths):g}; {int((lengths < found.length).sum())} shorter than {found.length} (they hold their last pose)"
    )
    if not found.trajectory:
        print("no trajectory: the roots do not travel (decoders lie and plain only)")
    for note in found.notes:
        print(note)
    print(f"digest: {found.digest}")
    for label, action in enumerate(found.actions):
        clips = lengths[found.labels == label]
        print(f"  {label:>2} {action:<20} {len(clips):>5} clips {clips.sum():>7} frames")
    return 0
