"""Where a character's colors are laid: its texture layout, its vertices apart from each other, and
which pixels of the photo are of which part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.parts import PART_NEIGHBORS, PARTS
from a2v.body.places import canonical_places
from a2v.geometry.rays import ray_scene
from a2v.reconstruction.atlas import Atlas
from a2v.reconstruction.held import held_things
from a2v.reconstruction.limbs_seen import arms_by_landmarks, bare_hands
from a2v.reconstruction.surroundings import like_surroundings
from a2v.types import (
    Body,
    BodyMap,
    BoolArray,
    ByteArray,
    Camera,
    FloatArray,
    IntArray,
    OrthographicCamera,
    Subject,
    Surface,
)

_MARGIN = 0.01
"""Pixels up to so far, meters, from another part's are not trusted, ..."""
_FADE = 0.006
"""... and within so much more they fade in."""
_SURE = 0.12
"""Places of the body map with a larger scale tell no part."""
_MIXED = 0.7
"""A pixel of the body map is of another part where at least this share of what is around it is."""
_DOUBTFUL = 0.07
"""Up to so far from another part a pixel's color is looked at, meters."""
_DEEP = 0.02
"""What is deeper in a part tells its colors, meters."""
_MOVING = ("hand", "lower_arm", "shin", "foot")
"""Parts that lie before others, or others before them, in poses of which the fit is a little
off."""
_ALIKE = 9.0
"""Colors within so many CIELAB units are alike."""
_TELLS = 2.0
"""A pixel is another part's if the share of that part's pixels that are like it is so many times
the share of its own part's."""
_RARE = 0.03
"""And so much more."""
_SAMPLES = 600
"""Pixels of a part that are compared, at most."""
_LEAST = 30
"""Pixels of a part that are needed."""
_CLOTH = 0.4
"""Cloth of which a larger share looks like skin is not told from it."""
_HEM = 0.1
"""Up to so far from cloth that hangs before legs, meters, it may hang otherwise in the photo."""
STEP = 2
"""Pixels of the photo a side that share an answer."""


@dataclass(frozen=True, eq=False)
class Canvas:
    """What the colors of a canonical person are laid on.

    Attributes
    ----------
    rest : (V, 3) float64
        Vertices at rest, meters: neighbors are found there.
    parts : (V,) int
        Index into `a2v.body.PARTS`.
    twin : (V,) int
        The mirrored vertex.
    atlas : Atlas
    agreement : (P, H / step, W / step) uint8
        For each part how far, 0 to 255, the photo's pixels are its own.
    hands : (3,), optional
        Color of hands that are not seen, sRGB in [0, 1]; None where nobody knows, or they wear
        gloves.
    loose : (V,) bool, optional
        Vertices of cloth that is no skin's: a skirt.
    """

    rest: FloatArray
    parts: IntArray
    twin: IntArray
    atlas: Atlas
    agreement: ByteArray
    hands: FloatArray | None = None
    loose: BoolArray | None = None

    def agrees(self, pixels: FloatArray, parts: IntArray) -> FloatArray:
        """How far (N,), 0 to 1, the photo's `pixels` (N, 2) are of the `parts` (N,)."""
        _, height, width = self.agreement.shape
        column = np.clip(pixels[:, 0] / STEP, 0, width - 1).astype(np.int64)
        row = np.clip(pixels[:, 1] / STEP, 0, height - 1).astype(np.int64)
        return self.agreement[parts, row, column] / 255.0


def strangers() -> BoolArray:
    """Which parts (P, P) do not grow into each other."""
    apart = ~np.eye(len(PARTS), dtype=bool)
    for pair in PART_NEIGHBORS:
        first, second = map(PARTS.index, pair)
        apart[first, second] = apart[second, first] = False
    return apart


@dataclass(frozen=True, eq=False)
class Clues:
    """What else tells which pixels are not of a part.

    Attributes
    ----------
    taken : (h, w) bool
        Pixels that the mask has for the person where the photo shows what is around
        (`surroundings_taken`).
    arms : (P, h, w) bool, better : (P,) bool
        Arms by the landmarks, and for which parts those tell more than the fit
        (`a2v.reconstruction.limbs_seen.arms_by_landmarks`).
    skin : (h, w) bool, optional
        Pixels that look like skin, of which hands are; None where nobody knows
        (`a2v.reconstruction.limbs_seen.bare_hands`).
    loose : (V,) bool
        Vertices of cloth that is no skin's: where the surface shows them, the body map is not
        asked.
    """

    taken: BoolArray
    arms: BoolArray
    better: BoolArray
    skin: BoolArray | None
    loose: BoolArray

    def against(self, part: int, apart: BoolArray) -> BoolArray:
        """Pixels (h, w) that are not of a part; `apart` (P, P) are parts that do not grow into each
        other."""
        return np.asarray(self.taken | self.arms[self.better & apart[part]].any(axis=0))

    def within(self, part: int) -> BoolArray | None:
        """Pixels (h, w) of which alone a part may be; None for all. Fingers are too thin for a
        margin here."""
        own = self.arms[part] if self.better[part] else None
        if self.skin is None or not PARTS[part].endswith("hand"):
            return own
        return self.skin if own is None else np.asarray(own & self.skin)

    def tone(self, image: ByteArray) -> FloatArray | None:
        """Color (3,), sRGB in [0, 1], of the bare hands in a picture (H, W, 3), else of all skin;
        None where nobody knows."""
        import cv2

        if self.skin is None or not self.skin.any():
            return None
        hands = self.skin & self.arms[[name.endswith("hand") for name in PARTS]].any(axis=0)
        small = cv2.resize(image, self.skin.shape[::-1], interpolation=cv2.INTER_AREA)
        return np.asarray(
            np.median(small[hands if hands.sum() > _LEAST else self.skin], axis=0) / 255.0
        )


def clues_of(subject: Subject, body: Body, camera: Camera, loose: BoolArray) -> Clues:
    """What a photo and its fitted body tell."""
    height, width = (side // STEP for side in subject.mask.shape)
    arms, better = arms_by_landmarks(subject, body, camera, (height, width), STEP)
    return Clues(
        surroundings_taken(body, subject, camera),
        arms,
        better,
        bare_hands(subject, arms, STEP),
        loose,
    )


def surroundings_taken(body: Body, subject: Subject, camera: Camera) -> BoolArray:
    """Which pixels (h, w), every `STEP`-th, the mask has for the person where the photo shows what
    is around a fitted body, or what its hands hold."""
    shown = body_shown(body, subject, camera)
    scale = camera.scale / STEP
    return like_surroundings(subject, shown, scale) | held_things(subject, shown, scale)


def body_shown(body: Body, subject: Subject, camera: Camera) -> IntArray:
    """Part (h, w) that a fitted body, without clothes, shows on every `STEP`-th pixel of the photo;
    -1 for none."""
    height, width = (side // STEP for side in subject.mask.shape)
    flat = camera.flatten(body.vertices).astype(np.float32)
    skin = Surface(
        vertices=flat,
        faces=np.asarray(body.faces, np.int32),
        colors=np.zeros(flat.shape, np.float32),
    )
    return parts_shown(skin, np.asarray(body.parts, np.int64), camera.flat, (height, width))


def part_agreement(
    surface: Surface, parts: IntArray, subject: Subject, camera: OrthographicCamera, *, clues: Clues
) -> ByteArray:
    """For each part how far (P, h, w) the photo's pixels are its own.

    Neither the posed character nor the body map shows another part there, nor next to it; around
    such borders, where the fit may be off, the pixel's color is not that of the other part; and
    the `clues` do not speak against it.
    """
    import cv2

    height, width = (side // STEP for side in subject.mask.shape)
    shown = parts_shown(surface, parts, camera, (height, width))
    told = None if subject.bodymap is None else _parts_of_map(subject.bodymap, (height, width))
    hanging = (
        parts_shown(surface, clues.loose.astype(np.int64), camera, (height, width)) == 1
        if clues.loose.any()
        else np.zeros((height, width), bool)
    )
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
    for part in range(len(PARTS)):
        others = np.isin(shown, np.flatnonzero(apart[part]))
        if told is not None:
            others |= told[apart[part]].sum(axis=0) > _MIXED
        others |= clues.against(part, apart)
        if not others.any():
            continue
        before = np.isin(shown, np.flatnonzero(palettes.asked[part]))
        near = cv2.distanceTransform((~before).astype(np.uint8), cv2.DIST_L2, 5) / scale
        doubtful = (shown == part) & (near < _DOUBTFUL) & ~others
        others[doubtful] = palettes.of_others(part, doubtful)
        away = cv2.distanceTransform((~others).astype(np.uint8), cv2.DIST_L2, 5) / scale
        result[part] = np.clip((away - _MARGIN) / _FADE, 0, 1) * 255
    for part in range(len(PARTS)):
        within = clues.within(part)
        if within is not None:
            result[part][~within] = 0
    if hanging.any() and clues.skin is not None and clues.skin[hanging].mean() < _CLOTH:
        bare_legs(result, hanging, clues.skin, scale)
    return result


def bare_legs(agreement: ByteArray, hanging: BoolArray, skin: BoolArray, scale: float) -> None:
    """Around the hem of cloth that is seen `hanging` (h, w), legs take what is `skin` (h, w) alone,
    and the cloth what is none: as it hung in the photo, it hangs no more.

    `agreement` (P, h, w) is changed; `scale` is pixels per meter.
    """
    import cv2

    near = cv2.distanceTransform((~hanging).astype(np.uint8), cv2.DIST_L2, 5) < _HEM * scale
    for part, name in enumerate(PARTS):
        if name.endswith(("thigh", "shin")):
            agreement[part][near & ~skin] = 0
    agreement[PARTS.index("torso")][hanging & skin] = 0


class _Palettes:
    """What the photo shows well within each part: by this a pixel near a border is told from the
    other side's."""

    def __init__(self, image: ByteArray, shown: IntArray, apart: BoolArray, scale: float) -> None:
        import cv2
        from skimage.color import rgb2lab

        self.lab = np.asarray(rgb2lab(image), np.float64)
        moving = np.array([name.endswith(_MOVING) for name in PARTS])
        self.asked = apart & (
            moving[:, None] | moving
        )  # the skin of a neckline is that of the face, and the trunk's
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
        for number in hands:  # alike, and small
            self.samples[number] = both

    def of_others(self, part: int, asked: BoolArray) -> BoolArray:
        """Which of the pixels `asked` (h, w) look like another part rather than like `part`, (n,)
        bool."""
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


def parts_shown(
    surface: Surface, parts: IntArray, camera: OrthographicCamera, size: tuple[int, int]
) -> IntArray:
    """Part (h, w) that a posed surface on `parts` (V,) shows on every `STEP`-th pixel; -1 for
    none."""
    columns, rows = np.meshgrid(
        (np.arange(size[1]) + 0.5) * STEP, (np.arange(size[0]) + 0.5) * STEP
    )
    points = camera.unproject(np.stack([columns, rows], axis=-1), 0.0)
    rays = np.empty((*size, 6), np.float32)
    rays[..., :2], rays[..., 2], rays[..., 3:] = (
        points[..., :2],
        float(surface.vertices[:, 2].max()) + 1,
        (0, 0, -1),
    )
    found = ray_scene(surface.vertices, surface.faces, threads=0).cast_rays(rays)
    hit = np.isfinite(found["t_hit"].numpy())
    face = np.where(hit, found["primitive_ids"].numpy().astype(np.int64), 0)
    return np.where(hit, parts[surface.faces[face, 0]], -1)


def _parts_of_map(found: BodyMap, size: tuple[int, int]) -> FloatArray:
    """Share (P, h, w) of each part around each pixel, as the body map has it; 0 where it is not
    sure."""
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
