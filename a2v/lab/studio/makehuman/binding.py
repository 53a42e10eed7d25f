"""Clothes on a body: MakeHuman's barycentric rule, the covered vertices, and the skinning
weights."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from a2v.lab.studio.makehuman.assets import BASE_VERTICES, Binding, Item
from a2v.types import BoolArray, FloatArray, IntArray

DECIMETRE = 0.1
OPAQUE = 0.5
"""Faces with a smaller mean opacity of their texture are dropped: strands of hair are painted on
cards."""


def lay_on(binding: Binding, base: FloatArray) -> FloatArray:
    """Return vertices (V, 3), meters, of an item on ``hm08`` in any shape.

    `base` (19158, 3) is in meters, y up, facing +z.
    """
    scale = np.array(
        [
            abs(base[first, axis] - base[second, axis]) / (DECIMETRE * length) if length else 1.0
            for axis, (first, second, length) in enumerate(binding.scales)
        ]
    )
    placed: FloatArray = (
        np.einsum("vk,vki->vi", binding.weights, base[binding.corners])
        + DECIMETRE * scale * binding.offsets
    )
    return placed


def carried(binding: Binding, weights: FloatArray) -> FloatArray:
    """Return the skinning weights (V, B) of an item from those of ``hm08`` (19158, B); rows sum to
    1."""
    share = np.maximum(binding.weights, 0)
    share = share / np.maximum(share.sum(axis=1, keepdims=True), 1e-9)
    mixed = np.einsum("vk,vkb->vb", share, weights[binding.corners])
    return np.asarray(mixed / np.maximum(mixed.sum(axis=1, keepdims=True), 1e-9))


def visible_parts(items: Sequence[Item]) -> tuple[BoolArray, list[BoolArray]]:
    """Return the visible vertices of the base (19158,) and of each item, under the items that are
    worn over them."""
    hidden = np.zeros(BASE_VERTICES, bool)
    seen: dict[int, BoolArray] = {}
    for number in sorted(range(len(items)), key=lambda index: -items[index].binding.layer):
        binding = items[number].binding
        seen[number] = ~hidden[binding.corners].all(axis=1)
        hidden = hidden | binding.hides
    return ~hidden, [seen[number] for number in range(len(items))]


def kept_faces(faces: IntArray, seen: BoolArray) -> BoolArray:
    """Return the faces (F,) with a visible vertex: skin continues below the hem."""
    return np.asarray(seen[faces].any(axis=1))


def opaque_faces(item: Item) -> BoolArray:
    """Return the faces (F,) of an item whose texture is mostly opaque."""
    opacity = item.texture[..., 3].astype(np.float32) / 255
    height, width = opacity.shape
    spots = np.array(
        [[1 / 3, 1 / 3, 1 / 3], [0.7, 0.15, 0.15], [0.15, 0.7, 0.15], [0.15, 0.15, 0.7]]
    )
    uv = np.einsum("sk,fki->fsi", spots, item.mesh.uv) % 1.0
    rows = np.clip(((1 - uv[..., 1]) * height).astype(int), 0, height - 1)
    columns = np.clip((uv[..., 0] * width).astype(int), 0, width - 1)
    return np.asarray(opacity[rows, columns].mean(axis=1) > OPAQUE)
