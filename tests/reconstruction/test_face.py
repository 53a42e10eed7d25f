"""The body's face on a surface: expressions move it, and the sewn surface is closed."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2v.animation import bind, blinking, blinks, change_rig, deform, express, load_rig
from a2v.animation.expressions import BlinkSettings
from a2v.body.face import actions_of, face_landmarks
from a2v.geometry.mesh import is_closed
from a2v.geometry.sewing import sew
from a2v.reconstruction import FaceSettings, add_face
from a2v.reconstruction.face.bends import Bend
from a2v.reconstruction.face.build import _facing, _posed
from a2v.reconstruction.face.colors import _eyeballs, _with_eyeballs, face_paint
from a2v.reconstruction.face.patch import face_patch
from a2v.reconstruction.face.places import (
    LEFT_EYE,
    LEFT_IRIS,
    RIGHT_EYE,
    RIGHT_IRIS,
    placing_points,
)
from a2v.types import Body, Character, Face, Reconstruction, Surface
from tests.support.faces import CAMERA, photographed
from tests.support.surfaces import coated

BOTH_LIDS = {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0}


@pytest.fixture(scope="module")
def plain(body: Body) -> Reconstruction:
    """One piece around head and shoulders without eyes and mouth, as from backends."""
    return coated(body, cell=0.008, coat=0.003, above=float(body.vertices[:, 1].max()) - 0.42)


@pytest.fixture(scope="module")
def made(plain: Reconstruction, body: Body) -> Surface:
    return add_face(plain, photographed(body), body, CAMERA).surface


@pytest.fixture(scope="module")
def face(made: Surface) -> Face:
    assert made.face is not None
    return made.face


def kind(face: Face, surface: Surface, number: int) -> np.ndarray:
    return surface.vertices[face.patch[face.kinds == number]].astype(np.float64)


def test_the_surface_stays_whole(made: Surface, face: Face, plain: Reconstruction) -> None:
    assert is_closed(made.vertices, made.faces)
    assert set(np.unique(face.kinds)) == {0, 1, 2, 3, 4}
    reach = np.linalg.norm(made.vertices - made.vertices[face.patch].mean(axis=0), axis=1)
    kept = made.vertices[(np.arange(len(made.vertices)) < face.patch[0]) & (reach > 0.15)]
    assert len(kept) > 1000
    old = {tuple(vertex) for vertex in plain.surface.vertices.tolist()}
    assert all(
        tuple(vertex) in old for vertex in kept.tolist()
    )  # nothing far from the face has moved


def test_lids_and_lips_lie_where_the_photo_has_them(made: Surface, face: Face, body: Body) -> None:
    ids, weights = face_landmarks()
    place = np.full(13718, -1)
    place[face.twins[face.kinds == 0]] = face.patch[face.kinds == 0]
    subject = photographed(body)
    assert subject.face is not None
    known = (place[ids] >= 0).all(axis=1)
    assert known[list(RIGHT_EYE)].all()
    seen = CAMERA.project(
        np.einsum("kc,kcd->kd", weights[known], made.vertices[place[ids[known]]].astype(np.float64))
    )
    wide = float(np.ptp(subject.face[:, 0]))
    away = np.linalg.norm(seen - subject.face[known, :2], axis=1) * 512 / wide
    chosen = np.isin(
        np.flatnonzero(known),
        placing_points(np.tile(np.arange(478)[:, None], (1, 2)))[:, 0].astype(int),
    )
    assert away[chosen].max() < 4  # pixels of a face of 512
    assert away[chosen].mean() < 1


def test_a_blink_moves_the_lids_alone_and_shuts_them(made: Surface, face: Face) -> None:
    balls = kind(face, made, 1)
    moved, offsets = face.mixed(BOTH_LIDS)
    far = np.linalg.norm(
        made.vertices[moved][:, None]
        - [
            balls[balls[:, 0] > balls[:, 0].mean()].mean(0),
            balls[balls[:, 0] < balls[:, 0].mean()].mean(0),
        ],
        axis=-1,
    ).min(axis=1)
    assert far[np.linalg.norm(offsets, axis=1) > 5e-4].max() < 0.045
    assert uncovered(made, face, {}) > 0.05
    assert uncovered(made, face, BOTH_LIDS) < 0.05 * uncovered(made, face, {})
    assert uncovered(made, face, {"eyeBlinkLeft": 1.0}) == pytest.approx(
        uncovered(made, face, {}) / 2, rel=0.25
    )


def uncovered(surface: Surface, face: Face, strengths: dict[str, float]) -> float:
    """Return the share of places in front of the eyeballs that are visible from there."""
    from a2v.geometry.rays import ray_scene

    moved, offsets = face.mixed(strengths)
    vertices = surface.vertices.copy()
    vertices[moved] += offsets.astype(np.float32)
    kinds = np.zeros(len(vertices), int)
    kinds[face.patch] = face.kinds
    seen = []
    for side in (1, -1):
        ball = kind(face, surface, 1)
        ball = ball[side * (ball[:, 0] - ball[:, 0].mean()) > 0]
        x, y = np.meshgrid(*(np.linspace(ball[:, k].min(), ball[:, k].max(), 60) for k in (0, 1)))
        rays = np.stack([x, y, 0 * x + 5, 0 * x, 0 * x, 0 * x - 1], axis=-1).astype(np.float32)
        hit = (
            ray_scene(vertices, surface.faces)
            .cast_rays(rays)["primitive_ids"]
            .numpy()
            .astype(np.int64)
        )
        seen.append(
            np.where(
                hit < len(surface.faces),
                kinds[surface.faces[np.minimum(hit, len(surface.faces) - 1)]].min(axis=-1) == 1,
                False,
            )
        )
    return float(np.mean(seen))


def test_left_and_right_are_alike(face: Face) -> None:
    for name in ("eyeBlink", "mouthSmile", "browDown", "cheekSquint"):
        left, right = (
            np.linalg.norm(face.target(name + side)[1], axis=1).sum() for side in ("Left", "Right")
        )
        assert left == pytest.approx(right, rel=0.1), name


def test_a_jaw_opens_the_lips(made: Surface, face: Face) -> None:
    moved, offsets = face.mixed({"jawOpen": 1.0})
    patch = dict(zip(face.patch.tolist(), face.kinds.tolist(), strict=True))
    teeth = [place for place, vertex in enumerate(moved.tolist()) if patch.get(vertex) == 4]
    assert len(teeth) == 68  # the lower row
    assert offsets[teeth][:, 1].min() < -0.015
    assert np.linalg.norm(offsets, axis=1).max() < 0.05


def test_all_of_arkit_is_there_and_nothing_is_the_neutral(
    made: Surface, face: Face, body: Body
) -> None:
    assert set(face.names) == set(actions_of())
    assert len(face.names) == 52
    assert all(len(face.target(name)[0]) for name in face.names)
    person = bind(made, body)
    posed = deform(person, body.bone_transforms)
    assert express(person, posed, body.bone_transforms, {}) is posed
    assert express(person, posed, body.bone_transforms, {"jawOpen": 0.0}) is posed
    np.testing.assert_array_equal(person.anchors[face.patch], face.twins)


def test_an_expression_goes_with_the_head(made: Surface, face: Face, body: Body) -> None:
    person = bind(made, body)
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    turned = body.bone_transforms.astype(np.float64).copy()
    turned[:, :3, :3], turned[:, :3, 3] = turn @ turned[:, :3, :3], turned[:, :3, 3] @ turn.T
    rest, away = (
        express(person, deform(person, moves), moves, BOTH_LIDS)
        for moves in (body.bone_transforms, turned)
    )
    np.testing.assert_allclose(away, rest @ turn.T, atol=1e-5)


def test_another_rig_expresses_the_same(made: Surface, face: Face, body: Body) -> None:
    person = bind(made, body)
    change = change_rig(person, load_rig("vrm"))
    back = change.follow(body.bone_transforms[None])[0]
    difference = [
        express(one, deform(one, moves), moves, {"jawOpen": 1.0}) - deform(one, moves)
        for one, moves in ((person, body.bone_transforms), (change.character, back))
    ]
    np.testing.assert_allclose(difference[1], difference[0], atol=2e-4)


def test_without_a_face_from_before_nothing_changes(plain: Reconstruction, body: Body) -> None:
    blind = dataclasses.replace(photographed(body), face=None)
    for subject, reason in (
        (blind, "no face"),
        (photographed(body, turned=60.0), "turned away by 6"),
    ):
        kept = add_face(plain, subject, body, CAMERA)
        assert kept.surface.face is None
        assert kept.surface.vertices is plain.surface.vertices
        assert reason in kept.surface.provenance["face"]
    assert (
        add_face(plain, photographed(body), body, CAMERA, settings=FaceSettings(expressions=False))
        is plain
    )


def test_a_face_is_saved_and_older_characters_load(made: Surface, character: Character) -> None:
    arrays = made.to_arrays()
    again = Surface.from_arrays(arrays)
    assert again.face is not None
    assert again.face.names == made.face.names  # type: ignore[union-attr]
    np.testing.assert_array_equal(again.face.offsets, made.face.offsets)  # type: ignore[union-attr]
    old = {name: array for name, array in character.to_arrays().items() if ".face." not in name}
    assert Character.from_arrays(old).surface.face is None


def test_the_head_is_turned_as_the_photos(body: Body) -> None:
    """Otherwise teeth and tongue, which lie deep, would be beside the mouth."""
    posed, turns = _posed(body)
    ids, weights = face_landmarks()
    points = np.einsum("kc,kcd->kd", weights, posed[ids])
    middle = points.mean(axis=0)
    seen = middle + Rotation.from_euler("x", 3.06, degrees=True).apply(
        points - middle
    )  # what the detector does to an upright head
    landmarks = np.concatenate([CAMERA.project(seen), CAMERA.scale * seen[:, 2:]], axis=1)
    askew = Rotation.from_euler("xyz", [14, -8, 5], degrees=True)
    found, turned = _facing(
        middle + askew.apply(posed - middle), askew.as_matrix() @ turns, landmarks, CAMERA
    )
    np.testing.assert_allclose(found, posed, atol=1e-6)
    np.testing.assert_allclose(turned, turns, atol=1e-6)


def test_the_bend_keeps_what_touches_together() -> None:
    random = np.random.default_rng(0)
    sources = random.uniform(-0.1, 0.1, (30, 2))
    bend = Bend(sources, sources + random.normal(0, 0.003, (30, 2)), 0.0)
    points = random.uniform(-0.1, 0.1, (5, 3))
    np.testing.assert_allclose(bend(points)[:, 2], points[:, 2])
    np.testing.assert_array_equal(bend(points), bend(points.copy()))


def test_two_loops_are_sewn_into_a_band() -> None:
    angles = [np.linspace(0, 2 * np.pi, count, endpoint=False) for count in (30, 47)]
    loops = [
        np.stack([radius * np.cos(a), radius * np.sin(a), 0 * a], axis=1)
        for radius, a in zip((1.2, 1.0), angles, strict=True)
    ]
    strip = sew(np.concatenate(loops), np.arange(30), 30 + np.arange(47))
    assert len(strip) == 77
    corners = np.concatenate(loops)[strip]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    assert (normals > 0).all()
    polygons = [
        0.5 * count * np.sin(2 * np.pi / count) * radius**2
        for count, radius in ((30, 1.2), (47, 1.0))
    ]
    assert 0.5 * normals.sum() == pytest.approx(polygons[0] - polygons[1])


def test_the_patch_has_one_rim() -> None:
    patch = face_patch()
    assert len(np.unique(patch.rim)) == len(patch.rim)
    assert (patch.kinds[patch.rim] == 0).all()


@pytest.mark.parametrize("fps", [8.0, 24.0, 60.0])
def test_people_blink_now_and_then(fps: float) -> None:
    seconds = 600
    shut = blinks(int(seconds * fps), fps, BlinkSettings(seed=3))
    assert shut.min() == 0
    starts = np.flatnonzero((shut[1:] == 1) & (shut[:-1] < 1))
    assert 10 < len(starts) * 60 / seconds < 20
    assert (np.diff(starts) / fps).min() > 0.8
    np.testing.assert_array_equal(shut, blinks(int(seconds * fps), fps, BlinkSettings(seed=3)))
    assert not np.array_equal(shut, blinks(int(seconds * fps), fps, BlinkSettings(seed=4)))
    assert (blinks(int(2.5 * fps), fps, BlinkSettings(seed=9)) == 1).any()  # short clips show one
    assert blinking(100, fps, BlinkSettings(rate=0)) == {}


@pytest.mark.parametrize("azimuth", [0.0, 45.0])
def test_closed_lips_hide_what_is_behind_them(made: Surface, face: Face, azimuth: float) -> None:
    step = 0.0003
    angle = np.radians(azimuth)
    backward, right = (
        np.array([np.sin(angle), 0, np.cos(angle)]),
        np.array([np.cos(angle), 0, -np.sin(angle)]),
    )
    x, y = np.meshgrid(np.arange(-0.045, 0.045, step), np.arange(-0.03, 0.03, step))
    starts = (
        kind(face, made, 4).mean(axis=0)
        + x[..., None] * right
        + y[..., None] * np.array([0, 1, 0])
        + backward
    )

    from a2v.geometry.rays import ray_scene

    rays = np.concatenate([starts, np.broadcast_to(-backward, starts.shape)], axis=-1).astype(
        np.float32
    )
    hit = (
        ray_scene(made.vertices, made.faces)
        .cast_rays(rays)["primitive_ids"]
        .numpy()
        .astype(np.int64)
    )
    kinds = np.zeros(len(made.vertices), int)
    kinds[face.patch] = face.kinds
    seen = kinds[made.faces[hit[hit < len(made.faces)]]].min(axis=-1)
    assert (
        (seen == 4).sum() * step** 2 < 3e-6
    )  # square meters of teeth; the model's own lips show 12 square millimeters
    assert (seen >= 2).sum() * step**2 < 5e-6


def test_eyes_behind_dark_lenses_stay_dark(made: Surface, face: Face) -> None:
    """White is painted only where the photo has some; there the ball is white beyond the lids too."""
    skin, dark, white = (
        np.array([0.7, 0.5, 0.4]),
        np.array([0.1, 0.1, 0.13]),
        np.array([0.8, 0.78, 0.76]),
    )
    points = face.landmarks[:, :2].astype(np.float64)
    corners = points[list(RIGHT_EYE)]
    wide, middle = float(np.ptp(corners[:, 0])), corners.mean(axis=0)
    rows, columns = np.mgrid[:2048, :2048] + 0.5
    around = (np.abs(columns - middle[0]) < 1.2 * wide) & (np.abs(rows - middle[1]) < 0.8 * wide)
    inside = (
        cv2.fillPoly(np.zeros((2048, 2048), np.uint8), [np.round(corners).astype(np.int32)], 1) > 0
    )
    above = int(corners[:, 1].min() - 0.3 * wide), int(middle[0] - 0.3 * wide)
    lenses = np.where(around[..., None], dark, skin)
    paint = face_paint(made, lenses)
    assert paint is not None
    assert (
        np.abs(
            paint.eyes[np.hypot(columns - middle[0], rows - middle[1]) < 0.6 * wide] - dark
        ).max()
        < 0.05
    )
    paint = face_paint(made, np.where(inside[..., None], white, skin))
    assert paint is not None
    assert paint.eyes[above].min() > skin.max() - 0.05
    assert paint.colors.shape == (len(paint.inner), 3)
    teeth = paint.colors[np.isin(paint.inner, face.patch[face.kinds == 4])]
    assert (
        teeth.max(axis=0)[0] > 0.6 > teeth.min(axis=0)[0]
    )  # front teeth are bright, those that lie deep are not


def test_eyeballs_in_a_window_are_those_in_the_whole_photo() -> None:
    generator = np.random.default_rng(0)
    photo = generator.random((700, 500, 3)).astype(np.float32)
    points = np.full((478, 2), [250.0, 300.0])
    around = [(0, 0), (6, 0), (0, 6), (-6, 0), (0, -6)]
    for opening, iris, column in ((RIGHT_EYE, RIGHT_IRIS, 215.0), (LEFT_EYE, LEFT_IRIS, 285.0)):
        turn = np.pi + np.arange(len(opening)) * 2 * np.pi / len(opening)
        rim = np.stack([20 * np.cos(turn), 8 * np.sin(turn)], axis=1)
        points[list(opening)] = rim + np.array([column, 300])
        points[list(iris)] = [[column + u, 300 + v] for u, v in around]
    found, whole = _eyeballs(photo, points, 0.9), _with_eyeballs(photo, points, 0.9)
    assert np.abs(found - whole).max() < 1e-5
    assert (np.abs(found - photo).max(axis=2) > 0.05).sum() > 100
