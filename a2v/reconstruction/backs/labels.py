"""Label a surface with skin, hair, upper and lower garment and shoes by the photo, and extend the
labels to the back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from a2v.reconstruction.backs.pieces import joined_pieces, with_votes
from a2v.reconstruction.backs.seen import (
    ARM_PARTS,
    FOOT_PARTS,
    HAIR,
    HANDS,
    HEAD_PARTS,
    LOWER,
    SHOES,
    SKIN,
    UNSURE,
    UPPER,
    BackEvidence,
    allowed_parts,
)
from a2v.reconstruction.palettes import clustered_colors, lab_of, palette_distance
from a2v.types import BoolArray, FloatArray, IntArray

_NEVER = 60.0
"""Cost of a label on a part that does not wear it, in CIELAB units."""
_SHADE = np.array([0.5, 1.0, 1.0])
"""Weights of lightness, a and b: shadows are the same material."""
_HUE = np.array([0.3, 1.0, 1.0])
"""The same for skin, which has all shades between light and shadow."""
HANGING = 0.3
"""Largest distance of hanging hair from the head, meters."""
TUFT = 0.2
"""Smallest size of an unseen piece of hair, as a share of the largest piece."""
_FAIR = 6.0
"""Smallest distance of fair hair from all shades of the skin, CIELAB units."""
_SAME = 11.0
"""Distance of colors below which two garments are one, CIELAB units."""


@dataclass(frozen=True, kw_only=True)
class LabelCosts:
    """Costs of labels, in CIELAB units unless they are shares; the labels with the smallest sum
    over the surface are chosen.

    Attributes
    ----------
    unlike_before : float
        On the back, a label other than that of the front at the same pixel.
    skin_on_torso, hair : float
        Factors of it for skin in front of the trunk, and for hair.
    below_neckline : float
        Skin on the trunk behind a neckline, if there is an upper garment: collars are higher at the
        back.
    expected, expected_hidden : float
        Weight of an expected color relative to the photo, and where scalp or bare skin must be.
    no_hair, no_skin : float
        Cost of a label other than hair on the scalp, and of one other than skin on the face.
    unlike_twin : float
        A label other than that of the visible mirrored vertex.
    most_expected : float
        Largest cost of an expected color.
    print_from : float
        Cost of the best label above which the color of a vertex is not that of the label.
    print_share : float
        Share of such vertices above which a label is dropped.
    shoes_off_feet, skin_on_trunk, skin_on_arms, lower_on_trunk : float
        Labels on parts that rarely have them (`_reluctance`).
    chest : float
        Quantile of the heights of the trunk above which a lower garment costs `lower_on_trunk`.
    """

    unlike_before: float = 7.0
    skin_on_torso: float = 3.0
    hair: float = 0.5
    below_neckline: float = 12.0
    expected: float = 0.7
    expected_hidden: float = 0.2
    no_hair: float = 15.0
    no_skin: float = 15.0
    unlike_twin: float = 10.0
    most_expected: float = 40.0
    print_from: float = 30.0
    print_share: float = 0.35
    shoes_off_feet: float = 6.0
    skin_on_trunk: float = 9.0
    skin_on_arms: float = 2.0
    lower_on_trunk: float = 15.0
    chest: float = 0.6


_COSTS = LabelCosts()


@dataclass(frozen=True, kw_only=True)
class PaletteSettings:
    """Settings of the palettes of the labels. Set by hand; there is no published source.

    Attributes
    ----------
    skin : float
        CIELAB distance from the color of the face up to which a vertex is bare skin.
    few, many : int
        Smallest number of visible vertices of a small part (crown, shoes) and of a large part
        (trunk, thighs).
    trunk : (float, float)
        The upper garment is sampled between these quantiles of the trunk's heights: below the
        collar, above the belt.
    crown, thigh : float
        Hair and the lower garment are sampled above these quantiles of the head's and the thighs'
        heights.
    hairline : float
        Height of the band at the top of the face in which hair is sampled if no crown is visible,
        as a share of the height of the face.
    hair_share : float
        Share of this band above which it is hair.
    share : float
        A cluster with a smaller share of the vertices is dropped.
    """

    skin: float = 10.0
    few: int = 20
    many: int = 100
    crown: float = 0.6
    trunk: tuple[float, float] = (0.35, 0.95)
    thigh: float = 0.5
    hairline: float = 0.1
    hair_share: float = 0.7
    share: float = 0.08


_PALETTE = PaletteSettings()
_KMEANS_ROUNDS = 12
_FRONT_ROUNDS = 4
"""Rounds of smoothing of visible labels."""
_BEHIND_ROUNDS = 10
"""Rounds of smoothing of labels on the back."""


def label_surface(seen: BackEvidence) -> tuple[IntArray, BoolArray]:
    """Return the label (V,) int of each vertex, an index into `KINDS`, and which vertices (V,) have
    another color than their label (prints).

    Visible vertices are sorted by color: every label has a palette from parts that have it for
    certain (hair: the crown; the upper garment: the chest; the lower one: the thighs). On the back,
    the expected colors count, and the label directly in front, because hems, belts and collars
    continue around the body at the same height. Both are smoothed over the surface.
    """
    lab = lab_of(seen.colors)
    palettes = _palettes(seen, lab)
    if not palettes:
        return np.full(len(lab), UNSURE), np.zeros(len(lab), bool)
    kinds = np.array(sorted(palettes))
    cost = np.stack(
        [palette_distance(lab, palettes[kind], _HUE if kind == SKIN else _SHADE) for kind in kinds],
        axis=1,
    )
    for column, kind in enumerate(kinds):
        cost[~seen.on(*allowed_parts(int(kind))), column] += _NEVER
        cost[:, column] += _reluctance(seen, int(kind), palettes)
        if seen.cloth is not None and kind not in (UPPER, LOWER):
            cost[seen.cloth, column] += _NEVER
        if seen.strands is not None:
            other = seen.strands if kind != HAIR else seen.on("torso") & ~seen.strands
            cost[other, column] += _NEVER
    front = with_votes(np.minimum(cost, _NEVER), seen.neighbors, rounds=_FRONT_ROUNDS)
    chosen = front.argmin(axis=1)
    # on the back a blurred expectation is less certain than the photo, and the label in front of
    # it is further evidence
    mirrored = chosen[seen.front]
    before = _COSTS.unlike_before * (np.arange(len(kinds)) != mirrored[:, None])
    before *= np.where(
        seen.on("torso")[:, None] & (kinds == SKIN),
        _COSTS.skin_on_torso,
        np.where(kinds == HAIR, _COSTS.hair, 1.0),
    )
    before[seen.face[seen.front] | seen.on("head")] = 0
    neckline = seen.on("torso") & (kinds[mirrored] == SKIN)  # on the back, collars are higher
    before[neckline] = np.where(kinds == SKIN, _COSTS.below_neckline * (UPPER in palettes), 0.0)
    trust = np.full((len(lab), 1), _COSTS.expected)
    if HAIR in palettes:  # hair reaches the nape, even if the network predicts otherwise
        trust[seen.scalp] = _COSTS.expected_hidden
        before[seen.scalp] += _COSTS.no_hair * (kinds != HAIR)
    if SKIN in palettes:  # a person who is turned away also has a face
        trust[seen.bare] = _COSTS.expected_hidden
        before[seen.bare] += _COSTS.no_skin * (kinds != SKIN)
    twins = seen.twin >= 0
    before[twins] = _COSTS.unlike_twin * (np.arange(len(kinds)) != chosen[seen.twin[twins], None])
    behind = with_votes(
        np.minimum(trust * cost, _COSTS.most_expected) + before,
        seen.neighbors,
        fixed=np.where(seen.known, chosen, -1),
        rounds=_BEHIND_ROUNDS,
    )
    final = np.where(seen.known, chosen, behind.argmin(axis=1))
    best = np.where(seen.known, front.min(axis=1), behind.min(axis=1))
    labels, strange = kinds[final], best > _COSTS.print_from
    loose = loose_hair(seen, labels)
    if loose.any():
        labels[loose] = kinds[
            np.where(kinds == HAIR, np.inf, cost[loose] + before[loose]).argmin(axis=1)
        ]
    labels[best > _NEVER] = UNSURE
    for kind in kinds:  # a label is wrong if most of its vertices have another color
        own = labels == kind
        if strange[own].mean() > _COSTS.print_share if own.any() else False:
            labels[own & strange] = UNSURE
    return labels, strange & (labels > UNSURE)


def _trunk_height(seen: BackEvidence) -> FloatArray:
    """Height (V,) of vertices along the trunk, meters: along the axis from the thighs to the head,
    also if the person leans."""
    thighs, head = seen.on("left_thigh", "right_thigh"), seen.on(*HEAD_PARTS)
    up = np.array([0.0, 1.0, 0.0])
    if thighs.any() and head.any():
        up = seen.vertices[head].mean(axis=0) - seen.vertices[thighs].mean(axis=0)
    return np.asarray(seen.vertices @ (up / max(float(np.linalg.norm(up)), 1e-9)))


def _reluctance(seen: BackEvidence, kind: int, palettes: Mapping[int, FloatArray]) -> FloatArray:
    """Return the cost (V,) of a label on parts that rarely have it. Clothes may have the color of
    skin, hair or shoes."""
    from scipy.spatial import cKDTree

    cost = np.zeros(len(seen.parts))
    if kind == SHOES:
        cost[~seen.on(*FOOT_PARTS)] = _COSTS.shoes_off_feet
    elif kind == SKIN and UPPER in palettes:
        cost[seen.on("torso")] = _COSTS.skin_on_trunk
        cost[seen.on(*ARM_PARTS)] = _COSTS.skin_on_arms
    elif kind == LOWER and UPPER in palettes:
        torso, height = seen.on("torso"), _trunk_height(seen)
        cost[torso] = _COSTS.lower_on_trunk * (
            height[torso] > np.quantile(height[torso], _COSTS.chest)
        )
    elif kind == HAIR:
        torso, head = seen.on("torso"), seen.on("head")
        if torso.any() and head.any():
            far = cKDTree(seen.vertices[head]).query(seen.vertices[torso], workers=1)[0] > HANGING
            alike = (
                UPPER in palettes
                and palette_distance(palettes[HAIR], palettes[UPPER], _SHADE).min() < _SAME
            )
            cost[torso] = np.where(far | alike, _NEVER, 0.0)
    return cost


def loose_hair(seen: BackEvidence, labels: IntArray) -> BoolArray:
    """Return which vertices (V,) look like hair but are not connected to the head (dark cloth), or
    are small unseen islands of hair."""
    hair = labels == HAIR
    piece = joined_pieces(hair, seen.neighbors)
    size = np.bincount(piece, hair & seen.on("head"))
    held = (size >= 20) & (
        (np.bincount(piece, hair & seen.known) > 0) | (size >= TUFT * size.max())
    )
    return np.asarray(hair & ~held[piece])


def _palettes(seen: BackEvidence, lab: FloatArray) -> dict[int, FloatArray]:
    """Typical CIELAB colors (n, 3) of each visible label."""
    from skimage.color import rgb2lab

    skin = None if seen.skin is None else rgb2lab(np.clip(seen.skin, 0, 1)[None])[0]
    bare = np.zeros(len(lab), bool)
    if skin is not None:
        # skin in shadow is still skin, but a shirt may have its hue
        bare = (
            np.linalg.norm(
                (lab - skin) * np.where(seen.on("torso", *ARM_PARTS)[:, None], _SHADE, _HUE), axis=1
            )
            < _PALETTE.skin
        )
    height = _trunk_height(seen)
    found: dict[int, FloatArray] = {}
    if skin is not None:
        found[SKIN] = _centers(
            lab[seen.known & bare & seen.on(*HEAD_PARTS, *HANDS)], skin[None], count=3
        )
    head = seen.known & seen.on("head") & ~seen.face
    crown = np.zeros(len(lab), bool)
    if head.sum() > _PALETTE.few:
        crown = head & (height > np.quantile(height[head], _PALETTE.crown)) & ~bare
    if crown.sum() <= _PALETTE.few:  # a low view: the hairline is within the box of the face
        crown = _hairline(seen, height, bare)
    if crown.sum() <= _PALETTE.few:  # fair hair has the hue of skin
        crown = (
            head
            & seen.scalp
            & (SKIN not in found or palette_distance(lab, found[SKIN], _SHADE) > _FAIR)
        )
    if crown.sum() > _PALETTE.few:
        found[HAIR] = _centers(lab[crown], None, count=2)
    body = seen.known & ~bare
    chest = body & seen.on("torso")
    if chest.sum() > _PALETTE.many:  # arms and legs may be bare, in the shadow
        low, high = np.quantile(height[chest], _PALETTE.trunk)
        found[UPPER] = _centers(lab[chest & (height > low) & (height < high)], None, count=4)
    thighs = body & seen.on("left_thigh", "right_thigh")
    if thighs.sum() > _PALETTE.many:
        thighs &= height > np.quantile(height[thighs], _PALETTE.thigh)
        lower = _centers(lab[thighs], None, count=4)
        # dresses and overalls: legs and chest have the same garment
        if (
            UPPER not in found
            or np.median(palette_distance(lab[thighs], found[UPPER], _SHADE)) > _SAME
        ):
            found[LOWER] = lower
    shoes = body & seen.on(*FOOT_PARTS)
    if shoes.sum() > _PALETTE.few:
        found[SHOES] = _centers(lab[shoes], None, count=2)
    return found


def _hairline(seen: BackEvidence, height: FloatArray, bare: BoolArray) -> BoolArray:
    """Return the visible vertices (V,) of hair at the top of the face; none if most vertices there
    are bare, since a bald head may have spots of gloss.

    `height` (V,) is along the trunk, meters; `bare` (V,) has the color of skin.
    """
    shown, face = seen.known & seen.on("head"), seen.face & seen.on("head")
    if not face.any():
        return np.zeros(len(bare), bool)
    level = height[face].max() - _PALETTE.hairline * float(np.ptp(height[face]))
    top = shown & (height > level)
    hair = top & ~bare
    return hair if hair.sum() > _PALETTE.hair_share * top.sum() else np.zeros(len(bare), bool)


def _centers(lab: FloatArray, start: FloatArray | None, *, count: int) -> FloatArray:
    """At most `count` centers of colors (N, 3) by k-means, without small clusters; `start` (1, 3)
    is added."""
    none = np.zeros((0, 3)) if start is None else start
    if len(lab) < 4 * count or lab.std(axis=0).max() < 1.0:
        return none if len(none) or not len(lab) else np.median(lab, axis=0)[None]
    found = clustered_colors(lab, count, shade=_SHADE, share=_PALETTE.share, rounds=_KMEANS_ROUNDS)
    return np.concatenate([none, found])
