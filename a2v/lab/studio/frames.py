"""Poses from every frame of the recorded motions, for people of any proportions."""

from __future__ import annotations

import os

import numpy as np

from a2v.errors import InputError
from a2v.lab.datasets.base import ActionDataset
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.posing import (
    POSED_BONES,
    Pose,
    avatar_body,
    curled_fingers,
    local_rotations,
    without_heading,
)


class MotionFrames:
    """All frames of the clips of CMU and HumanAct12 as poses.

    Parameters
    ----------
    data : path
        Folder that holds ``cmu_mocap.zip`` and ``humanact12.zip``; one of them suffices.

    Raises
    ------
    InputError
        Neither data set exists.
    """

    def __init__(self, data: str | os.PathLike[str]) -> None:
        """See the class."""
        from a2v.lab.datasets import load_dataset

        self._sets: list[ActionDataset] = []
        problems: list[str] = []
        for name in ("cmu", "humanact12"):
            try:
                self._sets.append(load_dataset(name, str(data)))
            except InputError as error:
                problems.append(str(error))
        if not self._sets:
            raise InputError(f"no recorded motions for action poses: {'; '.join(problems)}")
        self._lengths = [np.array([len(joints) for joints in found.joints]) for found in self._sets]

    @property
    def count(self) -> int:
        """Total number of frames."""
        return int(sum(lengths.sum() for lengths in self._lengths))

    def draw(self, avatar: Avatar, generator: np.random.Generator) -> tuple[Pose, str]:
        """Draw a frame on the avatar's rig; returns its pose and action.

        Both data sets are equally likely, and all frames of one are. Hands are between open and a
        fist.
        """
        from a2v.animation.life import STILL
        from a2v.animation.retarget import RetargetSettings, retarget

        chosen = int(generator.integers(len(self._sets)))
        found, ends = self._sets[chosen], np.cumsum(self._lengths[chosen])
        place = int(generator.integers(ends[-1]))
        clip = int(np.searchsorted(ends, place, side="right"))
        motion = found.motion(clip)
        transforms = retarget(
            motion, avatar_body(avatar), settings=RetargetSettings(raw=True, life=STILL)
        )
        local = local_rotations(avatar, transforms[[place - int(ends[clip]) + motion.frames]])[0]
        pose = {name: local[avatar.bone_names.index(name)] for name in POSED_BONES}
        pose["Hips"] = without_heading(
            pose["Hips"]
        )  # a person's heading is drawn separately for every photograph
        return pose | curled_fingers(generator), motion.action
