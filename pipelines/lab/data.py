"""``a2v data``: check and describe a data set."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.lab.datasets import DATASETS
from pipelines.answer import Answer
from pipelines.lab.dataset_options import NAMES, DataOptions
from pipelines.options import option

HELP = "Check a motion data set's files and describe it."
EXAMPLES = """examples:
  a2v data cmu --data ../shared/data
  a2v data humanact12 --data HumanAct12.zip
  a2v data cmu --data ../shared/data --full CMU             CMU's whole data base: CMU/01/01.asf, CMU/01/01_01.amc or .bvh...
  a2v data babel --data AMASS                               AMASS/CMU/01/01_01_poses.npz... and AMASS/train.json; also amass
  a2v data humanml3d --data HumanML3D                       new_joints/*.npy and texts/*.txt
  a2v data 100style --data 100STYLE                         Aeroplane/Aeroplane_FW.bvh... and Frame_Cuts.csv
  a2v data bvh --data my_actions                            my_actions/walk/*.bvh, my_actions/jump/*.bvh...
  a2v data bvh --data my_actions --bvh.fps 30 --bvh.units centimeters"""


@dataclass(frozen=True, kw_only=True)
class Options(DataOptions):
    """Options of the command."""

    dataset: str = option(NAMES, names=("dataset",), choices=DATASETS)


def run(options: Options) -> Answer:
    """Load and check every clip, and print a summary."""
    found = options.open()
    lengths = np.array([len(joints) for joints in found.joints])
    counts = {action: lengths[found.labels == label] for label, action in enumerate(found.actions)}
    lines = [
        (
            f"{found.name}: {len(found)} clips, {lengths.sum()} frames at {found.fps:g} "
            f"fps, {len(set(found.subjects))} subjects"
        ),
        f"skeleton: {found.skeleton.name}, {len(found.skeleton.parents)} joints",
        f"frames per clip: {lengths.min()} to {lengths.max()}, median "
        f"{np.median(lengths):g}; {int((lengths < found.length).sum())} shorter than "
        f"{found.length} (they hold their last pose)",
        *(
            []
            if found.trajectory
            else ["no trajectory: the roots do not travel (decoders lie and plain only)"]
        ),
        *found.notes,
        f"sha256: {found.sha256}",
        *(
            f"  {label:>2} {action:<20} {len(clips):>5} clips {clips.sum():>7} frames"
            for label, (action, clips) in enumerate(counts.items())
        ),
    ]
    facts = {
        "dataset": found.name,
        "clips": len(found),
        "frames": int(lengths.sum()),
        "fps": float(found.fps),
        "sha256": found.sha256,
        "subjects": sorted(set(found.subjects)),
        "skeleton": found.skeleton.name,
        "joints": len(found.skeleton.parents),
        "trajectory": found.trajectory,
        "remarks": list(found.notes),
        "actions": {
            action: {"clips": len(clips), "frames": int(clips.sum())}
            for action, clips in counts.items()
        },
    }
    return Answer(text="\n".join(lines), facts=facts)
