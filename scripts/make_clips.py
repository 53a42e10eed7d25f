"""Makes ``a2v/weights/clips.npz``, the library of hand-keyed clips, from the BVH files of
``clips_cc0.zip``.

    python scripts/make_clips.py [../shared/data/clips_cc0.zip]

and from the gestures of our own in ``scripts/gestures.py``.

``a2v/motion/clips.csv`` lists the clips and how they are played. The people of the two libraries
differ by a centimeter in the length of the legs: all clips get the legs of the first library.
Joints are kept to a fifth of a millimeter, as differences from frame to frame. A joint
``head_front`` is added in front of the face, since joints alone do not give the direction in which
a head looks. Clips that walk on the spot get the pace at which their feet would stand: the median
of what the lower foot moves backwards while it is down. The last frame of a cycle that repeats the
first is left out.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from gestures import FPS, GESTURES, Puppet

from a2v.formats.bvh import read_bvh
from a2v.io import write_npz
from a2v.kinematics import skeleton_from_parents
from a2v.kinematics.orientations import bone_rotmats
from a2v.kinematics.transforms import on_lengths
from a2v.motion.clips import LIBRARY, STEP, TABLE
from a2v.types import Motion

ROOT = Path(__file__).resolve().parent.parent
FRONT = np.array([0.0, 0.04, 0.12])
"""The marker in front of the face, from the head's joint at rest, meters."""
DOWN = 0.02
"""Height of a foot's ball above its lowest place below which it is in contact, meters."""
REPEATS = 0.5
"""The last frame repeats the first one if their difference is below this share of the difference of
two successive frames.
"""


def with_front(motion: Motion) -> Motion:
    """The clip with the joint ``head_front`` after ``head_end``."""
    head, end = motion.joint_names.index("head"), motion.joint_names.index("head_end")
    front = motion.joints[:, head] + bone_rotmats(motion)[:, end] @ FRONT
    at = end + 1
    parents = motion.parents + (motion.parents >= at)
    return dataclasses.replace(
        motion,
        joints=np.insert(motion.joints, at, front, axis=1).astype(np.float32),
        rotations=np.insert(motion.rotations, at, 0, axis=1),
        parents=np.insert(parents, at, head),
        joint_names=(*motion.joint_names[:at], "head_front", *motion.joint_names[at:]),
        rest_offsets=np.insert(motion.rest_offsets, at, FRONT, axis=0),
    )


def pace_of(motion: Motion, travels: str) -> float:
    """Return the speed at which the clip moves ahead, meters per second."""
    if not travels:
        return 0.0
    if travels not in ("feet", "body"):
        return float(travels)
    ends = ("ball_l", "ball_r") if travels == "feet" else ("hand_l", "hand_r")
    points = motion.joints[:, [motion.joint_names.index(name) for name in ends]].astype(np.float64)
    back = -np.gradient(points[..., 2], axis=0) * motion.fps
    height = points[..., 1] - points[..., 1].min(axis=0)
    down = (height < DOWN) & (back > 0)
    return float(np.median(back[down]))


def leg_length(lengths: np.ndarray, names: Sequence[str]) -> float:
    """Return the length of thigh and shin, from the lengths (J,) of the bones that end at the
    joints `names`."""
    return float(lengths[names.index("calf_l")] + lengths[names.index("foot_l")])


def as_cycle(joints: np.ndarray) -> np.ndarray:
    """Return the frames (T, J, 3) of a cycle without a last one that repeats the first."""
    step = np.median(np.abs(np.diff(joints, axis=0)).max(axis=(1, 2)))
    return (
        joints[:-1] if np.abs(joints[-1] - joints[0]).max() <= REPEATS * max(step, 1e-4) else joints
    )


def main() -> None:
    """Write the library; print one line per clip."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "archive", nargs="?", default=str(ROOT.parent / "shared" / "data" / "clips_cc0.zip")
    )
    archive = zipfile.ZipFile(parser.parse_args().archive)
    read = {
        name: with_front(read_bvh(archive.read(f"{name}.bvh"), name=name))
        for name in ("idle-loop", "reject", "punch-jab")
    }
    first = read["idle-loop"]
    skeleton = skeleton_from_parents(first.parents.tolist(), first.joint_names, first.rest_offsets)
    lengths = np.linalg.norm(first.rest_offsets, axis=-1)
    open_hand = read["reject"].joints[read["reject"].frames // 2].astype(np.float64)
    puppet = Puppet(
        skeleton,
        first.joints[0].astype(np.float64),
        {"open": open_hand, "fist": read["punch-jab"].joints[0].astype(np.float64)},
    )
    with TABLE.open(newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    missing = {*(Path(name).stem for name in archive.namelist()), *GESTURES} ^ {
        row["file"] for row in rows
    }
    if missing:
        raise SystemExit(f"{TABLE.name} and the archive differ in {', '.join(sorted(missing))}")
    clips, facts = [], []
    for row in rows:
        if row["file"] in GESTURES:
            joints, fps, pace = (
                on_lengths(puppet.play(GESTURES[row["file"]][0]), skeleton, lengths),
                FPS,
                0.0,
            )
        else:
            motion = with_front(read_bvh(archive.read(row["file"] + ".bvh"), name=row["file"]))
            assert motion.joint_names == first.joint_names
            scale = leg_length(lengths, motion.joint_names) / leg_length(
                np.linalg.norm(motion.rest_offsets, axis=-1), motion.joint_names
            )
            joints, fps, pace = (
                on_lengths(motion.joints * scale, skeleton, lengths),
                motion.fps,
                scale * pace_of(motion, row["travels"]),
            )
        joints = joints if row["plays"] == "once" else as_cycle(joints)
        clips.append(np.round(joints / STEP).astype(np.int16))
        facts.append((fps, pace))
        print(
            f"{row['name']:28s} {len(joints):4d} frames at {motion.fps:g} fps, {facts[-1][1]:.2f} "
            "m/s"
        )
    steps = [np.diff(clip, axis=0, prepend=np.zeros_like(clip[:1])) for clip in clips]
    write_npz(
        LIBRARY,
        {
            "files": np.array([row["file"] for row in rows]),
            "frames": np.array([len(clip) for clip in clips]),
            "fps": np.array([fps for fps, _ in facts]),
            "pace": np.array([pace for _, pace in facts]),
            "steps": np.ascontiguousarray(np.concatenate(steps).transpose(1, 2, 0)),
            "parents": first.parents,
            "joint_names": np.array(first.joint_names),
            "rest_offsets": first.rest_offsets,
            "licence": np.array(
                "CC0-1.0; by Quaternius (Universal Animation Library), Mesh2Motion and a2v"
            ),
        },
        compress=True,
    )
    print(f"{LIBRARY}: {LIBRARY.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
