"""The papers' CMU MoCap set: 1,088 clips of 8 actions, 20 joints at 12 Hz, from the published
files."""

from __future__ import annotations

import csv
import io
from pathlib import Path, PurePosixPath

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import CMU
from a2v.lab.datasets.base import ActionDataset, Clip, NativeFrame
from a2v.lab.datasets.files import check_joints, find_source

FILE_UNITS = 20.0
"""The papers divide the files' positions by this."""

FRAME = NativeFrame(meters_per_unit=FILE_UNITS * 0.0254 / 0.45)
"""CMU's unit is an inch over 0.45 (a note of the database on its ASF files), so one native unit is
1.129 m."""

FPS = 12.0

ACTIONS = ("Walk", "Wash", "Run", "Jump", "Animal Behavior", "Dance", "Step", "Climb")
"""Actions in the order of the authors' classifier and of first appearance by frequency; checked on
load."""


def load_cmu(path: str | Path) -> ActionDataset:
    """Load the CMU set from ``cmu_mocap.zip``, its folder (``pose_clip.csv`` and
    ``mocap_3djoints``), or a folder that holds the zip.

    Raises
    ------
    InputError
        The list or a clip is missing or damaged; the message names the file.
    """
    source = find_source(path, archive="cmu_mocap.zip", marker="pose_clip.csv")
    list_name = source.names("pose_clip.csv")[0]
    try:
        rows = list(csv.DictReader(io.StringIO(source.read(list_name).decode("utf-8"))))
    except UnicodeDecodeError:
        raise InputError(f"{source.path}/{list_name} is not UTF-8 text") from None
    if not rows or not {"motion", "action_type"} <= set(rows[0]):
        raise InputError(f"{source.path}/{list_name}: expected the columns motion and action_type")
    files = {PurePosixPath(name).stem: name for name in source.names(".npy")}
    clips = []
    for line, row in enumerate(rows, start=2):
        motion, action = (row["motion"] or "").strip(), (row["action_type"] or "").strip()
        if not motion and not action:
            continue
        if action not in ACTIONS:
            raise InputError(
                f"{source.path}/{list_name}, line {line}: unknown action '{action}'; expected one "
                f"of {', '.join(ACTIONS)}"
            )
        if motion not in files:
            raise InputError(
                f"{source.path}/{list_name}, line {line}: clip {motion}.npy is missing"
            )
        array = check_joints(
            source.read_npy(files[motion]), CMU.n_joints, f"{source.path}/{files[motion]}"
        )
        joints = array / np.float32(FILE_UNITS)
        clips.append(
            Clip(
                joints=joints,
                action=ACTIONS.index(action),
                name=motion,
                subject=motion.split("_")[0],
            )
        )
    return ActionDataset.from_clips(
        clips, name="cmu", skeleton=CMU, actions=ACTIONS, fps=FPS, length=100, frame=FRAME
    )
