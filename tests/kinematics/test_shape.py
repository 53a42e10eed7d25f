"""Joints are found by the shape of a skeleton where its names say nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from a2v import Character, InputError
from a2v.animation import retarget
from a2v.animation.source import source_joints
from a2v.formats import read_bvh, read_motion
from a2v.kinematics.names import REQUIRED
from a2v.kinematics.shape import LEAST, joints_by_shape
from a2v.kinematics.understand import UP_Z, understand
from tests.support.rigs import StrangeRig, plain_rigs, strange

COUNT = 200
FIRST = 1000
"""Seeds that the rules were not made with."""


@pytest.fixture(scope="module")
def rigs(character: Character) -> dict[str, StrangeRig]:
    return plain_rigs(character)


def test_rigs_of_known_tools_are_found_without_their_names(rigs: dict[str, StrangeRig]) -> None:
    for name, rig in rigs.items():
        shape = joints_by_shape(rig.parents, rig.heads)
        assert {joint: shape.joints.get(joint) for joint in rig.truth} == rig.truth, name
        assert shape.confidence > 0.9, name


def test_most_of_200_mutilated_rigs_are_right_and_all_have_a_note(
    rigs: dict[str, StrangeRig],
) -> None:
    plain, right = [*rigs.values()], 0
    for seed in range(FIRST, FIRST + COUNT):
        rig = strange(plain[seed % len(plain)], seed)
        found = understand(rig.names, rig.parents, rig.heads)
        if found is None:
            continue
        assert "by their shape (confidence" in found.notes[0]
        joints = {name: bone for name, bone in found.joints.items() if bone < len(rig.parents)}
        ends = {name for name in joints if name in REQUIRED}
        right += all(joints.get(name) == bone for name, bone in rig.truth.items()) and ends <= set(
            rig.truth
        )
    assert right >= 0.95 * COUNT


def test_z_up_is_seen_and_what_is_no_person_is_not(rigs: dict[str, StrangeRig]) -> None:
    rig = rigs["mixamo"]
    found = understand(rig.names, rig.parents, rig.heads @ UP_Z)
    assert found is not None
    assert {joint: found.joints[joint] for joint in rig.truth} == rig.truth
    tail = np.cumsum(np.tile([0.0, 0.1, 0], (12, 1)), axis=0)
    assert joints_by_shape([-1, *range(11)], tail).confidence == 0
    dog = {"hips": ("", 0, 0.6, -0.4), "chest": ("hips", 0, 0.62, 0.4), "head": ("chest", 0, 0.8, 0.7)} | {
        f"{end}{side}{part}": (f"{end}{side}{part - 1}" if part else top, x, 0.58 - 0.18 * part, z)
        for end, top, z in (("b", "hips", -0.4), ("f", "chest", 0.4))
        for side, x in (("l", 0.1), ("r", -0.1))
        for part in range(4)
    }  # fmt: skip
    names = [*dog]
    parents = [names.index(dog[name][0]) if dog[name][0] else -1 for name in names]
    heads = np.array([dog[name][1:] for name in names], float)
    assert joints_by_shape(parents, heads).confidence < LEAST


def test_a_motion_of_nameless_bones_is_carried_over(
    data_dir: Path, character: Character, tmp_path: Path
) -> None:
    from a2v.formats import write_bvh

    walk = read_motion(data_dir / "motions" / "humanoid3d_walk.txt", fps=20)
    write_bvh(tmp_path / "named.bvh", walk)
    text = (tmp_path / "named.bvh").read_text()
    for number, name in enumerate(sorted(walk.joint_names, key=len, reverse=True)):
        for word in ("ROOT", "JOINT"):
            text = text.replace(f"{word} {name}\n", f"{word} b{number}\n")
            text = text.replace(f"{word} {name}_turn\n", f"{word} t{number}\n")
    motion = read_bvh(text)
    assert "by their shape" in motion.provenance["notes"][0]
    wanted, found = source_joints(walk), source_joints(motion)
    for name in REQUIRED:
        assert np.abs(found[name] - wanted[name]).max() < 0.01, name
    assert np.isfinite(retarget(motion, character.body)).all()


def test_a_motion_without_a_forearm_moves_the_rest(data_dir: Path, tmp_path: Path) -> None:
    lines = (data_dir / "strangers" / "r09_reference_root.bvh").read_text().splitlines()
    names = [line.split()[-1] for line in lines if "JOINT" in line]
    forearm = next(name for name in names if "LeftForeArm" in name or "LeftLowArm" in name)
    motion = read_bvh(_without(lines, forearm))
    assert "left arm ends early" in " ".join(motion.provenance["notes"])
    joints = source_joints(motion)
    lengths = [
        np.linalg.norm(joints[f"{side}_elbow"] - joints[f"{side}_shoulder"], axis=1).mean()
        for side in ("left", "right")
    ]
    assert lengths[0] == pytest.approx(lengths[1], rel=0.01)


def _without(lines: list[str], name: str) -> str:
    """A BVH without a joint and all below it: they become an End Site."""
    start = next(i for i, line in enumerate(lines) if line.split()[-1:] == [name])
    depth, end, gone, before, columns = 0, start, 0, 0, 0
    for i, line in enumerate(lines):
        words = line.split()
        if words[:1] == ["CHANNELS"]:
            columns += int(words[1])
            before += int(words[1]) * (i < start)
        if i > start and end == start:
            depth += (words == ["{"]) - (words == ["}"])
            gone += int(words[1]) if words[:1] == ["CHANNELS"] else 0
            if words == ["}"] and depth == 0:
                end = i
    motion = lines.index("MOTION")
    kept = [*lines[:start], "End Site", "{", "OFFSET 0 0 0", "}", *lines[end + 1 : motion + 3]]
    for line in lines[motion + 3 :]:
        numbers = line.split()
        kept.append(" ".join(numbers[:before] + numbers[before + gone :]))
    return "\n".join(kept)


def test_an_upper_body_is_still_refused(data_dir: Path) -> None:
    with pytest.raises(InputError, match="upper body"):
        read_motion(data_dir / "strangers" / "r24_upper_body_only.bvh")
