"""GLB for engines: materials, normal maps, coarser copies and compression."""

from __future__ import annotations

import dataclasses
import json
import struct
from pathlib import Path

import numpy as np
import pytest

from a2v import Character, InputError, MissingDependencyError
from a2v.formats.gltf import compress_glb, write_glb
from a2v.formats.gltf.compression import KINDS, PACKAGES
from a2v.npm import find_node
from a2v.types import MATERIALS
from pipelines.engines import EngineOptions
from tests.support.glb import Glb, validate
from tests.support.npm import npm_folder


@pytest.fixture(scope="module")
def person(expressive: Character) -> Character:
    """With a texture, a normal map and a material for each fifth of the height."""
    surface = expressive.surface
    uv = surface.vertices[surface.faces][..., :2] * [0.4, 0.5] + [0.5, 0.0]
    picture = np.random.default_rng(0).integers(0, 256, (64, 64, 3), dtype=np.uint8)
    height = surface.vertices[surface.faces].mean(axis=1)[:, 1]
    fifth = np.clip(5 * height / height.max(), 0, 4).astype(np.uint8)
    return dataclasses.replace(
        expressive,
        surface=dataclasses.replace(
            surface, uv=uv.astype(np.float32), texture=picture, normal_map=picture, materials=fifth
        ),
    )


def test_materials_and_map_are_valid(person: Character, validator: Path, tmp_path: Path) -> None:
    write_glb(tmp_path / "a.glb", person)
    report = validate(tmp_path / "a.glb", validator)
    assert report["errors"] == 0, report["messages"]
    file = Glb(tmp_path / "a.glb")
    assert [material["name"] for material in file.json["materials"]] == list(MATERIALS)
    assert all("normalTexture" in material for material in file.json["materials"])
    primitives = file.json["meshes"][0]["primitives"]
    assert sum(len(file.array(primitive["indices"])) for primitive in primitives) == 3 * len(
        person.surface.faces
    )
    assert all(len(primitive["targets"]) == 52 for primitive in primitives)
    tangents = file.array(primitives[0]["attributes"]["TANGENT"])
    normals = file.array(primitives[0]["attributes"]["NORMAL"])
    np.testing.assert_allclose((tangents[:, :3] * normals).sum(axis=1), 0, atol=1e-4)
    assert set(tangents[:, 3]) <= {-1.0, 1.0}
    assert (
        file.json["accessors"][primitives[0]["attributes"]["WEIGHTS_0"]]["type"] == "VEC4"
    )  # four bones a vertex


def test_coarser_copies_lie_beside(person: Character, validator: Path, tmp_path: Path) -> None:
    options = EngineOptions(lods="8000,3000")
    written = options.write(
        tmp_path / "a.glb",
        person,
        lambda path, made, quality: write_glb(path, made, jpeg_quality=quality),
    )
    assert [path.name for path in written] == ["a.glb", "a_lod1.glb", "a_lod2.glb"]
    counts = []
    for path in written:
        report = validate(path, validator)
        assert report["errors"] == 0, report["messages"]
        counts.append(report["info"]["totalTriangleCount"])
    assert counts[1] <= 8000
    assert counts[2] <= 4000
    assert counts[0] > 20_000
    with pytest.raises(InputError, match="'many'"):
        EngineOptions(lods="many").check(tmp_path / "a.glb")
    with pytest.raises(InputError, match=r"apply to \.glb files"):
        EngineOptions(lods="8000").check(tmp_path / "a.fbx")


def test_without_the_tool_the_command_is_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("A2V_GLTF_TRANSFORM", str(tmp_path))
    with pytest.raises(InputError, match="zip"):
        compress_glb(tmp_path / "a.glb", "zip")
    if find_node() is None:
        pytest.skip("node is not installed")
    with pytest.raises(MissingDependencyError, match=r"npm install --prefix .*gltf-transform/cli"):
        EngineOptions(compress="meshopt").check(tmp_path / "a.glb")


@pytest.mark.parametrize("kind", KINDS)
def test_compressed_files_are_smaller_and_whole(
    kind: str, person: Character, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    if find_node() is None:
        pytest.skip("compression needs node; it is not installed")
    monkeypatch.setenv("A2V_GLTF_TRANSFORM", str(npm_folder("gltf_transform", *PACKAGES.packages)))
    write_glb(tmp_path / "a.glb", person)
    before = (tmp_path / "a.glb").stat().st_size
    compress_glb(tmp_path / "a.glb", kind)
    data = (tmp_path / "a.glb").read_bytes()
    assert len(data) < 0.8 * before
    document = json.loads(data[20 : 20 + struct.unpack("<I", data[12:16])[0]])
    assert any(kind in name for name in document["extensionsRequired"])
    assert len(document["skins"][0]["joints"]) == len(person.body.bone_names)
    assert all(len(primitive["targets"]) == 52 for primitive in document["meshes"][0]["primitives"])
    assert [material["name"] for material in document["materials"]] == list(MATERIALS)
