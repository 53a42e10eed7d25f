"""On synthetic people cloth continues at the back in phase, without prints or tints of skin."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from a2v.body.parts import PARTS
from a2v.geometry.images import sample_image
from a2v.geometry.mesh import vertex_normals
from a2v.reconstruction.backs import (
    KINDS,
    BackEvidence,
    Continuation,
    Materials,
    continue_photo,
    find_panels,
    in_palette,
    label_surface,
    run_around,
    seen_before,
)
from a2v.reconstruction.backs.frames import unrolling
from a2v.reconstruction.backs.labels import loose_hair
from a2v.reconstruction.backs.seen import HAIR, UPPER
from a2v.reconstruction.backs.seen import SKIN as SKIN_LABEL
from a2v.reconstruction.palettes import lab_of
from a2v.reconstruction.reading.skin import is_skin, skin_of_hands
from a2v.types import BoolArray, FloatArray, IntArray, OrthographicCamera

RADIUS, HALF = 0.14, 0.3
CAMERA = OrthographicCamera(scale=400.0, center_u=80.0, center_v=140.0)
SIZE = (280, 160)
CLOTH = np.array([0.35, 0.4, 0.55])
SKIN = np.array([0.8, 0.6, 0.5])


def _cylinder(step: float = 0.008) -> tuple[FloatArray, IntArray]:
    """An upright tube, closed by cones: vertices (V, 3), meters, and faces (F, 3)."""
    rings, around = round(2 * HALF / step) + 1, round(2 * np.pi * RADIUS / step)
    angle = np.arange(around) * 2 * np.pi / around
    height = np.linspace(-HALF, HALF, rings)
    ring = np.stack([RADIUS * np.sin(angle), np.zeros(around), RADIUS * np.cos(angle)], axis=1)
    vertices = (ring[None] + np.stack([0 * height, height, 0 * height], axis=1)[:, None]).reshape(
        -1, 3
    )
    row, column = (
        grid.ravel() for grid in np.meshgrid(np.arange(rings - 1), np.arange(around), indexing="ij")
    )
    a, b = row * around + column, row * around + (column + 1) % around
    faces = np.concatenate(
        [np.stack([a, b, b + around], axis=1), np.stack([a, b + around, a + around], axis=1)]
    )
    low, high = len(vertices), len(vertices) + 1
    own, after = np.arange(around), (np.arange(around) + 1) % around
    top = (rings - 1) * around
    caps = [
        np.stack([np.full(around, low), after, own], axis=1),
        np.stack([np.full(around, high), top + own, top + after], axis=1),
    ]
    return np.concatenate([vertices, [[0, -HALF - 0.02, 0], [0, HALF + 0.02, 0]]]), np.concatenate(
        [faces, *caps]
    )


def _made(vertices: FloatArray, *, near: int = 8, **given: Any) -> BackEvidence:
    """Return what is known of vertices: the `given` ones, and nothing of the others."""
    count = len(vertices)
    nothing = {name: np.zeros(count, bool) for name in ("scalp", "bare", "face")}
    neighbors = cKDTree(vertices).query(vertices, near + 1)[1][:, 1:]
    return BackEvidence(
        **{
            "vertices": vertices,
            "front": np.arange(count),
            "twin": np.full(count, -1),
            "neighbors": neighbors,
            "skin": None,
        }
        | nothing
        | given
    )


def _seen(
    vertices: FloatArray,
    normals: FloatArray,
    clean: FloatArray,
    *,
    expected: FloatArray,
    parts: IntArray | None = None,
) -> BackEvidence:
    pixels = CAMERA.project(vertices)
    known: BoolArray = normals[:, 2] > 0.35
    parts = np.full(len(vertices), PARTS.index("torso")) if parts is None else parts
    colors = np.where(known[:, None], sample_image(clean, pixels), expected)
    return _made(
        vertices,
        near=10,
        colors=colors,
        known=known,
        parts=parts,
        front=seen_before(pixels, known, parts),
    )


def _photo(paint: Callable[[FloatArray, FloatArray], FloatArray]) -> FloatArray:
    """The tube's photo (H, W, 3) in the colors of `paint`.

    `paint` takes the distance around the tube from the middle of the front (n,) and heights (n,),
    meters.
    """
    columns, rows = np.meshgrid(np.arange(SIZE[1]) + 0.5, np.arange(SIZE[0]) + 0.5)
    points = CAMERA.unproject(np.stack([columns, rows], axis=-1), 0.0)
    across = np.clip(points[..., 0] / RADIUS, -1, 1)
    return np.clip(paint(RADIUS * np.arcsin(across), points[..., 1]), 0, 1).astype(np.float32)


def continued_by_steps(
    seen: BackEvidence,
    faces: IntArray,
    normals: FloatArray,
    clean: FloatArray,
    camera: OrthographicCamera,
) -> Continuation:
    """What the steps of the coloring make, from the labels to the palette."""
    labels, strange = label_surface(seen)
    labels = run_around(seen, labels)
    materials = Materials(labels, strange, *find_panels(seen, labels))
    made = continue_photo(seen, materials, faces, normals, clean, camera)
    expected = in_palette(made.expected, made.labels, seen.known)
    return dataclasses.replace(made, expected=expected)


def _continued(clean: FloatArray, expected: FloatArray = CLOTH) -> tuple[FloatArray, Continuation]:
    vertices, faces = _cylinder()
    normals = vertex_normals(vertices, faces)
    return vertices, continued_by_steps(
        _seen(vertices, normals, clean, expected=expected), faces, normals, clean, CAMERA
    )


def _body(vertices: FloatArray) -> BoolArray:
    """The tube without its ends."""
    return np.abs(vertices[:, 1]) < HALF - 0.06


def test_rings_go_on_around_the_body_in_phase() -> None:
    period = 0.05
    clean = _photo(lambda way, y: CLOTH + 0.15 * np.cos(2 * np.pi * y / period)[..., None])
    vertices, continued = _continued(clean)
    detail = continued.on_vertices()[:, 0]
    wanted = np.cos(2 * np.pi * vertices[:, 1] / period)
    for behind in (vertices[:, 2] < -0.5 * RADIUS, np.abs(vertices[:, 2]) < 0.5 * RADIUS):
        chosen = behind & _body(vertices) & continued.continues
        assert (
            chosen.sum()
            > 0.9 * (behind & _body(vertices) & (vertex_normals(*_cylinder())[:, 2] <= 0.35)).sum()
        )
        assert np.corrcoef(detail[chosen], wanted[chosen])[0, 1] > 0.9
        assert 0.6 < detail[chosen].std() / (0.15 * wanted[chosen].std()) < 1.3


def test_upright_stripes_keep_their_width_on_the_sides_and_behind() -> None:
    period = 2 * np.pi * RADIUS / 20
    clean = _photo(lambda way, y: CLOTH + 0.15 * np.cos(2 * np.pi * way / period)[..., None])
    vertices, continued = _continued(clean)
    level = np.abs(vertices[:, 1] - vertices[np.abs(vertices[:, 1]).argmin(), 1]) < 1e-6
    ring = np.flatnonzero(level & (vertices[:, 2] < 0.3 * RADIUS))
    ring = ring[np.argsort(np.arctan2(vertices[ring, 0], -vertices[ring, 2]))]
    detail = continued.on_vertices()[ring, 0]
    crossings = (np.diff(np.sign(detail - detail.mean())) != 0).sum()
    assert 0.7 < crossings / (2 * 20 * len(ring) / 110) < 1.3
    assert detail.std() > 0.05


def test_a_print_is_not_repeated() -> None:
    weave = np.random.default_rng(0).normal(0, 0.03, (*SIZE, 1))
    clean = _photo(
        lambda way, y: (
            CLOTH
            + weave
            + np.where((np.hypot(way, y - 0.05) < 0.05)[..., None], [0.5, -0.3, -0.4], 0.0)
        )
    )
    vertices, faces = _cylinder()
    normals = vertex_normals(vertices, faces)
    pixels = CAMERA.project(vertices)
    shining = 0.5 * CLOTH + 0.5 * sample_image(
        clean, pixels
    )  # as a network would predict: the print shines through
    continued = continued_by_steps(
        _seen(vertices, normals, clean, expected=shining), faces, normals, clean, CAMERA
    )
    behind = (normals[:, 2] < -0.3) & _body(vertices)
    print_behind = behind & (np.hypot(vertices[:, 0], vertices[:, 1] - 0.05) < 0.03)
    assert continued.doubtful[print_behind].all()
    redness = continued.expected[behind, 0] - continued.expected[behind, 2]
    assert np.abs(redness - (CLOTH[0] - CLOTH[2])).max() < 0.06
    assert np.abs(continued.on_vertices()[behind]).max() < 0.12
    assert continued.on_vertices()[behind].std() > 0.002


def test_skin_does_not_tint_cloth() -> None:
    """A body in a shirt that ends in the middle: above it skin; behind, what is expected is blurred
    over the border."""
    clean = _photo(lambda way, y: np.where((y < 0.0)[..., None], CLOTH, SKIN))
    vertices, faces = _cylinder()
    normals = vertex_normals(vertices, faces)
    parts = np.where(vertices[:, 1] < 0.0, PARTS.index("torso"), PARTS.index("neck"))
    share = np.clip(0.5 + vertices[:, 1] / 0.08, 0, 1)[:, None]
    seen = _seen(vertices, normals, clean, expected=share * SKIN + (1 - share) * CLOTH, parts=parts)
    seen = BackEvidence(**{**vars(seen), "skin": SKIN})
    labels, _ = label_surface(seen)
    clear = _body(vertices) & (np.abs(vertices[:, 1]) > 0.02)
    wanted = np.where(vertices[:, 1] < 0, KINDS.index("upper"), KINDS.index("skin"))
    assert (labels == wanted)[clear].mean() > 0.98
    continued = continued_by_steps(seen, faces, normals, clean, CAMERA)
    assert (labels[continued.neighbors] == labels[:, None]).all()
    near = (normals[:, 2] < 0) & (vertices[:, 1] < -0.02) & (vertices[:, 1] > -0.05)
    before, after = (
        np.linalg.norm(colors[near] - CLOTH, axis=1).mean()
        for colors in (seen.colors, continued.expected)
    )
    assert after < 0.7 * before


def test_a_surface_unrolls_as_the_photo_shows_it() -> None:
    vertices, faces = _cylinder()
    normals = vertex_normals(vertices, faces)
    body = _body(vertices)
    neighbors = cKDTree(vertices).query(vertices, k=11)[1][:, 1:]
    maps = unrolling(vertices, normals, np.full(len(vertices), PARTS.index("torso")), neighbors)[
        body
    ]
    tangent = np.stack([normals[body, 2], 0 * normals[body, 2], -normals[body, 0]], axis=1)
    assert np.abs(np.einsum("nij,nj->ni", maps, tangent) - [1, 0]).max() < 0.05
    assert np.abs(maps[:, :, 1] - [0, 1]).max() < 0.05


def test_nothing_is_continued_where_nothing_is_understood() -> None:
    """A tube of hands alone: no label, and the expected colors stay what they were."""
    vertices, faces = _cylinder(0.012)
    normals = vertex_normals(vertices, faces)
    clean = _photo(lambda way, y: np.broadcast_to(CLOTH, (*np.shape(y), 3)))
    parts = np.full(len(vertices), PARTS.index("left_hand"))
    seen = _seen(vertices, normals, clean, expected=SKIN, parts=parts)
    continued = continued_by_steps(seen, faces, normals, clean, CAMERA)
    assert not continued.labels.any()
    assert not continued.continues.any()
    assert not continued.on_vertices().any()


@pytest.mark.parametrize("name", ["torso", "left_thigh"])
def test_a_limb_is_seen_before_its_own_back(name: str) -> None:
    pixels = np.array([[0.0, 0.0], [10.0, 0.0], [0.5, 0.0]])
    parts = np.repeat([PARTS.index(name), PARTS.index("left_hand"), PARTS.index(name)], 30)
    spread = np.repeat(pixels, 30, axis=0) + np.linspace(0, 0.1, 90)[:, None]
    known = np.arange(90) < 60
    assert (seen_before(spread, known, parts)[60:] < 30).all()


def test_a_tuft_behind_is_no_hair_but_the_crown_and_a_beard_are() -> None:
    rng = np.random.default_rng(0)
    vertices = rng.standard_normal((6000, 3))
    vertices *= 0.1 / np.linalg.norm(vertices, axis=1, keepdims=True)
    known = vertices[:, 2] > 0.01
    crown, tuft, beard = (
        vertices[:, 1] > 0.05,
        (vertices[:, 2] < -0.09),
        (vertices[:, 1] < -0.06) & known,
    )
    parts = np.full(len(vertices), PARTS.index("head"))
    seen = _made(
        vertices, near=6, colors=np.full((len(vertices), 3), 0.5), known=known, parts=parts
    )
    labels = np.where(crown | tuft | beard, HAIR, SKIN_LABEL)
    np.testing.assert_array_equal(loose_hair(seen, labels), tuft)
    assert not loose_hair(
        seen, np.where(crown | (vertices[:, 2] < -0.05), HAIR, SKIN_LABEL)
    ).any()  # as large as a crown: long hair


def test_a_collar_goes_on_behind_the_neckline() -> None:
    vertices, _ = _cylinder()
    top, skin, cloth = vertices[:, 1].max(), np.array([0.8, 0.6, 0.5]), np.array([0.2, 0.3, 0.7])
    known = vertices[:, 2] > 0.02
    neckline = (np.abs(vertices[:, 0]) < 0.06) & (vertices[:, 1] > top - 0.12)
    colors = np.where((known & neckline)[:, None], skin, cloth)
    colors[~known & neckline] = (
        0.6 * skin + 0.4 * cloth
    )  # what a network that has seen the front expects
    pixels = vertices[:, :2] * [1, -1]
    parts = np.full(len(vertices), PARTS.index("torso"))
    seen = _made(
        vertices,
        colors=colors,
        known=known,
        parts=parts,
        front=seen_before(pixels, known, parts),
        skin=skin,
    )
    labels, _ = label_surface(seen)
    assert (labels[known & neckline] == KINDS.index("skin")).mean() > 0.8
    assert (labels[~known & neckline] == KINDS.index("upper")).mean() > 0.9


def test_the_other_side_of_the_body_says_what_is_there() -> None:
    """A shirt above red trousers with a patch at the back.

    A network and the photo in front predict the shirt there; its mirrored spot shows trousers.
    """
    red = np.array([0.7, 0.15, 0.15])
    clean = _photo(lambda way, y: np.where((y < 0.0)[..., None], red, CLOTH))
    vertices, faces = _cylinder()
    normals = vertex_normals(vertices, faces)
    parts = np.where(vertices[:, 1] < 0.0, PARTS.index("left_thigh"), PARTS.index("torso"))
    seen = _seen(vertices, normals, clean, expected=CLOTH, parts=parts)
    patch = ~seen.known & (vertices[:, 1] > 0.01) & (vertices[:, 1] < 0.09)
    shown = np.flatnonzero(seen.known & (vertices[:, 1] < -0.03) & (vertices[:, 1] > -0.15))
    twin = np.full(len(vertices), -1)
    twin[patch] = np.resize(shown, patch.sum())
    colors = np.where(patch[:, None], seen.colors[twin], seen.colors)
    inner = patch & (vertices[:, 1] > 0.03) & (vertices[:, 1] < 0.07) & (normals[:, 2] < 0.2)
    told = continued_by_steps(
        dataclasses.replace(seen, twin=twin, colors=colors), faces, normals, clean, CAMERA
    )
    alone = continued_by_steps(seen, faces, normals, clean, CAMERA)
    assert (alone.labels[inner] == KINDS.index("upper")).all()
    assert (told.labels[inner] == KINDS.index("lower")).mean() > 0.95
    assert np.abs(told.expected[inner] - red).max(axis=1).mean() < 0.05


def _head(hair: FloatArray, skin: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A ball of a head, and its colors: hair above, skin below."""
    rng = np.random.default_rng(0)
    vertices = rng.standard_normal((6000, 3))
    vertices *= 0.1 / np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices, np.where((vertices[:, 1] > 0.03)[:, None], hair, skin) + rng.normal(
        0, 0.01, (len(vertices), 3)
    )


@pytest.mark.parametrize("hair", [[0.25, 0.18, 0.12], [0.92, 0.78, 0.62]], ids=["dark", "fair"])
def test_hair_reaches_the_nape_where_a_network_expects_skin(hair: list[float]) -> None:
    skin = np.array([0.85, 0.65, 0.55])
    vertices, colors = _head(np.array(hair), skin)
    known, high = vertices[:, 2] > 0.01, vertices[:, 1] > 0.03
    scalp = (vertices[:, 2] < -0.01) & (vertices[:, 1] > -0.05) | (vertices[:, 1] > 0.06)
    parts = np.full(len(vertices), PARTS.index("head"))
    seen = _made(
        vertices,
        colors=colors,
        known=known,
        parts=parts,
        scalp=scalp,
        skin=skin,
        face=known & ~high,
    )
    nape = ~known & (vertices[:, 1] > -0.04) & (vertices[:, 1] < 0.02) & (vertices[:, 2] < -0.03)
    below = ~known & (vertices[:, 1] < -0.07)
    labels, _ = label_surface(seen)
    assert (labels[nape] == HAIR).mean() > 0.95
    assert (labels[below] == SKIN_LABEL).mean() > 0.95
    without, _ = label_surface(dataclasses.replace(seen, scalp=vertices[:, 1] > 0.06))
    assert (without[nape] == HAIR).mean() < 0.3


@pytest.mark.parametrize("bald", [False, True], ids=["hair", "bald"])
def test_a_hairline_within_the_face_is_hair_but_gloss_on_a_bald_head_is_not(bald: bool) -> None:
    skin = np.array([0.85, 0.65, 0.55])
    vertices, colors = _head(skin if bald else np.array([0.25, 0.18, 0.12]), skin)
    known = vertices[:, 2] > 0.01
    gloss = known & (vertices[:, 1] > 0.07) & (np.abs(vertices[:, 0]) < 0.02)
    colors[gloss & bald] = 1.0
    seen = _made(
        vertices,
        colors=np.where(known[:, None], colors, skin),
        known=known,
        parts=np.full(len(vertices), PARTS.index("head")),
        scalp=(vertices[:, 2] < -0.01) & (vertices[:, 1] > -0.05) | (vertices[:, 1] > 0.06),
        skin=skin,
        face=known,
    )
    behind = seen.scalp & ~known & (vertices[:, 2] < -0.03)
    labels, _ = label_surface(seen)
    assert (labels[behind] == (SKIN_LABEL if bald else HAIR)).mean() > 0.95


def test_who_is_seen_from_behind_has_a_face_of_skin() -> None:
    hair, skin = np.array([0.25, 0.18, 0.12]), np.array([0.85, 0.65, 0.55])
    vertices, colors = _head(hair, skin)
    known = vertices[:, 2] > 0.01  # the back of the head, and the neck
    bare = (vertices[:, 2] < -0.03) & (vertices[:, 1] < 0.07)
    colors[~known] = 0.7 * hair + 0.3 * skin  # what a network expects that sees a head of hair
    seen = _made(
        vertices,
        colors=colors,
        known=known,
        parts=np.full(len(vertices), PARTS.index("head")),
        skin=skin,
    )
    inner = (vertices[:, 2] < -0.05) & (vertices[:, 1] < 0.05)
    assert (
        label_surface(dataclasses.replace(seen, bare=bare))[0][inner] == SKIN_LABEL
    ).mean() > 0.95
    assert (label_surface(seen)[0][inner] == SKIN_LABEL).mean() < 0.7


def test_hands_tell_the_skin_but_gloves_do_not() -> None:
    rng = np.random.default_rng(0)
    for skin in ([0.85, 0.65, 0.55], [0.35, 0.22, 0.16]):
        found = skin_of_hands(np.array(skin) + rng.normal(0, 0.02, (100, 3)))
        assert found is not None
        np.testing.assert_allclose(found, skin, atol=0.01)
    for glove in ([0.2, 0.2, 0.22], [0.2, 0.3, 0.7], [0.3, 0.5, 0.3]):
        assert skin_of_hands(np.tile(glove, (100, 1))) is None
    assert skin_of_hands(np.tile([0.85, 0.65, 0.55], (10, 1))) is None


def test_hair_over_the_cheeks_is_no_skin() -> None:
    for skin in ([0.85, 0.65, 0.55], [0.25, 0.15, 0.11], [0.95, 0.8, 0.75]):
        assert is_skin(lab_of(np.array(skin)))
    for other in ([0.12, 0.12, 0.12], [0.75, 0.75, 0.77], [0.2, 0.4, 0.6]):
        assert not is_skin(lab_of(np.array(other)))


WHITE, RED = np.array([0.9, 0.9, 0.92]), np.array([0.7, 0.1, 0.1])


def _panels_of(
    paint: Callable[[FloatArray, FloatArray], FloatArray],
) -> tuple[BackEvidence, IntArray]:
    """A tube in white and red, seen from the front and expected to be pink behind; the panels."""
    vertices, faces = _cylinder()
    seen = _seen(
        vertices,
        vertex_normals(vertices, faces),
        _photo(lambda way, y: np.where(paint(way, y)[..., None], WHITE, RED)),
        expected=(WHITE + RED) / 2,
    )
    return seen, find_panels(seen, np.full(len(vertices), UPPER))[0]


def test_a_panel_on_one_side_ends_and_does_not_fade_over_the_back() -> None:
    vertices, faces = _cylinder()
    normals = vertex_normals(vertices, faces)
    clean = _photo(lambda way, y: np.where((way > 0.10)[..., None], WHITE, RED))
    seen = _seen(vertices, normals, clean, expected=(WHITE + RED) / 2)
    expected = continued_by_steps(seen, faces, normals, clean, CAMERA).expected
    behind = _body(vertices) & ~seen.known
    whiteness = (expected[behind] - RED) @ (WHITE - RED) / ((WHITE - RED) @ (WHITE - RED))
    assert ((whiteness > 0.2) & (whiteness < 0.8)).mean() < 0.06  # pink before: all of them
    right = (vertices[behind, 0] < 0) | (vertices[behind, 2] < -0.95 * RADIUS)
    assert (whiteness[right] < 0.2).all()
    beside = (vertices[behind, 0] > 0.9 * RADIUS) & (vertices[behind, 2] > 0.2 * RADIUS)
    assert (whiteness[beside] > 0.8).mean() > 0.9


def test_a_band_around_the_body_goes_on_behind() -> None:
    seen, panels = _panels_of(lambda way, y: np.abs(y) < 0.06)
    inner, outer = np.abs(seen.vertices[:, 1]) < 0.045, np.abs(seen.vertices[:, 1]) > 0.075
    assert len(np.unique(panels)) == 2
    assert len(np.unique(panels[inner])) == 1
    assert len(np.unique(panels[outer])) == 1


def test_narrow_stripes_and_plain_cloth_are_no_panels() -> None:
    assert not _panels_of(lambda way, y: (y / 0.01).astype(int) % 2 == 0)[1].any()
    assert not _panels_of(lambda way, y: way > 1)[1].any()


def test_an_open_jacket_of_a_color_like_the_shirts_covers_the_back() -> None:
    vertices, faces = _cylinder()
    normals = vertex_normals(vertices, faces)
    arms = [PARTS.index(f"{side}_upper_arm") for side in ("left", "right")]
    parts = np.select([vertices[:, 0] > 0.1, vertices[:, 0] < -0.1], arms, PARTS.index("torso"))
    shirt, denim = np.array([0.82, 0.81, 0.83]), np.array([0.6, 0.7, 0.82])
    woven = np.random.default_rng(0).normal(1, 0.12, (*SIZE[:2], 1))

    def panels(jacket: FloatArray) -> IntArray:
        clean = _photo(
            lambda way, y: np.where(((way > -0.08) & (way < 0.02))[..., None], shirt, jacket)
        )
        clean = np.clip(clean * woven, 0, 1).astype(np.float32)
        seen = _seen(vertices, normals, clean, expected=(shirt + jacket) / 2, parts=parts)
        return find_panels(seen, np.full(len(vertices), UPPER))[0]

    found, torso = panels(denim), parts == PARTS.index("torso")
    behind = torso & (vertices[:, 2] < 0)
    sleeve = np.unique(found[~torso])
    assert len(sleeve) == 1
    assert (found[behind & _body(vertices)] == sleeve).all()
    middle = torso & ~behind & (np.abs(vertices[:, 0] + 0.03) < 0.03)
    assert not (found[middle] == sleeve).any()
    assert not panels(0.8 * shirt).any()  # a shirt with its sleeves in shade
