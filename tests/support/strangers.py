"""A small skinned person as the JSON and the numbers of a glTF, to be changed by tests."""

from __future__ import annotations

from typing import Any

import numpy as np

BONES = {
    "Hips": ("", 0.0, 1.0, 0.0),
    "Spine": ("Hips", 0.0, 1.2, 0.0),
    "Neck": ("Spine", 0.0, 1.5, 0.0),
    "Head": ("Neck", 0.0, 1.6, 0.0),
} | {
    f"{side}{name}": (above if above in ("Hips", "Spine") else f"{side}{above}", way * x, y, z)
    for side, way in (("Left", 1), ("Right", -1))
    for name, above, x, y, z in (
        ("Arm", "Spine", 0.2, 1.45, 0.0),
        ("ForeArm", "Arm", 0.45, 1.45, 0.0),
        ("Hand", "ForeArm", 0.7, 1.45, 0.0),
        ("UpLeg", "Hips", 0.1, 0.95, 0.0),
        ("Leg", "UpLeg", 0.1, 0.5, 0.0),
        ("Foot", "Leg", 0.1, 0.03, 0.0),
        ("ToeBase", "Foot", 0.1, 0.02, 0.12),
    )
}
"""By Mixamo's names: the bone above, and the place of the head, meters."""


def person() -> tuple[dict[str, Any], bytes]:
    """Return the JSON and the binary chunk of a person with a small box on each bone."""
    names = list(BONES)
    heads = np.array([BONES[name][1:] for name in names], np.float32)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
    points = (heads[:, None] + 0.02 * corners).reshape(-1, 3)
    joints = np.zeros((len(points), 4), np.uint8)
    joints[:, 0] = np.arange(len(points)) // 8
    weights = np.tile(np.array([1, 0, 0, 0], np.float32), (len(points), 1))
    faces = (np.array([0, 1, 3, 5, 7, 6]) + 8 * np.arange(len(names))[:, None]).astype(np.uint16)
    bind = np.tile(np.eye(4, dtype=np.float32), (len(names), 1, 1))
    bind[:, 3, :3] = -heads
    blob = b""
    views, accessors = [], []
    for array, kind, layout in (
        (points, 5126, "VEC3"),
        (joints, 5121, "VEC4"),
        (weights, 5126, "VEC4"),
        (faces.reshape(-1, 1), 5123, "SCALAR"),
        (bind.reshape(-1, 16), 5126, "MAT4"),
    ):
        blob += b"\0" * (-len(blob) % 4)
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes})
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": kind,
                "count": len(array),
                "type": layout,
            }
        )
        blob += array.tobytes()
    accessors[0] |= {"min": points.min(0).tolist(), "max": points.max(0).tolist()}
    nodes: list[dict[str, Any]] = []
    for name in names:
        above, *head = BONES[name]
        start = BONES[above][1:] if above else (0, 0, 0)
        below = [names.index(other) for other in names if BONES[other][0] == name]
        node: dict[str, Any] = {
            "name": name,
            "translation": [float(a - b) for a, b in zip(head, start, strict=True)],
        }
        nodes.append(node | ({"children": below} if below else {}))
    nodes.append({"name": "body", "mesh": 0, "skin": 0})
    attributes = {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}
    tree = {
        "asset": {"version": "2.0"},
        "nodes": nodes,
        "scenes": [{"nodes": [0, len(nodes) - 1]}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 3}]}],
        "skins": [{"joints": list(range(len(names))), "inverseBindMatrices": 4}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(blob)}],
    }
    return tree, blob
