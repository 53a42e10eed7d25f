"""Imitated observations of heads: a chart in other colors and shapes, photographed from some side,
and projected on a fitted head with the errors of real fits."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from a2v.body.head_chart import HEIGHT, WIDTH
from a2v.geometry.images import nearest_known
from a2v.geometry.steps import smoothstep
from a2v.geometry.vectors import unit
from a2v.kinematics import rotvec_to_rotmat
from a2v.lab.heads.charts import HAIR, HAT, NOTHING, SKIN, HeadCharts
from a2v.reconstruction.coloring.completing import OFFSET, inputs_of
from a2v.types import BoolArray, FloatArray, IntArray

PHOTO = 88
"""Width and height of the imitated photo, pixels."""
PIXEL = 0.0042
"""Length of a pixel of it, meters."""
TARGETS = 11
"""Channels of a target: outermost (3) and skin (3) color, cover, keep for both, offset, bare."""
_HAIR = np.array(
    [
        [9, 1, 1],
        [14, 3, 4],
        [24, 7, 9],
        [36, 9, 16],
        [52, 9, 24],
        [66, 6, 26],
        [40, 22, 28],
        [55, 0, 3],
        [80, 0, 4],
    ],
    np.float64,
)
"""Typical colors of hair, CIELAB: black to blond, red, gray, white."""
_SKIN = np.array(
    [[30, 11, 15], [42, 13, 18], [55, 14, 20], [65, 13, 18], [74, 11, 15], [82, 8, 12]]
)
"""Typical colors of skin, CIELAB."""
_ALIKE = 11.0
"""Scale of the distance at which an observed color is kept, CIELAB units."""


@dataclass(frozen=True, eq=False)
class _Head:
    under: FloatArray
    outer: FloatArray
    lab: FloatArray
    skin: FloatArray
    kinds: IntArray
    bare: BoolArray


class HeadImitator:
    """Draws imitated observations of the heads of charts."""

    def __init__(self, charts: HeadCharts) -> None:
        """Colors of painted hair are told from skin here."""
        self.under = charts.under.astype(np.float32)
        self.outer = charts.outer.astype(np.float32)
        self.lab, self.skin = (
            np.stack([_lab_of(one / np.float32(255)) for one in one_chart]).astype(np.float32)
            for one_chart in (charts.colors, charts.skin)
        )
        self.kinds = charts.kinds.astype(np.int64)
        self.bare = charts.bare.copy()
        for number in np.flatnonzero(charts.sources == 0):
            self.kinds[number] = with_painted_hair(self.lab[number], self.kinds[number])
            self.bare[number] &= self.kinds[number] == SKIN
        self.sources = charts.sources

    def draw(self, generator: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Draw the input (C, H, W) and the target (`TARGETS`, H, W) of one head, float32."""
        head = self._head(generator)
        gain = np.exp(generator.normal(0, [0.15, 0.03, 0.04]) @ _TINT)
        rgb = [np.clip(_rgb(lab) * gain, 0, 1) for lab in (head.lab, head.skin)]
        view = rotvec_to_rotmat(np.array([0.0, 0.0, generator.normal(0, 0.15)])) @ rotvec_to_rotmat(
            np.array([generator.normal(0, 0.2), 0.0, 0.0])
        )
        view = view @ rotvec_to_rotmat(np.array([0.0, _yaw(generator), 0.0]))
        shown = head.kinds != NOTHING
        outer = head.outer @ view.T
        image, person, blur = _photograph(outer, rgb[0], shown, generator)
        fitted, offset = _fitted(head, generator)
        placed = fitted @ view.T
        seen, trust = _projected(image, person, placed, shown, blur)
        seen, trust = _disturbed(seen, trust, generator)
        keeps = []
        for truth in rgb:
            away = (_lab_of(seen) - _lab_of(truth)) * [0.5, 1.0, 1.0]
            keeps.append(np.exp(-((away**2).sum(axis=-1)) / _ALIKE**2))
        cover = (head.kinds == HAIR) | (head.kinds == HAT)
        away = np.linalg.norm(head.outer - head.under, axis=-1) / OFFSET
        target = np.concatenate(
            [
                rgb[0],
                rgb[1],
                np.stack([cover, keeps[0], keeps[1], away, head.bare & shown], axis=-1),
            ],
            axis=-1,
        )
        made = inputs_of(seen, trust, offset, shown)
        return made, np.asarray(target.transpose(2, 0, 1), np.float32)

    def _head(self, generator: np.random.Generator) -> _Head:
        """Draw a head in other colors, with more or less hair, perhaps mirrored, perhaps capped."""
        number = int(generator.integers(len(self.lab)))
        under, outer = self.under[number].astype(np.float64), self.outer[number].astype(np.float64)
        lab, skin = self.lab[number].astype(np.float64), self.skin[number].astype(np.float64)
        kinds, bare = self.kinds[number].copy(), self.bare[number].copy()
        if self.sources[number] == 1 and generator.random() < 0.12:  # nobody's hair
            lab, kinds, outer = skin.copy(), np.where(bare, SKIN, kinds), under.copy()
        if generator.random() < 0.5:
            under, outer, lab, skin, kinds, bare = (
                values[:, ::-1] for values in (under, outer, lab, skin, kinds, bare)
            )
            under, outer = under * [-1, 1, 1], outer * [-1, 1, 1]
        lab, skin = lab.copy(), skin.copy()
        _recolored(lab, skin, kinds, generator)
        _bearded(lab, skin, kinds, generator)
        away = outer - under
        hair = kinds == HAIR
        grown = np.ones(hair.shape)
        grown[hair] = float(np.exp(generator.normal(0, 0.35)))
        outer = under + away * grown[..., None]
        way = unit(under - np.array([0.0, -0.02, 0.0]))
        if generator.random() < 0.2:
            thick = _smooth(generator, 6, 1.0) * 0.01 + generator.uniform(0, 0.07)
            outer = outer + (_softened(hair) * np.maximum(thick, 0))[..., None] * way
        if generator.random() < 0.12:
            kinds = _capped(outer, lab, kinds, way, generator)
            bare = bare & (kinds == SKIN) | (bare & (self.sources[number] == 1))
        return _Head(under, outer, lab, skin, kinds, bare)


_TINT = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, -1.0], [-0.5, 1.0, -0.5]])


def with_painted_hair(lab: FloatArray, kinds: IntArray) -> IntArray:
    """Kinds (H, W) in which paint on the scalp of another color than the face's is hair."""
    height, width = kinds.shape
    row, column = np.mgrid[:height, :width]
    azimuth = np.abs((column + 0.5) / width - 0.5) * 360
    cheeks = (azimuth < 40) & (row > 0.5 * height) & (row < 0.75 * height) & (kinds == SKIN)
    tone = np.median(lab[cheeks], axis=0)
    unlike = np.linalg.norm((lab - tone) * [0.6, 1.0, 1.0], axis=-1) > 13
    face = (azimuth < 48) & (row > 0.40 * height)
    lowest = np.where(azimuth > 100, 0.92, 0.82) * height  # the nape, and the collar in front
    painted = unlike & ~face & (row < lowest) & (kinds == SKIN)
    painted = cv2.medianBlur(painted.astype(np.uint8), 5) > 0
    return np.where(painted & (kinds == SKIN), HAIR, kinds)


def _recolored(
    lab: FloatArray, skin: FloatArray, kinds: IntArray, generator: np.random.Generator
) -> None:
    """Change the colors of hair, skin and hat of both charts (H, W, 3) in place."""
    bare = kinds == SKIN
    if generator.random() < 0.75 and bare.any():
        first = generator.integers(len(_SKIN))
        share = generator.random()
        target = (1 - share) * _SKIN[first] + share * _SKIN[generator.integers(len(_SKIN))]
        target = target + generator.normal(0, [3, 2, 3])
        middle, soft = np.median(lab[bare], axis=0), generator.uniform(0.7, 1.1)
        lab[bare] = target + (lab[bare] - middle) * [soft, 0.9, 0.9]
        skin[:] = target + (skin - middle) * [soft, 0.9, 0.9]
    for kind in (HAIR, HAT):
        own = kinds == kind
        if not own.any():
            continue
        middle = lab[own].mean(axis=0)
        if kind == HAIR and generator.random() < 0.92:
            target = _HAIR[
                generator.choice(
                    len(_HAIR), p=[0.22, 0.16, 0.14, 0.12, 0.1, 0.08, 0.06, 0.06, 0.06]
                )
            ]
            target = target + generator.normal(0, [5, 3, 4])
        else:
            target = np.array([generator.uniform(8, 92), *generator.normal(0, 22, 2)])
        soft = generator.uniform(0.25, 0.9) * min(1.0, 12 / max(lab[own, 0].std(), 1e-6))
        lab[own] = target + (lab[own] - middle) * [soft, 0.4, 0.4]
        lab[own, 0] += (2.0 * _smooth(generator, 8, 1.0))[own]
    lab[..., 0] = np.clip(lab[..., 0], 3, 97)
    skin[..., 0] = np.clip(skin[..., 0], 3, 97)


def _bearded(
    lab: FloatArray, skin: FloatArray, kinds: IntArray, generator: np.random.Generator
) -> None:
    """Draw a beard, make-up or glasses on both charts (H, W, 3) in place: all three are skin."""
    height, width = kinds.shape
    row, column = np.mgrid[:height, :width]
    azimuth = np.abs((column + 0.5) / width - 0.5) * 360
    hair = lab[kinds == HAIR].mean(axis=0) if (kinds == HAIR).any() else _HAIR[1]
    lips = (np.abs(row - 79) < 3) & (azimuth < 13)
    beard = (row > 70 + 4 * _smooth(generator, 5, 0.5)) & (azimuth < generator.uniform(40, 85))
    eyes = np.abs(row - 58) < generator.uniform(3, 6)
    eyes &= (azimuth > 4) & (azimuth < generator.uniform(25, 34))
    for chance, where, color in (
        (0.22, beard & ~lips, hair),
        (0.08, eyes, np.array([generator.uniform(5, 40), 0.0, 0.0])),
        (0.1, lips, np.array([generator.uniform(25, 50), 40.0, 20.0])),
    ):
        if generator.random() < chance:
            share = cv2.GaussianBlur(where.astype(np.float64), (0, 0), 0.8)[..., None]
            share = generator.uniform(0.3, 0.95) * share
            skin += share * (color - skin)
            lab += share * (kinds == SKIN)[..., None] * (color - lab)


def _capped(
    outer: FloatArray,
    lab: FloatArray,
    kinds: IntArray,
    way: FloatArray,
    generator: np.random.Generator,
) -> IntArray:
    """Put a cap, knitted hat or hood of one or two colors on a head; `outer` and `lab` change in
    place. Returns the kinds."""
    height, width = kinds.shape
    row, column = np.mgrid[:height, :width]
    azimuth = ((column + 0.5) / width - 0.5) * 2 * np.pi
    edge = height * (
        generator.uniform(0.32, 0.5) + generator.uniform(-0.02, 0.16) * (1 - np.cos(azimuth)) / 2
    )
    hood = generator.random() < 0.25
    if hood:
        edge = np.where(np.abs(azimuth) > generator.uniform(0.9, 1.4), height, 0.36 * height)
    own = (row < edge) & (kinds != NOTHING)
    target = np.array([generator.uniform(8, 92), *generator.normal(0, 20, 2)])
    lab[own] = target + generator.normal(0, 2, (*own.shape, 1))[own]
    if generator.random() < 0.4:
        band = own & (row > edge - generator.uniform(4, 12))
        lab[band] = np.array([generator.uniform(8, 92), *generator.normal(0, 20, 2)])
    thick = generator.uniform(0.004, 0.03) * (1 if hood else 0.6)
    outer[own] += thick * way[own]
    return np.where(own, HAT, kinds)


def _photograph(
    outer: FloatArray, rgb: FloatArray, shown: BoolArray, generator: np.random.Generator
) -> tuple[FloatArray, BoolArray, float]:
    """Imitate a photo: its clean colors (S, S, 3), its mask, and its blur in pixels."""
    normals = _normals(outer)
    light = unit(generator.normal([0, 0.6, 0.8], 1))
    shade = 1 + generator.uniform(0, 0.3) * (normals @ light) + 0.08 * _smooth(generator, 5, 1.0)
    if generator.random() < 0.4:
        shade = shade * (1 - generator.uniform(0, 0.4) * (_smooth(generator, 6, 1.0) > 0.8))
    column, row = _pixels(outer)
    depth = np.full((PHOTO, PHOTO), -np.inf)
    points = np.flatnonzero(shown.ravel())
    order = points[np.argsort(outer[..., 2].ravel()[points])]
    depth[row.ravel()[order], column.ravel()[order]] = outer[..., 2].ravel()[order]
    near = cv2.dilate(depth, np.ones((3, 3)))
    front = outer[..., 2].ravel()[order] > near[row.ravel()[order], column.ravel()[order]] - 0.02
    order = order[front]
    image, hit = np.zeros((PHOTO, PHOTO, 3)), np.zeros((PHOTO, PHOTO), bool)
    lit = np.clip(rgb * shade[..., None], 0, 1).reshape(-1, 3)
    image[row.ravel()[order], column.ravel()[order]] = lit[order]
    hit[row.ravel()[order], column.ravel()[order]] = True
    person = cv2.morphologyEx(hit.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3))) > 0
    index = nearest_known(hit)
    image = image[index[0], index[1]]
    blur = float(generator.uniform(0, 1.6))
    if blur > 0.3:
        image = cv2.GaussianBlur(image, (0, 0), blur)
    core = cv2.erode(person.astype(np.uint8), np.ones((3, 3))) > 0
    index = nearest_known(core if core.any() else person)
    image = image[index[0], index[1]] + generator.normal(
        0, generator.uniform(0, 0.015), image.shape
    )
    return np.clip(image, 0, 1), person, blur


def _fitted(head: _Head, generator: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """A head (H, W, 3) as a fit and a reconstruction find it, and the offset (H, W) of its cells
    from the body's skin, meters."""
    height, width = head.kinds.shape
    row, column = np.mgrid[:height, :width]
    azimuth = np.abs((column + 0.5) / width - 0.5) * 360
    face = np.clip((60 - azimuth) / 25, 0, 1) * np.clip((row / height - 0.3) / 0.12, 0, 1)
    loose = 1 - 0.65 * face
    share = np.clip(generator.uniform(0.2, 1.05) + 0.2 * _smooth(generator, 6, 1.0), 0, 1.15)
    away = cv2.GaussianBlur(head.outer - head.under, (0, 0), generator.uniform(0.5, 3))
    moved = share[..., None] * away * np.clip(loose, 0.2, 1)[..., None]
    noise = np.stack([_smooth(generator, 6, 1.0) for _ in range(3)], axis=-1)
    fitted = head.under + moved + generator.uniform(0.001, 0.006) * loose[..., None] * noise
    turn = rotvec_to_rotmat(generator.normal(0, 0.05, 3))
    fitted = fitted @ turn.T * np.exp(generator.normal(0, 0.025, 3))
    fitted = fitted + generator.normal(0, [0.004, 0.004, 0.006])
    offset = np.linalg.norm(moved, axis=-1)
    if generator.random() < 0.6:  # the face that is laid on a fitted body moves it, too
        offset = offset + generator.uniform(0, 0.03) * np.abs(_smooth(generator, 6, 0.7))
    return fitted, offset


def _projected(
    image: FloatArray, person: BoolArray, placed: FloatArray, shown: BoolArray, blur: float
) -> tuple[FloatArray, FloatArray]:
    """Colors (H, W, 3) of the photo at the cells of a fitted head, and their trust (H, W), as
    `PhotoProjection` computes it."""
    column, row = _pixels(placed)
    depth = np.full((PHOTO, PHOTO), -np.inf)
    points = np.flatnonzero(shown.ravel())
    order = points[np.argsort(placed[..., 2].ravel()[points])]
    depth[row.ravel()[order], column.ravel()[order]] = placed[..., 2].ravel()[order]
    near = cv2.dilate(depth, np.ones((3, 3)))
    behind = np.clip((placed[..., 2] + 0.02 - near[row, column]) / 0.012, 0, 1)
    deep = cv2.distanceTransform(person.astype(np.uint8), cv2.DIST_L2, 5)[row, column]
    facing = np.clip((_normals(placed)[..., 2] - 0.12) / 0.28, 0, 1)
    trust = smoothstep(facing, 0, 1) * behind * np.clip(deep / 1.3 - 0.5, 0, 1) * shown
    place = np.stack(_places(placed), axis=-1).astype(np.float32)
    seen = cv2.remap(
        image.astype(np.float32),
        place[..., 0],
        place[..., 1],
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return seen.astype(np.float64), trust


def _disturbed(
    seen: FloatArray, trust: FloatArray, generator: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Hide a patch of a head, or lay something of one color on it."""
    seen = seen.copy()
    for chance, colored in ((0.25, False), (0.15, True)):
        if generator.random() < chance:
            field = _smooth(generator, 7, 1.0)
            patch = field > np.quantile(field, generator.uniform(0.8, 0.97))
            if colored:
                seen[patch] = 0.5 * seen[patch] + 0.5 * generator.random(3)
            else:
                trust = trust * ~patch
    return seen, trust


def _yaw(generator: np.random.Generator) -> float:
    """Angle of a head in a photo, radians."""
    kind = generator.random()
    if kind < 0.6:
        return float(generator.normal(0, np.radians(22)))
    limit = np.radians(70 if kind < 0.9 else 180)
    return float(generator.uniform(-limit, limit))


def _pixels(points: FloatArray) -> tuple[IntArray, IntArray]:
    column, row = _places(points)
    return (
        np.clip(np.rint(column), 0, PHOTO - 1).astype(np.int64),
        np.clip(np.rint(row), 0, PHOTO - 1).astype(np.int64),
    )


def _places(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    return points[..., 0] / PIXEL + PHOTO / 2, -points[..., 1] / PIXEL + PHOTO / 2


def _normals(points: FloatArray) -> FloatArray:
    """Unit normals (H, W, 3), outward, of a chart of places."""
    around = np.roll(points, -1, axis=1) - np.roll(points, 1, axis=1)
    down = np.gradient(points, axis=0)
    return unit(np.cross(down, around))


def _smooth(generator: np.random.Generator, cells: int, size: float) -> FloatArray:
    """A smooth random field (H, W) of deviation `size`, with about `cells` waves around."""
    coarse = generator.normal(0, size, (cells, cells + 2)).astype(np.float32)
    coarse = np.concatenate([coarse, coarse[:, :1]], axis=1)
    return np.asarray(
        cv2.resize(coarse, (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC).astype(np.float64)
    )


def _softened(chosen: BoolArray) -> FloatArray:
    return np.asarray(cv2.GaussianBlur(chosen.astype(np.float64), (0, 0), 2.0))


def _lab_of(rgb: FloatArray) -> FloatArray:
    return np.asarray(cv2.cvtColor(rgb.astype(np.float32), cv2.COLOR_RGB2LAB).astype(np.float64))


def _rgb(lab: FloatArray) -> FloatArray:
    return np.asarray(
        np.clip(cv2.cvtColor(lab.astype(np.float32), cv2.COLOR_LAB2RGB), 0, 1).astype(np.float64)
    )
