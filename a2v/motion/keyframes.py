"""Read keyframes and held joints from files and words (docs/motion.md)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.formats import read_motion
from a2v.io import brief, read_bytes
from a2v.kinematics import Skeleton, bone_vectors
from a2v.kinematics.ground import heading, yaw_to_rotmat
from a2v.motion.applications import on_skeleton
from a2v.motion.direction import Hold, Keyframe
from a2v.motion.model import MotionModel
from a2v.motion.placement import leg_length
from a2v.plain_yaml import parse_yaml
from a2v.types import FloatArray

MAX_BYTES = 1 << 18
MAX_POSES = 200
"""Largest number of keyframes in a file."""

_ENTRIES = {
    "pose": {"time", "frame", "file", "pose", "at", "heading"},
    "place": {"time", "frame", "at", "heading"},
    "hold": {"joint", "at", "body", "from", "to"},
}
_NUMBER = r"[-+]?\d*\.?\d+"
_POSES = re.compile(
    r"(?P<file>.+?)(#(?P<first>\d{1,7})(-(?P<last>\d{1,7}))?)?", re.ASCII | re.DOTALL
)
_HELD = re.compile(
    rf"(?P<joint>\w+)\s+(?P<body>body\s+)?(?P<at>{_NUMBER},{_NUMBER},{_NUMBER})\s+from\s+(?P<start>{_NUMBER})\s+to\s+(?P<end>{_NUMBER})(\s*s)?",
    re.ASCII,
)


def read_keyframes(
    source: str | Path, model: MotionModel, *, fps: float
) -> tuple[list[Keyframe], list[Hold]]:
    """Read the keyframes and held joints of a YAML file, for a result of `fps` frames per second.

    The file is a list. ``{time: 2, file: x.bvh, pose: 12}`` is a pose of a motion file, at its own
    position, or moved to ``at: [x, z]`` and to a ``heading`` in degrees. ``{time: 2, at: [x, z],
    heading: 90}`` is a place, a heading, or both. ``{joint: left_wrist, at: [x, y, z], from: 1, to:
    2}`` is a joint held at a place, or at ``body: [left, up, ahead]`` relative to the root.
    ``frame`` may replace ``time``. Paths of files are relative to this file.

    Raises
    ------
    InputError
        The file, or one that it names, cannot be read, or an entry is unknown or of the wrong kind.
    """
    data = read_bytes(source, limit=MAX_BYTES)
    expected = "a YAML list of entries such as {time: 2, file: walk.npz, pose: 12}"
    content = parse_yaml(data, source, "list of keyframes", expected)
    if not isinstance(content, list) or not 1 <= len(content) <= MAX_POSES:
        raise InputError(
            f"{source} is not a list of keyframes (no list of 1 to {MAX_POSES} entries); expected "
            f"{expected}"
        )
    keys: list[Keyframe] = []
    holds: list[Hold] = []
    for number, entry in enumerate(content, 1):
        where = f"entry {number} of {source}"
        kind = _kind(entry, where)
        if kind == "hold":
            place = "body" if "body" in entry else "at"
            at = _vector(entry.get(place), 3, f"{place} of {where}")
            start, end = (_number(entry.get(name), f"{name} of {where}") for name in ("from", "to"))
            holds.append(
                Hold(
                    joint=str(entry["joint"]),
                    start=start,
                    end=end,
                    at=(at[0], at[1], at[2]),
                    body=place == "body",
                )
            )
            continue
        time = (
            _number(entry["time"], f"time of {where}")
            if "time" in entry
            else _number(entry.get("frame"), f"frame of {where}") / fps
        )
        to = _vector(entry["at"], 2, f"at of {where}") if "at" in entry else None
        turn = (
            np.radians(_number(entry["heading"], f"heading of {where}"))
            if "heading" in entry
            else None
        )
        key = Keyframe(time=_checked(time), at=None if to is None else (to[0], to[1]), heading=turn)
        if kind == "pose":
            file = Path(source).parent / str(entry["file"])
            pose = str(entry.get("pose", 0))
            if not pose.isdecimal():
                raise InputError(
                    f"pose of {where} is {brief(pose)} and names no pose; count from 0"
                )
            key = placed(read_poses(f"{file}#{pose}", model)[0][1], key, model.skeleton)
        keys.append(key)
    return keys, holds


def read_poses(text: str, model: MotionModel) -> list[tuple[float, FloatArray]]:
    """Read poses (J, 3) on the model's skeleton, and their times in seconds from the first.

    `text` is "FILE" (the first pose), "FILE#12" (one pose) or "FILE#8-15"; FILE may be "FILE#CLIP",
    as in "dance.glb#Spin#12". The lowest joint of the clip is the ground. Bones are the model's;
    the root is lower if its legs are shorter.

    Raises
    ------
    InputError
        The file cannot be read, or has no such poses.
    """
    found = _POSES.fullmatch(text)
    if found is None:
        raise InputError(f"{brief(text)} names no pose; expected FILE, FILE#12 or FILE#8-15")
    file, first = found["file"], int(found["first"] or 0)
    last = int(found["last"] or first)
    motion = read_motion(file)
    motion = motion[(0,) * len(motion.batch)] if motion.batch else motion
    if not first <= last < min(motion.frames, first + MAX_POSES):
        raise InputError(
            f"{file} has poses 0 to {motion.frames - 1}; {first} to {last} is outside of this "
            f"range, or has more than {MAX_POSES} poses"
        )
    skeleton, own = model.skeleton, model.bone_lengths * model.card.meters_per_unit
    joints = on_skeleton(motion, skeleton, own).astype(np.float64)
    joints[..., 1] -= joints[..., 1].min()
    vectors = bone_vectors(joints, skeleton)
    size = np.linalg.norm(vectors, axis=-1)
    smaller = float(leg_length(own, skeleton) / leg_length(np.median(size, axis=0), skeleton))
    bones = vectors / np.maximum(size, 1e-9)[..., None] * own[:, None]
    root = joints[:, 0] * (1, smaller, 1)
    poses = (
        np.einsum("jb,tbx->tjx", skeleton.path_matrix, bones)[first : last + 1]
        + root[first : last + 1, None]
    )
    return [((number - first) / motion.fps, pose) for number, pose in enumerate(poses, first)]


def placed(pose: FloatArray, key: Keyframe, skeleton: Skeleton) -> Keyframe:
    """A keyframe with a pose (J, 3), turned and moved to the place of `key`."""
    joints = pose
    if key.heading is not None:
        turned = yaw_to_rotmat(np.array(key.heading - float(heading(pose, skeleton))))
        joints = (pose - pose[0]) @ turned.T + pose[0]
    if key.at is not None:
        joints = joints - joints[0] * (1, 0, 1) + (key.at[0], 0, key.at[1])
    return Keyframe(time=key.time, joints=joints)


def read_holds(text: str) -> list[Hold]:
    """Parse held joints from "left_wrist 0.3,1.4,0.4 from 1 to 2; head body 0,0.6,0.1 from 0 to 3":
    meters, seconds.

    Raises
    ------
    InputError
        A part is of another form.
    """
    holds = []
    for part in filter(None, (part.strip() for part in text.split(";"))):
        found = _HELD.fullmatch(part)
        if found is None:
            raise InputError(
                f"{brief(part)} holds no joint; expected JOINT x,y,z from SECONDS to SECONDS, or "
                "JOINT body x,y,z from ..."
            )
        x, y, z = (float(number) for number in found["at"].split(","))
        holds.append(
            Hold(
                joint=found["joint"],
                start=float(found["start"]),
                end=float(found["end"]),
                at=(x, y, z),
                body=bool(found["body"]),
            )
        )
    return holds


def _kind(entry: object, where: str) -> str:
    if not isinstance(entry, dict):
        raise InputError(f"{where} is {brief(entry)}; expected names and values, such as time: 2")
    kind = "hold" if "joint" in entry else "pose" if "file" in entry else "place"
    known = _ENTRIES[kind]
    if unknown := [name for name in entry if name not in known]:
        raise InputError(
            f"{where} has the unknown entry {brief(unknown[0])}; expected "
            f"{', '.join(sorted(known))}"
        )
    if kind == "place" and not {"at", "heading"} & set(entry):
        raise InputError(f"{where} is empty; expected a file, a place (at), a heading or a joint")
    return kind


def _number(value: object, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise InputError(f"{what} is {brief(value)}; expected a number")
    return float(value)


def _vector(value: object, size: int, what: str) -> list[float]:
    if not isinstance(value, list) or len(value) != size:
        raise InputError(f"{what} is {brief(value)}; expected {size} numbers, meters")
    return [_number(part, what) for part in value]


def _checked(time: float) -> float:
    if time < 0:
        raise InputError(f"a keyframe is at {time:g} s; expected a time of at least 0")
    return time
