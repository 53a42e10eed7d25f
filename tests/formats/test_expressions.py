"""Expressions in files: GLB's morph targets, VRM's expressions, USD's blend shapes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from a2v import Character, InputError
from a2v.animation import blinking, prepare_rig
from a2v.animation.expressions import BlinkSettings
from a2v.formats import write_glb, write_usd
from a2v.formats.gltf import VrmMeta, write_vrm
from a2v.formats.gltf.vrm import EXPRESSIONS
from tests.support.glb import Glb, validate

META = VrmMeta(name="Ada", author="A. Person", licence_url="https://example.org/licence")


def morphed(file: Glb, name: str) -> np.ndarray:
    """Offsets (N, 3) of one morph target."""
    mesh = file.json["meshes"][0]
    target = mesh["primitives"][0]["targets"][mesh["extras"]["targetNames"].index(name)]["POSITION"]
    accessor = file.json["accessors"][target]
    sparse, dense = accessor["sparse"], np.zeros((accessor["count"], 3), np.float32)
    views = [file.json["bufferViews"][sparse[part]["bufferView"]]["byteOffset"] for part in ("indices", "values")]
    index = np.frombuffer(file.blob, np.uint32, sparse["count"], views[0])
    assert (np.diff(index.astype(np.int64)) > 0).all()
    dense[index] = np.frombuffer(file.blob, np.float32, 3 * sparse["count"], views[1]).reshape(-1, 3)
    return dense


def test_a_glb_has_every_expression_and_blinks(expressive: Character, validator: Path, tmp_path: Path) -> None:
    moves = np.repeat(expressive.body.bone_transforms[None], 48, axis=0)
    strengths = blinking(48, 24.0, BlinkSettings(seed=1))
    assert max(strengths["eyeBlinkLeft"]) == 1
    write_glb(tmp_path / "a.glb", expressive, {"stand": (moves, 24.0)}, expressions={"stand": strengths})
    report = validate(tmp_path / "a.glb", validator)
    assert report["errors"] == 0, report["messages"]
    file, face = Glb(tmp_path / "a.glb"), expressive.surface.face
    assert face is not None
    positions = file.array(file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"])
    for name in ("jawOpen", "eyeBlinkLeft", "tongueOut"):
        vertices, offsets = face.target(name)
        whole = np.zeros_like(expressive.surface.vertices)
        whole[vertices] = offsets
        np.testing.assert_array_equal(positions, expressive.surface.vertices)
        np.testing.assert_allclose(morphed(file, name), whole, atol=1e-7)
    channel = next(one for one in file.json["animations"][0]["channels"] if one["target"]["path"] == "weights")
    table = file.array(file.json["animations"][0]["samplers"][channel["sampler"]]["output"]).reshape(48, 52)
    np.testing.assert_array_equal(table[:, face.names.index("eyeBlinkRight")], strengths["eyeBlinkRight"])
    assert table.sum() == pytest.approx(2 * strengths["eyeBlinkLeft"].sum())
    with pytest.raises(InputError, match="wink"):
        write_glb(tmp_path / "b.glb", expressive, {"stand": (moves, 24.0)}, expressions={"stand": {"wink": np.zeros(48)}})


def test_expressions_cost_little(expressive: Character, character: Character, tmp_path: Path) -> None:
    write_glb(tmp_path / "a.glb", expressive)
    write_glb(tmp_path / "b.glb", character)
    assert (tmp_path / "a.glb").stat().st_size - (tmp_path / "b.glb").stat().st_size < 2_000_000
    assert "targets" not in Glb(tmp_path / "b.glb").json["meshes"][0]["primitives"][0]


def test_vrm_has_its_presets(expressive: Character, validator: Path, tmp_path: Path) -> None:
    person, _ = prepare_rig(expressive, {}, rig="vrm")
    write_vrm(tmp_path / "a.vrm", person, META)
    report = validate(tmp_path / "a.vrm", validator)
    assert report["errors"] == 0, report["messages"]
    file = Glb(tmp_path / "a.vrm")
    said = file.json["extensions"]["VRMC_vrm"]["expressions"]
    assert said["preset"].keys() == EXPRESSIONS.keys()
    assert len(said["custom"]) == 52
    names = file.json["meshes"][0]["extras"]["targetNames"]
    for name, strengths in EXPRESSIONS.items():
        assert strengths.keys() <= set(names)  # no name of ours is misspelt
        assert {names[bind["index"]]: bind["weight"] for bind in said["preset"][name]["morphTargetBinds"]} == dict(strengths)
    assert all(file.json["nodes"][bind["node"]]["mesh"] == 0 for bind in said["preset"]["aa"]["morphTargetBinds"])


def test_usd_has_blend_shapes(expressive: Character, tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from pxr import Usd, UsdSkel

    write_usd(tmp_path / "a.usdc", expressive)
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    binding = UsdSkel.BindingAPI(stage.GetPrimAtPath("/character/surface"))
    assert len(binding.GetBlendShapesAttr().Get()) == 52
    face = expressive.surface.face
    assert face is not None
    place = list(binding.GetBlendShapesAttr().Get()).index("jawOpen")
    shape = UsdSkel.BlendShape(stage.GetPrimAtPath(binding.GetBlendShapeTargetsRel().GetTargets()[place]))
    np.testing.assert_array_equal(np.array(shape.GetPointIndicesAttr().Get()), face.target("jawOpen")[0])
    np.testing.assert_allclose(np.array(shape.GetOffsetsAttr().Get()), face.target("jawOpen")[1])
