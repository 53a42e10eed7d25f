"""A block that is red on one side and blue on the other."""

from __future__ import annotations

import numpy as np
import trimesh

from a2v.types import Surface

RED, BLUE = (0.8, 0.1, 0.1), (0.1, 0.1, 0.8)


def block() -> Surface:
    """A box 0.6 x 1.8 x 0.3 m on the ground; its left half (+x) is red, the right half blue."""
    box = trimesh.creation.box((0.6, 1.8, 0.3))
    for _ in range(3):
        box = box.subdivide()
    vertices = np.asarray(box.vertices, np.float32) + np.float32([0, 0.9, 0])
    colors = np.where(vertices[:, :1] > 0, RED, BLUE).astype(np.float32)
    return Surface(vertices=vertices, faces=np.asarray(box.faces, np.int32), colors=colors)
