"""What a2v writes, a2v reads: motions to the same joints, characters to the same people."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from a2v import Character, Motion
from a2v.animation import prepare_rig, retarget
from a2v.animation.source import source_joints
from a2v.formats import fbx, read_motion, write_motion
from a2v.formats.bare import write_rig_skeleton
from a2v.formats.bvh import write_rig_bvh
from a2v.formats.gltf import VrmMeta, compress_glb, compression, write_glb, write_vrm, write_vrma
from a2v.formats.gltf.people import read_person
from a2v.formats.registry import MOTION_FORMATS
from a2v.formats.smpl import write_smpl_motion
from a2v.npm import find_node
from a2v.types import Body, FloatArray
from pipelines.rigs import write_pose
from tests.support.glb import validate

LARGEST = 2e-3
"""Largest distance of joints, meters."""


@pytest.fixture(scope="module")
def walk(data_dir: Path) -> Motion:
    return read_motion(data_dir / "motions" / "humanoid3d_walk.txt", fps=20)


@pytest.fixture(scope="module")
def moves(walk: Motion, character: Character) -> FloatArray:
    return retarget(walk, character.body)


def demand_fbx(suffix: str) -> None:
    if suffix == ".fbx" and not fbx.can_write():
        pytest.skip("Node or npm's packages for FBX are not installed")


@pytest.mark.parametrize(
    "suffix", [suffix for item in MOTION_FORMATS if item.write for suffix in item.suffixes]
)
def test_joints_of_motions_come_back(
    suffix: str, walk: Motion, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    demand_fbx(suffix)
    (path,) = write_motion(tmp_path / f"m{suffix}", walk)
    again = read_motion(path)
    assert again.fps == walk.fps
    if suffix == ".glb":
        assert validate(path, request.getfixturevalue("validator"))["errors"] == 0
    places = [again.joint_names.index(name) for name in walk.joint_names]
    assert np.abs(again.joints[:, places] - walk.joints).max() < LARGEST


@pytest.mark.parametrize(
    ("suffix", "rig", "write"),
    [
        (".bvh", "mixamo", write_rig_bvh),
        (".glb", "unreal", write_rig_skeleton),
        (".fbx", "mixamo", write_rig_skeleton),
        (".npz", "smpl", write_smpl_motion),
        (".vrma", "vrm", write_vrma),
    ],
)
def test_joints_of_rigs_come_back(
    suffix: str,
    rig: str,
    write: Callable[[Path, Body, FloatArray, float], object],
    character: Character,
    moves: FloatArray,
    tmp_path: Path,
) -> None:
    demand_fbx(suffix)
    person, clips = prepare_rig(character, {"walk": (moves, 20.0)}, rig=rig)
    write(tmp_path / f"m{suffix}", person.body, *clips["walk"])
    again = read_motion(tmp_path / f"m{suffix}")
    assert again.fps == 20
    names = [name for name in person.body.bone_names if name in again.joint_names]
    assert len(names) > 20
    order = [person.body.bone_names.index(name) for name in names]
    wanted = clips["walk"][0][:, order][..., :3, 3]
    found = again.joints[:, [again.joint_names.index(name) for name in names]]
    assert np.abs(found - wanted).max() < LARGEST


@pytest.mark.parametrize("kind", ["", *compression.KINDS])
def test_characters_and_their_clips_come_back(
    kind: str, character: Character, moves: FloatArray, tmp_path: Path
) -> None:
    if kind and (find_node() is None or not compression.PACKAGES.installed):
        pytest.skip("Node or glTF Transform is not installed")
    path = tmp_path / "c.glb"
    write_glb(path, character, {"walk": (moves, 20.0), "still": (moves[:1], 20.0)})
    if kind:
        compress_glb(path, kind)
    person = read_person(path)
    assert set(person.body.bone_names) == set(character.body.bone_names)
    motion = read_motion(path)
    assert "'walk' is read" in motion.provenance["notes"][0]
    assert motion.frames == len(moves)
    order = [character.body.bone_names.index(name) for name in motion.joint_names]
    assert np.abs(motion.joints - moves[:, order][..., :3, 3]).max() < LARGEST
    assert read_motion(f"{path}#still").frames == 1


@pytest.mark.parametrize("edition", ["1.0", "0.x"])
def test_avatars_come_back(
    edition: str, character: Character, moves: FloatArray, tmp_path: Path
) -> None:
    person, _ = prepare_rig(character, {"walk": (moves, 20.0)}, rig="vrm")
    meta = VrmMeta(name="a", author="b", license_url="https://example.org", edition=edition)
    write_vrm(tmp_path / "a.vrm", person, meta)
    found = read_person(tmp_path / "a.vrm")
    assert {"hips", "leftUpperArm", "head"} <= set(found.body.bone_names)


def test_characters_as_fbx_come_back(
    character: Character, moves: FloatArray, tmp_path: Path
) -> None:
    demand_fbx(".fbx")
    fbx.write_fbx(tmp_path / "c.fbx", character, {"walk": (moves, 20.0)})
    motion = read_motion(tmp_path / "c.fbx")
    assert motion.frames == len(moves)
    order = [character.body.bone_names.index(name) for name in motion.joint_names]
    assert np.abs(motion.joints - moves[:, order][..., :3, 3]).max() < LARGEST


@pytest.mark.parametrize("suffix", [".bvh", ".npz", ".vrma", ".glb"])
def test_the_pose_of_a_character_is_a_motion_of_one_frame(
    suffix: str, character: Character, tmp_path: Path
) -> None:
    write_pose(tmp_path / f"pose{suffix}", character)
    motion = read_motion(tmp_path / f"pose{suffix}")
    assert motion.frames == 1
    found = source_joints(motion)
    heads = dict(zip(character.body.bone_names, character.body.bone_transforms, strict=True))
    for joint, bone in (("left_wrist", "wrist.L"), ("right_ankle", "foot.R"), ("head", "head")):
        wanted = heads[bone][:3, 3] - heads["upperleg01.L"][:3, 3]
        assert np.linalg.norm(found[joint][0] - found["left_hip"][0] - wanted) < 0.01, joint
