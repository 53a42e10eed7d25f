"""Custom actions: a folder (or zip) of motion files, such as BVH, with one subfolder per action."""

from __future__ import annotations

import dataclasses
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from a2v.errors import InputError
from a2v.formats.bvh import read_bvh
from a2v.formats.registry import read_motion, readable_suffixes
from a2v.kinematics import SKELETONS, Skeleton, skeleton_from_parents
from a2v.kinematics.names import canonical_joints
from a2v.lab.datasets.base import ActionDataset, Clip
from a2v.lab.datasets.files import FileSource, check_joints
from a2v.types import Motion, Progress

SUFFIXES: frozenset[str] = frozenset(readable_suffixes()) - {".txt", ".json"}
"""Suffixes of the files that are clips; texts may be notes about them."""


@dataclass(frozen=True)
class BVHFolderSettings:
    """Settings of a data set from a folder of BVH files.

    Attributes
    ----------
    fps : float
        Every clip is resampled to this rate, frames per second.
    frames : int
        Length of the windows for training and evaluation; shorter clips hold their last pose.
    units : str
        Unit of the files: meters, centimeters, millimeters, inches or feet; "" guesses from the
        person's height in the first file.
    up : str
        The files' upward axis: x, y, z, -x, -y or -z; "" guesses from the first file.
    """

    fps: float = 20.0
    frames: int = 60
    units: str = ""
    up: str = ""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.fps) and 1 <= self.fps <= 240):
            raise InputError(f"fps is {self.fps}; expected 1 to 240")
        if not 2 <= self.frames <= 10_000:
            raise InputError(f"frames is {self.frames}; expected 2 to 10000")


def load_bvh_folder(
    path: str | Path, settings: BVHFolderSettings | None = None, *, progress: Progress | None = None
) -> ActionDataset:
    """Load ``ACTION/*.bvh`` or ``ACTION/SUBJECT/*.bvh`` below a folder or inside a zip archive.

    Other kinds of motions (`a2v.formats.read_motion`) are loaded in the same way.

    Joints come from the files' own forward kinematics, in meters, y up. The skeleton is the first
    file's, with its rest offsets as rest directions, and every other file must have the same
    joints; bone lengths may differ. Units and the upward axis of BVH are decided once, on the first
    file. The subject of a clip is the folder between the action's and the clip, else the part of
    its name in front of the first underscore (as in CMU), else "unknown".

    Parameters
    ----------
    path : path
    settings : BVHFolderSettings
    progress : Progress
        Called after each file.

    Raises
    ------
    InputError
        No such files, a file that cannot be used or that has another skeleton; the message names
        the file, and the line if known.
    """
    settings = settings or BVHFolderSettings()
    source = FileSource(Path(path))
    names = _clips(source)
    actions = tuple(sorted({action for action, _, _ in names.values()}))
    clips = []
    first: tuple[str, Motion] | None = None
    units: str | float | None = settings.units or None
    up: str | None = settings.up or None
    for done, (name, (action, subject, clip)) in enumerate(names.items()):
        where = f"{source.path}/{name}"
        data = source.read(name)
        motion = (
            read_bvh(data, fps=settings.fps, units=units, up=up, action=action, name=where)
            if name.lower().endswith(".bvh")
            else _read_other(data, where, settings.fps, action)
        )
        if first is None:
            first = (where, motion)
            if name.lower().endswith(".bvh"):
                units, up = float(motion.provenance["scale"]), str(motion.provenance["up"])
        else:
            demand_same_joints(motion, where, first)
        joints = check_joints(motion.joints, len(motion.parents), where)
        clips.append(Clip(joints=joints, action=actions.index(action), name=clip, subject=subject))
        if progress is not None:
            progress(done + 1, len(names))
    assert first is not None
    return ActionDataset.from_clips(
        clips,
        name="bvh",
        skeleton=skeleton_of_file(first[1]),
        actions=actions,
        fps=settings.fps,
        length=settings.frames,
        notes=(
            f"units: {first[1].provenance.get('units', 'meters')}, up: "
            f"{up or first[1].provenance.get('up', 'y')}, as in {first[0]}",
        ),
    )


def _read_other(data: bytes, where: str, fps: float, action: str) -> Motion:
    """Read a motion that is not BVH from the bytes of its file."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / PurePosixPath(where).name
        copy.write_bytes(data)
        try:
            motion = read_motion(copy, fps=fps, action=action)
        except InputError as error:
            raise InputError(str(error).replace(str(copy), where)) from None
    if motion.batch:
        raise InputError(f"{where} holds several clips; write one to each file")
    return motion


def _clips(source: FileSource) -> dict[str, tuple[str, str, str]]:
    """Return action, subject and clip of each file by its name."""
    names = [name for name in source.names("") if PurePosixPath(name).suffix.lower() in SUFFIXES]
    if not names:
        raise InputError(
            f"{source.path} holds no .bvh or other motion files; expected one sub-folder an "
            "action with its clips inside"
        )
    inside = {name: PurePosixPath(name).parts for name in names}
    tops = {parts[0] for parts in inside.values()}
    if (
        source.path.is_file()
        and len(tops) == 1
        and all(len(parts) > 2 for parts in inside.values())
    ):
        inside = {
            name: parts[1:] for name, parts in inside.items()
        }  # archives often have a single top folder
    clips = {}
    for name, parts in inside.items():
        if len(parts) < 2:
            raise InputError(
                f"{source.path}/{name} is not in the folder of an action; move it to "
                f"{source.path}/ACTION/{parts[-1]}"
            )
        stem = PurePosixPath(parts[-1]).stem
        subject = (
            parts[-2] if len(parts) > 2 else stem.partition("_")[0] if "_" in stem else "unknown"
        )
        clips[name] = (parts[0], subject, "/".join((*parts[:-1], stem)))
    return clips


def demand_same_joints(motion: Motion, where: str, first: tuple[str, Motion]) -> None:
    """Check that a file of a set has the joints of the `first` one (its name and motion).

    Raises
    ------
    InputError
        It has others.
    """
    wanted, found = first[1], motion
    if found.joint_names == wanted.joint_names and np.array_equal(found.parents, wanted.parents):
        return
    missing = [name for name in wanted.joint_names if name not in found.joint_names]
    extra = [name for name in found.joint_names if name not in wanted.joint_names]
    what = (
        f"has no joint '{missing[0]}'"
        if missing
        else f"has a joint '{extra[0]}' more"
        if extra
        else "joins its joints differently"
    )
    raise InputError(
        f"{where} {what}: its skeleton is not that of {first[0]}; a data set needs one skeleton, "
        "retarget the file or remove it"
    )


def skeleton_of_file(motion: Motion) -> Skeleton:
    """Return the known skeleton of that name, or a new one with the rest pose of the file."""
    if motion.skeleton in SKELETONS:
        return SKELETONS[motion.skeleton]
    skeleton = skeleton_from_parents(
        motion.parents.tolist(), motion.joint_names, motion.rest_offsets, name=motion.skeleton
    )
    found = canonical_joints(motion.joint_names, motion.parents.tolist())

    def known(names: Sequence[str]) -> tuple[int, ...]:
        return tuple(found[name] for name in names if name in found)

    return dataclasses.replace(
        skeleton,
        feet=known(["left_ankle", "left_foot", "right_ankle", "right_foot"]),
        hips=(found["left_hip"], found["right_hip"]),
        shoulders=(found["left_shoulder"], found["right_shoulder"]),
    )
