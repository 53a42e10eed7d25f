"""HumanAct12: 1,191 clips of 12 actions (34 fine-grained), 24 joints, from the published ``.npy``
files."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath
from typing import Literal

from a2v.errors import InputError
from a2v.kinematics import HUMANACT12
from a2v.lab.datasets.base import ActionDataset, Clip, NativeFrame
from a2v.lab.datasets.files import check_joints, find_source

COARSE = {
    "01": "warm_up", "02": "walk", "03": "run", "04": "jump", "05": "drink", "06": "lift_dumbbell", "07": "sit", "08": "eat",
    "09": "turn_steering_wheel", "10": "phone", "11": "boxing", "12": "throw",
}  # fmt: skip
"""Coarse action by the two digits after ``A`` in a file's name."""

FINE = {
    "0101": "warm_up_wristankle", "0102": "warm_up_pectoral", "0103": "warm_up_elbowback", "0104": "warm_up_bodylean_right_arm",
    "0105": "warm_up_bodylean_left_arm", "0106": "warm_up_bow_right", "0107": "warm_up_bow_left", "0201": "walk", "0301": "run",
    "0401": "jump_handsup", "0402": "jump_vertical", "0501": "drink_bottle_righthand", "0502": "drink_bottle_lefthand",
    "0503": "drink_cup_righthand", "0504": "drink_cup_lefthand", "0505": "drink_both_hands", "0601": "lift_dumbbell_righthand",
    "0602": "lift_dumbbell_lefthand", "0603": "lift_dumbbell_bothhands", "0604": "lift_dumbbell_overhead",
    "0605": "lift_dumbbell_bothhands_bend_legs", "0701": "sit", "0801": "eat_righthand", "0802": "eat_lefthand",
    "0803": "eat_pie_burger", "0901": "turn_steering_wheel", "1001": "phone_take_out_call_put_back", "1002": "phone_call_lefthand",
    "1101": "boxing_left_right", "1102": "boxing_left_upwards", "1103": "boxing_right_upwards", "1104": "boxing_right_left",
    "1201": "throw_right_hand", "1202": "throw_both_hands",
}  # fmt: skip
"""Fine-grained action by the four digits after ``A`` (first paper, Table 5)."""

FRAME = NativeFrame(meters_per_unit=1.0, signs=(1.0, -1.0, -1.0))
"""The published joints are in the camera's axes: x to the image's right, y down, z away from the
camera."""

FPS = 20.0
"""Frame rate. The publication gives none; gait and jump times in the clips fit 20 frames per
second."""

_NAME = re.compile(r"P(?P<subject>\d\d)G.*A(?P<code>\d\d\d\d)$")


def load_humanact12(
    path: str | Path, *, grain: Literal["coarse", "fine"] = "coarse"
) -> ActionDataset:
    """Load HumanAct12 from ``humanact12.zip``, its folder, or a folder that holds the zip.

    Parameters
    ----------
    path : path
    grain : "coarse" (12 actions) or "fine" (34)

    Raises
    ------
    InputError
        There are no clips, or a clip is damaged; the message names the file.
    """
    source = find_source(path, archive="humanact12.zip", marker=".npy")
    table = COARSE if grain == "coarse" else FINE
    codes = list(table)
    clips = []
    for name in source.names(".npy"):
        stem = PurePosixPath(name).stem
        match = _NAME.match(stem)
        if match is None or match["code"][: len(codes[0])] not in table:
            raise InputError(
                f"{source.path}/{name}: expected a name such as P01G01R01F0001T0064A0101.npy "
                "(action code after A)"
            )
        joints = FRAME.flip(
            check_joints(source.read_npy(name), HUMANACT12.n_joints, f"{source.path}/{name}")
        )
        clips.append(
            Clip(
                joints=joints,
                action=codes.index(match["code"][: len(codes[0])]),
                name=stem,
                subject=f"P{match['subject']}",
            )
        )
    return ActionDataset.from_clips(
        clips,
        name="humanact12" if grain == "coarse" else "humanact12-fine",
        skeleton=HUMANACT12,
        actions=tuple(table.values()),
        fps=FPS,
        length=60,
        frame=FRAME,
    )
