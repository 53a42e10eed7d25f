"""NTU-RGBD with poses re-estimated by VIBE: 13 actions, 18 joints, from pickles of the published
layout.

The annotations are no longer available for download. The loader is for users who have them, or have
run VIBE themselves.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import numpy as np

from a2v.errors import InputError
from a2v.formats.arrays_pickle import read_arrays_pickle
from a2v.kinematics import NTU_VIBE
from a2v.lab.datasets.base import ActionDataset, Clip, NativeFrame
from a2v.lab.datasets.files import FileSource, check_joints
from a2v.types import FloatArray

LIST_NAME = "ntu_vibe_list.txt"
"""List of the pickles, one path per line, relative to its own folder."""

ACTIONS = {
    6: "pickup", 7: "throw", 8: "sitting down", 9: "standing up", 22: "cheer up", 23: "hand waving", 24: "kicking something",
    38: "salute", 80: "squat down", 93: "shake fist", 99: "running on the spot", 100: "butt kicks", 102: "side kick",
}  # fmt: skip
"""NTU's action numbers in the papers, in the order of the labels."""

VIBE_JOINTS = 49
KEPT_JOINTS = (8, 1, 2, 3, 4, 5, 6, 7, 0, 9, 10, 11, 12, 13, 14, 21, 24, 38)
"""VIBE's joints in our skeleton's order: OpenPose's body with the middle of the hips first, the
heels, the top of the head."""

FRAME = NativeFrame(meters_per_unit=1.0, signs=(1.0, -1.0, -1.0))
"""VIBE's camera has y down and looks along +z."""

FPS = 30.0

_NAME = re.compile(r"(?:.*?P(?P<subject>\d{3}))?.*A(?P<action>\d{1,3})$")


def load_ntu_vibe(path: str | Path) -> ActionDataset:
    """Load the folder (or zip) that holds ``ntu_vibe_list.txt`` and the pickles it names.

    A pickle is what VIBE's demo writes: a dict by track number, of which the papers take track 1
    and its ``joints3d`` (T, 49, 3). Files without track 1 are skipped, as in the published loader,
    and counted in `notes`. The number after the last ``A`` of a name is the action, the one after
    ``P`` the subject.

    The poses are relative to the person: there is no trajectory.

    Raises
    ------
    InputError
        The list or a file is missing, damaged, refers to anything other than arrays, or does not
        hold (T, 49, 3) finite numbers in at least two frames; the message names the file, or the
        line of the
           list.
    """
    source = FileSource(Path(path))
    lists = source.names(LIST_NAME)
    if not lists:
        raise InputError(
            f"{source.path} holds no {LIST_NAME}; expected the folder of NTU-VIBE with this list "
            "and the pickles it names"
        )
    clips, without = [], []
    for entry in _read_list(source, lists[0]):
        joints = _read_joints(source, (PurePosixPath(lists[0]).parent / entry.path).as_posix())
        if joints is None:
            without.append(entry.path.name)
        else:
            clips.append(
                Clip(
                    joints=joints, action=entry.action, name=entry.path.stem, subject=entry.subject
                )
            )
    if not clips:
        raise InputError(
            f"{source.path}/{lists[0]} lists no clip with a track 1; expected paths of VIBE's "
            "pickles"
        )
    return ActionDataset.from_clips(
        clips,
        name="ntu_vibe",
        skeleton=NTU_VIBE,
        actions=tuple(ACTIONS.values()),
        fps=FPS,
        length=60,
        frame=FRAME,
        trajectory=False,
        notes=(f"{len(without)} files without a track 1 were passed over, such as {without[0]}",)
        if without
        else (),
    )


@dataclass(frozen=True)
class _Entry:
    """A line of the list: a pickle's path relative to the list's folder, the index of its action,
    and its subject."""

    path: PurePosixPath
    action: int
    subject: str


def _read_list(source: FileSource, name: str) -> Iterator[_Entry]:
    """Yield the entries of the list of that name in order, each checked when it is read."""
    try:
        lines = source.read(name).decode("utf-8").splitlines()
    except UnicodeDecodeError:
        raise InputError(f"{source.path}/{name} is not UTF-8 text") from None
    numbers = list(ACTIONS)
    for line, text in enumerate(lines, start=1):
        entry = PurePosixPath(text.strip().replace("\\", "/"))
        if not entry.name:
            continue
        here = f"{source.path}/{name}, line {line}"
        if entry.is_absolute() or ".." in entry.parts:
            raise InputError(
                f"{here}: '{entry}' points outside of the folder; expected a path below "
                f"{PurePosixPath(name).parent or '.'}"
            )
        match = _NAME.match(entry.stem)
        if match is None or int(match["action"]) not in ACTIONS:
            raise InputError(
                f"{here}: '{entry.name}' has no known action number after A; expected one of "
                f"{', '.join(map(str, numbers))}"
            )
        yield _Entry(
            entry,
            numbers.index(int(match["action"])),
            f"P{match['subject']}" if match["subject"] else "unknown",
        )


def _read_joints(source: FileSource, name: str) -> FloatArray | None:
    """Return joints (T, 18, 3) float32 of track 1 of a pickle, in the world's axes; None without a
    track 1."""
    where = f"{source.path}/{name}"
    tracks = read_arrays_pickle(source.read(name), where)
    if not isinstance(tracks, dict):
        raise InputError(f"{where} holds a {type(tracks).__name__}; expected VIBE's dict of tracks")
    track = tracks.get(1)
    if not isinstance(track, dict) or "joints3d" not in track:
        return None
    found = track["joints3d"]
    if not isinstance(found, np.ndarray):
        raise InputError(f"{where}: 'joints3d' of track 1 is not an array")
    return FRAME.flip(check_joints(found, VIBE_JOINTS, where)[:, list(KEPT_JOINTS)])
