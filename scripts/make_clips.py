"""Makes ``a2v/weights/clips.npz``, the library of hand-keyed clips, from the BVH files of
``clips_cc0.zip``.

    python scripts/make_clips.py [../shared/data/clips_cc0.zip]

and from the gestures of our own in ``scripts/gestures.py``.

``a2v/motion/clips.csv`` lists the clips and how they are played. The people of the two libraries
differ by a centimeter in the length of the legs: all clips get the legs of the first library.
Joints are kept to a fifth of a millimeter, as differences from frame to frame. A joint
``head_front`` is added in front of the face, since joints alone do not give the direction in which
a head looks. Clips that walk on the spot get the pace at which their feet would stand still: the median
of what the lower foot moves backwards while it is down. The last frame of a cycle that repeats the
first is left out.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import lzma
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from gestures import FPS, GESTURES, SIDES, Puppet
from more_clips import SecondLibrary, carried
from scipy.ndimage import gaussian_filter1d

from a2v.formats.bvh import read_bvh
from a2v.geometry.vectors import unit
from a2v.io import write_npz
from a2v.kinematics import rotvec_to_rotmat, skeleton_from_parents
from a2v.kinematics.limbs import bend_to
from a2v.kinematics.orientations import bone_rotmats
from a2v.kinematics.transforms import on_lengths
from a2v.motion.clips import LIBRARY, STEP, TABLE, clip_library
from a2v.types import Motion

ROOT = Path(__file__).resolve().parent.parent
FRONT = np.array([0.0, 0.04, 0.12])
"""The marker in front of the face, from the head's joint at rest, meters."""
DOWN = 0.02
"""Height of a foot's ball above its lowest place below which it is in contact, meters."""
STANDS = 0.6
"""Least height of the pelvis of a clip that stands, meters."""
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


STRIDES = {
    "jog-fwd-loop": 0.56, "sprint-loop": 0.82, "run-anime": 0.38,
}  # fmt: skip
"""Factors on the stride of cycles whose feet move faster than people run: 5.9, 8.2 and 9.9 m/s with
3, 3 and 4 steps a second."""


KICKS = {"swim-fwd-loop": (3, 17.0, 24.0)}
"""Kicks of each leg in a cycle, and half the swing of thigh and shin in degrees, of clips whose
legs are stiff."""

LEFT_OUT = {"crawl"}
"""Clips of the first archive that are not taken: its toes slide at 1.7 m/s; DeepMimic's is captured."""
WAYS = {"feet": (2, 1), "body": (2, 1), "back": (2, -1), "left": (0, 1), "right": (0, -1)}
"""Axis and sign of the way of cycles on the spot; "body" is carried by the hands."""


def pace_of(joints: np.ndarray, names: Sequence[str], fps: float, travels: str) -> np.ndarray:
    """Return the speed (2,) to the left and ahead at which the standing foot of a cycle on the spot
    would stand still, meters per second."""
    if travels not in WAYS:
        return np.array([0.0, float(travels or 0.0)])
    axis, sign = WAYS[travels]
    ends = ("hand_l", "hand_r") if travels == "body" else ("ball_l", "ball_r")
    points = joints[:, [names.index(name) for name in ends]].astype(np.float64)
    around = np.concatenate([points[-1:], points, points[:1]])
    speed = -(around[2:] - around[:-2]) / 2 * fps
    height = points[..., 1] - points[..., 1].min(axis=0)
    down = (height < DOWN) & (points[..., 1] <= points[..., 1].min(axis=1, keepdims=True))
    own = sign * speed[..., axis][down]
    along = sign * float(np.median(own[own > 0]))
    return np.array([along, 0.0] if axis == 0 else [0.0, along])


def standing(joints: np.ndarray, names: Sequence[str]) -> bool:
    """Return whether a clip stands on its feet throughout."""
    return bool(joints[:, names.index("pelvis"), 1].min() > STANDS)


def with_travel(
    joints: np.ndarray, names: Sequence[str], fps: float, travels: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return a cycle on the spot whose body moves within the cycle so that the standing foot stays
    in place at an even pace, and that pace (2,)."""
    axis, sign = WAYS[travels]
    points = joints[:, [names.index(name) for name in ("ball_l", "ball_r")]].astype(np.float64)
    around = np.concatenate([points[-1:], points, points[:1]])
    back = -(around[2:] - around[:-2])[..., axis] / 2 * fps
    low = points[..., 1].argmin(axis=1)
    frames = np.arange(len(joints))
    own = back[frames, low]
    down = (points[frames, low, 1] - points[..., 1].min() < DOWN) & (sign * own > 0)
    at = frames[down]
    count = len(joints)
    speed = np.interp(frames, np.concatenate([at - count, at, at + count]), np.tile(own[down], 3))
    speed = gaussian_filter1d(speed, 0.02 * fps, mode="wrap")
    made = joints.astype(np.float64).copy()
    made[..., axis] += (np.cumsum(speed - speed.mean()) / fps)[:, None]
    return made, np.array([speed.mean(), 0.0] if axis == 0 else [0.0, speed.mean()])


def shorter_strides(
    joints: np.ndarray, names: Sequence[str], factor: float, *, aside: bool
) -> np.ndarray:
    """Scale the way of the feet of a cycle on the spot, ahead and back of the pelvis."""
    made = joints.astype(np.float64).copy()
    for side in SIDES:
        hip, knee, ankle, *rest = (
            names.index(name.format(side))
            for name in ("thigh_{}", "calf_{}", "foot_{}", "ball_{}", "ball_{}_end")
        )
        foot = made[:, rest] - made[:, [ankle]]
        target = made[:, ankle].copy()
        target[:, 2] = made[:, hip, 2] + factor * (target[:, 2] - made[:, hip, 2])
        if aside:
            target = made[:, ankle].copy()
            target[:, 0] = made[:, hip, 0] + factor * (target[:, 0] - made[:, hip, 0])
        made[:, knee], made[:, ankle] = bend_to(made[:, hip], made[:, knee], made[:, ankle], target)
        made[:, rest] = made[:, [ankle]] + foot
    return made


def kicking(
    joints: np.ndarray, names: Sequence[str], kicks: tuple[int, float, float]
) -> np.ndarray:
    """Swing the legs of a cycle in turn; the shin follows the thigh by a quarter of a kick."""
    count, thigh, shin = kicks
    made = joints.astype(np.float64).copy()
    phase = np.arange(len(made)) * (2 * np.pi * count / len(made))
    across = unit(made[:, names.index("thigh_l")] - made[:, names.index("thigh_r")])
    for side, offset in (("l", 0.0), ("r", np.pi)):
        chain = [name.format(side) for name in ("calf_{}", "foot_{}", "ball_{}", "ball_{}_end")]
        for pivot, moved, swing in (
            (f"thigh_{side}", chain, thigh * np.sin(phase + offset)),
            (chain[0], chain[1:], 0.5 * shin * (1 + np.sin(phase + offset - np.pi / 2))),
        ):
            turn = rotvec_to_rotmat(np.deg2rad(swing)[:, None] * across)
            at = made[:, names.index(pivot)].copy()
            for joint in moved:
                own = names.index(joint)
                made[:, own] = at + np.einsum("tab,tb->ta", turn, made[:, own] - at)
    return made


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


def write(
    files: Sequence[str],
    clips: Sequence[np.ndarray],
    facts: Sequence[tuple[float, ...]],
    first: Motion,
) -> None:
    """Write the library."""
    steps = [np.diff(clip, axis=0, prepend=np.zeros_like(clip[:1])) for clip in clips]
    write_npz(
        LIBRARY,
        {
            "files": np.array(files[: len(clips)]),
            "frames": np.array([len(clip) for clip in clips]),
            "fps": np.array([fps for fps, *_ in facts]),
            "aside": np.array([aside for _, aside, _ in facts]),
            "pace": np.array([pace for *_, pace in facts]),
            "steps": np.frombuffer(
                lzma.compress(
                    np.ascontiguousarray(np.concatenate(steps).transpose(1, 2, 0)).tobytes(),
                    preset=9,
                ),
                np.uint8,
            ),
            "parents": first.parents,
            "joint_names": np.array(first.joint_names),
            "rest_offsets": first.rest_offsets,
            "licence": np.array("of each clip: a2v.motion.clips.AUTHORS"),
        },
    )


def main() -> None:
    """Write the library; print one line per clip."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "archive", nargs="?", default=str(ROOT.parent / "shared" / "data" / "clips_cc0.zip")
    )
    given = parser.parse_args()
    archive = zipfile.ZipFile(given.archive)
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
    known = {*(Path(name).stem for name in archive.namelist()), *GESTURES} - LEFT_OUT
    missing = known ^ {row["file"] for row in rows if "/" not in row["file"]}
    if missing:
        raise SystemExit(f"{TABLE.name} and the archive differ in {', '.join(sorted(missing))}")
    names = first.joint_names
    clips: list[np.ndarray] = []
    facts: list[tuple[float, ...]] = []
    more: SecondLibrary | None = None
    rows.sort(key=lambda row: "/" in row["file"])
    for row in rows:
        if "/" in row["file"] and more is None:  # these are carried over to the first library
            write([row["file"] for row in rows], clips, facts, first)
            clip_library.cache_clear()
            more = SecondLibrary(zipfile.ZipFile(Path(given.archive).with_name("clips_more.zip")))
        if row["file"] in GESTURES:
            joints, fps = puppet.play(GESTURES[row["file"]][0]), FPS
        elif more is not None:
            joints, fps = puppet.with_hands(more.joints(row["file"]), row["hand"]), FPS
            stays = standing(joints, names) or row["plays"] == "once"
            if row["file"].startswith("kaykit") and stays and "Dodge" not in row["file"]:
                joints = carried(joints, closes=row["plays"] != "once")
        else:
            motion = with_front(read_bvh(archive.read(row["file"] + ".bvh"), name=row["file"]))
            assert motion.joint_names == first.joint_names
            scale = leg_length(lengths, names) / leg_length(
                np.linalg.norm(motion.rest_offsets, axis=-1), names
            )
            joints, fps = motion.joints * scale, motion.fps
        joints = on_lengths(joints, skeleton, lengths)
        joints = joints if row["plays"] == "once" else as_cycle(joints)
        if row["file"] in STRIDES:
            joints = shorter_strides(
                joints, names, STRIDES[row["file"]], aside=row["travels"] in ("left", "right")
            )
        if row["file"] in KICKS:
            joints = kicking(joints, names, KICKS[row["file"]])
        pace = pace_of(joints, names, fps, row["travels"])
        if row["travels"] in WAYS and row["travels"] != "body":
            joints, pace = with_travel(joints, names, fps, row["travels"])
        clips.append(np.round(joints / STEP).astype(np.int16))
        facts.append((fps, *pace))
        print(
            f"{row['name']:28s} {len(joints):4d} frames at {fps:g} fps, {pace[1]:.2f} m/s"
            + (f", {pace[0]:.2f} m/s to the left" if pace[0] else "")
        )
    write([row["file"] for row in rows], clips, facts, first)
    print(f"{LIBRARY}: {LIBRARY.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
