"""Expressions in files: GLB's morph targets, VRM's expressions, USD's blend shapes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from a2v import Character, InputError
from a2v.animation import blinking, deform, express, prepare_rig
from a2v.animation.expressions import BlinkSettings
from a2v.formats import write_glb, write_usd
from a2v.formats.gltf import VrmMeta, write_vrm, write_vrma
from a2v.formats.gltf.vrm import EXPRESSIONS
from a2v.geometry.mesh import vertex_normals
from pipelines.nodes.values import Poses
from pipelines.rigs import RigOptions, write_avatar, write_rigged
from tests.support.glb import Glb, validate

SHUT = blinking(48, 24.0, BlinkSettings(seed=1))
META = VrmMeta(name="Ada", author="A. Person", license_url="https://example.org/license")


def morphed(file: Glb, name: str, attribute: str = "POSITION") -> np.ndarray:
    """Offsets (N, 3) of one morph target."""
    mesh = file.json["meshes"][0]
    target = mesh["primitives"][0]["targets"][mesh["extras"]["targetNames"].index(name)][attribute]
    accessor = file.json["accessors"][target]
    sparse, dense = accessor["sparse"], np.zeros((accessor["count"], 3), np.float32)
    views = [
        file.json["bufferViews"][sparse[part]["bufferView"]]["byteOffset"]
        for part in ("indices", "values")
    ]
    kind = {5123: np.uint16, 5125: np.uint32}[sparse["indices"]["componentType"]]
    index = np.frombuffer(file.blob, kind, sparse["count"], views[0])
    assert (np.diff(index.astype(np.int64)) > 0).all()
    dense[index] = np.frombuffer(file.blob, np.float32, 3 * sparse["count"], views[1]).reshape(
        -1, 3
    )
    return dense


def test_a_glb_has_every_expression_and_blinks(
    expressive: Character, validator: Path, tmp_path: Path
) -> None:
    moves = np.repeat(expressive.body.bone_transforms[None], 48, axis=0)
    strengths = blinking(48, 24.0, BlinkSettings(seed=1))
    assert max(strengths["eyeBlinkLeft"]) == 1
    write_glb(
        tmp_path / "a.glb", expressive, {"stand": (moves, 24.0)}, expressions={"stand": strengths}
    )
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
        normals = file.array(
            file.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"]
        ) + morphed(file, name, "NORMAL")
        wanted = vertex_normals(
            (expressive.surface.vertices + whole).astype(np.float64), expressive.surface.faces
        )
        assert np.abs(normals - wanted).max() < 0.021  # smaller changes are left out
        assert np.abs(morphed(file, name, "NORMAL")).max() > 0.1
    channel = next(
        one for one in file.json["animations"][0]["channels"] if one["target"]["path"] == "weights"
    )
    table = file.array(
        file.json["animations"][0]["samplers"][channel["sampler"]]["output"]
    ).reshape(48, 52)
    np.testing.assert_array_equal(
        table[:, face.names.index("eyeBlinkRight")], strengths["eyeBlinkRight"]
    )
    assert table.sum() == pytest.approx(2 * strengths["eyeBlinkLeft"].sum())
    with pytest.raises(InputError, match="wink"):
        write_glb(
            tmp_path / "b.glb",
            expressive,
            {"stand": (moves, 24.0)},
            expressions={"stand": {"wink": np.zeros(48)}},
        )


def test_expressions_cost_little(
    expressive: Character, character: Character, tmp_path: Path
) -> None:
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
        assert {
            names[bind["index"]]: bind["weight"]
            for bind in said["preset"][name]["morphTargetBinds"]
        } == dict(strengths)
    assert all(
        file.json["nodes"][bind["node"]]["mesh"] == 0
        for bind in said["preset"]["aa"]["morphTargetBinds"]
    )


@pytest.mark.parametrize("rig", ["mixamo", "unreal"])
def test_blinks_on_other_rigs(
    expressive: Character, validator: Path, tmp_path: Path, rig: str
) -> None:
    poses = Poses(
        bone_transforms=np.repeat(expressive.body.bone_transforms[None], 48, axis=0),
        fps=24.0,
        expressions=SHUT,
    )
    path, _ = write_rigged(tmp_path, expressive, poses, RigOptions(rig=rig), name="stand")
    assert validate(path, validator)["errors"] == 0
    file = Glb(path)
    (channel,) = (
        one for one in file.json["animations"][0]["channels"] if one["target"]["path"] == "weights"
    )
    assert file.json["nodes"][channel["target"]["node"]]["mesh"] == 0
    table = file.array(
        file.json["animations"][0]["samplers"][channel["sampler"]]["output"]
    ).reshape(48, 52)
    np.testing.assert_array_equal(
        table[:, file.json["meshes"][0]["extras"]["targetNames"].index("eyeBlinkLeft")],
        SHUT["eyeBlinkLeft"],
    )


def test_blinks_of_a_vrm_are_in_its_clips(
    expressive: Character, validator: Path, tmp_path: Path
) -> None:
    moves = np.repeat(expressive.body.bone_transforms[None], 48, axis=0)
    _, path = write_avatar(
        tmp_path / "a.vrm",
        expressive,
        {"stand": (moves, 24.0)},
        META,
        expressions={"stand": {**SHUT, "jawOpen": SHUT["eyeBlinkLeft"]}},
    )
    report = validate(path, validator)
    assert report["errors"] == 0, report["messages"]
    file = Glb(path)
    said = file.json["extensions"]["VRMC_vrm_animation"]["expressions"]
    assert said["preset"].keys() == {"blinkLeft", "blinkRight"}
    node = said["preset"]["blinkLeft"]["node"]
    animation = file.json["animations"][0]
    (sampler,) = (
        one["sampler"]
        for one in animation["channels"]
        if one["target"] == {"node": node, "path": "translation"}
    )
    np.testing.assert_array_equal(
        file.array(animation["samplers"][sampler]["output"])[:, 0], SHUT["eyeBlinkLeft"]
    )
    person, _ = prepare_rig(expressive, {}, rig="vrm")
    with pytest.raises(InputError, match="'eyeBlinkLeft' of shape"):
        write_vrma(path, person.body, person.body.bone_transforms[None], 24.0, strengths=SHUT)


def test_usds_own_deformer_blinks(expressive: Character, tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom, UsdSkel

    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    moves = np.repeat(expressive.body.bone_transforms[None].astype(np.float64), 48, axis=0)
    moves[:, :, :3, :3], moves[:, :, :3, 3] = (
        turn @ moves[:, :, :3, :3],
        moves[:, :, :3, 3] @ turn.T,
    )
    write_usd(
        tmp_path / "a.usdc", expressive, {"turned": (moves, 24.0)}, expressions={"turned": SHUT}
    )
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    assert UsdSkel.BakeSkinning(UsdSkel.Root(stage.GetDefaultPrim()))
    points = UsdGeom.Mesh(stage.GetPrimAtPath("/character/surface")).GetPointsAttr()
    shut = int(SHUT["eyeBlinkLeft"].argmax())
    for frame, strength in ((shut, 1.0), (0, 0.0)):
        lids = dict.fromkeys(SHUT, strength)
        wanted = express(expressive, deform(expressive, moves[frame]), moves[frame], lids)
        np.testing.assert_allclose(np.array(points.Get(frame)), wanted, atol=2e-4)


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
    shape = UsdSkel.BlendShape(
        stage.GetPrimAtPath(binding.GetBlendShapeTargetsRel().GetTargets()[place])
    )
    moved, offsets = face.target("jawOpen")
    places = np.array(shape.GetPointIndicesAttr().Get())
    own = np.isin(places, moved)
    np.testing.assert_array_equal(places[own], moved)
    np.testing.assert_allclose(np.array(shape.GetOffsetsAttr().Get())[own], offsets, atol=1e-7)
    assert not np.array(shape.GetOffsetsAttr().Get())[~own].any()
    assert np.linalg.norm(shape.GetNormalOffsetsAttr().Get(), axis=1).max() > 0.3
