"""Long hair: when the photo shows it, and the layer that hangs from the head."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.body.parts import PARTS
from a2v.geometry.mesh import is_closed, vertex_normals
from a2v.geometry.rays import RayScene, signed_distance_and_normals
from a2v.reconstruction.backs.seen import HAIR
from a2v.reconstruction.canonical import Sight, canonical_person
from a2v.reconstruction.canonical.build import posed_vertices
from a2v.reconstruction.canonical.coloring import layout, load_layout
from a2v.reconstruction.canonical.hair import (
    ROWS,
    hair_faces,
    hair_layout,
    hair_twins,
    strand_numbers,
)
from a2v.reconstruction.canonical.strands import COLUMNS, TEMPLES, angles
from a2v.reconstruction.canonical.topology import topology
from a2v.reconstruction.coloring.atlas import padded_layout
from a2v.reconstruction.coloring.canvas import Canvas
from a2v.reconstruction.coloring.tones import combed
from a2v.reconstruction.reading.hair import head_colors, long_hair
from a2v.types import Body, FloatArray, Standing, Subject
from tests.support.bodies import with_turned_limb
from tests.support.faces import BLACK, CAMERA, GREEN, with_hair
from tests.support.sights import with_skirt
from tests.support.surfaces import coated

COUNT = 2 * ROWS * COLUMNS
NAVY = (24, 30, 52)
"""Of a coat, sRGB."""


@pytest.fixture(scope="module")
def photo(body: Body) -> Subject:
    return with_hair(body, -0.07)


def test_hair_beside_the_neck_is_long(body: Body, photo: Subject) -> None:
    seen = long_hair(photo, body, CAMERA)
    assert seen is not None
    assert not seen.like_cloth
    shown = (photo.image == BLACK).all(axis=-1)
    assert (seen.pixels & shown).sum() > 0.9 * shown.sum()
    assert not (seen.pixels & (photo.image == GREEN).all(axis=-1)).any()


def test_an_ear_does_not_cut_hair_in_two(body: Body, photo: Subject) -> None:
    seen, face = long_hair(photo, body, CAMERA), photo.face
    assert seen is not None
    assert face is not None
    chin, middle = float(face[:, 1].max()), float(face[:, 0].mean())
    bare = photo.image[int(face[1, 1]), int(middle)]
    image, ear = photo.image.copy(), int(0.05 * CAMERA.scale)
    rows = slice(int(chin) - 2 * ear, int(chin) - ear)  # across all hair of one side
    image[rows, : int(middle)][(image[rows, : int(middle)] == BLACK).all(axis=-1)] = bare
    found = long_hair(dataclasses.replace(photo, image=image), body, CAMERA)
    assert found is not None
    below = np.zeros(photo.mask.shape, bool)
    below[int(chin) - ear + 4 :, : int(middle)] = True
    assert (found.pixels & below).sum() > 0.9 * (seen.pixels & below).sum() > 100


def test_short_hair_dark_clothes_and_an_unseen_face_give_no_long_hair(
    body: Body, photo: Subject
) -> None:
    assert long_hair(with_hair(body, 0.05), body, CAMERA) is None  # to the lips
    assert long_hair(with_hair(body, 0.05, cloth=BLACK), body, CAMERA) is None
    assert long_hair(dataclasses.replace(photo, face=None), body, CAMERA) is None


def test_a_dark_collar_beside_the_cheeks_is_no_hair(body: Body) -> None:
    photo, navy = with_hair(body, 0.03, cloth=NAVY), np.array(NAVY)
    assert photo.face is not None
    face = photo.face[:, :2]
    chin, middle = float(face[:, 1].max()), float(face[:, 0].mean())
    rows, columns = np.ogrid[: len(photo.image), : photo.image.shape[1]]
    beside = np.abs(columns - middle) / CAMERA.scale
    collar = (rows > chin - 0.05 * CAMERA.scale) & (rows < chin + 0.1 * CAMERA.scale)
    collar = collar & (beside > 0.07) & (beside < 0.12)
    image, mask = photo.image.copy(), photo.mask.copy()
    image[collar], mask[collar] = 0.7 * navy, 1  # in shade
    assert long_hair(dataclasses.replace(photo, image=image, mask=mask), body, CAMERA) is None


def test_on_clothes_of_its_color_hair_is_seen_down_to_the_shoulders_alone(body: Body) -> None:
    seen = long_hair(with_hair(body, -0.07, cloth=BLACK), body, CAMERA)
    assert seen is not None
    assert seen.like_cloth
    shoulder = body.bone_transforms[body.bone_names.index("upperarm01.L"), :3, 3]
    row = int(CAMERA.project(shoulder[None].astype(np.float64))[0, 1])
    assert not seen.pixels[row:].any()


@pytest.fixture(scope="module")
def standing(body: Body, photo: Subject) -> Standing:
    made = canonical_person(
        with_skirt(Sight(photo, body, CAMERA, coated(body, cell=0.02, coat=0.01)), False)
    )
    assert made.surface.standing is not None
    assert is_closed(made.surface.vertices, made.surface.faces)
    return made.surface.standing


def test_long_hair_is_a_closed_layer_outside_the_body(standing: Standing) -> None:
    mesh, first = topology(), len(topology().twin)
    hair = standing.vertices[first:]
    assert len(hair) == COUNT
    assert is_closed(hair, hair_faces())
    assert (standing.parts[first:] == PARTS.index("head")).all()
    faces = mesh.faces[mesh.skin[mesh.faces].all(axis=1)]
    skin = standing.vertices[:first]
    away, _ = signed_distance_and_normals(
        skin, faces, vertex_normals(skin, faces), RayScene(skin, faces.astype(np.int32)), hair
    )
    below = np.arange(COUNT) % (ROWS * COLUMNS) >= 10 * COLUMNS  # roots lie within the head
    before = np.minimum(angles(), 360 - angles()) < TEMPLES + 8  # and short strands altogether
    below &= ~np.tile(before, COUNT // COLUMNS)
    assert np.quantile(away[below], 0.01) > -0.003
    assert away.max() < 0.15
    outside = hair[: ROWS * COLUMNS].reshape(ROWS, COLUMNS, 3)
    assert np.ptp(outside[..., 1]) > 0.25  # from the crown over the nape to the back
    assert (outside[-1, COLUMNS // 2 - 5 : COLUMNS // 2 + 5, 2] < 0).all()


def test_hair_behind_the_head_stands_off_like_that_at_its_sides(
    standing: Standing, body: Body
) -> None:
    wide = with_hair(body, -0.07, width=0.17)
    afro = canonical_person(
        with_skirt(Sight(wide, body, CAMERA, coated(body, cell=0.02, coat=0.01)), False)
    ).surface.standing
    assert afro is not None
    first, count = len(topology().twin), ROWS * COLUMNS

    def depth(person: Standing) -> float:
        rows = person.vertices[first : first + count].reshape(ROWS, COLUMNS, 3)
        return float(-rows[ROWS // 2, COLUMNS // 2, 2])

    assert depth(afro) > depth(standing) + 0.02


def test_hair_follows_the_head_and_no_arm(standing: Standing, body: Body) -> None:
    first, names = len(topology().twin), body.bone_names
    weights, bones = standing.weights[first:], standing.bones[first:]
    assert np.allclose(weights.sum(axis=1), 1, atol=1e-5)
    used = {names[bone] for bone in np.unique(bones[weights > 0])}
    assert used <= {"head", "neck02", "spine01", "spine02", "spine03", "spine04"}
    rows = weights * (bones == names.index("head"))
    assert (rows.sum(axis=1)[:COLUMNS] > 0.99).all()


@pytest.mark.parametrize("turn", [[0.0, 60.0, 0.0], [35.0, 0.0, 0.0], [-30.0, 0.0, 20.0]])
def test_no_turn_of_the_head_tears_the_hair(
    standing: Standing, body: Body, turn: list[float]
) -> None:
    posed = with_turned_limb(body, "head", turn)
    first, faces = len(topology().twin), hair_faces()
    moved = posed_vertices(standing, posed)[first:]
    still = posed_vertices(standing, body)[first:]
    assert np.abs(moved - still).max() > 0.05
    long = _edges(moved, faces)
    assert not ((long > 0.04) & (long > 3 * _edges(still, faces))).any()
    # a strand that ends on the face is beside a long one
    assert np.quantile(long, 0.999) < max(0.04, 1.5 * np.quantile(_edges(still, faces), 0.999))


def _edges(vertices: FloatArray, faces: FloatArray) -> FloatArray:
    corners = vertices[faces]
    return np.asarray(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2))


def test_the_strip_of_the_hair_lies_below_the_body_and_beside_that_of_a_skirt() -> None:
    faces = len(topology().faces)
    alone = layout(256, hairy=True).uv
    assert len(alone) == faces + len(hair_faces()) == faces + len(hair_layout())
    assert alone.min() >= 0
    assert alone.max() <= 1
    assert alone[faces:, :, 1].max() < alone[:faces, :, 1].min()
    both = layout(256, 2 * 192 * 20, hairy=True).uv
    hair, skirt = both[-len(hair_faces()) :], both[faces : -len(hair_faces())]
    assert skirt[..., 1].max() < hair[..., 1].min()
    assert hair[..., 1].max() < both[:faces, :, 1].min()


def test_twins_of_strands_are_mirrored(standing: Standing) -> None:
    twins = hair_twins()
    assert (twins[twins] == np.arange(COUNT)).all()
    roots = standing.vertices[len(topology().twin) :][:COLUMNS]
    assert np.abs(roots * [-1, 1, 1] - roots[twins[:COLUMNS]]).max() < 0.02
    assert (strand_numbers(COUNT)[:COLUMNS] == np.arange(COLUMNS)).all()


def test_unseen_strands_have_the_tone_of_the_visible_ones_and_streaks() -> None:
    rows, columns = np.mgrid[:40, :30]
    rest = np.stack([columns.ravel(), -rows.ravel(), 0 * rows.ravel()], axis=1) * 0.01
    canvas = Canvas(
        rest=rest,
        parts=np.full(1200, PARTS.index("head")),
        twin=np.arange(1200),
        atlas=layout(256),
        agreement=np.zeros((len(PARTS) + 1, 1, 1), np.uint8),
        strands=columns.ravel(),
    )
    base = np.random.default_rng(1).normal([0.4, 0.25, 0.2], 0.02, (1200, 3))
    known, labels = rows.ravel() < 20, np.full(1200, HAIR)
    base[~known] = [0.1, 0.8, 0.1]
    mouth = np.zeros(1200, bool)
    mouth[30 * 18 : 30 * 20] = True
    base[mouth] = [0.17, 0.0, 0.0]
    result = combed(base, known, canvas, labels, mouth)
    assert (result[known] == base[known]).all()
    assert result[~known][:30, 1].min() > 0.15  # beside the mouth
    assert np.abs(result[~known].mean(axis=0) - [0.4, 0.25, 0.2]).max() < 0.05
    assert result[-30:].std(axis=0).max() > 0.003  # from strand to strand
    assert (combed(base, known & (rest[:, 0] < 0), canvas, labels, mouth) == base).all()
    assert (canvas.owners == len(PARTS)).all()
    short = dataclasses.replace(canvas, strands=None)
    assert (combed(base, known, short, labels, mouth) == base).all()
    assert (short.owners == PARTS.index("head")).all()


def test_hair_halfway_between_a_light_and_a_dark_side_is_between_them() -> None:
    rows, columns = np.mgrid[:20, :61]
    angle = np.radians(columns.ravel() * 6.0)
    rest = np.stack([0.1 * np.sin(angle), -0.01 * rows.ravel(), -0.1 * np.cos(angle)], axis=1)
    canvas = Canvas(
        rest=rest,
        parts=np.full(len(rest), PARTS.index("head")),
        twin=np.arange(len(rest)),
        atlas=layout(256),
        agreement=np.zeros((len(PARTS) + 1, 1, 1), np.uint8),
        strands=columns.ravel(),
    )
    side, ahead = rest[:, 0] > 0, rest[:, 2] > 0
    base = np.where(side[:, None], [0.5, 0.35, 0.25], [0.15, 0.1, 0.08])
    colors = combed(base, ahead, canvas, np.full(len(rest), HAIR), np.zeros(len(rest), bool))
    turn = np.degrees(np.arctan2(rest[:, 0], -rest[:, 2]))  # from straight behind
    dark, light = (colors[np.abs(turn - at) < 5, 0].mean() for at in (-80, 80))
    middle = colors[np.abs(turn) < 5, 0].mean()
    assert dark + 0.1 < middle < light - 0.1
    steps = [colors[np.abs(turn - at) < 5, 0].mean() for at in range(-80, 81, 20)]
    assert np.diff(steps).max() < 0.6 * (light - dark)  # no edge down the back


def test_colors_of_the_upper_rows_are_those_of_the_whole_photo(photo: Subject) -> None:
    noise = np.random.default_rng(0).integers(0, 256, photo.image.shape)
    photo = dataclasses.replace(photo, image=(photo.image // 2 + noise // 2).astype(np.uint8))
    whole = head_colors(photo, CAMERA.scale, rows=len(photo.image), blur=0.004)
    some = head_colors(photo, CAMERA.scale, rows=len(photo.image) // 3, blur=0.004)
    assert whole is not None
    assert some is not None
    assert len(some.lab) == len(photo.image) // 3
    assert np.abs(whole.lab[: len(some.lab)] - some.lab).max() < 1e-9
    assert (whole.outside[: len(some.lab)] == some.outside).all()
    assert (whole.crown[: len(some.lab)] == some.crown).all()
    assert not whole.crown[len(some.lab) :].any()


def test_a_loaded_layout_is_the_one_of_people_without_layers() -> None:
    load_layout(64)
    made = padded_layout.cache_info().misses
    atlas = layout(64, 0, hairy=False)
    assert padded_layout(atlas).atlas is atlas
    assert padded_layout.cache_info().misses == made
