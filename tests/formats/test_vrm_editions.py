"""VRM 0.x and 1.0, and skirts that swing, as @pixiv/three-vrm shows them in a browser."""

from __future__ import annotations

import base64
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from a2v import Character, InputError
from a2v.animation import prepare_rig
from a2v.formats.gltf import VrmMeta, write_vrm
from a2v.formats.gltf.hair import JOINTS as HAIR_JOINTS
from a2v.formats.gltf.skirt import CHAINS, JOINTS
from a2v.formats.gltf.vrm import EXPRESSIONS, VRM_REQUIRED, with_springs
from a2v.types import MATERIALS
from tests.support.browser import THREE_VRM, bundled, told_by
from tests.support.glb import Glb, validate
from tests.support.hair import with_hair

NEW = VrmMeta(name="Ada", author="A. Person", license_url="https://example.org/license")
OLD = dataclasses.replace(NEW, edition="0.x")


def skirted(character: Character) -> Character:
    """A character on VRM's rig with a closed tube from above the hips to the knees."""
    names = character.body.bone_names
    hips, knee = (
        character.body.bone_transforms[names.index(name), :3, 3]
        for name in ("hips", "leftLowerLeg")
    )
    rows, columns = 20, 40
    angles = 2 * np.pi * np.arange(columns) / columns
    heights = np.linspace(hips[1] + 0.06, knee[1] + 0.03, rows)
    radius = np.linspace(0.2, 0.27, rows)
    middle = [hips[0], hips[2] + 0.01]
    outer = np.stack(
        [
            middle[0] + radius[:, None] * np.sin(angles),
            np.repeat(heights[:, None], columns, axis=1),
            middle[1] + radius[:, None] * np.cos(angles),
        ],
        axis=-1,
    ).reshape(-1, 3)
    one = (np.arange(rows - 1)[:, None] * columns + np.arange(columns)).ravel()
    two = (np.arange(rows - 1)[:, None] * columns + (np.arange(columns) + 1) % columns).ravel()
    tube = np.concatenate(
        [
            np.stack([one, one + columns, two], axis=1),
            np.stack([two, one + columns, two + columns], axis=1),
        ]
    )
    surface, count = character.surface, len(character.surface.vertices)

    def grown(array: np.ndarray, value: Any) -> np.ndarray:
        return np.concatenate([array, np.full((len(outer), *array.shape[1:]), value, array.dtype)])

    weights = grown(character.weights, 0)
    weights[count:, 0] = 1
    assert surface.materials is not None
    cloth = np.full(len(tube), MATERIALS.index("cloth"), np.uint8)
    dressed = dataclasses.replace(
        surface,
        materials=np.concatenate([surface.materials, cloth]),
        vertices=np.concatenate([surface.vertices, outer.astype(np.float32)]),
        faces=np.concatenate([surface.faces, (tube + count).astype(np.int32)]),
        colors=grown(surface.colors, 0.4),
    )
    return dataclasses.replace(
        character,
        surface=dressed,
        weights=weights,
        bones=grown(character.bones, names.index("hips")),
        anchors=grown(character.anchors, 0),
        parts=grown(character.parts, 0),
    )


@pytest.fixture(scope="module")
def person(expressive: Character) -> Character:
    return skirted(with_hair(prepare_rig(expressive, {}, rig="vrm")[0], length=0.2))


@pytest.fixture(scope="module")
def files(person: Character, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("editions")
    write_vrm(folder / "new.vrm", person, NEW)
    write_vrm(folder / "old.vrm", person, OLD)
    return folder / "new.vrm", folder / "old.vrm"


def test_khronos_finds_nothing_wrong(files: tuple[Path, Path], validator: Path) -> None:
    for path in files:
        report = validate(path, validator)
        assert report["errors"] == 0, report["messages"]


def test_the_old_edition_says_all_that_it_has_to(
    files: tuple[Path, Path], person: Character
) -> None:
    file = Glb(files[1])
    assert file.json["extensionsUsed"] == ["VRM"]
    vrm = file.json["extensions"]["VRM"]
    bones = {
        bone["bone"]: file.json["nodes"][bone["node"]]["name"]
        for bone in vrm["humanoid"]["humanBones"]
    }
    assert len(bones) == len(vrm["humanoid"]["humanBones"]) == 54
    assert bones.keys() >= VRM_REQUIRED | {"chest", "neck"}
    thumb = [bones[f"leftThumb{part}"] for part in ("Proximal", "Intermediate", "Distal")]
    assert thumb == ["leftThumbMetacarpal", "leftThumbProximal", "leftThumbDistal"]
    groups = {group["name"]: group for group in vrm["blendShapeMaster"]["blendShapeGroups"]}
    assert {
        "A",
        "I",
        "U",
        "E",
        "O",
        "Blink",
        "Blink_L",
        "Blink_R",
        "Joy",
        "Angry",
        "Sorrow",
        "Fun",
        "BrowInnerUp",
        "TongueOut",
    } <= groups.keys()
    assert len(groups) == len(EXPRESSIONS) + 52
    names = file.json["meshes"][0]["extras"]["targetNames"]
    assert {names[bind["index"]]: bind["weight"] for bind in groups["A"]["binds"]} == {
        "jawOpen": 60
    }
    assert vrm["meta"]["otherLicenseUrl"] == NEW.license_url
    assert (vrm["meta"]["author"], vrm["meta"]["allowedUserName"]) == ("A. Person", "OnlyAuthor")
    assert [item["name"] for item in vrm["materialProperties"]] == [
        item["name"] for item in file.json["materials"]
    ]
    assert vrm["firstPerson"]["firstPersonBone"] == person.body.bone_names.index("head")
    positions = file.array(file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"])
    np.testing.assert_array_equal(
        positions[: len(person.surface.vertices)],
        person.surface.vertices * np.float32([-1, 1, -1]),
    )  # faces -z
    assert all(node.get("rotation", [0, 0, 0, 1]) == [0, 0, 0, 1] for node in file.json["nodes"])
    with pytest.raises(InputError, match=r"choose from 1.0, 0.x"):
        dataclasses.replace(NEW, edition="2")


def test_a_skirt_hangs_on_chains(person: Character, expressive: Character) -> None:
    hung, both = with_springs(person)
    assert [springs.name for springs in both] == ["skirt", "hair"]
    springs = both[0]
    assert len(springs.chains) == CHAINS
    assert all(len(chain) == JOINTS + 1 for chain in springs.chains)
    np.testing.assert_allclose(hung.weights.sum(axis=1), 1, atol=1e-5)
    body = len(expressive.surface.vertices)
    np.testing.assert_array_equal(hung.bones[:body], person.bones[:body])
    hem = np.argsort(person.surface.vertices[body:, 1])[:40] + body
    assert (
        hung.bones[hem] * (hung.weights[hem] > 0)
        >= len(person.body.bone_names) * (hung.weights[hem] > 0)
    ).all()
    assert [0.03 < capsule.radius < 0.12 for capsule in springs.capsules] == [True] * 4
    plain = prepare_rig(expressive, {}, rig="vrm")[0]
    assert with_springs(plain) == (plain, ())  # no skirt and no hair layer


def outside(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Distances of points (n, 3) from a line between two places."""
    along = np.clip((points - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1)
    return np.asarray(np.linalg.norm(points - start - along[:, None] * (end - start), axis=1))


@pytest.mark.slow
def test_three_vrm_reads_both(files: tuple[Path, Path], person: Character) -> None:
    script = bundled(Path(__file__).with_name("swing_in_three_vrm.mjs"), "three-vrm", *THREE_VRM)
    face = person.surface.face
    assert face is not None
    chosen, lips = list(range(0, len(person.surface.vertices), 97)), face.target("jawOpen")[0][::9]
    given = {
        "vertices": chosen,
        "face": lips.tolist(),
        "expressions": ["aa", "happy"],
        "lift": 1.2,
        "turn": 0.7,
    }
    both = told_by(
        script, given | {"files": [base64.b64encode(path.read_bytes()).decode() for path in files]}
    )
    skirt, hair = with_springs(person)[1]
    thigh = skirt.capsules[0]
    for told, version in zip(both, ("1", "0"), strict=True):
        assert told["meta"]["metaVersion"] == version
        assert set(told["bones"]) >= VRM_REQUIRED
        assert len(told["names"]) == len(EXPRESSIONS) + 52
        np.testing.assert_allclose(
            told["rest"], person.surface.vertices[chosen], atol=1e-5
        )  # both face +z now
        for name in ("aa", "happy"):
            whole = person.surface.vertices.astype(np.float64)
            moved, offsets = face.mixed(EXPRESSIONS[name])
            whole[moved] += offsets
            np.testing.assert_allclose(told["expressions"][name], whole[lips], atol=2e-4)
        assert told["swings"] >= CHAINS * JOINTS + len(hair.chains) * HAIR_JOINTS
        names = sorted(told["before"])
        before, still, moving, lifted = (
            np.array([told[when][name] for name in names])
            for when in ("before", "still", "moving", "lifted")
        )
        assert np.linalg.norm(still - before, axis=1).max() < 0.04  # at rest it hangs unchanged
        assert np.linalg.norm(moving - still, axis=1).max() > 0.05  # the thigh lifts the cloth
        back = [names.index(name) for name in names if name.startswith("skirt_5_")]
        assert np.linalg.norm(lifted - still, axis=1)[back].max() < 0.03  # and not behind
        ends = [name.endswith(("_1", "_2", "_3")) for name in names]
        away = outside(lifted[ends], *map(np.array, told["thigh"]))
        assert away.min() > thigh.radius - 0.01
        chains = sorted(told["hair"]["still"])
        assert len(chains) == len(hair.chains) * (HAIR_JOINTS + 1)
        hanging, swung, after = (
            np.array([told["hair"][when][name] for name in chains])
            for when in ("still", "moving", "after")
        )
        assert np.linalg.norm(swung - hanging, axis=1).max() > 0.015  # the tips stay behind
        assert np.linalg.norm(after - hanging, axis=1).max() < 0.01  # and come back
