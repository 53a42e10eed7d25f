"""A bounded reader of binary glTF 2.0: the container, its accessors and its images.

It covers what skinned people need; the caller interprets skins and poses. The JSON is read with the
standard library rather than pygltflib, so that every broken file gives one clear `InputError`.
"""

from __future__ import annotations

import io
import os
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.formats.gltf.bounds import (
    MAX_IMAGE_SIDE,
    MAX_ITEMS,
    MAX_JOINTS,
    MAX_NUMBERS,
    excess,
    parse_gltf,
)
from a2v.formats.gltf.parts import join_parts
from a2v.geometry.polar import nearest_rotations
from a2v.io import brief, read_bytes, shorten
from a2v.kinematics import rotmat_to_quat
from a2v.types import ByteArray, FloatArray

MAX_FILE_BYTES = 128 << 20
MAX_STRIDE = 252
"""Largest stride of a buffer view, bytes (glTF 2.0, section 5.11.4)."""

_UNEVEN = 0.02
"""Largest relative difference between the scales of a bone along its axes."""
_LEAST_SIZE = 1e-9
_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


@dataclass(frozen=True)
class Gltf:
    """A parsed ``.glb``: its JSON and its binary chunk. It counts the numbers that are read."""

    path: Path
    json: dict[str, Any]
    binary: bytes
    _lists: dict[str, list[dict[str, Any]]] = field(default_factory=dict, repr=False, compare=False)
    _read: list[int] = field(default_factory=lambda: [0], repr=False, compare=False)

    def fail(self, what: str) -> InputError:
        """Return an error that names the file."""
        return self.expect(what, "a binary glTF 2.0 of a skinned person")

    def expect(self, what: str, expected: str) -> InputError:
        """Return an error that names the file, and what was expected."""
        return InputError(f"{self.path}: {shorten(what, 400)}; expected {expected}")

    def items(self, kind: str) -> list[dict[str, Any]]:
        """Return the list `kind` ("nodes", "meshes", ...) of the file; empty if absent."""
        if kind not in self._lists:
            value = self.json.get(kind, [])
            if (
                not isinstance(value, list)
                or len(value) > MAX_ITEMS
                or any(not isinstance(entry, dict) for entry in value)
            ):
                raise self.fail(f"'{kind}' is no list of at most {MAX_ITEMS} objects")
            self._lists[kind] = value
        return self._lists[kind]

    def indices(self, kind: str, value: Any, name: str) -> list[int]:
        """Check and return a list of indices into the list `kind`, such as "children" and "joints";
        `name` is its name in messages."""
        if not isinstance(value, list) or len(value) > MAX_ITEMS:
            raise self.fail(f"'{name}' is {brief(value)}, no list of {kind}")
        for index in value:
            self.item(kind, index)
        return value

    def joints(self, skin: dict[str, Any]) -> list[int]:
        """Return the nodes that are the joints of a skin. Some exporters list one twice."""
        joints = self.indices("nodes", skin.get("joints"), "joints")
        if not 1 <= len(joints) <= MAX_JOINTS:
            raise self.fail(f"a skin has {len(joints)} joints; expected 1 to {MAX_JOINTS}")
        return joints

    def item(self, kind: str, index: Any) -> dict[str, Any]:
        """Return entry `index` of list `kind`."""
        entries = self.items(kind)
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(entries):
            raise self.fail(f"refers to {kind}[{brief(index)}] of {len(entries)}")
        return entries[index]

    def view(self, index: Any) -> tuple[int, int, int]:
        """Return offset, length and stride (0: tightly packed) in bytes of a buffer view, checked
        against the binary chunk."""
        view = self.item("bufferViews", index)
        offset, length, stride = (
            self._count(view.get(key, 0), key) for key in ("byteOffset", "byteLength", "byteStride")
        )
        if view.get("buffer", 0) != 0 or offset + length > len(self.binary):
            raise self.fail(
                f"bufferView {index} reaches beyond the file's {len(self.binary)} bytes"
            )
        return offset, length, stride

    def count(self, index: Any) -> int:
        """Return the number of elements that an accessor states."""
        return self._count(self.item("accessors", index).get("count"), "count")

    def accessor(self, index: Any, only: str = "") -> np.ndarray:
        """Read an accessor as (count, width); normalized integers are mapped to [0, 1] or [-1, 1]
        float32.

        Interleaved views are de-interleaved; sparse accessors are not supported. `only` is the
        expected type, such as "VEC3"; another is refused before it is read, as is an accessor by
        which more than `MAX_NUMBERS` would be read of the file.
        """
        accessor, count = self.item("accessors", index), self.count(index)
        kind, layout = accessor.get("componentType"), accessor.get("type")
        component = _COMPONENTS.get(kind) if isinstance(kind, int) else None
        width = _WIDTHS.get(layout) if isinstance(layout, str) else None
        if component is None or width is None or "sparse" in accessor:
            raise self.fail(f"accessor {index} is of an unknown or sparse kind")
        if only and layout != only:
            raise self.fail(f"accessor {index} is a {layout}; expected {only}")
        self._read[0] += count * width
        if self._read[0] > MAX_NUMBERS:
            raise self.fail(f"accessor {index} goes beyond the {MAX_NUMBERS} numbers that are read")
        if "bufferView" not in accessor:
            return np.zeros((count, width), component)
        start, length, stride = self.view(accessor["bufferView"])
        dtype = np.dtype(component)
        offset, stride = (
            self._count(accessor.get("byteOffset", 0), "byteOffset"),
            stride or dtype.itemsize * width,
        )
        if stride > MAX_STRIDE:
            raise self.fail(f"accessor {index} has a stride of {brief(stride)} bytes")
        if count and offset + stride * (count - 1) + dtype.itemsize * width > length:
            raise self.fail(f"accessor {index} reaches beyond its bufferView")
        raw: np.ndarray = np.ndarray(
            (count, width), dtype, self.binary, start + offset, (stride, dtype.itemsize)
        ).copy()
        if not accessor.get("normalized") or dtype.kind == "f":
            return raw
        return np.maximum(raw.astype(np.float32) / np.iinfo(dtype).max, -1.0)

    def image(self, index: Any) -> ByteArray:
        """Decode image `index` to (H, W, 3) uint8 sRGB; the size is checked before decoding."""
        from PIL import Image

        source = self.item("images", index)
        if "bufferView" not in source:
            raise self.fail(f"image {index} is not inside the file")
        start, length, _ = self.view(source["bufferView"])
        try:
            with Image.open(
                io.BytesIO(self.binary[start : start + length]), formats=("JPEG", "PNG", "WEBP")
            ) as picture:
                if max(picture.size) > MAX_IMAGE_SIDE:
                    raise self.fail(
                        f"image {index} is {picture.width} x {picture.height} pixels; at most "
                        f"{MAX_IMAGE_SIDE} are read"
                    )
                return np.asarray(picture.convert("RGB"))
        except OSError as error:
            raise self.fail(f"image {index} is no readable JPEG, PNG or WebP ({error})") from error

    def node_matrices(self) -> tuple[FloatArray, list[int]]:
        """Return the world matrices (N, 4, 4) float64 of the nodes in the pose of the file, and
        each node's parent (-1: none)."""
        nodes = self.items("nodes")
        parents = [-1] * len(nodes)
        for index, node in enumerate(nodes):
            for child in self.indices("nodes", node.get("children", []), "children"):
                if parents[child] >= 0:
                    raise self.fail(f"node {child} has two parents")
                parents[child] = index
        world: list[np.ndarray | None] = [None] * len(nodes)
        level = [0] * len(nodes)
        for index in range(len(nodes)):
            chain, at = [], index
            while at >= 0 and world[at] is None:
                chain.append(at)
                at = parents[at]
                if len(chain) + (level[at] if at >= 0 else 0) > MAX_JOINTS:
                    raise self.fail(f"the nodes form a loop, or more than {MAX_JOINTS} levels")
            for link in reversed(chain):
                local = self.local_matrix(link)
                above = world[parents[link]] if parents[link] >= 0 else None
                level[link] = level[parents[link]] + 1 if parents[link] >= 0 else 1
                world[link] = local if above is None else above @ local
        return np.stack([matrix for matrix in world if matrix is not None]) if nodes else np.zeros(
            (0, 4, 4)
        ), parents

    def without_matrix(self, node: dict[str, Any]) -> dict[str, Any]:
        """Return a node with its matrix as translation, rotation and scale."""
        matrix = self._matrix(node)
        turns, odd = decomposed(matrix[None])
        scale = np.linalg.norm(matrix[:3, :3], axis=0)
        if odd and np.abs(turns[0] * scale - matrix[:3, :3]).max() > 1e-3 * scale.max():
            raise self.fail(f"has a sheared matrix at node {brief(node.get('name', ''))}")
        return {name: value for name, value in node.items() if name != "matrix"} | {
            "translation": matrix[:3, 3].tolist(),
            "rotation": rotmat_to_quat(turns)[0, [1, 2, 3, 0]].tolist(),
            "scale": scale.tolist(),
        }

    def local_matrix(self, index: int) -> np.ndarray:
        """Return the transform (4, 4) float64 of a node in its parent."""
        return self._matrix(self.items("nodes")[index])

    def _matrix(self, node: dict[str, Any]) -> np.ndarray:
        try:
            if "matrix" in node:
                return (
                    np.asarray(node["matrix"], np.float64).reshape(4, 4).T
                )  # glTF is column-major
            x, y, z, w = np.asarray(node.get("rotation", (0, 0, 0, 1)), np.float64).reshape(4)
            scale = np.asarray(node.get("scale", (1, 1, 1)), np.float64).reshape(3)
            move = np.asarray(node.get("translation", (0, 0, 0)), np.float64).reshape(3)
        except (TypeError, ValueError, OverflowError) as error:
            raise self.fail(
                f"node {brief(node.get('name', ''))} has a malformed transform ({shorten(error)})"
            ) from error
        local = np.eye(4)
        local[:3, :3] = scale * np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        local[:3, 3] = move
        return local

    def _count(self, value: Any, name: str) -> int:
        if not isinstance(value, int) or isinstance(value, bool) or value < 0:
            raise self.fail(f"'{name}' is {shorten(value, 60)}")
        return value


def node_name(node: dict[str, Any]) -> str:
    """Return the name of a node. That of an FBX is among the extras if three.js has changed it."""
    extras = node.get("extras")
    own = extras.get("name") if isinstance(extras, dict) else None
    return (own if isinstance(own, str) and own else str(node.get("name", "")))[:200]


def decomposed(matrices: FloatArray) -> tuple[FloatArray, tuple[int, ...]]:
    """Return the rotations (n, 3, 3) of matrices (n, 4, 4), and which are mirrored, scaled to
    nothing, or scaled unevenly; the nearest rotation of these is a guess."""
    axes = matrices[:, :3, :3]
    lengths = np.linalg.norm(axes, axis=1)
    sizes = lengths.mean(axis=1)
    flat = sizes < _LEAST_SIZE
    uneven = (np.abs(lengths - sizes[:, None]) > _UNEVEN * sizes[:, None]).any(axis=1)
    odd = flat | uneven | (np.linalg.det(axes) <= 0)
    units = np.where(
        flat[:, None, None], np.eye(3), axes / np.maximum(sizes, _LEAST_SIZE)[:, None, None]
    )
    return nearest_rotations(units), tuple(np.flatnonzero(odd).tolist())


def read_glb(path: str | os.PathLike[str]) -> Gltf:
    """Read the container of a binary glTF 2.0 file, or a ``.gltf`` with its parts beside it.

    Raises
    ------
    InputError
        The file is missing, too large, truncated or not a binary glTF 2.0; the message names the
        file.
    """
    source = Path(path)
    data = read_bytes(source, limit=MAX_FILE_BYTES)
    empty = Gltf(source, {}, b"")
    if data.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"{":
        try:
            content, binary = join_parts(source, parse_gltf(data), MAX_FILE_BYTES)
        except ValueError as error:
            raise empty.fail(shorten(error, 300)) from None
        return _bounded(Gltf(source, content, binary))
    if len(data) < 20 or data[:4] != b"glTF" or struct.unpack_from("<I", data, 4)[0] != 2:
        raise empty.fail("is no binary glTF 2.0")
    chunks: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= len(data):
        length, kind = struct.unpack_from("<I4s", data, at)
        if at + 8 + length > len(data):
            raise empty.fail("is truncated")
        chunks.setdefault(kind, data[at + 8 : at + 8 + length])
        at += 8 + length
    try:
        content = parse_gltf(chunks.get(b"JSON", b""))
    except ValueError as error:
        raise empty.fail(f"has unusable JSON ({shorten(error)})") from None
    return _bounded(Gltf(source, content, chunks.get(b"BIN\0", b"")))


def _bounded(file: Gltf) -> Gltf:
    """Return the file if nothing in it is used too often."""
    if problem := excess(*(file.items(kind) for kind in ("nodes", "skins", "meshes"))):
        raise file.fail(problem)
    return file
