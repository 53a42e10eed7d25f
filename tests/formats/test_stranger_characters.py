"""Characters of strangers: bones without names, clothes with bones of their own, several people, z
up, files with parts beside them, and arms that end early."""

from __future__ import annotations

import base64
import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from a2v.animation import retarget
from a2v.errors import InputError
from a2v.formats.gltf.people import Person, read_person, write_map_of
from a2v.formats.gltf.person_clips import write_person
from a2v.formats.gltf.reading import Gltf, read_glb
from a2v.types import FloatArray
from pipelines.commands import retarget as command
from pipelines.options import parse
from tests.support.glb import glb, validate
from tests.support.motions import person as walker
from tests.support.strangers import BONES, person

COUNT = len(BONES)
NAMES = list(BONES)
Z_UP = [0.7071067811865476, 0.0, 0.0, 0.7071067811865476]
"""A turn that makes y up into z up."""


def moved(path: Path, **options: Any) -> tuple[Person, Gltf, FloatArray]:
    """What `a2v retarget` does: the person, the written file, and the places of its nodes (T, N, 3)
    in the frames of the clip."""
    motion = walker(frames=5)
    made = read_person(path, **options)
    moves = retarget(motion, made.body)
    out = path.with_name("out.glb")
    write_person(out, made, {"walk": (moves, motion.fps)})
    file = read_glb(out)
    places = []
    for frame in range(5):
        nodes = [dict(node) for node in file.json["nodes"]]
        for channel in file.json["animations"][-1]["channels"]:
            sampler = file.json["animations"][-1]["samplers"][channel["sampler"]]
            values = file.accessor(sampler["output"])
            nodes[channel["target"]["node"]][channel["target"]["path"]] = values[frame].tolist()
        posed = Gltf(file.path, {**file.json, "nodes": nodes}, file.binary)
        places.append(posed.node_matrices()[0][:, :3, 3])
    return made, file, np.array(places)


def twice(change: Callable[[dict[str, Any], int], None]) -> tuple[dict[str, Any], bytes]:
    """A person and a copy of all nodes and of the skin; `change` may change each copied node."""
    tree, binary = person()
    copies = copy.deepcopy(tree["nodes"])
    for number, node in enumerate(copies):
        if "children" in node:
            node["children"] = [child + COUNT + 1 for child in node["children"]]
        if "skin" in node:
            node["skin"] = 1
        change(node, number)
    tree["nodes"] += copies
    tree["scenes"][0]["nodes"] += [COUNT + 1, 2 * COUNT + 1]
    skin = copy.deepcopy(tree["skins"][0])
    skin["joints"] = [joint + COUNT + 1 for joint in skin["joints"]]
    tree["skins"].append(skin)
    return tree, binary


def test_clothes_with_bones_of_their_own_move_with_the_body(
    tmp_path: Path, validator: Path
) -> None:
    def blender(node: dict[str, Any], number: int) -> None:
        node["name"] += ".001" if number % 2 else ""

    (tmp_path / "a.glb").write_bytes(glb(*twice(blender)))
    made, _, places = moved(tmp_path / "a.glb")
    report = validate(tmp_path / "out.glb", validator)
    assert report["errors"] == validate(tmp_path / "a.glb", validator)["errors"], report["messages"]
    assert len(made.twins) == 1
    assert made.notes == ()
    first, second = places[:, :COUNT], places[:, COUNT + 1 : 2 * COUNT + 1]
    assert np.ptp(first, axis=0).max() > 0.1
    assert np.abs(first - second).max() < 1e-4


def test_of_two_people_one_moves_and_it_is_said(tmp_path: Path) -> None:
    def aside(node: dict[str, Any], number: int) -> None:
        if node["name"] == "Hips":
            node["translation"][0] += 1.5

    (tmp_path / "a.glb").write_bytes(glb(*twice(aside)))
    made, _, places = moved(tmp_path / "a.glb")
    assert made.notes[0].startswith("of 2 people the one with most vertices (Hips) moves")
    moving = np.ptp(places, axis=0).max(axis=1)
    assert moving[:COUNT].max() > 0.1
    assert moving[COUNT + 1 : 2 * COUNT + 1].max() == 0


def test_bones_without_names_are_found_and_may_be_named_by_a_table(tmp_path: Path) -> None:
    tree, binary = person()
    for number, node in enumerate(tree["nodes"][:COUNT]):
        node["name"] = f"Bone.{number:03d}"
    path = tmp_path / "a.glb"
    path.write_bytes(glb(tree, binary))
    made, _, nameless = moved(path)
    assert "by their shape (confidence" in made.notes[0]
    (tmp_path / "named.glb").write_bytes(glb(*person()))
    _, _, named = moved(tmp_path / "named.glb")
    assert np.abs(nameless - named).max() < 1e-5
    write_map_of(path, tmp_path / "map.txt")
    lines = (tmp_path / "map.txt").read_text().splitlines()
    assert sum("|" in line for line in lines) == COUNT
    assert f"left_elbow     | . . . Bone.{NAMES.index('LeftForeArm'):03d}" in lines
    made, _, mapped = moved(path, bone_map=tmp_path / "map.txt")
    assert np.abs(mapped - named).max() < 1e-5
    for old, new, said in (
        ("left_elbow ", "right_elbow ", "named twice"),
        ("left_elbow ", "elbow ", r"bad.txt:\d+: unknown joint"),
        ("Bone.003", "Bone.xyz", "there is no bone"),
        ("left_hip ", "- ", "has no bone for left_hip"),
    ):
        (tmp_path / "bad.txt").write_text("\n".join(lines).replace(old, new, 1))
        with pytest.raises(InputError, match=said):
            read_person(path, bone_map=tmp_path / "bad.txt")


def test_the_command_writes_the_table_first(tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(glb(*person()))
    words = ["--character", str(tmp_path / "a.glb"), "--out", str(tmp_path / "b.glb"),
             "--action", "Walk", "--seconds", "1", "--bone-map", str(tmp_path / "map.txt")]  # fmt: skip

    def answer() -> Any:
        return command.run(
            parse(command.Options, words, command="retarget", about=command.HELP, examples="")
        )

    assert answer().files == [tmp_path / "map.txt"]
    assert not (tmp_path / "b.glb").exists()
    assert answer().files == [tmp_path / "b.glb"]


def test_who_stands_along_z_walks_along_z(tmp_path: Path) -> None:
    tree, binary = person()
    above = {"name": "Armature", "rotation": Z_UP, "children": [0]}
    tree["nodes"].append(above)
    tree["scenes"][0]["nodes"] = [COUNT + 1, COUNT]
    (tmp_path / "a.glb").write_bytes(glb(tree, binary))
    made, _, places = moved(tmp_path / "a.glb")
    assert "stands along z" in made.notes[0]
    (tmp_path / "y.glb").write_bytes(glb(*person()))
    _, _, upright = moved(tmp_path / "y.glb")
    turned = upright[:, :COUNT] @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]).T
    assert np.abs(places[:, :COUNT] - turned).max() < 1e-4


def test_an_arm_without_a_forearm_moves_the_rest(tmp_path: Path) -> None:
    tree, binary = person()
    lost = [NAMES.index("LeftForeArm"), NAMES.index("LeftHand")]
    tree["nodes"][NAMES.index("LeftArm")].pop("children")
    for number in lost:
        tree["nodes"][number] = {"name": f"camera{number}"}
    joints = tree["skins"][0]["joints"]
    tree["skins"][0]["joints"] = [NAMES.index("LeftArm") if j in lost else j for j in joints]
    (tmp_path / "a.glb").write_bytes(glb(tree, binary))
    made, file, places = moved(tmp_path / "a.glb")
    assert "the left arm ends early" in made.notes[0]
    assert len(made.body.bone_names) == len(made.nodes) + 2
    assert np.ptp(places[:, NAMES.index("RightHand")], axis=0).max() > 0.1
    animated = {channel["target"]["node"] for channel in file.json["animations"][0]["channels"]}
    assert not animated & set(lost)


def test_parts_beside_a_gltf_are_read_and_none_elsewhere(tmp_path: Path) -> None:
    tree, binary = person()
    folder = tmp_path / "in"
    (folder / "parts").mkdir(parents=True)
    (folder / "parts" / "a b.bin").write_bytes(binary)
    (tmp_path / "secret.bin").write_bytes(binary)
    (folder / "link.bin").symlink_to(tmp_path / "secret.bin")
    (folder / "short.bin").write_bytes(binary[:100])

    def written(uri: str) -> Path:
        tree["buffers"] = [{"byteLength": len(binary), "uri": uri}]
        (folder / "a.gltf").write_text(json.dumps(tree))
        return folder / "a.gltf"

    (tmp_path / "a.glb").write_bytes(glb(*person()))
    _, _, wanted = moved(tmp_path / "a.glb")
    data = base64.b64encode(binary).decode()
    for uri in ("parts/a%20b.bin", f"data:application/octet-stream;base64,{data}"):
        _, file, places = moved(written(uri))
        assert np.abs(places - wanted).max() < 1e-6
        assert "uri" not in file.json["buffers"][0]
    for uri in (
        "../secret.bin",
        "parts/../../secret.bin",
        "%2e%2e/secret.bin",
        str(tmp_path / "secret.bin"),
        f"file://{tmp_path}/secret.bin",
        "C:\\secret.bin",
        "link.bin",
    ):
        with pytest.raises(InputError, match="not a file beside it"):
            read_person(written(uri))
    for uri, said in (("none.bin", "does not exist"), ("short.bin", "with 100 in its file"),
                      ("parts", "is a folder"), ("data:,abc", "not base64")):  # fmt: skip
        with pytest.raises(InputError, match=said):
            read_person(written(uri))
