"""Avatars for TalkingHead: contents of the files, and how @met4citizen/talkinghead plays them."""

from __future__ import annotations

import base64
import dataclasses
from pathlib import Path

import numpy as np
import pytest

from a2v import Character, InputError
from a2v.animation import prepare_rig
from a2v.animation.visemes import add_visemes, visemes
from a2v.formats.gltf import write_glb
from a2v.types import MATERIALS
from tests.support.browser import bundled, told_by
from tests.support.glb import Glb, validate

PACKAGES = ("@met4citizen/talkinghead@1.7.0", "three@0.180.0", "esbuild@0.28.2")
OCULUS = ("sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR", "aa", "E", "I", "O", "U")
EXTRAS = ("mouthOpen", "mouthSmile", "eyesClosed", "eyesLookUp", "eyesLookDown")


@pytest.fixture(scope="module")
def person(expressive: Character) -> Character:
    """A character with a texture and all materials."""
    surface = expressive.surface
    middle = surface.vertices[surface.faces].mean(axis=1)
    kinds = np.where(middle[:, 1] < 1.4, MATERIALS.index("cloth"), MATERIALS.index("skin"))
    kinds[middle[:, 1] > 1.67] = MATERIALS.index("hair")
    uv = surface.vertices[surface.faces][..., :2] * [0.4, 0.5] + [0.5, 0.0]
    picture = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    dressed = dataclasses.replace(
        surface, uv=uv.astype(np.float32), texture=picture, materials=kinds.astype(np.uint8)
    )
    return prepare_rig(dataclasses.replace(expressive, surface=dressed), {}, rig="talkinghead")[0]


@pytest.fixture(scope="module")
def avatar(person: Character, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("talkinghead") / "ada.glb"
    write_glb(path, person)
    return path


def test_the_file_is_what_the_program_looks_for(
    avatar: Path, person: Character, validator: Path
) -> None:
    report = validate(avatar, validator)
    assert report["errors"] == 0, report["messages"]
    assert avatar.stat().st_size < 5_000_000
    file = Glb(avatar)
    (top,) = file.json["scenes"][0]["nodes"]
    assert file.json["nodes"][top]["name"] == "Armature"
    below = [file.json["nodes"][index] for index in file.json["nodes"][top]["children"]]
    assert [node["name"] for node in below if "mesh" not in node] == ["Hips"]
    assert [node["mesh"] for node in below if "mesh" in node] == [0, 1, 2]  # one for each material
    assert all(len(mesh["primitives"]) == 1 for mesh in file.json["meshes"])
    names = {file.json["nodes"][index]["name"] for index in file.json["skins"][0]["joints"]}
    assert {
        "HeadTop_End",
        "LeftToe_End",
        "LeftHandIndex4",
        "RightHandThumb4",
        "LeftEye",
        "Spine2",
    } <= names
    assert not any(":" in name for name in names)
    assert len(person.surface.faces) <= 20_000
    corners = sum(len(file.array(mesh["primitives"][0]["indices"])) for mesh in file.json["meshes"])
    assert corners == 3 * len(person.surface.faces)
    shapes = {
        name
        for mesh in file.json["meshes"]
        for name in mesh.get("extras", {}).get("targetNames", [])
    }
    face = person.surface.face
    assert face is not None
    assert shapes == set(face.names)
    assert len(shapes) == 52 + 15 + 5
    arms = {
        name: person.body.rest_transforms[person.body.bone_names.index(name), :3, 3]
        for name in ("LeftArm", "LeftHand")
    }
    assert abs(float(arms["LeftHand"][1] - arms["LeftArm"][1])) < 1e-3  # T-pose


def test_parts_of_the_mesh_are_those_of_the_whole(
    person: Character, avatar: Path, tmp_path: Path
) -> None:
    """Seams between materials must not show: normals and shapes of a part equal the whole mesh's."""
    body = dataclasses.replace(person.body, model="mixamo")
    write_glb(tmp_path / "whole.glb", dataclasses.replace(person, body=body))
    whole, parts = Glb(tmp_path / "whole.glb"), Glb(avatar)

    def corners(file: Glb, attribute: str) -> np.ndarray:
        primitives = [primitive for mesh in file.json["meshes"] for primitive in mesh["primitives"]]
        return np.concatenate(
            [
                file.array(one["attributes"][attribute])[file.array(one["indices"])]
                for one in primitives
            ]
        )

    for attribute in ("POSITION", "NORMAL", "TEXCOORD_0", "WEIGHTS_0", "JOINTS_0"):
        np.testing.assert_array_equal(corners(parts, attribute), corners(whole, attribute))


def test_visemes_are_sums_of_arkits_shapes(expressive: Character) -> None:
    talking = add_visemes(expressive, "vrchat")
    face, before = talking.surface.face, expressive.surface.face
    assert face is not None
    assert before is not None
    assert face.names[:52] == before.names
    assert [name.lower() for name in face.names[52:]] == [
        f"vrc.v_{name}"
        for name in (
            "sil",
            "pp",
            "ff",
            "th",
            "dd",
            "kk",
            "ch",
            "ss",
            "nn",
            "rr",
            "aa",
            "e",
            "ih",
            "oh",
            "ou",
        )
    ]
    moved, offsets = face.target("vrc.v_oh")
    whole = np.zeros_like(expressive.surface.vertices)
    for name, strength in (("jawOpen", 0.35), ("mouthFunnel", 0.6)):
        places, shifts = before.target(name)
        whole[places] += np.float32(strength) * shifts
    np.testing.assert_allclose(offsets, whole[moved], atol=1e-6)
    known = set(before.names)
    assert all(set(parts) <= known for parts in visemes("oculus").values())  # none is misspelt
    assert list(visemes("oculus")) == [*(f"viseme_{name}" for name in OCULUS), *EXTRAS]
    with pytest.raises(InputError, match="oculus, vrchat"):
        add_visemes(expressive, "disney")


@pytest.mark.slow
def test_it_speaks_a_sentence(avatar: Path, person: Character) -> None:
    script = bundled(Path(__file__).with_name("speak_in_talkinghead.mjs"), "talkinghead", *PACKAGES)
    sentence = {
        "words": ["hello", "my", "friends"],
        "wtimes": [100, 600, 900],
        "wdurations": [400, 250, 600],
    }
    order = ["aa", "PP", "U", "FF", "O"]
    vowels = {"words": ["x"], "wtimes": [0], "wdurations": [1], "visemes": order}
    vowels |= {"vtimes": [300 + 1000 * i for i in range(5)], "vdurations": [400] * 5}
    face = person.surface.face
    assert face is not None
    file = Glb(avatar)
    skin = next(mesh for mesh in file.json["meshes"] if mesh["name"].endswith("skin"))[
        "primitives"
    ][0]
    points = file.array(skin["attributes"]["POSITION"])
    mouth = face.target("jawOpen")[0]
    near = [
        int(np.argmin(np.linalg.norm(points - person.surface.vertices[vertex], axis=1)))
        for vertex in mouth[::11]
    ]
    exact = np.linalg.norm(points[near] - person.surface.vertices[mouth[::11]], axis=1) < 1e-7
    chosen, vertices = np.array(near)[exact], mouth[::11][exact]
    assert len(chosen) > 30
    looks = [500 + 1000 * i for i in range(5)]
    told = told_by(
        script,
        {
            "glb": base64.b64encode(avatar.read_bytes()).decode(),
            "places": ["Hips", "LeftHand", "RightHand", "LeftArm", "LeftFoot", "Head"],
            "mesh": "skin",
            "chosen": chosen.tolist(),
            "speeches": [
                {"ms": 2000, "audio": sentence},
                {"ms": 6000, "audio": vowels, "looks": looks},
            ],
        },
    )
    assert told["armature"] == "Armature"
    stands = {name: np.array(place) for name, place in told["stands"].items()}
    assert (
        stands["Head"][1] > stands["LeftArm"][1] > stands["LeftHand"][1] + 0.3
    )  # its own pose: the arms hang
    assert stands["LeftHand"][0] > 0 > stands["RightHand"][0]
    assert abs(float(stands["LeftFoot"][1])) < 0.25
    spoken, shown = told["speeches"]
    assert [item["name"] for item in spoken["asked"]][:4] == [
        f"viseme_{name}" for name in told["words"]
    ]  # "hello" by its English rules
    assert len(spoken["asked"]) >= 10
    for speech in (spoken, shown):
        for item in speech["asked"]:
            top = round(item["times"][1] / 20) - 1
            reached = max(speech["tracks"][item["name"]][max(top - 1, 0) : top + 2])
            assert reached == pytest.approx(item["strengths"][1], abs=0.12), item
    assert [item["name"] for item in shown["asked"]] == [f"viseme_{name}" for name in order]
    strengths = [0.9 if name in ("PP", "FF") else 0.6 for name in order]
    for name, strength, seen in zip(order, strengths, shown["frames"], strict=True):
        whole = np.zeros_like(person.surface.vertices)
        moved, offsets = face.target(f"viseme_{name}")
        whole[moved] = strength * offsets
        assert np.abs(whole[vertices]).max() > 1e-3
        np.testing.assert_allclose(np.array(seen) - points[chosen], whole[vertices], atol=1e-3)
