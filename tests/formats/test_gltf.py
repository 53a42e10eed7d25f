from __future__ import annotations

import dataclasses
import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from a2v import Character, InputError, Surface
from a2v.animation import RIGS, ArapDeformer, deform, prepare_rig, retarget
from a2v.formats import read_motion
from a2v.formats.gltf import Gltf, write_glb, write_morph_glb
from a2v.formats.obj_ply import write_obj, write_ply
from tests.support.glb import Glb, validate


@pytest.fixture(scope="module")
def textured(character: Character) -> Character:
    random = np.random.default_rng(0)
    surface = character.surface
    uv = surface.vertices[surface.faces][..., :2] * [0.4, 0.5] + [0.5, 0.0]
    uv[::7] += 0.01  # seams
    texture = random.integers(0, 256, (64, 32, 3), dtype=np.uint8)
    return dataclasses.replace(
        character, surface=dataclasses.replace(surface, uv=uv.astype(np.float32), texture=texture)
    )


@pytest.fixture(scope="module")
def clips(character: Character, data_dir: Path) -> dict[str, tuple[np.ndarray, float]]:
    folder = data_dir / "motions"
    return {
        name: (
            retarget(read_motion(folder / f"humanoid3d_{name}.txt", fps=10), character.body),
            10.0,
        )
        for name in ("walk", "cartwheel")
    }


def test_skinned_glb_is_valid_and_moves_like_our_frames(
    tmp_path: Path, textured: Character, clips: dict[str, tuple[np.ndarray, float]], validator: Path
) -> None:
    path = tmp_path / "c.glb"
    write_glb(path, textured, clips)
    report = validate(path, validator)
    assert report["errors"] == 0, report["messages"]
    assert report["info"]["animationCount"] == 2
    assert report["info"]["hasTextures"]
    assert report["info"]["hasSkins"]
    glb = Glb(path)
    assert [a["name"] for a in glb.json["animations"]] == ["walk", "cartwheel"]
    assert len(glb.json["skins"][0]["joints"]) == len(textured.body.bone_names)
    source = np.unique(
        np.concatenate(
            [textured.surface.faces.reshape(-1, 1), textured.surface.uv.reshape(-1, 2)], axis=1
        ),
        axis=0,  # type: ignore[union-attr]
    )[:, 0].astype(int)
    for name, frame in (("walk", 5), ("cartwheel", 12)):
        wanted = deform(textured, clips[name][0][frame])
        got = glb.animated(name, frame)
        assert len(got) == len(source) > len(wanted)
        order = np.lexsort(
            np.round(
                glb.array(glb.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"]), 5
            ).T
        )
        rest = textured.surface.vertices[source]
        np.testing.assert_allclose(
            got[order], wanted[source][np.lexsort(np.round(rest, 5).T)], atol=2e-4
        )


def test_vertex_colors_without_a_texture(
    tmp_path: Path, character: Character, validator: Path
) -> None:
    write_glb(tmp_path / "c.glb", character)
    report = validate(tmp_path / "c.glb", validator)
    assert report["errors"] == 0, report["messages"]
    glb = Glb(tmp_path / "c.glb")
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    linear = glb.array(attributes["COLOR_0"])[:, :3] / 65535
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(srgb, character.surface.colors, atol=2e-3)
    position = glb.json["accessors"][attributes["POSITION"]]
    np.testing.assert_allclose(position["min"], character.surface.vertices.min(0), atol=1e-6)
    assert "animations" not in glb.json


def test_texture_is_upright(tmp_path: Path, textured: Character) -> None:
    import io

    from PIL import Image

    write_glb(tmp_path / "c.glb", textured, jpeg_quality=0)
    glb = Glb(tmp_path / "c.glb")
    view = glb.json["bufferViews"][glb.json["images"][0]["bufferView"]]
    image = Image.open(
        io.BytesIO(glb.blob[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
    )
    np.testing.assert_array_equal(np.asarray(image), textured.surface.texture)
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    down, height = (
        glb.array(attributes["TEXCOORD_0"])[:, 1],
        glb.array(attributes["POSITION"])[:, 1],
    )
    assert np.corrcoef(down, height)[0, 1] < -0.99  # glTF counts v from the top


def test_morph_targets_hold_the_exact_frames(
    tmp_path: Path, textured: Character, clips: dict[str, tuple[np.ndarray, float]], validator: Path
) -> None:
    deformer = ArapDeformer(textured)
    frames = np.stack([deformer(t) for t in clips["walk"][0][:3]])
    write_morph_glb(tmp_path / "m.glb", textured.surface, frames, 10.0)
    report = validate(tmp_path / "m.glb", validator)
    assert report["errors"] == 0, report["messages"]
    glb = Glb(tmp_path / "m.glb")
    primitive = glb.json["meshes"][0]["primitives"][0]
    base, index = glb.array(primitive["attributes"]["POSITION"]), glb.array(primitive["indices"])
    assert len(primitive["targets"]) == 3
    moved = base + glb.array(primitive["targets"][2]["POSITION"])
    np.testing.assert_allclose(
        moved[index], frames[2][textured.surface.faces].reshape(-1, 3), atol=1e-5
    )


@pytest.mark.parametrize("suffix", [".obj", ".ply"])
def test_meshes_read_back(tmp_path: Path, textured: Character, suffix: str) -> None:
    import trimesh

    surface: Surface = dataclasses.replace(textured.surface, uv=None, texture=None)
    path = tmp_path / f"m{suffix}"
    (write_obj if suffix == ".obj" else write_ply)(path, surface)
    mesh = trimesh.load(path, process=False)
    np.testing.assert_allclose(mesh.vertices, surface.vertices, atol=1e-5)
    np.testing.assert_array_equal(mesh.faces, surface.faces)
    np.testing.assert_allclose(mesh.visual.vertex_colors[:, :3] / 255, surface.colors, atol=0.005)


def test_textured_obj_brings_its_material(tmp_path: Path, textured: Character) -> None:
    write_obj(tmp_path / "m.obj", textured.surface)
    assert {p.name for p in tmp_path.iterdir()} == {"m.obj", "m.mtl", "m.png"}
    text = (tmp_path / "m.obj").read_text()
    assert text.startswith("mtllib m.mtl\nusemtl surface\n")
    assert sum(line.startswith("f ") for line in text.split("\n")) == len(textured.surface.faces)


def test_bad_clips(tmp_path: Path, character: Character) -> None:
    bones = len(character.body.bone_names)
    for transforms, fps, what in (
        (np.zeros((3, bones, 4)), 20.0, "shape"),
        (np.full((3, bones, 4, 4), np.nan), 20.0, "NaN"),
        (np.tile(np.eye(4), (3, bones, 1, 1)), 0.0, "per second"),
    ):
        with pytest.raises(InputError, match=what):
            write_glb(tmp_path / "c.glb", character, {"a": (transforms, fps)})
    with pytest.raises(InputError, match="expected"):
        write_morph_glb(tmp_path / "c.glb", character.surface, np.zeros((2, 5, 3)), 20.0)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("rig", RIGS)
def test_every_rig_is_valid_and_moves_like_its_frames(
    tmp_path: Path,
    character: Character,
    clips: dict[str, tuple[np.ndarray, float]],
    validator: Path,
    rig: str,
) -> None:
    person, moves = prepare_rig(character, clips, rig=rig, root_motion=True)
    write_glb(tmp_path / "c.glb", person, moves)
    report = validate(tmp_path / "c.glb", validator)
    assert report["errors"] == 0, report["messages"]
    glb = Glb(tmp_path / "c.glb")
    assert [glb.json["nodes"][joint]["name"] for joint in glb.json["skins"][0]["joints"]] == list(
        person.body.bone_names
    )
    for name, frame in (("walk", 5), ("cartwheel", 12)):
        np.testing.assert_allclose(
            glb.animated(name, frame), deform(person, moves[name][0][frame]), atol=2e-4
        )


@pytest.mark.parametrize("form", ["JPEG", "PNG", "WEBP"])
def test_textures_of_other_programs_are_read(form: str) -> None:
    stream = io.BytesIO()
    Image.fromarray(np.full((4, 6, 3), 120, np.uint8)).save(stream, form)
    binary = stream.getvalue()
    content = {
        "images": [{"bufferView": 0}],
        "bufferViews": [{"buffer": 0, "byteLength": len(binary)}],
        "buffers": [{"byteLength": len(binary)}],
    }
    assert np.abs(Gltf(Path("a.glb"), content, binary).image(0).astype(int) - 120).max() <= 1
    with pytest.raises(InputError, match="no readable JPEG, PNG or WebP"):
        Gltf(Path("a.glb"), content, b"GIF89a" + binary[6:]).image(0)
