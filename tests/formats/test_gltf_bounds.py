"""A glTF of strangers is bounded before anything is allocated, and refused in one sentence."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from a2v.animation import retarget
from a2v.errors import InputError
from a2v.formats.gltf import bounds, read_glb
from a2v.formats.gltf.people import read_person
from a2v.formats.gltf.person_clips import write_person
from a2v.types import Motion
from tests.support.glb import glb
from tests.support.hostile import owes_a_sentence
from tests.support.motions import person as walker
from tests.support.strangers import person

WITHOUT_VIEW = {"componentType": 5126, "count": 4_000_000, "type": "MAT4"}


@pytest.fixture(scope="module")
def motion() -> Motion:
    return walker(frames=5)


def moved(path: Path, motion: Motion) -> None:
    """What `a2v retarget` does with a character."""
    made = read_person(path)
    moves = retarget(motion, made.body)
    write_person(path.with_name("out.glb"), made, {"walk": (moves, motion.fps)})


def refused(path: Path, tree: Any, binary: bytes, motion: Motion, said: str) -> None:
    """Check that a file is refused with `said`, soon and within the memory of a reader."""
    path.write_bytes(glb(tree, binary))
    seen = list[InputError]()

    def read() -> None:
        try:
            moved(path, motion)
        except InputError as error:
            seen.append(error)
            raise

    begun = time.process_time()
    owes_a_sentence(read)
    assert time.process_time() - begun < 8
    assert seen, "it was read"
    assert said in str(seen[0]), seen[0]
    assert not path.with_name("out.glb").exists()


def test_the_person_of_these_tests_moves(tmp_path: Path, motion: Motion) -> None:
    (tmp_path / "a.glb").write_bytes(glb(*person()))
    moved(tmp_path / "a.glb", motion)
    assert len(read_glb(tmp_path / "out.glb").json["animations"]) == 1


def test_indices_are_one_number_each(tmp_path: Path, motion: Motion) -> None:
    """A MAT4 of indices without a view took 18.8 GB."""
    tree, binary = person()
    tree["accessors"] += [{**WITHOUT_VIEW, "componentType": 5125}]
    primitive = tree["meshes"][0]["primitives"][0] | {"indices": 5}
    tree["meshes"][0]["primitives"] = [primitive] * 100
    refused(tmp_path / "a.glb", tree, binary, motion, "is a MAT4; expected SCALAR")


def test_the_numbers_of_all_accessors_are_bounded(tmp_path: Path, motion: Motion) -> None:
    tree, binary = person()
    tree["accessors"] += [{**WITHOUT_VIEW, "componentType": 5125, "type": "SCALAR"}]
    primitive = tree["meshes"][0]["primitives"][0] | {"indices": 5}
    tree["meshes"][0]["primitives"] = [primitive] * 100
    refused(tmp_path / "a.glb", tree, binary, motion, "numbers that are read")


def test_vertices_are_bounded_before_they_are_read(tmp_path: Path, motion: Motion) -> None:
    tree, binary = person()
    tree["accessors"][0] = {"componentType": 5126, "count": 2_000_000, "type": "VEC3"}
    for index in (1, 2):
        tree["accessors"][index] |= {"count": 2_000_000}
        del tree["accessors"][index]["bufferView"]
    refused(tmp_path / "a.glb", tree, binary, motion, "vertices and")


@pytest.mark.parametrize("text", ["\ud800", "a\udfffb"])
@pytest.mark.parametrize("place", ["name", "extras", "key"])
def test_half_a_character(tmp_path: Path, motion: Motion, text: str, place: str) -> None:
    tree, binary = person()
    tree["nodes"][0] |= {"extras": {text: 1}} if place == "key" else {place: text}
    refused(tmp_path / "a.glb", tree, binary, motion, "half a character")


@pytest.mark.parametrize("levels", [70, 700, 5000])
def test_deep_json(tmp_path: Path, motion: Motion, levels: int) -> None:
    tree, binary = person()
    text = json.dumps({**tree, "extras": "here"}).replace('"here"', "[" * levels + "]" * levels)
    path = tmp_path / "a.glb"
    data = text.encode() + b" " * (-len(text) % 4)
    path.write_bytes(
        b"glTF\2\0\0\0"
        + (28 + len(data) + len(binary)).to_bytes(4, "little")
        + len(data).to_bytes(4, "little")
        + b"JSON"
        + data
        + len(binary).to_bytes(4, "little")
        + b"BIN\0"
        + binary
    )
    with pytest.raises(InputError, match="nested deeper"):
        moved(path, motion)


@pytest.mark.parametrize("number", ["NaN", "Infinity", "1e999"])
def test_numbers_that_json_does_not_have(tmp_path: Path, motion: Motion, number: str) -> None:
    """NaN of a given file went into ours."""
    tree, binary = person()
    data = glb({**tree, "extras": 7777777}, binary).replace(
        b"7777777", number[:7].ljust(7).encode()
    )
    if number == "Infinity":
        data = glb({**tree, "extras": 77777777}, binary).replace(b"77777777", b"Infinity")
    (tmp_path / "a.glb").write_bytes(data)
    with pytest.raises(InputError, match="unusable JSON"):
        moved(tmp_path / "a.glb", motion)


def test_inverse_bind_matrices_without_numbers(tmp_path: Path, motion: Motion) -> None:
    """All vertices were at one point: a traceback in the feet."""
    tree, binary = person()
    del tree["accessors"][4]["bufferView"]
    refused(tmp_path / "a.glb", tree, binary, motion, "inverse bind matrices")


def test_many_skins(tmp_path: Path, motion: Motion) -> None:
    """Skins without inverse bind matrices are read as they are."""
    tree, binary = person()
    tree["skins"] += [{"joints": [0, 0]}] * 49_000
    del tree["skins"][0]["inverseBindMatrices"]
    (tmp_path / "a.glb").write_bytes(glb(tree, binary))
    owes_a_sentence(lambda: moved(tmp_path / "a.glb", motion))


def test_joints_over_several_skins(tmp_path: Path, motion: Motion) -> None:
    tree, binary = person()
    first = len(tree["nodes"])
    tree["nodes"] += [{}] * 36_000
    tree["skins"] += [
        {"joints": list(range(start, start + 2000))} for start in range(first, first + 36_000, 2000)
    ]
    refused(tmp_path / "a.glb", tree, binary, motion, "joints in its skins")


def test_primitives_times_nodes(tmp_path: Path, motion: Motion) -> None:
    tree, binary = person()
    tree["meshes"] += [{"primitives": [{}] * 100_000}]
    tree["nodes"] += [{"mesh": 1, "skin": 0}] * 1_000
    refused(tmp_path / "a.glb", tree, binary, motion, "primitives; at most")


def test_joints_times_nodes(tmp_path: Path, motion: Motion) -> None:
    tree, binary = person()
    tree["nodes"] += [{"mesh": 0, "skin": 0}] * 15_000
    refused(tmp_path / "a.glb", tree, binary, motion, "skinned nodes; at most")


def test_values_of_the_json(tmp_path: Path, motion: Motion) -> None:
    tree, binary = person()
    tree["extras"] = [[]] * (bounds.MAX_VALUES // 2 + 1)
    refused(tmp_path / "a.glb", tree, binary, motion, "values; expected")


def test_a_joint_that_is_listed_twice(tmp_path: Path, motion: Motion) -> None:
    """Real VRM files list one twice: its vertices follow it all the same."""
    tree, binary = person()
    tree["skins"][0]["joints"] += [0]
    tree["accessors"][4]["count"] += 1
    view = tree["bufferViews"][4]
    view["byteLength"] += 64
    (tmp_path / "a.glb").write_bytes(glb(tree, binary + np.eye(4, dtype=np.float32).tobytes()))
    moved(tmp_path / "a.glb", motion)


@pytest.mark.parametrize("lift", ["LeftToeBase", "LeftFoot"])
def test_a_person_saved_on_tiptoe(tmp_path: Path, motion: Motion, lift: str) -> None:
    """One end of a foot is higher than the other: the half without a sole was empty."""
    tree, binary = person()
    for side in ("Left", "Right"):
        node = next(n for n in tree["nodes"] if n["name"] == lift.replace("Left", side))
        node["translation"][1] += 0.2
    (tmp_path / "a.glb").write_bytes(glb(tree, binary))
    moved(tmp_path / "a.glb", motion)
