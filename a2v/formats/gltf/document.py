"""A glTF document under construction."""

from __future__ import annotations

import json
import os
import struct
from typing import Any

import numpy as np

from a2v.io import atomic_path
from a2v.types import FloatArray, IntArray
from a2v.version import __version__

ARRAY_BUFFER = 34962
"""glTF's number of a buffer of vertices (OpenGL)."""
ELEMENT_BUFFER = 34963
"""glTF's number of a buffer of indices (OpenGL)."""
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
_COMPONENTS = {
    np.dtype(np.float32): 5126,
    np.dtype(np.uint32): 5125,
    np.dtype(np.uint16): 5123,
    np.dtype(np.uint8): 5121,
}


def smallest_kind(count: int) -> type[np.uint16] | type[np.uint32]:
    """Return the smallest type of indices into `count` vertices; glTF reserves the largest number
    of a type."""
    return np.uint16 if count < 65535 else np.uint32


def pack_glb(tree: dict[str, Any], binary: bytes) -> bytes:
    """Return a binary glTF of its JSON and its binary chunk."""
    text = json.dumps(tree, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    return b"".join(
        (
            struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(binary)),
            struct.pack("<I4s", len(text), b"JSON") + text,
            struct.pack("<I4s", len(binary), b"BIN\0") + binary,
        )
    )


class Document:
    """A glTF document under construction: JSON plus one binary buffer."""

    def __init__(self, name: str):
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": f"a2v {__version__}"},
            "scene": 0,
            "scenes": [{"name": name, "nodes": []}],
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
            "materials": [],
        }
        self.blob = bytearray()

    def view(self, data: bytes, target: int | None = None) -> int:
        """Append bytes as a buffer view; return its index."""
        self.blob += b"\0" * (-len(self.blob) % 4)
        entry: dict[str, Any] = {"buffer": 0, "byteOffset": len(self.blob), "byteLength": len(data)}
        if target is not None:
            entry["target"] = target
        self.blob += data
        self.json["bufferViews"].append(entry)
        return len(self.json["bufferViews"]) - 1

    def accessor(
        self,
        array: np.ndarray,
        *,
        target: int | None = None,
        bounds: bool = False,
        normalized: bool = False,
    ) -> int:
        """Append an array (N, ...) of a component type of glTF; return the index of its
        accessor."""
        array = np.ascontiguousarray(array)
        flat = array.reshape(len(array), -1)
        entry: dict[str, Any] = {
            "bufferView": self.view(array.tobytes(), target),
            "componentType": _COMPONENTS[array.dtype],
            "count": len(array),
            "type": _TYPES[flat.shape[1]],
        }
        if normalized:
            entry["normalized"] = True
        if bounds:
            entry["min"], entry["max"] = flat.min(axis=0).tolist(), flat.max(axis=0).tolist()
        self.json["accessors"].append(entry)
        return len(self.json["accessors"]) - 1

    def times(self, frames: int, fps: float) -> int:
        """Append the times of an animation's frames, seconds; return the index of their
        accessor."""
        return self.accessor((np.arange(frames) / fps).astype(np.float32), bounds=True)

    def channel(
        self,
        animation: dict[str, Any],
        times: int,
        target: tuple[int, str],
        values: FloatArray,
        *,
        interpolation: str = "LINEAR",
    ) -> None:
        """Append a channel to an animation: `values` (T, ...) at `times` of a property (path) of
        a node, its `target`."""
        output = self.accessor(values.astype(np.float32))
        sampler = {"input": times, "output": output, "interpolation": interpolation}
        animation["samplers"].append(sampler)
        node, path = target
        animation["channels"].append(
            {"sampler": len(animation["samplers"]) - 1, "target": {"node": node, "path": path}}
        )

    def sparse_accessor(self, count: int, indices: IntArray, values: FloatArray) -> int:
        """Append vectors (count, 3) that are zero except `values` (n, 3) float32 at ascending
        `indices` (n,), n >= 1.

        Returns the index of the accessor.
        """
        values = np.ascontiguousarray(values, np.float32)
        whole = np.concatenate([values, np.zeros((int(len(values) < count), 3), np.float32)])
        kind = smallest_kind(count)
        entry = {
            "componentType": _COMPONENTS[np.dtype(np.float32)],
            "count": count,
            "type": "VEC3",
            "min": whole.min(axis=0).tolist(),
            "max": whole.max(axis=0).tolist(),
            "sparse": {
                "count": len(indices),
                "indices": {
                    "bufferView": self.view(indices.astype(kind).tobytes()),
                    "componentType": _COMPONENTS[np.dtype(kind)],
                },
                "values": {"bufferView": self.view(values.tobytes())},
            },
        }
        self.json["accessors"].append(entry)
        return len(self.json["accessors"]) - 1

    def node(self, **values: Any) -> int:
        """Append a node; return its index."""
        self.json["nodes"].append(values)
        return len(self.json["nodes"]) - 1

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the file, atomically."""
        self.blob += b"\0" * (-len(self.blob) % 4)
        self.json["buffers"] = [{"byteLength": len(self.blob)}]
        text = json.dumps(self.json, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        with atomic_path(path) as temporary, open(temporary, "wb") as stream:
            stream.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(self.blob)))
            stream.write(struct.pack("<I4s", len(text), b"JSON") + text)
            stream.write(struct.pack("<I4s", len(self.blob), b"BIN\0"))
            stream.write(self.blob)
