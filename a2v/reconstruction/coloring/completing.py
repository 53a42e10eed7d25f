"""Complete heads by a network in the head chart: which observed colors are right, and what the
unseen places look like.

The network is trained on the studio's heads (`a2v.lab.heads`). Card: a2v/weights/README.md.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from a2v.body.head_chart import (
    HEIGHT,
    WIDTH,
    head_cells,
    sample_chart,
)
from a2v.body.parts import PARTS
from a2v.geometry.images import sample_image
from a2v.geometry.steps import smoothstep
from a2v.reconstruction.coloring.painting import HeadCover, Painting
from a2v.reconstruction.reading.shown import STEP
from a2v.sessions import WEIGHTS, open_session, read_metadata
from a2v.types import BoolArray, FloatArray

FORMAT = "a2v-heads/1"
FILE = WEIGHTS / "person_heads.onnx"
CHANNELS = 9
"""Channels of the network's input: color (3), trust, offset, whether the cell is on the head, and
its direction (3)."""
OUTPUTS = 10
"""Channels of its output: outermost (3) and skin (3) color, logits of cover and of keeping a color
for both, and the distance of the outermost from the skin, which only the training uses."""
OFFSET = 0.05
"""Unit of offsets, meters."""
_KEEP = (0.3, 0.7)
"""Probabilities that an observed color is right between which the trust in it rises."""
_NEAR = 0.03
"""Distance over which the difference of photo and network is carried from a kept place, meters."""
_UNLIKE = 0.1
"""Scale of the distance of colors beyond which they are not of the same material, sRGB."""
_NEIGHBORS = 60
"""Number of kept places whose difference is carried to a place."""
_FADE = 0.1
"""Weight of the usual difference, which holds far from all kept places."""
_TEMPLES = 48
"""Row of the chart at the height of the eyes, below which skin in front of the ears has no hair."""
_EARS = 34
"""Distance of the back of the ears from the middle of the face, columns."""
_VOLUME = 0.05
"""Distance from the sides of the head beyond which hair is a volume around the face, meters."""
_CHIN = (74, 82, 8)
"""First and last row of the chin, and its largest distance from the middle, columns."""
_BESIDE_HAIR = 0.003
"""Distance from hair that hangs before a cheek within which its pixels are not skin, meters."""
_BEARD = 0.3
"""Share of the chin with the colors of the hair from which on there is a beard."""


@dataclass(frozen=True, eq=False)
class CompletedHead:
    """What the network says of the cells of the chart.

    Attributes
    ----------
    outer, skin : (H, W, 3)
        Color of what lies outermost, and of the skin below it, sRGB.
    cover : (H, W)
        Probability that hair, a hat or cloth lies on the skin.
    keep, keep_skin : (H, W)
        Probability that the observed color is that of the outermost, or of the skin.
    """

    outer: FloatArray
    skin: FloatArray
    cover: FloatArray
    keep: FloatArray
    keep_skin: FloatArray


def inputs_of(
    colors: FloatArray, trust: FloatArray, offset: FloatArray, valid: BoolArray
) -> FloatArray:
    """The network's input (`CHANNELS`, H, W) float32.

    Parameters
    ----------
    colors : (H, W, 3)
        Of the photo at the cells, sRGB in [0, 1].
    trust : (H, W)
        Reliability of these colors, from 0 to 1.
    offset : (H, W)
        Distance of the surface from the body's skin, meters.
    valid : (H, W) bool
        Cells on head or neck.
    """
    row, column = np.mgrid[:HEIGHT, :WIDTH]
    azimuth = ((column + 0.5) / WIDTH - 0.5) * 2 * np.pi
    direction = [np.sin(azimuth), np.cos(azimuth), (row + 0.5) / HEIGHT - 0.5]
    seen = (colors - 0.5) * trust[..., None]
    rest = np.stack([trust, offset / OFFSET, valid, *direction])
    return np.asarray(np.concatenate([seen.transpose(2, 0, 1), rest]), np.float32)


def completed(chart: FloatArray) -> CompletedHead:
    """Complete a chart (`CHANNELS`, H, W): the mean over it and its mirror image.

    Raises
    ------
    InputError
        The file of the weights is not a network of heads.
    """
    read_metadata(FILE, (FORMAT,), "network of heads")
    mirrored = chart[:, :, ::-1].copy()
    mirrored[6] *= -1  # the sine of the azimuth
    (found,) = open_session(FILE).run(["completed"], {"chart": np.stack([chart, mirrored])})
    found = (found[0] + found[1, :, :, ::-1]) / 2
    keep = 1 / (1 + np.exp(-found[6:9].astype(np.float64)))
    colors = np.clip(found[:6], 0, 1).transpose(1, 2, 0)
    return CompletedHead(
        outer=colors[..., :3],
        skin=colors[..., 3:],
        cover=keep[0],
        keep=keep[1],
        keep_skin=keep[2],
    )


def observed_chart(painting: Painting) -> FloatArray:
    """The network's input for a canonical person."""
    canvas, photo, cells = painting.canvas, painting.photo, head_cells()
    assert canvas is not None
    assert canvas.head is not None
    own = slice(0, len(canvas.head.bare))
    points = cells.spread(painting.vertices[own]).reshape(-1, 3)
    normals = cells.spread(painting.normals[own]).reshape(-1, 3)
    strongest = np.take_along_axis(
        cells.corners, cells.weights.argmax(axis=2)[..., None], axis=2
    ).ravel()
    trust = photo.trust(points, normals, canvas.owners[strongest]).reshape(HEIGHT, WIDTH)
    trust = trust * cells.valid
    colors = sample_image(photo.clean, photo.camera.project(points)).reshape(HEIGHT, WIDTH, 3)
    away = cells.spread(canvas.rest[own] - canvas.head.bare)
    offset = np.linalg.norm(away, axis=-1) * cells.valid
    return inputs_of(np.clip(colors, 0, 1), trust, offset, cells.valid)


def complete_head(painting: Painting) -> Painting:
    """Expect on head and neck what a network completes, and keep only the colors of the photo that
    are of what lies there."""
    canvas = painting.canvas
    if canvas is None or canvas.head is None:
        return painting
    found = completed(observed_chart(painting))
    vertices = np.flatnonzero(canvas.head.outermost & ~painting.mouth)
    places, hair = canvas.head.places[vertices], canvas.head.covered[vertices]
    shares = np.stack([found.cover, found.keep, found.keep_skin], axis=-1)
    outer, skin, shares = (
        sample_chart(chart, places) for chart in (found.outer, found.skin, shares)
    )
    hung, on_hair = (chosen[vertices] for chosen in _behind_strands(painting))
    cover = ~(hair | hung | canvas.head.ears[vertices]) & (shares[:, 0] > 0.5)
    colors = np.where(cover[:, None], outer, skin)
    keep = smoothstep(np.where(hair | hung, shares[:, 2], shares[:, 1]), *_KEEP)
    keep = np.where(hung & on_hair, 0.0, keep)
    # what covers a neck is mostly a collar, which garments continue; and if the crown has hair,
    # the scalp has, too: the network takes brown hair above brown skin for skin
    scalp = np.zeros(len(painting.known), bool) if painting.spots is None else painting.spots.scalp
    asked = np.where(cover, painting.on("head")[vertices], hair | hung | ~scalp[vertices])
    vertices, cover, colors, keep = vertices[asked], cover[asked], colors[asked], keep[asked]
    told, covered = np.zeros((2, len(painting.known)), bool)
    told[vertices], covered[vertices] = True, cover
    kept = np.ones(len(told))
    kept[vertices] = keep
    # what another photo shows is known
    known = painting.known & ((kept > 0.5) | ~painting.main)
    expected = painting.expected.copy()
    expected[vertices] = _matched(painting, vertices, known, covered, colors)
    return dataclasses.replace(
        painting,
        known=known,
        main=painting.main & known,
        kept=kept,
        expected=expected,
        head_cover=HeadCover(told=told, covered=covered),
    )


def _behind_strands(painting: Painting) -> tuple[BoolArray, BoolArray]:
    """Return the vertices (V,) of cheeks, jaw and neck of a person with a layer of long hair, and
    those (V,) at which the photo shows it: there it hangs in front of them.

    A beard is hair on them, too, and an afro lies on them: then there are none.
    """
    canvas, spots = painting.canvas, painting.spots
    none = np.zeros(len(painting.known), bool)
    if canvas is None or canvas.head is None or canvas.hairy is None or spots is None:
        return none, none
    places, wide = canvas.head.places, np.abs(canvas.rest[:, 0])
    if wide[canvas.hairy].max() > wide[canvas.head.outermost & painting.on("head")].max() + _VOLUME:
        return none, none
    middle = np.abs(places[:, 0] - WIDTH / 2)
    front = ~spots.scalp | (middle < _EARS)
    behind = canvas.head.outermost & front & (places[:, 1] > _TEMPLES)
    chin = painting.main & (places[:, 1] > _CHIN[0]) & (places[:, 1] < _CHIN[1])
    chin &= middle < _CHIN[2]
    on_hair = _on_hair(painting)
    bearded = bool(chin.any()) and on_hair[chin].mean() > _BEARD
    return (none, none) if bearded else (np.asarray(behind), on_hair)


def _on_hair(painting: Painting) -> BoolArray:
    """Return the vertices (V,) at or near whose pixels the photo shows long hair."""
    import cv2

    canvas = painting.canvas
    assert canvas is not None
    reach = 2 * round(_BESIDE_HAIR * painting.photo.camera.scale / STEP) + 1
    hair = cv2.dilate(canvas.agreement[len(PARTS)], np.ones((reach, reach), np.uint8))
    canvas = dataclasses.replace(canvas, agreement=hair[None])
    pixels = painting.photo.camera.project(painting.vertices)
    return canvas.agrees(pixels, np.zeros(len(pixels), np.int64)) > 0


def paint_head(painting: Painting) -> Painting:
    """Give hidden skin of head and neck the colors that the network completes."""
    cover, colors = painting.head_cover, painting.colors.copy()
    if cover is None:
        return painting
    hidden = cover.told & ~cover.covered & ~painting.known
    colors[hidden] = painting.expected[hidden]
    return dataclasses.replace(painting, colors=colors)


def _matched(
    painting: Painting,
    vertices: np.ndarray,
    known: BoolArray,
    covered: BoolArray,
    colors: FloatArray,
) -> FloatArray:
    """The completed `colors` (n, 3) of `vertices` (n,) in the tone of the photo: the difference at
    kept places, separately for skin and for what covers it, fades out behind them."""
    from scipy.spatial import cKDTree

    assert painting.canvas is not None
    rest, result = painting.canvas.rest, colors.copy()
    for kind in (False, True):
        own = covered[vertices] == kind
        shown = own & known[vertices]
        if shown.sum() < _NEIGHBORS:
            continue
        differ = painting.colors[vertices[shown]] - colors[shown]
        sure = np.exp(-0.5 * (np.linalg.norm(differ, axis=1) / _UNLIKE) ** 2)
        tree = cKDTree(rest[vertices[shown]])
        away, near = tree.query(rest[vertices[own]], k=_NEIGHBORS, workers=1)
        alike = np.linalg.norm(colors[own][:, None] - colors[shown][near], axis=2)
        weight = np.exp(-0.5 * ((away / _NEAR) ** 2 + (alike / _UNLIKE) ** 2)) * sure[near]
        usual = (sure[:, None] * differ).sum(axis=0) / sure.sum()
        carried = np.einsum("nk,nkc->nc", weight, differ[near]) + _FADE * usual
        result[own] = colors[own] + carried / (weight.sum(axis=1, keepdims=True) + _FADE)
    return np.clip(result, 0, 1)
