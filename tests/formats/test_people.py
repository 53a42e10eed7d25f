"""Custom characters get motions on their bones; everything else in their files is unchanged."""

from __future__ import annotations

import copy
import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from a2v import Character, InputError, MissingDependencyError
from a2v.animation import prepare_rig, retarget
from a2v.formats import read_motion, write_bvh, write_glb
from a2v.formats.gltf import VrmMeta, compress_glb, read_glb, write_vrm
from a2v.formats.gltf.compression import COMPRESSED, KINDS, PACKAGES, plain
from a2v.formats.gltf.people import Person, read_person
from a2v.formats.gltf.person_clips import write_person
from a2v.formats.gltf.reading import Gltf
from a2v.kinematics.names import canonical_joints
from a2v.types import Motion
from pipelines.answer import Answer
from pipelines.commands import retarget as command
from pipelines.options import parse
from tests.support.glb import glb, validate
from tests.support.motions import person as walker
from tests.support.npm import npm_folder
from tests.support.strangers import BONES
from tests.support.strangers import person as small_person

META = VrmMeta(name="Ada", author="A. Person", license_url="https://example.org/license")


@pytest.fixture(scope="module")
def cartwheel_clip(data_dir: Path) -> Motion:
    return read_motion(data_dir / "motions" / "humanoid3d_walk.txt", fps=10)


def answered(*words: str) -> Answer:
    """Return the output of a command line."""
    return command.run(
        parse(
            command.Options,
            words,
            command="retarget",
            about=command.HELP,
            examples=command.EXAMPLES,
        )
    )


def heads_at(path: Path, clip: int, frame: int) -> dict[str, np.ndarray]:
    """Return the positions of all named nodes as a viewer computes them, in the file's units."""
    file = read_glb(path)
    nodes = copy.deepcopy(file.json["nodes"])
    animation = file.json["animations"][clip]
    for channel in animation["channels"]:
        values = file.accessor(animation["samplers"][channel["sampler"]]["output"])
        node = nodes[channel["target"]["node"]]
        if "matrix" not in node:
            node[channel["target"]["path"]] = values[frame].tolist()
    world = Gltf(path, {**file.json, "nodes": nodes}, file.binary).node_matrices()[0]
    return {
        str(node.get("name", "")): matrix[:3, 3] for node, matrix in zip(nodes, world, strict=True)
    }


def danced(source: Path, motion: Motion, target: Path) -> tuple[Person, np.ndarray]:
    person = read_person(source)
    moves = retarget(motion, person.body)
    write_person(target, person, {"walk": (moves, motion.fps)})
    return person, moves


def unchanged(before: Path, after: Path) -> None:
    old, new = read_glb(before), read_glb(after)
    assert new.binary[: len(old.binary)] == old.binary
    for key, value in old.json.items():
        if key in ("accessors", "bufferViews", "animations"):
            assert new.json[key][: len(value)] == value
        elif key != "buffers":
            assert new.json[key] == value, key


@pytest.mark.parametrize(
    "rig", ["anny", "mixamo", "unreal", "rigify", "unity", "godot", "talkinghead"]
)
def test_known_rigs_move_as_our_own(
    rig: str, character: Character, cartwheel_clip: Motion, validator: Path, tmp_path: Path
) -> None:
    made, _ = prepare_rig(character, {}, rig=rig)
    write_glb(tmp_path / "before.glb", made)
    person, moves = danced(tmp_path / "before.glb", cartwheel_clip, tmp_path / "after.glb")
    unchanged(tmp_path / "before.glb", tmp_path / "after.glb")
    report = validate(tmp_path / "after.glb", validator)
    assert report["errors"] == 0, report["messages"]
    ours = retarget(cartwheel_clip, character.body)
    own, theirs = (
        canonical_joints(character.body.bone_names),
        canonical_joints(person.body.bone_names),
    )
    joints = [
        "left_wrist",
        "right_wrist",
        "left_ankle",
        "right_knee",
        *(["head"] if "head" in theirs else []),
    ]  # Rigify's is spine.006
    for frame in (0, 5, 9):
        shown = heads_at(tmp_path / "after.glb", 0, frame)
        for joint in joints:
            place = shown[person.body.bone_names[theirs[joint]]] - [0, person.floor, 0]
            np.testing.assert_allclose(
                place, moves[frame, theirs[joint], :3, 3], atol=2e-4
            )  # the file shows the generated motion
            assert np.linalg.norm(place - ours[frame, own[joint], :3, 3]) < 0.06, (
                joint,
                frame,
            )  # and that is the motion


def test_a_strangers_avatar_walks_on_the_ground(
    data_dir: Path, cartwheel_clip: Motion, tmp_path: Path
) -> None:
    """A character of the VALID library: centimeters, a turned armature, four skinned meshes."""
    source = data_dir / "avatars" / "Asian_F_2_Casual.glb"
    person, moves = danced(source, cartwheel_clip, tmp_path / "after.glb")
    unchanged(source, tmp_path / "after.glb")
    assert 1.4 < float(np.ptp(person.body.vertices[:, 1])) < 2.1
    rest = person.body.rest_transforms.astype(np.float64)
    skin = np.concatenate(
        [person.body.vertices, np.ones((len(person.body.vertices), 1), np.float32)], axis=1
    )[::7]
    blended = np.einsum(
        "vb,tbac->tvac", person.body.weights[::7].astype(np.float64), moves @ np.linalg.inv(rest)
    )
    posed = np.einsum("tvac,vc->tva", blended, skin)
    low = posed[..., 1].min(axis=1)
    assert low.min() > -0.03  # soles are not below the ground
    assert np.median(np.abs(low)) < 0.02  # and stand on it
    stretched = np.linalg.norm(np.diff(posed, axis=1), axis=-1) / np.maximum(
        np.linalg.norm(np.diff(skin[:, :3], axis=0), axis=-1), 0.02
    )
    assert np.quantile(stretched, 0.999) < 3  # nothing is torn
    bones = canonical_joints(person.body.bone_names, person.body.bone_parents.tolist())
    first, last = (heads_at(tmp_path / "after.glb", 0, frame) for frame in (0, 9))
    hips = person.body.bone_names[bones["pelvis"]]
    arms = [np.linalg.norm(shown["LeftArm"] - shown["LeftForeArm"]) for shown in (first, last)]
    assert arms[0] == pytest.approx(arms[1], abs=1e-4)
    assert float(last[hips][2] - first[hips][2]) > 0.3  # it faces +z and walks that way


@pytest.mark.parametrize("edition", ["1.0", "0.x"])
def test_vrm_says_itself_which_bone_is_which(
    edition: str, character: Character, cartwheel_clip: Motion, tmp_path: Path
) -> None:
    made, _ = prepare_rig(character, {}, rig="vrm")
    write_vrm(tmp_path / "named.vrm", made, dataclasses.replace(META, edition=edition))
    file = read_glb(tmp_path / "named.vrm")
    tree = copy.deepcopy(file.json)
    for number, node in enumerate(tree["nodes"]):
        node["name"] = f"J_Bip_{number}"
    before = tmp_path / "before.vrm"
    before.write_bytes(glb(tree, file.binary))
    person, moves = danced(before, cartwheel_clip, tmp_path / "after.vrm")
    bones = canonical_joints(person.body.bone_names)
    ahead = 1 if edition == "1.0" else -1  # avatars of 0.x face -z and walk that way
    for frame in (0, 9):
        shown = heads_at(tmp_path / "after.vrm", 0, frame)
        for joint in ("left_wrist", "right_ankle"):
            place = shown[f"J_Bip_{person.nodes[bones[joint]]}"] - [0, person.floor, 0]
            np.testing.assert_allclose(
                place, moves[frame, bones[joint], :3, 3] * [ahead, 1, ahead], atol=2e-4
            )


def test_the_command_adds_what_is_asked_for(data_dir: Path, tmp_path: Path) -> None:
    source, out = str(data_dir / "avatars" / "Asian_F_2_Casual.glb"), tmp_path / "new.glb"
    walk = str(data_dir / "motions" / "humanoid3d_walk.txt")
    answer = answered(
        "--character",
        source,
        "--actions",
        "Walk",
        "--motions",
        walk,
        "--frames",
        "12",
        "--out",
        str(out),
    )
    assert answer.files == [out]
    assert [clip["name"] for clip in read_glb(out).json["animations"]] == [
        "Walk",
        "humanoid3d_walk",
    ]
    again = tmp_path / "again.glb"
    answered("--character", str(out), "--action", "Walk", "--frames", "12", "--out", str(again))
    assert [clip["name"] for clip in read_glb(again).json["animations"]] == [
        "Walk",
        "humanoid3d_walk",
        "Walk_2",
    ]
    with pytest.raises(InputError, match=r"expected a name that ends in \.fbx"):
        answered("--character", "a.fbx", "--action", "Walk", "--out", str(again))
    with pytest.raises(InputError, match=r"no motion given"):
        answered("--character", source, "--out", str(again))
    with pytest.raises(InputError, match=r"expected a name that ends in \.glb"):
        answered("--character", source, "--action", "Walk", "--out", "a.vrm")


def test_what_is_no_upright_person_is_refused(character: Character, tmp_path: Path) -> None:
    write_glb(tmp_path / "a.glb", character)
    file = read_glb(tmp_path / "a.glb")

    def with_changes(**changes: object) -> Path:
        path = tmp_path / "changed.glb"
        path.write_bytes(glb({**json.loads(json.dumps(file.json)), **changes}, file.binary))
        return path

    with pytest.raises(InputError, match="no skin"):
        read_person(with_changes(skins=[]))
    flat = [{**node, "name": "x", "translation": [0, 0.01, 0]} for node in file.json["nodes"]]
    with pytest.raises(InputError, match=r"has no bone for .* --bone-map FILE"):
        read_person(with_changes(nodes=flat))
    lying = copy.deepcopy(file.json["nodes"])
    root = file.json["scenes"][0]["nodes"][0]
    lying.append({"name": "above", "rotation": [0, 0, 0.7071068, 0.7071068], "children": [root]})
    with pytest.raises(InputError, match="stand upright"):
        read_person(with_changes(nodes=lying))
    lying[-1] = {"name": "above", "scale": [1, -1, 1], "children": [root]}
    with pytest.raises(InputError, match="mirrored"):
        read_person(with_changes(nodes=lying))


def local(node: dict[str, Any]) -> np.ndarray:
    """The matrix of a node."""
    bare = {name: value for name, value in node.items() if name != "children"}
    return Gltf(Path("a"), {"nodes": [bare]}, b"").node_matrices()[0][0]


def test_nodes_with_a_matrix_are_animated_by_their_parts(tmp_path: Path, validator: Path) -> None:
    """glTF allows no channels of nodes with a matrix: Khronos' validator found 60 errors."""
    tree, binary = small_person()
    tree["nodes"][0] |= {"rotation": [0.0, 0.6, 0.0, 0.8], "scale": [2.0, 2.0, 2.0]}
    tree["nodes"][2] |= {"rotation": [0.1, 0.0, 0.0, 0.99498744]}
    (tmp_path / "parts.glb").write_bytes(glb(tree, binary))
    for node in tree["nodes"][:-1]:
        matrix = local(node).T.ravel().tolist()
        for key in ("translation", "rotation", "scale"):
            node.pop(key, None)
        node["matrix"] = matrix
    (tmp_path / "matrix.glb").write_bytes(glb(tree, binary))
    motion = walker(frames=4)
    for name in ("parts", "matrix"):
        danced(tmp_path / f"{name}.glb", motion, tmp_path / f"{name}_out.glb")
    report = validate(tmp_path / "matrix_out.glb", validator)
    assert report["errors"] == 0, report["messages"]
    for frame in range(4):
        ours, theirs = (
            heads_at(tmp_path / f"{name}_out.glb", 0, frame) for name in ("matrix", "parts")
        )
        for bone, place in theirs.items():
            np.testing.assert_allclose(ours[bone], place, atol=1e-5)


@pytest.mark.parametrize("scale", [[1.0, 1.25, 1.0], [0.0, 0.0, 0.0], [-1.0, 1.0, 1.0]])
def test_an_odd_leaf_bone_stays_as_it_is_and_is_named(scale: list[float], tmp_path: Path) -> None:
    """Hidden hair refused the whole character. A bone that carries a joint still does, by name."""
    tree, binary = small_person()
    names = [node["name"] for node in tree["nodes"]]
    tree["nodes"].append({"name": "hair", "translation": [0.0, 0.1, 0.0], "scale": scale})
    tree["nodes"][names.index("Head")]["children"] = [len(names)]
    tree["skins"][0]["joints"] += [len(names)]
    tree["accessors"][4]["count"] += 1
    tree["bufferViews"][4]["byteLength"] += 64
    binary += np.eye(4, dtype=np.float32).tobytes()
    tree["buffers"][0]["byteLength"] = len(binary)
    (tmp_path / "a.glb").write_bytes(glb(tree, binary))
    person, _ = danced(tmp_path / "a.glb", walker(frames=4), tmp_path / "out.glb")
    assert [person.body.bone_names[bone] for bone in person.odd] == ["hair"]
    out = read_glb(tmp_path / "out.glb").json
    assert out["nodes"] == tree["nodes"]
    channels = out["animations"][0]["channels"]
    assert len(names) not in {channel["target"]["node"] for channel in channels}
    motion, target = tmp_path / "walk.bvh", tmp_path / "b.glb"
    write_bvh(motion, walker(frames=4))
    words = ("--character", tmp_path / "a.glb", "--motions", motion, "--out", target)
    told = answered(*map(str, words))
    assert "hair of a.glb stays in the pose of the file" in told.notes[0]
    tree["nodes"][names.index("LeftLeg")]["scale"] = scale
    (tmp_path / "a.glb").write_bytes(glb(tree, binary))
    with pytest.raises(InputError, match=r"scaled unevenly \(LeftLeg"):
        read_person(tmp_path / "a.glb")


@pytest.mark.parametrize("kind", KINDS)
def test_compressed_files_move_as_the_plain_ones(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Draco was read as zeros and meshopt refused, our own files too."""
    tree, binary = small_person()
    (tmp_path / "plain.glb").write_bytes(glb(tree, binary))
    (tmp_path / "small.glb").write_bytes(glb(tree, binary))
    monkeypatch.setenv("A2V_GLTF_TRANSFORM", str(npm_folder("gltf_transform", *PACKAGES.packages)))
    compress_glb(tmp_path / "small.glb", kind)
    assert read_glb(tmp_path / "small.glb").json["extensionsRequired"]
    people = [
        danced(tmp_path / f"{name}.glb", walker(frames=4), tmp_path / f"{name}_out.glb")[0].body
        for name in ("small", "plain")
    ]
    ours, theirs = (body.vertices[body.faces].astype(float).reshape(-1, 9) for body in people)
    far, _ = cKDTree(theirs).query(ours)
    assert len(ours) == len(theirs)
    assert far.max() < 2e-3
    for frame in range(4):
        shown, whole = (
            heads_at(tmp_path / f"{name}_out.glb", 0, frame) for name in ("small", "plain")
        )
        for bone in BONES:
            np.testing.assert_allclose(shown[bone], whole[bone], atol=1e-2)
    monkeypatch.setenv("A2V_GLTF_TRANSFORM", str(tmp_path / "none"))
    with pytest.raises(MissingDependencyError, match="npm install"):
        read_person(tmp_path / "small.glb")


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_not_compressed_stays_as_it_is(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As of a VRM: its extension, and what other tools write."""
    tree, binary = small_person()
    (tmp_path / "a.glb").write_bytes(glb(tree, binary))
    monkeypatch.setenv("A2V_GLTF_TRANSFORM", str(npm_folder("gltf_transform", *PACKAGES.packages)))
    compress_glb(tmp_path / "a.glb", kind)
    small = read_glb(tmp_path / "a.glb")
    own = {"VRM": {"meta": {"title": "somebody"}}, "other": [1, 2]}
    (tmp_path / "a.vrm").write_bytes(glb({**small.json, "extensions": own}, small.binary))
    whole = read_glb(tmp_path / "a.vrm")
    found = plain(whole)
    assert found.json["extensions"] == own
    for name in ("nodes", "skins", "materials", "animations"):
        assert found.json.get(name) == small.json.get(name)
    assert not set(COMPRESSED) & set(found.json.get("extensionsRequired", ()))
    faces = found.json["meshes"][0]["primitives"][0]
    assert len(found.accessor(faces["attributes"]["POSITION"], "VEC3")) > 100
    cut = (tmp_path / "a.vrm").read_bytes()
    broken = bytearray(cut)
    broken[-len(small.binary) :] = bytes(len(small.binary))
    (tmp_path / "b.vrm").write_bytes(bytes(broken))
    with pytest.raises(InputError, match="cannot be decoded"):
        read_person(tmp_path / "b.vrm")


def test_a_compressed_file_that_is_broken(tmp_path: Path) -> None:
    tree, binary = small_person()
    tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    tree["accessors"] += [{"componentType": 5126, "count": 40_000_000, "type": "VEC3"}]
    (tmp_path / "a.glb").write_bytes(glb(tree, binary))
    with pytest.raises(InputError, match="unpacks to"):
        read_person(tmp_path / "a.glb")
