"""Skirts and long coats that are drawn around the legs of the studio's people, none of whom wears
any in the training split (but one dress).

`scripts/fit_skirts.py` trains the network of `a2v.reconstruction.reading.skirt` with them.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter1d

from a2v.body.parts import PARTS, on_parts
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.steps import smoothstep
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.variation import draw_pattern
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray

COLUMNS = 96
"""Number of vertices around a skirt."""
_ROW = 0.025
"""Distance of rows, meters."""
_THICK = 0.004
"""Thickness of the cloth, meters."""
_FLARES = ((0.4, (0.0, 0.08)), (0.75, (0.08, 0.45)), (1.0, (0.45, 1.1)))
"""Cumulative shares of skirts, and the range of their flare: meters of radius per meter down."""
_LEGS = ("left_thigh", "right_thigh", "left_shin", "right_shin")


@dataclass(frozen=True, eq=False)
class DrawnSkirt:
    """Both sides of a skirt at rest, the outer one first.

    Attributes
    ----------
    vertices : (n, 3) float, meters
    weights : (n, B) float
        Of all bones of the avatar.
    faces : (f, 3) int
    uv : (f, 3, 2) float
        Share of the way around, and down; both sides have the same.
    """

    vertices: FloatArray
    weights: FloatArray
    faces: IntArray
    uv: FloatArray


def leg_heights(avatar: Avatar) -> FloatArray:
    """Heights (3,) of hips, knees and ankles at rest, meters."""
    heights = avatar.rest_transforms[:, 1, 3]
    names = avatar.bone_names
    return np.array(
        [
            (heights[names.index(f"Left{bone}")] + heights[names.index(f"Right{bone}")]) / 2
            for bone in ("UpLeg", "Leg", "Foot")
        ]
    )


def draw_skirt(
    avatar: Avatar, hem: float, generator: np.random.Generator, *, coat: bool
) -> DrawnSkirt:
    """Draw a skirt around the legs of an avatar, down to the height `hem` at rest, meters.

    It is wider to the hem by a flare, has folds and a tilt, and sometimes a slit; a `coat` usually
    opens in front.
    """
    hip = float(leg_heights(avatar)[0])
    top = hip + generator.uniform(0.03, 0.16)
    heights = np.linspace(top, hem, max(8, int((top - hem) / _ROW)))
    radii, middles, sides = _legs_at(avatar, heights)
    angle = 2 * np.pi * np.arange(COLUMNS) / COLUMNS
    down = np.maximum(hip - heights, 0)
    kind = generator.random()
    flare = generator.uniform(*next(range_ for share, range_ in _FLARES if kind < share))
    if coat:
        flare = generator.uniform(0.02, 0.2)
    out = 0.008 + generator.uniform(0, 0.012) + flare * down
    folds = int(generator.integers(3, 16))
    depth = generator.uniform(0, 0.16) * down * (generator.random() < 0.6)
    blown = generator.random() < 0.2  # by the wind, by a step, or held by a hand
    sway = generator.normal(0, 0.15 if blown else 0.03) * down
    lifted = generator.uniform(0, 0.7) * blown * down[:, None]
    twist = generator.uniform(0, 6) + generator.normal(0, 0.8) * heights[:, None] * 4
    wave = np.sin(folds * angle + twist) + 0.5 * np.sin(
        (folds // 2 + 1) * angle + generator.uniform(0, 6)
    )
    if kind < 0.2 and not coat and radii[0].mean() > radii[-1].mean():
        radii = (radii[0] + radii) / 2
    radii = radii + out[:, None] + 0.3 * depth[:, None] * wave
    radii = radii + lifted * np.maximum(np.cos(angle - generator.uniform(0, 2 * np.pi)), 0) ** 2
    level = np.linspace(0, 1, len(heights))[:, None]
    tilt = generator.normal(0, 0.015) * np.cos(angle + generator.uniform(0, 6)) * level
    outer = np.stack(
        [
            middles[:, :1] + radii * np.sin(angle) + sway[:, None],
            heights[:, None] + tilt,
            middles[:, 1:] + radii * np.cos(angle),
        ],
        axis=-1,
    ).reshape(-1, 3)
    sine = np.sin(angle)
    share = (smoothstep(sine, -1.0, 1.0) + smoothstep(np.arcsin(sine), -np.pi / 2, np.pi / 2)) / 2
    weights = (
        share[None, :, None] * sides[0][:, None] + (1 - share)[None, :, None] * sides[1][:, None]
    ).reshape(len(outer), -1)
    faces, uv = _tube(_closed(heights, hip, angle, generator, coat=coat))
    normals = np.nan_to_num(vertex_normals(outer, faces))
    return DrawnSkirt(
        np.concatenate([outer, outer - _THICK * normals]),
        np.tile(weights, (2, 1)),
        np.concatenate([faces, faces[:, ::-1] + len(outer)]),
        np.concatenate([uv, uv[:, ::-1]]),
    )


def _legs_at(
    avatar: Avatar, heights: FloatArray
) -> tuple[FloatArray, FloatArray, tuple[FloatArray, FloatArray]]:
    """Radii (n, C) of the hull of both legs at each height, its middles (n, 2), x and z, and the
    mean weights (n, B) of the left and the right leg there."""
    rest = avatar.skin(avatar.rest_transforms).astype(np.float64)
    low = on_parts(avatar.parts, "torso", *_LEGS)
    angle = 2 * np.pi * np.arange(COLUMNS) / COLUMNS
    ways = np.stack([np.sin(angle), np.cos(angle)], axis=1)
    apart = np.cos(angle[:, None] - angle)
    dense = np.zeros((len(rest), len(avatar.bone_names)))
    for k in range(avatar.bones.shape[1]):
        np.add.at(dense, (np.arange(len(rest)), avatar.bones[:, k]), avatar.weights[:, k])
    middle_x = _middle(avatar)
    radii, middles = [], []
    sides: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    for height in heights:
        away = np.abs(rest[:, 1] - height)
        band = rest[low & (away < 0.035) & (np.abs(rest[:, 0]) < 0.4)][:, [0, 2]]
        if len(band) < 8:
            band = np.concatenate([band, rest[low][np.argsort(away[low])[:40]][:, [0, 2]]])
        middle = np.array([middle_x, (band[:, 1].min() + band[:, 1].max()) / 2])
        support = ((band - middle) @ ways.T).max(axis=0)
        reach = np.where(apart > 0.05, support / np.maximum(apart, 0.05), np.inf)
        radii.append(reach.min(axis=1))
        middles.append(middle)
        for sign, side in zip((1, -1), sides, strict=True):
            own = low & (away < 0.05) & (sign * rest[:, 0] > 0)
            side.append(dense[own].mean(axis=0) if own.any() else side[-1])
    smooth = [
        np.asarray(gaussian_filter1d(np.array(rows), 1.5, axis=0, mode="nearest"))
        for rows in (radii, middles, *sides)
    ]
    return smooth[0], smooth[1], (smooth[2], smooth[3])


def _middle(avatar: Avatar) -> float:
    places = avatar.rest_transforms[:, 0, 3]
    names = avatar.bone_names
    return float((places[names.index("LeftUpLeg")] + places[names.index("RightUpLeg")]) / 2)


def _closed(
    heights: FloatArray,
    hip: float,
    angle: FloatArray,
    generator: np.random.Generator,
    *,
    coat: bool,
) -> BoolArray:
    """Return which cells (n - 1, C) have cloth: not those of a slit, or of the front of an open
    coat, which widens to the hem."""
    if coat and generator.random() < 0.75:
        begin, place, wide = (
            hip + generator.uniform(-0.2, 0.2),
            generator.normal(0, 0.1),
            generator.uniform(0.1, 0.9),
        )
    elif generator.random() < 0.12:
        begin, place, wide = (
            hip - generator.uniform(0.1, 0.4),
            generator.uniform(-2.5, 2.5),
            generator.uniform(0.03, 0.3),
        )
    else:
        return np.ones((len(heights) - 1, COLUMNS), bool)
    below = np.clip((begin - heights) / max(begin - heights[-1], 0.05), 0, 1)[:, None]
    away = np.abs((angle - place + np.pi) % (2 * np.pi) - np.pi)
    return np.asarray(~((away < wide * below) & (below > 0))[:-1])


def _tube(kept: BoolArray) -> tuple[IntArray, FloatArray]:
    """Faces (f, 3) of the `kept` cells (n - 1, C) of a tube, and their corners (f, 3, 2)."""
    row, column = np.nonzero(kept)
    one, two = row * COLUMNS + column, row * COLUMNS + (column + 1) % COLUMNS
    below, beside = one + COLUMNS, two + COLUMNS
    faces = np.concatenate(
        [np.stack([one, below, two], axis=1), np.stack([two, below, beside], axis=1)]
    )
    own, around = faces // COLUMNS, faces % COLUMNS
    ends = (around.max(axis=1) == COLUMNS - 1) & (around.min(axis=1) == 0)
    around = np.where(ends[:, None] & (around == 0), COLUMNS, around)
    return faces, np.stack([around / COLUMNS, own / len(kept)], axis=-1)


def draw_cloth(
    width: int, side: int, color: FloatArray, generator: np.random.Generator
) -> ByteArray:
    """Draw the cloth of a skirt: the outer side above the inner one, (2 side, width, 3) uint8.

    `color` (3,) is its CIELAB color; there can be a pattern, pleats and a band at the hem.
    """
    lab = np.tile(np.asarray(color, np.float32), (side, width, 1))
    coarse = generator.standard_normal((max(4, side // 8), max(4, width // 8))).astype(np.float32)
    lab[..., 0] += generator.uniform(0, 4) * cv2.resize(coarse, (width, side))
    row, column = (grid.ravel() for grid in np.mgrid[:side, :width])
    if generator.random() < 0.35:
        pattern = draw_pattern(row * 512 // side, column * 1024 // width, generator)
        lab += pattern.reshape(side, width, 3).astype(np.float32)
    if generator.random() < 0.5:
        pleats = int(generator.integers(6, 60))
        turn = pleats * np.arange(width) / width + generator.uniform(0, 1)
        rounded, sharp = np.sin(2 * np.pi * turn), 1 - 2 * (turn % 1)
        lab[..., 0] += generator.uniform(2, 20) * (rounded if generator.random() < 0.5 else sharp)
    if generator.random() < 0.3:
        begin = int(side * (1 - generator.uniform(0.02, 0.2)))
        band = (
            np.array([generator.uniform(3, 90), generator.normal(0, 18), generator.normal(0, 18)])
            if generator.random() < 0.6
            else np.array([generator.uniform(3, 15), 0, 0])
        )
        soft = np.clip((np.arange(side) - begin) / max(1, 0.03 * side), 0, 1)[:, None, None]
        lab = lab * (1 - soft) + soft * band
    lab[..., 0] = np.clip(lab[..., 0], 3, 97)
    inner = lab * np.array([generator.uniform(0.2, 1.0), 0.6, 0.6])
    return np.concatenate([rgb_of(lab), rgb_of(inner)])


def rgb_of(lab: FloatArray) -> ByteArray:
    """Colors (H, W, 3) uint8 sRGB of CIELAB colors (H, W, 3)."""
    colors = cv2.cvtColor(lab.astype(np.float32), cv2.COLOR_LAB2RGB)
    return np.asarray(np.clip(255 * colors, 0, 255), np.uint8)


def with_skirt(avatar: Avatar, texture: ByteArray, skirt: DrawnSkirt, cloth: ByteArray) -> Avatar:
    """Add a skirt to an avatar; its `texture` (H, W, 3) gets the `cloth` (2 side, W, 3) below."""
    bones = np.argsort(-skirt.weights, axis=1)[:, :4]
    four = np.take_along_axis(skirt.weights, bones, axis=1)
    four /= four.sum(axis=1, keepdims=True)
    height, side = len(texture), len(cloth) // 2
    whole = height + 2 * side
    uv = avatar.uv.copy()
    uv[..., 1] = (uv[..., 1] * height + 2 * side) / whole
    inner = (np.arange(len(skirt.faces)) >= len(skirt.faces) // 2)[:, None]
    row = height + inner * side + 2 + skirt.uv[..., 1] * (side - 5)
    own = np.stack([0.002 + 0.996 * skirt.uv[..., 0], 1 - row / whole], axis=-1)
    count, faces = len(avatar.weights), len(skirt.faces)
    places = np.repeat(skirt.vertices[:, None], 4, axis=1)
    mesh = int(avatar.mesh_ids.max()) + 1
    return dataclasses.replace(
        avatar,
        influences=np.concatenate([avatar.influences, places]).astype(np.float32),
        weights=np.concatenate([avatar.weights, four]).astype(np.float32),
        bones=np.concatenate([avatar.bones, bones]).astype(np.int32),
        faces=np.concatenate([avatar.faces, skirt.faces + count]).astype(np.int32),
        uv=np.concatenate([uv, own]).astype(np.float32),
        texture=np.concatenate([texture, cloth]),
        materials=np.concatenate([avatar.materials, np.zeros(faces, np.int32)]),
        mesh_ids=np.concatenate([avatar.mesh_ids, np.full(faces, mesh, np.int32)]),
        mesh_names=(*avatar.mesh_names, "skirt"),
        parts=np.concatenate(
            [avatar.parts, np.full(len(skirt.vertices), PARTS.index("torso"), np.int8)]
        ),
    )
