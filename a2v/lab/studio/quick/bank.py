"""The bank of poses: frames of every recorded clip on the avatars' rig, grouped into kinds, so that
rare poses can be drawn as often as common ones."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import rotvec_to_rotmat
from a2v.lab.studio.avatar_files import list_avatars, load_avatar
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.posing import POSED_BONES, Pose, avatar_body, local_rotations, without_heading
from a2v.lab.studio.variation import SPLITS
from a2v.record import Record
from a2v.types import FloatArray, IntArray, Progress

SETS = ("cmu", "humanact12")
KINDS = 500
"""Number of kinds of the poses of a data set and split."""
HELD_OUT = 9
"""Clips whose number ends in this digit belong to the validation split."""
_TOLD_BY = (
    "Head",
    *(
        f"{side}{bone}"
        for side in ("Left", "Right")
        for bone in ("ForeArm", "Hand", "UpLeg", "Leg", "Foot")
    ),
)
"""Bones whose heads distinguish poses."""


@dataclass(frozen=True, kw_only=True)
class PoseBank(Record):
    """Poses of recorded frames, without heading.

    Attributes
    ----------
    rotations : (P, 22, 3) float16
        Rotation vectors of `POSED_BONES`, radians, as `Avatar.bone_transforms` takes them.
    sets : (P,) int8
        Index into `SETS`.
    splits : (P,) int8
        Index into `SPLITS`.
    kinds : (P,) int16
        Kind of a pose, one of at most `KINDS` of its set and split.
    """

    rotations: FloatArray
    sets: IntArray
    splits: IntArray
    kinds: IntArray

    def __post_init__(self) -> None:
        sizes: dict[str, int] = {}
        for name, shape in {
            "rotations": ("P", len(POSED_BONES), 3),
            "sets": ("P",),
            "splits": ("P",),
            "kinds": ("P",),
        }.items():
            self._check(name, shape, sizes)

    @cached_property
    def _members(self) -> dict[tuple[int, int], list[IntArray]]:
        """Indices of the poses of each kind, by split and set."""
        found: dict[tuple[int, int], list[IntArray]] = {}
        for split in range(len(SPLITS)):
            for number in range(len(SETS)):
                own = np.flatnonzero((self.splits == split) & (self.sets == number))
                if len(own):
                    own = own[np.argsort(self.kinds[own], kind="stable")]
                    found[split, number] = np.split(
                        own, np.flatnonzero(np.diff(self.kinds[own])) + 1
                    )
        return found

    def draw(self, split: str, generator: np.random.Generator, common: float) -> Pose:
        """Draw a pose of a split: with probability `common` uniformly over frames, else uniformly
        over kinds.

        Raises
        ------
        InputError
            The bank has no pose of the split.
        """
        number = int(generator.random() < 0.4)  # CMU has more variety
        there = [at for of, at in self._members if of == SPLITS.index(split)]
        if not there:
            raise InputError(
                f"the bank has no poses of the split '{split}'; make it again from more clips"
            )
        kinds = self._members[SPLITS.index(split), number if number in there else there[0]]
        if generator.random() < common:
            starts = np.cumsum([len(own) for own in kinds])
            place = int(generator.integers(starts[-1]))
            kind = int(np.searchsorted(starts, place, side="right"))
            chosen = kinds[kind][place - int(starts[kind])]
        else:
            own = kinds[int(generator.integers(len(kinds)))]
            chosen = own[int(generator.integers(len(own)))]
        return {
            name: self.rotations[chosen, index].astype(np.float64)
            for index, name in enumerate(POSED_BONES)
        }


def make_pose_bank(
    avatar: Avatar,
    data: str | os.PathLike[str],
    *,
    step: int = 2,
    clips: int | None = None,
    progress: Progress | None = None,
) -> PoseBank:
    """Make the bank of all clips of CMU and HumanAct12.

    Parameters
    ----------
    avatar : Avatar
        The poses are made for its proportions; all avatars share the rig.
    data : path
        Folder that holds ``cmu_mocap.zip`` and ``humanact12.zip``; one of them suffices.
    step : int
        Every `step`-th frame is taken.
    clips : int, optional
        Number of first clips of each set; default: all.
    progress : Progress, optional
        Counts clips.

    Raises
    ------
    InputError
        Neither data set exists.
    """
    from a2v.animation.life import STILL
    from a2v.animation.retarget import RetargetSettings, retarget
    from a2v.lab.datasets import load_dataset

    found, problems = {}, []
    for number, name in enumerate(SETS):
        try:
            found[number] = load_dataset(name, str(data))
        except InputError as error:
            problems.append(str(error))
    if not found:
        raise InputError(f"no recorded motions for the bank of poses: {'; '.join(problems)}")
    body, slots = avatar_body(avatar), [avatar.bone_names.index(name) for name in POSED_BONES]
    todo = [
        (number, clip)
        for number, own in found.items()
        for clip in range(min(len(own.joints), clips or len(own.joints)))
    ]
    rotations: list[FloatArray] = []
    for done, (number, clip) in enumerate(todo, 1):
        transforms = retarget(
            found[number].motion(clip), body, settings=RetargetSettings(raw=True, life=STILL)
        )[::step]
        local = local_rotations(avatar, transforms)[:, slots]
        local[:, 0] = np.stack([without_heading(rotvec) for rotvec in local[:, 0]])
        rotations.append(local.astype(np.float16))
        if progress:
            progress(done, len(todo))
    lengths = [len(own) for own in rotations]
    sets = np.repeat([number for number, _ in todo], lengths).astype(np.int8)
    splits = np.repeat([clip % 10 == HELD_OUT for _, clip in todo], lengths).astype(np.int8)
    together = np.concatenate(rotations)
    return PoseBank(
        rotations=together,
        sets=sets,
        splits=splits,
        kinds=sort_poses(avatar, together, 2 * sets + splits),
    )


def open_bank(
    folder: str | os.PathLike[str], data: str | os.PathLike[str], progress: Progress | None = None
) -> PoseBank:
    """Open the bank of a folder, ``bank.npz``; the first call makes it, in ten minutes.

    Parameters
    ----------
    folder : path
        Folder of the views.
    data : path
        Folder with ``avatars/`` and the motion data.
    progress
        See `make_pose_bank`.

    Raises
    ------
    InputError
        No avatars or motions.
    """
    path = Path(folder) / "bank.npz"
    if not path.exists():
        make_pose_bank(
            load_avatar(list_avatars(Path(data) / "avatars")[0]), data, progress=progress
        ).save(path)
    return PoseBank.load(path)


def sort_poses(avatar: Avatar, rotations: FloatArray, groups: IntArray) -> IntArray:
    """Return the kinds (P,) int16 of poses (P, 22, 3) in each of their `groups` (P,).

    A kind is the nearest of `KINDS` poses that are far from each other. These are chosen greedily,
    each as far as possible from the earlier ones (Gonzalez 1985), by the positions of `_TOLD_BY`
    relative to the hips.
    """
    kinds = np.zeros(len(rotations), np.int16)
    for group in np.unique(groups):
        own = np.flatnonzero(groups == group)
        told = np.concatenate(
            [
                joint_places(avatar, part)
                for part in np.array_split(rotations[own], -(-len(own) // 8192))
            ]
        )
        nearest, last = np.full(len(own), np.inf, np.float32), 0
        for kind in range(min(KINDS, len(own))):
            distance = ((told - told[last]) ** 2).sum(axis=1)
            closer = distance < nearest
            nearest[closer], kinds[own[closer]] = distance[closer], kind
            last = int(nearest.argmax())
    return kinds


def joint_places(avatar: Avatar, rotations: FloatArray) -> FloatArray:
    """Return the positions of the heads of `_TOLD_BY` in poses (P, 22, 3), meters from the middle
    of the hips; (P, 33) float32."""
    numbers = [avatar.bone_names.index(name) for name in POSED_BONES]
    rest = avatar.rest_transforms[:, :3, 3].astype(np.float64)
    turns = np.asarray(rotvec_to_rotmat(rotations.astype(np.float64)))
    world: dict[int, FloatArray] = {}
    heads: dict[int, FloatArray] = {}
    for slot, bone in enumerate(numbers):
        parent = int(avatar.bone_parents[bone])
        while parent >= 0 and parent not in world:  # a bone that is not posed moves with its parent
            parent = int(avatar.bone_parents[parent])
        if parent < 0:
            world[bone], heads[bone] = (
                turns[:, slot],
                np.repeat(rest[None, bone], len(rotations), axis=0),
            )
        else:
            world[bone] = world[parent] @ turns[:, slot]
            heads[bone] = heads[parent] + world[parent] @ (rest[bone] - rest[parent])
    told = np.stack([heads[avatar.bone_names.index(name)] for name in _TOLD_BY], axis=1)
    hips = (told[:, _TOLD_BY.index("LeftUpLeg")] + told[:, _TOLD_BY.index("RightUpLeg")]) / 2
    return np.asarray((told - hips[:, None]).reshape(len(told), -1), np.float32)
