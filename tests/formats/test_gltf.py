from __future__ import annotations

import dataclasses
import json
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from a2v import Character, InputError, Surface
from a2v.animation import ArapDeformer, deform, retarget
from a2v.formats import read_motion
from a2v.formats.gltf import write_glb, write_morph_glb
from a2v.formats.obj_ply import write_obj, write_ply
from a2v.kinematics import quat_to_rotmat

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def validator() -> Path:
    """Khronos' glTF validator from npm, in an ignored folder."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is None or npm is None:
        pytest.skip("Khronos' glTF validator needs node and npm; they are not installed")
    folder = ROOT / "build" / "gltf-validator"
    modules = folder / "node_modules"
    if not (modules / "gltf-validator").is_dir():
        folder.mkdir(parents=True, exist_ok=True)
        command = [npm, "install", "--no-audit", "--no-fund", "--silent", "--prefix", str(folder), "gltf-validator@2.0.0-dev.3.10"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
        if done.returncode:
            pytest.skip(f"the npm registry gave no gltf-validator: {done.stderr.strip()[-200:]}")
    return modules


def validate(path: Path, modules: Path) -> dict[str, Any]:
    command = ["node", str(Path(__file__).with_name("validate_gltf.js")), str(modules), str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    report: dict[str, Any] = json.loads(done.stdout)
    return report


class Glb:
    """The parts of a GLB that the tests read."""

    def __init__(self, path: Path):
        data = path.read_bytes()
        magic, version, length = struct.unpack("<4sII", data[:12])
        assert (magic, version, length) == (b"glTF", 2, len(data))
        size = struct.unpack("<I", data[12:16])[0]
        self.json = json.loads(data[20 : 20 + size])
        self.blob = data[28 + size :]

    def array(self, index: int) -> np.ndarray:
        item = self.json["accessors"][index]
        kind = {5126: np.float32, 5125: np.uint32, 5123: np.uint16, 5121: np.uint8}[item["componentType"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}[item["type"]]
        start = self.json["bufferViews"][item["bufferView"]]["byteOffset"]
        flat = np.frombuffer(self.blob, kind, item["count"] * width, start)
        return flat.reshape(item["count"], width) if width > 1 else flat

    def animated(self, clip: str, frame: int) -> np.ndarray:
        """Skinned vertices as a viewer computes them."""
        document = self.json
        nodes = [dict(node) for node in document["nodes"]]
        animation = next(a for a in document["animations"] if a["name"] == clip)
        for channel in animation["channels"]:
            values = self.array(animation["samplers"][channel["sampler"]]["output"])
            nodes[channel["target"]["node"]][channel["target"]["path"]] = values[frame].tolist()
        world = {}

        def visit(index: int, parent: np.ndarray) -> None:
            node, local = nodes[index], np.eye(4)
            x, y, z, w = node.get("rotation", [0, 0, 0, 1])
            local[:3, :3], local[:3, 3] = quat_to_rotmat(np.array([w, x, y, z])), node.get("translation", [0, 0, 0])
            world[index] = parent @ local
            for child in node.get("children", []):
                visit(child, world[index])

        for root in document["scenes"][0]["nodes"]:
            visit(root, np.eye(4))
        skin = document["skins"][0]
        inverse = np.swapaxes(self.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4), 1, 2)
        matrices = np.stack([world[joint] for joint in skin["joints"]]) @ inverse
        attributes = document["meshes"][0]["primitives"][0]["attributes"]
        points, joints, weights = (self.array(attributes[name]) for name in ("POSITION", "JOINTS_0", "WEIGHTS_0"))
        blended = np.einsum("vk,vkab->vab", weights, matrices[joints])
        return np.einsum("vab,vb->va", blended[:, :3, :3], points) + blended[:, :3, 3]


@pytest.fixture(scope="module")
def textured(character: Character) -> Character:
    random = np.random.default_rng(0)
    surface = character.surface
    uv = surface.vertices[surface.faces][..., :2] * [0.4, 0.5] + [0.5, 0.0]
    uv[::7] += 0.01  # seams
    texture = random.integers(0, 256, (64, 32, 3), dtype=np.uint8)
    return dataclasses.replace(character, surface=dataclasses.replace(surface, uv=uv.astype(np.float32), texture=texture))


@pytest.fixture(scope="module")
def clips(character: Character, data_dir: Path) -> dict[str, tuple[np.ndarray, float]]:
    folder = data_dir / "motions"
    return {
        name: (retarget(read_motion(folder / f"humanoid3d_{name}.txt", fps=10), character.body), 10.0) for name in ("walk", "cartwheel")
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
        np.concatenate([textured.surface.faces.reshape(-1, 1), textured.surface.uv.reshape(-1, 2)], axis=1),
        axis=0,  # type: ignore[union-attr]
    )[:, 0].astype(int)
    for name, frame in (("walk", 5), ("cartwheel", 12)):
        wanted = deform(textured, clips[name][0][frame])
        got = glb.animated(name, frame)
        assert len(got) == len(source) > len(wanted)
        order = np.lexsort(np.round(glb.array(glb.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"]), 5).T)
        rest = textured.surface.vertices[source]
        np.testing.assert_allclose(got[order], wanted[source][np.lexsort(np.round(rest, 5).T)], atol=2e-4)


def test_vertex_colours_without_a_texture(tmp_path: Path, character: Character, validator: Path) -> None:
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
    image = Image.open(io.BytesIO(glb.blob[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]))
    np.testing.assert_array_equal(np.asarray(image), textured.surface.texture)
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    down, height = glb.array(attributes["TEXCOORD_0"])[:, 1], glb.array(attributes["POSITION"])[:, 1]
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
    np.testing.assert_allclose(moved[index], frames[2][textured.surface.faces].reshape(-1, 3), atol=1e-5)


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
