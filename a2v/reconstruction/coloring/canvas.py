"""The canvas of a character's colors: its texture layout, its vertices at rest, and the part of
each pixel of the photo."""

from __future__ import annotations

import functools
from collections.abc import Sequence, Set
from dataclasses import dataclass

import numpy as np

from a2v.body.parts import PART_NEIGHBORS, PARTS
from a2v.body.places import canonical_places
from a2v.geometry.colors import lab_of_bytes
from a2v.reconstruction.coloring.atlas import Atlas
from a2v.reconstruction.flanks import flanks_beside_arms
from a2v.reconstruction.reading.record import HairSeen, Reading
from a2v.reconstruction.reading.shown import STEP, vertices_shown
from a2v.types import (
    BodyMap,
    BoolArray,
    ByteArray,
    FloatArray,
    IntArray,
    OrthographicCamera,
    Subject,
    Surface,
)

_MARGIN = 0.01
"""Distance from pixels of another part up to which pixels are not trusted, meters."""
_FADE = 0.006
"""Further distance over which they fade in, meters."""
_SURE = 0.12
"""Largest scale at which a place of the body map gives a part."""
_MIXED = 0.7
"""If other parts have this share around a pixel of the body map, the pixel belongs to another
part."""
_DOUBTFUL = 0.07
"""Distance from another part up to which the color of a pixel is compared, meters."""
_DEEP = 0.02
"""Pixels at least this deep within a part give its colors, meters."""
_MOVING = ("hand", "lower_arm", "shin", "foot")
"""Parts that often occlude others, or are occluded, so that small errors of the fit matter."""
_ALIKE = 9.0
"""Largest distance of similar colors, CIELAB units."""
_TELLS = 2.0
"""A pixel belongs to another part if the share of similar pixels there exceeds that in its own part
by this factor ..."""
_RARE = 0.03
"""... plus this share."""
_SAMPLES = 600
"""Largest number of pixels of a part that are compared."""
_LEAST = 30
"""Smallest number of pixels of a part that are needed."""
_HEM = 0.1
"""Distance from cloth in front of legs within which the cloth may hang differently in the photo,
meters."""
_CLOTH = 0.4
"""Share of cloth that looks like skin above which both are not separated."""
_WITHIN_HAIR = 0.002
"""Distance from the border of hair within which its pixels are not used, meters."""
_BESIDE_HAIR = 0.004
"""Distance from hair within which pixels of trunk and neck are not used, meters."""


@dataclass(frozen=True, eq=False)
class CanvasHead:
    """The head of a canonical person with V vertices.

    Attributes
    ----------
    places : (V, 2) float64
        Places of its vertices in the head chart (`a2v.body.head_chart`).
    outermost : (V,) bool
        Vertices of head and neck that the chart shows: without layers, eyes, teeth, and the inside
        of mouth, nose and ears.
    covered : (V,) bool
        Those under the layer of long hair.
    ears : (V,) bool
        Those of ears that the photo shows.
    bare : (A, 3) float64
        The body model's vertices at rest, without clothes and hair, meters; the person's first A
        vertices are the same ones.
    """

    places: FloatArray
    outermost: BoolArray
    covered: BoolArray
    ears: BoolArray
    bare: FloatArray


@dataclass(frozen=True, eq=False)
class Canvas:
    """The texture of a canonical person, and the parts of the photo.

    Attributes
    ----------
    rest : (V, 3) float64
        Vertices at rest, meters, by which neighbors are found.
    parts : (V,) int
        Index into `a2v.body.PARTS`.
    twin : (V,) int
        The mirrored vertex.
    atlas : Atlas
    agreement : (P, H / step, W / step) uint8
        For each part and pixel, 0 to 255: whether the pixel belongs to the part. With long hair
        one row more follows, for the hair.
    hands : (3,), optional
        Color of unseen hands, or of the gloves on them, sRGB in [0, 1]; None if it is unknown.
    gloved : bool
        Whether the hands wear gloves.
    loose : (V,) bool, optional
        Vertices of a separate layer of cloth: a skirt.
    around : (V,) int, optional
        For each vertex of that layer, one of the side that faces the camera, at the same height;
        for others the vertex itself.
    strands : (V,) int, optional
        Number of the strand of each vertex of a separate layer of long hair; -1 for all others.
    bare : sequence of str
        Forearms without sleeves (`Reading.bare_forearms`).
    head : CanvasHead, optional
    """

    rest: FloatArray
    parts: IntArray
    twin: IntArray
    atlas: Atlas
    agreement: ByteArray
    hands: FloatArray | None = None
    gloved: bool = False
    loose: BoolArray | None = None
    around: IntArray | None = None
    strands: IntArray | None = None
    bare: Sequence[str] = ()
    head: CanvasHead | None = None

    @functools.cached_property
    def owners(self) -> IntArray:
        """Row (V,) of `agreement` of each vertex: its part, or the last row for long hair."""
        return self.parts if self.hairy is None else np.where(self.hairy, len(PARTS), self.parts)

    @property
    def hairy(self) -> BoolArray | None:
        """Vertices (V,) of the layer of long hair; None without one."""
        return None if self.strands is None else self.strands >= 0

    def agrees(self, pixels: FloatArray, owners: IntArray) -> FloatArray:
        """Return, from 0 to 1, whether the `pixels` (N, 2) of the photo belong to the `owners`
        (N,)."""
        _, height, width = self.agreement.shape
        column = np.clip(pixels[:, 0] / STEP, 0, width - 1).astype(np.int64)
        row = np.clip(pixels[:, 1] / STEP, 0, height - 1).astype(np.int64)
        return self.agreement[owners, row, column] / 255.0


def strangers() -> BoolArray:
    """Return which pairs of parts (P, P) do not grow into each other."""
    apart = ~np.eye(len(PARTS), dtype=bool)
    for pair in PART_NEIGHBORS:
        first, second = map(PARTS.index, pair)
        apart[first, second] = apart[second, first] = False
    return apart


@dataclass(frozen=True, eq=False)
class BodyLayers:
    """Separate layers of a canonical person with V vertices.

    Attributes
    ----------
    loose : (V,) bool
        Vertices of a layer of cloth: in their pixels the body map is not used.
    strands : (V,) bool, optional
        Vertices of a layer of long hair.
    """

    loose: BoolArray
    strands: BoolArray | None = None

    @property
    def all(self) -> BoolArray:
        """Vertices (V,) of any layer."""
        return self.loose if self.strands is None else self.loose | self.strands


def _against(reading: Reading, arms: BoolArray, part: int, apart: BoolArray) -> BoolArray:
    """Return the pixels (h, w) that do not belong to a part; `apart` (P, P) are parts that do not
    grow into each other."""
    return np.asarray(reading.taken | arms[reading.better & apart[part]].any(axis=0))


def _only_within(reading: Reading, arms: BoolArray, part: int) -> BoolArray | None:
    """Return the only pixels (h, w) that may belong to a part; None for all. Fingers are too thin
    for a margin here."""
    own = arms[part] if reading.better[part] else None
    like = reading.like_hands
    if like is None or not PARTS[part].endswith("hand"):
        return own
    return like if own is None else np.asarray(own & like)


def part_agreement(
    surface: Surface,
    layers: BodyLayers,
    subject: Subject,
    camera: OrthographicCamera,
    reading: Reading,
    off: Set[str] = frozenset(),
) -> ByteArray:
    """For each part and pixel (P, h, w), 0 to 255: whether the pixel belongs to the part.

    It does if neither the posed character nor the body map shows another part there or next to it.
    Around such borders, where the fit may be wrong, the color of the pixel must not be that of the
    other part. Along a hanging arm there is such a border between trunk and upper arm too, and
    colors at the rim of the trunk must occur within it. The `reading` must not exclude the pixel.
    Rules in `off` are left out (`a2v.reconstruction.rules.COLORING`).
    """
    import cv2

    assert surface.standing is not None
    parts, arms = np.asarray(surface.standing.parts, np.int64), reading.arms
    height, width = (side // STEP for side in subject.mask.shape)
    vertex = vertices_shown(surface, camera, (height, width))
    shown = np.where(vertex >= 0, parts[vertex], -1)
    bodymap = None if "follow_map" in off else subject.bodymap
    told = None if bodymap is None else _parts_of_map(bodymap, (height, width))
    hanging = (vertex >= 0) & layers.loose[vertex]
    if told is not None:
        told[:, hanging] = 0.0
    apart, result = strangers(), np.full((len(PARTS), height, width), 255, np.uint8)
    scale = camera.scale / STEP
    palettes = _Palettes(
        cv2.resize(subject.image, (width, height), interpolation=cv2.INTER_AREA),
        shown,
        apart,
        scale,
    )
    flanks = flanks_beside_arms(surface, vertex, shown, layers.all, palettes.lab, scale)
    if "part_flanks" in off:
        flanks = {}
    for part in range(len(PARTS)):
        others = np.isin(shown, np.flatnonzero(apart[part]))
        if told is not None:
            others |= told[apart[part]].sum(axis=0) > _MIXED
        others |= _against(reading, arms, part, apart) | flanks.get(part, False)
        if not others.any():
            continue
        before = np.isin(shown, np.flatnonzero(palettes.asked[part]))
        near = cv2.distanceTransform((~before).astype(np.uint8), cv2.DIST_L2, 5) / scale
        doubtful = (shown == part) & (near < _DOUBTFUL) & ~others
        if "sort_by_palette" not in off:
            others[doubtful] = palettes.of_others(part, doubtful)
        away = cv2.distanceTransform((~others).astype(np.uint8), cv2.DIST_L2, 5) / scale
        result[part] = np.clip((away - _MARGIN) / _FADE, 0, 1) * 255
    for part in range(len(PARTS)):
        within = _only_within(reading, arms, part)
        if within is not None:
            result[part][~within] = 0
    skin = None if "clear_hem" in off else reading.skin
    if hanging.any() and skin is not None and skin[hanging].mean() < _CLOTH:
        bare_legs(result, hanging, skin, scale)
    return result if layers.strands is None else _with_hair(result, reading.hair, scale)


def _with_hair(agreement: ByteArray, seen: HairSeen | None, scale: float) -> ByteArray:
    """Add a row for long hair to `agreement` (P, h, w): it takes only pixels of hair, deep within
    them. Trunk and neck take none of these."""
    import cv2

    if seen is None:
        return np.concatenate([agreement, agreement[PARTS.index("head")][None]])
    size = agreement.shape[:0:-1]
    hair = cv2.resize(seen.pixels.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
    deep = cv2.distanceTransform(hair.astype(np.uint8), cv2.DIST_L2, 5) / scale
    away = cv2.distanceTransform((~hair).astype(np.uint8), cv2.DIST_L2, 5) / scale
    for name in ("torso", "neck"):
        part = PARTS.index(name)
        free = np.clip((away - _BESIDE_HAIR) / _FADE, 0, 1) * 255
        agreement[part] = np.minimum(agreement[part], free.astype(np.uint8))
    own = np.clip((deep - _WITHIN_HAIR) / _FADE, 0, 1) * 255
    return np.concatenate([agreement, own.astype(np.uint8)[None]])


class _Palettes:
    """Colors deep within each part, by which pixels near a border are assigned to one side."""

    def __init__(self, image: ByteArray, shown: IntArray, apart: BoolArray, scale: float) -> None:
        import cv2

        self.lab = lab_of_bytes(image)
        moving = np.array([name.endswith(_MOVING) for name in PARTS])
        self.asked = apart & (
            moving[:, None] | moving
        )  # the skin of a neckline has the face's color, but belongs to the trunk
        self.samples: list[FloatArray] = []
        for part in range(len(PARTS)):
            others = np.isin(shown, np.flatnonzero(apart[part]))
            away = cv2.distanceTransform((~others).astype(np.uint8), cv2.DIST_L2, 5) / scale
            within = cv2.distanceTransform((shown == part).astype(np.uint8), cv2.DIST_L2, 5) / scale
            deep = _DEEP * (0.4 if PARTS[part].endswith("hand") else 1.0)
            found = self.lab[(within > 0.3 * deep) & (away > deep)]
            self.samples.append(found[:: max(1, len(found) // _SAMPLES)])
        hands = [number for number, name in enumerate(PARTS) if name.endswith("hand")]
        both = np.concatenate([self.samples[number] for number in hands])
        for number in hands:  # both hands have the same color, and are small
            self.samples[number] = both

    def of_others(self, part: int, asked: BoolArray) -> BoolArray:
        """Return which (n,) of the pixels `asked` (h, w) look more like another part than like
        `part`."""
        from scipy.spatial import cKDTree

        own = self.samples[part]
        other = np.concatenate(
            [self.samples[number] for number in np.flatnonzero(self.asked[part])]
        )
        if len(own) < _LEAST or len(other) < _LEAST or not asked.any():
            return np.zeros(int(asked.sum()), bool)
        colors = self.lab[asked]
        like_own, like_other = (
            cKDTree(palette).query_ball_point(colors, _ALIKE, workers=1, return_length=True)
            / len(palette)
            for palette in (own, other)
        )
        return np.asarray(like_other > _TELLS * like_own + _RARE)


def _parts_of_map(found: BodyMap, size: tuple[int, int]) -> FloatArray:
    """Return the share (P, h, w) of each part around each pixel of the body map; 0 if it is
    uncertain."""
    import cv2
    from scipy.spatial import cKDTree

    from a2v.body.registry import load_body_model

    canonical = canonical_places()
    sure = found.inside & (found.place_scales < _SURE)
    part = np.full(found.inside.shape, -1)
    nearest = cKDTree(canonical.places).query(found.places[sure], workers=1)[1]
    part[sure] = load_body_model("anny").parts[canonical.vertex_ids[nearest]]
    side, told = len(part), np.zeros((len(PARTS), *size), np.float32)
    move = np.array(
        [
            [STEP / found.step, 0, (0.5 * STEP - found.corner[0]) / found.step - 0.5],
            [0, STEP / found.step, (0.5 * STEP - found.corner[1]) / found.step - 0.5],
        ]
    )
    for number in np.unique(part[part >= 0]):
        layer = (part == number).astype(np.float32).reshape(side, side)
        told[number] = cv2.warpAffine(
            layer, move, size[::-1], flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        )
    return told


def bare_legs(agreement: ByteArray, hanging: BoolArray, skin: BoolArray, scale: float) -> None:
    """Restrict the pixels around the hem of hanging cloth, which hangs differently in the photo.

    Legs take only pixels of `skin` (h, w), and the cloth takes only other pixels. `hanging` (h, w)
    is the cloth. `agreement` (P, h, w) is changed; `scale` is in pixels per meter.
    """
    import cv2

    near = cv2.distanceTransform((~hanging).astype(np.uint8), cv2.DIST_L2, 5) < _HEM * scale
    for part, name in enumerate(PARTS):
        if name.endswith(("thigh", "shin")):
            agreement[part][near & ~skin] = 0
    agreement[PARTS.index("torso")][hanging & skin] = 0
