"""Long hair that swings: a layer over the hair on back and shoulders, on chains of bones below the
head."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.formats.gltf.springs import (
    Capsule,
    Springs,
    Swing,
    add_chains,
    apart,
    around,
    capsule_between,
    strongest,
    to_segment,
    weights_between,
)
from a2v.geometry.mesh import joined_by, piece_of_faces, piece_of_vertices, vertex_normals
from a2v.geometry.steps import smoothstep
from a2v.types import MATERIALS, BoolArray, Character, FloatArray, IntArray, Surface

CHAINS = 6
"""Largest number of chains around the neck."""
JOINTS = 3
"""Number of turning joints of a chain; one more is its end."""
SWING = Swing(stiffness=0.8, gravity=0.15, drag=0.4, radius=0.01)
"""Swing of hair."""
LENGTH = 0.08
"""Largest length of short hair below the base of the skull, meters."""
_COLOR = 14.0
"""Largest difference between a color of hair and the hair on the head, CIELAB units."""
_DEEPEST = 0.6
"""Largest length of hair below the base of the skull, meters; anything lower is clothing."""
_AROUND = 0.75
"""Largest share of the chest's vertices with the color of hair; with more, it is the color of the
clothing."""
_LIFTED = (0.002, 0.006)
"""Distances of the layer's inner and outer side from the hair below, meters."""
_BLEND = 0.05
"""Height over which the layer's weights change from the head's to the chains', meters."""
_SMALL = 40
"""Smallest number of faces of a piece of hair."""
_SHARE = 0.04
"""Smallest share of the layer's vertices beside a chain."""
_NEAR = 0.6
"""Width around a chain, in chains' widths, in which vertices determine its joints."""
_ALONG = (("neck", "head"), ("upperChest", "neck"), ("chest", "upperChest"))
"""Bones of the trunk with capsules, and the bones at which these end."""
_ARMS = (("leftUpperArm", "leftLowerArm"), ("rightUpperArm", "rightLowerArm"))
"""Bones of the arms with capsules, and the bones at which these end."""


def hang_hair(character: Character) -> tuple[Character, Springs | None]:
    """Hang the long hair of a character on VRM's rig on chains of bones below the head.

    Long hair that is a separate layer already swings below the skull. Else hair is what has the
    color of the hair on the head and is connected to it. On the body's own mesh it moves with the
    skin under it, so its lower part is copied into a separate layer that swings; the mesh itself is
    unchanged. Short hair, hair of the same color as the clothing and a
    surface without materials are returned unchanged, with None.
    """
    names = character.body.bone_names
    if not {"head", *(name for pair in (*_ALONG, *_ARMS) for name in pair)} <= set(names):
        return character, None
    head = names.index("head")
    skull = character.body.bone_transforms[head, :3, 3].astype(np.float64)
    layer, layered = _own_layer(character, skull), character
    if not len(layer):
        faces = _falling(character, skull)
        if not len(faces):
            return character, None
        layered = _with_layer(character, faces)
        layer = np.arange(len(character.surface.vertices), len(layered.surface.vertices))
    points = layered.surface.vertices[layer].astype(np.float64)
    along, used = _columns(points - skull)
    places = _places(points, along, used)
    body, bones = add_chains(layered.body, "hair", head, places)
    hung, owners = _weights(points, along, used, (places, bones), head)
    share = smoothstep(skull[1] - points[:, 1], 0, _BLEND)[:, None]
    weights, whose = layered.weights.copy(), layered.bones.copy()
    weights[layer], whose[layer] = strongest(
        np.concatenate([hung * share, weights[layer] * (1 - share)], axis=1),
        np.concatenate([owners, whose[layer]], axis=1),
    )
    changed = dataclasses.replace(layered, body=body, weights=weights, bones=whose)
    chains = tuple(map(tuple, bones.tolist()))
    capsules = _capsules(character, places)
    return changed, Springs(name="hair", chains=chains, capsules=capsules, swing=SWING)


def _own_layer(character: Character, skull: FloatArray) -> IntArray:
    """Return the vertices (n,) below the `skull` (3,) of a layer of long hair; none without one.

    Such a layer is not connected to the body, is mostly hair by its color, and reaches from the
    head to below the skull.
    """
    surface, none = character.surface, np.zeros(0, np.int64)
    if surface.materials is None:
        return none
    label = piece_of_vertices(len(surface.vertices), surface.faces)
    piece = label[surface.faces[:, 0]]
    hairy = np.bincount(piece, surface.materials == MATERIALS.index("hair"), label.max() + 1)
    count = np.bincount(piece, minlength=label.max() + 1)
    height = surface.vertices[:, 1]
    for part in np.flatnonzero((hairy > 0.5 * count) & (count >= _SMALL)):
        own = np.flatnonzero(label == part)
        if part != count.argmax() and height[own].max() > skull[1] > height[own].min() + LENGTH:
            return np.asarray(own[height[own] < skull[1]])
    return none


def _falling(character: Character, skull: FloatArray) -> IntArray:
    """Return the faces (n,) of the hair that hangs below the `skull` (3,), the position of the head
    bone; none for short hair."""
    surface = character.surface
    hair = _hair_of(character, skull)
    inside = hair[surface.faces].all(axis=1)
    below = surface.vertices[surface.faces][..., 1].min(axis=1) < skull[1]
    faces = np.flatnonzero(inside & below)
    if not len(faces):
        return faces
    pieces = piece_of_faces(len(surface.vertices), surface.faces[faces])
    faces = faces[np.bincount(pieces)[pieces] >= _SMALL]
    if not len(faces):
        return faces
    lowest = float(np.quantile(surface.vertices[surface.faces[faces]][..., 1], 0.02))
    return faces if LENGTH < skull[1] - lowest < _DEEPEST else faces[:0]


def _hair_of(character: Character, skull: FloatArray) -> BoolArray:
    """Return the vertices (V,) of hair: those connected to the head's hair and with its color."""
    from skimage.color import rgb2lab

    surface, count = character.surface, len(character.surface.vertices)
    nothing = np.zeros(count, bool)
    if surface.materials is None:
        return nothing
    own = surface.faces[surface.materials == MATERIALS.index("hair")]
    if len(own) < _SMALL:
        return nothing
    seeds = nothing.copy()
    seeds[own.ravel()] = True
    lab = rgb2lab(_colors(surface))
    middle = np.median(lab[seeds], axis=0)
    similar = np.linalg.norm((lab - middle) * [0.5, 1, 1], axis=1) < _COLOR
    names = character.body.bone_names
    trunk = {"head", "neck", "upperChest", "chest", "spine", "leftShoulder", "rightShoulder"}
    trunk |= {"leftUpperArm", "rightUpperArm"}
    moved = np.isin(character.bones[:, 0], [names.index(name) for name in trunk if name in names])
    similar &= moved
    chest = np.isin(character.bones[:, 0], [names.index("chest"), names.index("upperChest")])
    if not chest.any() or similar[chest].mean() > _AROUND:
        return nothing
    if surface.face is not None:
        similar[surface.face.patch] = False
    edges = np.concatenate([surface.faces[:, :2], surface.faces[:, 1:]])
    edges = edges[similar[edges].all(axis=1)]
    label = joined_by(count, edges)
    high = seeds & similar & (surface.vertices[:, 1] > skull[1])
    return np.asarray(similar & np.isin(label, np.unique(label[high])))


def _colors(surface: Surface) -> FloatArray:
    """Return sRGB (V, 3) of the vertices, from the texture if present."""
    if surface.texture is None or surface.uv is None:
        return surface.colors.astype(np.float64)
    height, width = surface.texture.shape[:2]
    column = np.clip((surface.uv[..., 0] * width).astype(int), 0, width - 1)
    row = np.clip(((1 - surface.uv[..., 1]) * height).astype(int), 0, height - 1)
    corners = surface.texture[row, column].reshape(-1, 3) / 255.0
    total = np.stack(
        [
            np.bincount(surface.faces.ravel(), corners[:, channel], len(surface.vertices))
            for channel in range(3)
        ],
        axis=1,
    )
    number = np.bincount(surface.faces.ravel(), minlength=len(surface.vertices))
    return np.asarray(total / np.maximum(number, 1)[:, None])


def _with_layer(character: Character, chosen: IntArray) -> Character:
    """Add a two-sided copy of the `chosen` faces (n,) above them.

    The new vertices follow those of the character: first the outer side, then the inner one.
    """
    surface, count = character.surface, len(character.surface.vertices)
    used, corners = np.unique(surface.faces[chosen], return_inverse=True)
    faces = corners.reshape(-1, 3)
    normals = vertex_normals(surface.vertices, surface.faces)[used]
    inner, outer = (surface.vertices[used] + lift * normals for lift in _LIFTED)
    both = np.concatenate([faces, faces[:, ::-1] + len(used)])

    def with_copies(values: np.ndarray) -> np.ndarray:
        return np.concatenate([values, values[used], values[used]])

    layered = dataclasses.replace(
        surface,
        vertices=np.concatenate([surface.vertices, outer, inner]).astype(np.float32),
        faces=np.concatenate([surface.faces, both + count]).astype(np.int32),
        colors=with_copies(surface.colors),
        uv=None
        if surface.uv is None
        else np.concatenate([surface.uv, surface.uv[chosen], surface.uv[chosen][:, ::-1]]),
        visible=None,
        twins=None,
        standing=None,
        materials=None
        if surface.materials is None
        else np.concatenate(
            [surface.materials, np.full(len(both), MATERIALS.index("hair"), np.uint8)]
        ),
    )
    return dataclasses.replace(
        character,
        surface=layered,
        weights=with_copies(character.weights),
        bones=with_copies(character.bones),
        anchors=with_copies(character.anchors),
        parts=with_copies(character.parts),
    )


def _columns(away: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the directions (n,) of points at `away` (n, 3) from the skull, and the chains (m,)
    beside which there is hair.

    Directions are in widths of a chain, from the front to the person's left.
    """
    along = around(away, CHAINS)
    number = np.bincount(np.round(along).astype(np.int64) % CHAINS, minlength=CHAINS)
    used = np.flatnonzero(number > _SHARE * len(along))
    return along, used


def _places(points: FloatArray, along: FloatArray, used: IntArray) -> FloatArray:
    """Return joints (m, JOINTS + 1, 3) of the chains `used` (m,) in the hair `points` (n, 3), from
    the top of the hair to its tips."""
    top = float(points[:, 1].max())
    chains = []
    for chain in used:
        near = np.exp(-((apart(along, chain, CHAINS) / _NEAR) ** 2))
        own = points[apart(along, chain, CHAINS) <= 0.5]
        low = float(np.quantile(own[:, 1], 0.03))
        joints = []
        for height in np.linspace(top, low, JOINTS + 1):
            weight = near * np.exp(-(((points[:, 1] - height) / 0.02) ** 2)) + 1e-12
            x, _, z = weight @ points / weight.sum()
            joints.append([x, height, z])
        chains.append(joints)
    return np.array(chains)


def _weights(
    points: FloatArray,
    along: FloatArray,
    used: IntArray,
    hung: tuple[FloatArray, IntArray],
    head: int,
) -> tuple[FloatArray, IntArray]:
    """Return weights and bones (n, 4) of the hair `points` (n, 3).

    `hung` are the joints (m, J + 1, 3) and bones (m, J + 1) of the chains.
    """
    places, bones = hung
    distances = np.stack([apart(along, chain, CHAINS) for chain in used], axis=1)
    order = np.argsort(distances, axis=1, kind="stable")
    first, second = order[:, 0], order[:, min(1, len(used) - 1)]
    rows = np.arange(len(points))
    near, far = distances[rows, first], distances[rows, second]
    across = np.where(far < 1, near / np.maximum(near + far, 1e-9), 0.0)
    top = places[:, 0, 1]
    low = places[:, -1, 1]
    depth = [(top[chain] - points[:, 1]) / (top[chain] - low[chain]) for chain in (first, second)]
    down = JOINTS * (depth[0] * (1 - across) + depth[1] * across)
    return weights_between((first, second, across), down, bones, head)


def _capsules(character: Character, places: FloatArray) -> tuple[Capsule, ...]:
    """Return capsules around neck, chest and upper arms. At rest they contain no joint of the
    chains `places`."""
    heads = character.body.bone_transforms[:, :3, 3].astype(np.float64)
    own = np.ones(len(character.surface.vertices), bool)
    joints = places[:, 1:].reshape(-1, 3)
    capsules = []
    for start, end in (*_ALONG, *_ARMS):
        capsule = capsule_between(character, start, end, own)
        free = float(to_segment(joints - heads[capsule.bone], capsule.tail).min()) - SWING.radius
        capsules.append(dataclasses.replace(capsule, radius=round(min(capsule.radius, free), 4)))
    return tuple(capsule for capsule in capsules if capsule.radius > 0.01)
