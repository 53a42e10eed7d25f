"""Faces that are turned away, or of which a photo shows one half."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2v.body.face import face_landmarks, points_on_face
from a2v.body.parts import PARTS, on_parts
from a2v.body.spots import rest_vertices
from a2v.reconstruction.backs.seen import HAIR, UPPER
from a2v.reconstruction.canonical import Sight, canonical_person
from a2v.reconstruction.canonical.coloring import canvas_of
from a2v.reconstruction.canonical.mean_face import EXTENT, mean_face
from a2v.reconstruction.coloring import ColorEvidence, ColorSettings, Painting
from a2v.reconstruction.coloring.bake import CROWN, STRAND, _of_hair
from a2v.reconstruction.coloring.elsewhere import shown_elsewhere
from a2v.reconstruction.coloring.tones import even_tones
from a2v.reconstruction.colorings import color_by_photo
from a2v.reconstruction.face.colors import EYE, face_paint
from a2v.reconstruction.face.drawing import drawn_over
from a2v.reconstruction.face.facing import behind_limb, is_averted, turned_away
from a2v.reconstruction.face.places import LIPS
from a2v.reconstruction.palettes import lab_of
from a2v.types import Body, Reconstruction, Surface
from tests.support.faces import CAMERA, photographed
from tests.support.surfaces import coated


@pytest.fixture(scope="module")
def dressed(body: Body) -> Reconstruction:
    return coated(body, cell=0.012, coat=0.005)


@pytest.fixture(scope="module")
def averted(body: Body, dressed: Reconstruction) -> Reconstruction:
    return canonical_person(Sight(photographed(body, turned=55.0), body, CAMERA, dressed))


def lying(surface: Surface) -> np.ndarray:
    """Landmarks (478, 3) of the body's face on a canonical surface."""
    ids, weights = face_landmarks()
    return np.asarray(np.einsum("kc,kcd->kd", weights, surface.vertices[ids].astype(np.float64)))


def test_a_face_that_is_turned_away_keeps_the_models_features_and_all_expressions(
    averted: Reconstruction, body: Body
) -> None:
    subject = photographed(body, turned=55.0)
    assert subject.face is not None
    assert turned_away(subject.face) > 50
    surface = averted.surface
    assert surface.face is not None
    assert len(surface.face.names) == 52
    assert surface.provenance["turned_face"]
    points = lying(surface)
    # eyes as wide apart as the model's: no bend along the ray
    ids, weights = face_landmarks()
    own = np.einsum("kc,kcd->kd", weights, body.vertices[ids].astype(np.float64))
    wide, model = (np.linalg.norm(places[33] - places[263]) for places in (points, own))
    assert wide == pytest.approx(model, rel=0.12)
    across = points[263] - points[33]
    assert np.degrees(np.arctan2(abs(across[2]), across[0])) == pytest.approx(55.0, abs=8.0)


def test_a_turned_faces_photo_is_drawn_where_the_surface_has_its_landmarks(
    averted: Reconstruction,
) -> None:
    surface = averted.surface
    assert surface.face is not None
    photo = np.zeros((2048, 2048, 3), np.float32)
    landmarks = surface.face.landmarks.copy()
    landmarks[:, 0] += 9.0  # the photo's face lies beside the surface's
    surface = dataclasses.replace(
        surface, face=dataclasses.replace(surface.face, landmarks=landmarks)
    )
    column, row = np.round(landmarks[4, :2]).astype(int)  # the nose
    photo[row - 4 : row + 5, column - 4 : column + 5] = 1.0
    moved, made = drawn_over(photo, surface, CAMERA)
    assert made.face is not None
    expected = CAMERA.project(lying(surface))
    assert np.allclose(made.face.landmarks[:, :2], expected, atol=1e-2)
    rows, columns = np.nonzero(moved[..., 0] > 0.5)
    assert max(np.ptp(rows), np.ptp(columns)) < 25  # nothing is shown twice
    assert np.hypot(columns.mean() - expected[4, 0], rows.mean() - expected[4, 1]) < 3.0
    assert np.hypot(column - expected[4, 0], row - expected[4, 1]) > 5.0


def test_a_face_behind_a_hand_stays_on_the_head(body: Body, averted: Reconstruction) -> None:
    """The surface at such a face's pixels is that of the hand, which says nothing of its depth."""
    hand, head = on_parts(body.parts, "left_hand", "left_lower_arm"), on_parts(body.parts, "head")
    vertices = body.vertices.copy()
    place = vertices[head].mean(axis=0) + np.array([0.03, 0.0, 0.25])
    vertices[hand] = place + 2.0 * (vertices[hand] - vertices[hand].mean(axis=0))
    raised = dataclasses.replace(body, vertices=vertices)
    covered = behind_limb(raised, points_on_face(vertices))
    assert 0.3 < covered.mean() < 1
    assert not behind_limb(body, points_on_face(body.vertices)).any()
    subject = photographed(body, turned=55.0)
    dressed = coated(raised, cell=0.012, coat=0.005)
    surface = canonical_person(Sight(subject, raised, CAMERA, dressed)).surface
    assert np.abs(lying(surface) - lying(averted.surface)).max() < 0.06  # on the hand: 0.28


def test_a_face_is_averted_by_its_landmarks_or_by_those_and_the_head(body: Body) -> None:
    def found(landmarks: float, head: float) -> bool:
        face = photographed(body, turned=landmarks).face
        turn = Rotation.from_euler("y", head, degrees=True).as_matrix()
        turned = dataclasses.replace(body, vertices=(body.vertices @ turn.T).astype(np.float32))
        assert face is not None
        return is_averted(face, turned, CAMERA)

    assert not found(20.0, 20.0)
    assert found(45.0, 0.0)
    assert found(33.0, 60.0)  # hair covers the face
    assert not found(5.0, 45.0)  # one of both is wrong


def test_the_eye_that_a_turned_face_hides_has_the_colors_of_the_other(
    averted: Reconstruction, body: Body
) -> None:
    surface = averted.surface
    assert surface.standing is not None
    paint = face_paint(surface, np.full((2048, 2048, 3), 0.5, np.float32))
    assert paint is not None
    sides = surface.standing.vertices[paint.far, 0]
    assert (sides > 0).all() or (sides < 0).all()
    eyes = paint.kinds == EYE
    assert paint.far.sum() == pytest.approx(eyes.sum() / 2, abs=2)
    assert surface.vertices[paint.far, 2].mean() < surface.vertices[eyes & ~paint.far, 2].mean()
    frontal = dataclasses.replace(surface, provenance={})
    forward = face_paint(frontal, np.full((2048, 2048, 3), 0.5, np.float32))
    assert forward is not None
    assert not forward.far.any()
    subject = photographed(body, turned=55.0)
    image = subject.image.copy()  # green where the farther half of the face is
    near = CAMERA.project(surface.vertices[eyes & ~paint.far]).mean(axis=0)
    middle = CAMERA.project(lying(surface))[6, 0]
    side = np.arange(2048) > middle if near[0] < middle else np.arange(2048) < middle
    image[:, side], image[:, ~side] = (20, 230, 20), (220, 60, 200)
    colored = color_by_photo(
        averted,
        dataclasses.replace(subject, image=image),
        body,
        CAMERA,
        settings=ColorSettings(texture=512, delight=False, synthesis=False, tolerance=0.1),
    )
    assert colored.uv is not None
    assert colored.texture is not None
    shown = paint.far[colored.faces].all(axis=1)
    places = colored.uv[shown].mean(axis=1)
    texels = colored.texture[
        (512 * (1 - places[:, 1])).astype(int), (512 * places[:, 0]).astype(int)
    ].astype(int)
    assert (texels[:, 1] < texels[:, 0]).mean() > 0.9


def test_the_brows_of_a_turned_face_do_not_meet(averted: Reconstruction) -> None:
    """In profile a brow reaches the outline of the face."""
    places = CAMERA.project(lying(averted.surface))
    brow = np.abs(np.arange(2048) - places[9, 1]) < 0.1 * np.ptp(places[:, 1])
    photo = np.tile(np.where(brow, 0.1, 0.7)[:, None, None], (1, 2048, 3)).astype(np.float32)
    surface = averted.surface
    assert surface.face is not None
    landmarks = surface.face.landmarks.copy()
    landmarks[:, :2] = places  # the photo's face already lies where the surface's does
    surface = dataclasses.replace(
        surface, face=dataclasses.replace(surface.face, landmarks=landmarks)
    )
    moved, _ = drawn_over(photo, surface, CAMERA)
    middle, outer = places[[107, 336, 285, 55]].mean(axis=0), places[[70, 300]]
    assert moved[int(middle[1]), int(middle[0]), 0] > 0.6
    assert moved[int(places[9, 1]), int(outer[:, 0].min()) - 20, 0] == pytest.approx(0.1, abs=0.01)


def test_what_the_photo_hides_of_a_head_is_the_other_half(
    body: Body, dressed: Reconstruction
) -> None:
    """The left half of the head, as behind a hand, has the right half's texture place by place."""
    subject = photographed(body)
    image = subject.image.copy()
    columns, rows = np.meshgrid(np.arange(2048), np.arange(2048))
    image[..., 0] = np.where(rows // 12 % 2, 220, 60)
    image[..., 2] = np.where(
        columns > CAMERA.center_u, 255, 0
    )  # the hidden half, picture right, is blue
    subject = dataclasses.replace(subject, image=image)
    sight = Sight(subject, body, CAMERA, dressed)
    surface = canonical_person(sight).surface
    canvas = canvas_of(surface, subject, CAMERA, sight.reading, ColorSettings(texture=256))
    agreement = canvas.agreement.copy()
    for name in ("head", "neck"):
        agreement[PARTS.index(name), :, agreement.shape[2] // 2 :] = 0
    canvas = dataclasses.replace(canvas, agreement=agreement)
    painting = Painting.of(surface, subject, CAMERA, ColorEvidence(canvas=canvas), ColorSettings())
    faces, vertices = painting.faces, painting.vertices
    head = on_parts(canvas.parts, "head")[faces].all(axis=1)
    hidden = faces[head & (vertices[faces][..., 0] > 0.01).all(axis=1)]
    weight = np.full((len(hidden), 3, 1), 1 / 3)
    kept, trust, colors = shown_elsewhere(painting, hidden, weight, np.ones((len(hidden), 1)))
    good = trust[:, 0] > 0.9
    assert kept.mean() > 0.9  # a face seen from the front is equally frontal on both sides
    assert good.sum() > 200
    assert colors[good, 2].max() < 0.1
    assert np.ptp(colors[good, 0]) > 0.4  # with its pattern
    trunk = faces[on_parts(canvas.parts, "torso")[faces].all(axis=1)][:50]
    kept, none, _ = shown_elsewhere(painting, trunk, np.full((50, 3, 1), 1 / 3), np.ones((50, 1)))
    assert kept.all()
    assert not none.any()


def test_unseen_skin_takes_the_tone_of_what_lies_in_the_light() -> None:
    base = np.repeat([[0.75, 0.6, 0.5], [0.3, 0.2, 0.15], [0.25, 0.12, 0.1]], [60, 40, 30], axis=0)
    known = np.arange(130) < 100
    toned = even_tones(base, known, ~known, np.ones(130, int), np.ones(130, bool), np.ones(130))
    assert np.array_equal(toned[:100], base[:100])
    assert toned[100:, 0].min() > 0.5
    kept = even_tones(base, known, ~known, np.ones(130, int), known, np.ones(130))
    assert np.array_equal(kept, base)  # cloth may hide it


def test_hair_behind_is_fainter_than_in_the_photo_and_a_patterned_hat_is_not() -> None:
    detail = np.array([[0.2, 0.1, 0.0], [0.05, 0.05, 0.05], [0.3, 0.0, 0.0]])
    labels = np.array([HAIR, HAIR, UPPER])
    found = _of_hair(detail.copy(), labels, 0.1, STRAND)
    assert np.allclose(found, [[0.025] * 3, [0.0125] * 3, [0.3, 0.0, 0.0]])
    assert np.array_equal(_of_hair(detail.copy(), labels, 0.4, STRAND), detail)
    assert np.allclose(
        _of_hair(detail.copy(), labels, 0.01, STRAND)[:2], 0.05
    )  # even hair is as it was
    assert np.abs(_of_hair(detail.copy(), labels, 0.1, CROWN)[:2]).max() <= CROWN


@pytest.mark.parametrize("skin", [(0.42, 0.28, 0.2), (0.9, 0.76, 0.68)])
def test_the_mean_face_has_the_tone_of_the_skin_and_lips_where_they_belong(
    body: Body, skin: tuple[float, float, float]
) -> None:
    size = 320
    points = points_on_face(rest_vertices(body))[:, :2]
    places = (points - points.mean(axis=0)) * [1, -1] * size / EXTENT + size / 2
    for moved in (0.0, 25.0):
        there = places + np.array([moved, 0.0])
        lab = lab_of(mean_face(there, np.array(skin), size))
        cheeks, lips = (
            np.median([lab[int(y), int(x)] for x, y in there[list(chosen)]], axis=0)
            for chosen in ((50, 280, 101, 330, 117, 346), LIPS)
        )
        assert np.linalg.norm(cheeks - lab_of(np.array(skin))) < 6
        assert lips[1] - cheeks[1] > 1
