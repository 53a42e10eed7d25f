"""GLB files as the tests read them, and Khronos' validator."""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from a2v.kinematics import quat_to_rotmat
from tests.support.npm import npm_folder

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def validator() -> Path:
    """Khronos' glTF validator from npm, in an ignored folder."""
    if shutil.which("node") is None:
        pytest.skip("Khronos' glTF validator needs node; it is not installed")
    return npm_folder("gltf-validator", "gltf-validator@2.0.0-dev.3.10") / "node_modules"


def glb(tree: Any, binary: bytes = b"") -> bytes:
    """A binary glTF of a JSON value and a chunk of numbers."""
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = (
        len(text).to_bytes(4, "little")
        + b"JSON"
        + text
        + len(binary).to_bytes(4, "little")
        + b"BIN\0"
        + binary
    )
    return b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks


def validate(path: Path, modules: Path) -> dict[str, Any]:
    command = [
        "node",
        str(ROOT / "tests" / "formats" / "validate_gltf.js"),
        str(modules),
        str(path),
    ]
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
        kind = {5126: np.float32, 5125: np.uint32, 5123: np.uint16, 5121: np.uint8}[
            item["componentType"]
        ]
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
            local[:3, :3], local[:3, 3] = (
                quat_to_rotmat(np.array([w, x, y, z])),
                node.get("translation", [0, 0, 0]),
            )
            world[index] = parent @ local
            for child in node.get("children", []):
                visit(child, world[index])

        for root in document["scenes"][0]["nodes"]:
            visit(root, np.eye(4))
        skin = document["skins"][0]
        inverse = np.swapaxes(self.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4), 1, 2)
        matrices = np.stack([world[joint] for joint in skin["joints"]]) @ inverse
        attributes = document["meshes"][0]["primitives"][0]["attributes"]
        points, joints, weights = (
            self.array(attributes[name]) for name in ("POSITION", "JOINTS_0", "WEIGHTS_0")
        )
        blended = np.einsum("vk,vkab->vab", weights, matrices[joints])
        return np.einsum("vab,vb->va", blended[:, :3, :3], points) + blended[:, :3, 3]
