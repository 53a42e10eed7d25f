"""The head placed by the landmarks of the face."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from a2v.body.evidence import gather_evidence
from a2v.body.face import face_landmarks
from a2v.body.head import HEAD, head_from_face
from a2v.body.registry import load_body_model
from a2v.body.settings import FitSettings
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.types import FloatArray, Subject

SIZE = 420.0
PLACE = np.array([300.0, 180.0, 0.0])


def seen(turn: Rotation, points: FloatArray) -> FloatArray:
    """Points of Anny at rest in a picture of 420 pixels per meter, with the head turned."""
    return np.asarray(SIZE * turn.apply(points - [0, 1.55, 0]) * [1, -1, 1] + PLACE)


@pytest.fixture(scope="module")
def model_head() -> tuple[FloatArray, FloatArray]:
    """Landmarks of the face (478, 3) and of the head (11, 3) of the default body, meters."""
    import torch

    model = load_body_model("anny")
    vertices, joints = model.rest(torch.from_numpy(model.shape_default))
    ids, weights = face_landmarks()
    face = np.einsum("kc,kcd->kd", weights, vertices.numpy().astype(np.float64)[ids])
    head = model.landmarks_of(vertices[model.landmark_vertices], joints)[:HEAD]
    return face, head.numpy().astype(np.float64)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("yaw", [0.0, -35.0, 70.0])
def test_a_turned_head_is_found_where_it_is(
    model_head: tuple[FloatArray, FloatArray], yaw: float, dtype: type
) -> None:
    face, head = model_head
    turn = Rotation.from_euler("yx", [yaw, 8.0], degrees=True)
    shown = seen(turn, face)
    shown[:, 2] *= 0.8  # detectors flatten faces
    open_mouth = face[:, 1] < face[1, 1] - 0.03
    shown[open_mouth, 1] += 0.02 * SIZE
    placed, size, turned = head_from_face(shown.astype(dtype))
    assert size == pytest.approx(SIZE, rel=0.02)
    assert turned == pytest.approx(np.arccos(turn.apply([0, 0, 1])[2]), abs=np.radians(2))
    np.testing.assert_allclose(placed[:, :2], seen(turn, head)[:, :2], atol=0.006 * SIZE)


@pytest.fixture(scope="module")
def subject(model_head: tuple[FloatArray, FloatArray]) -> Subject:
    """Somebody at rest whose keypoints show the head from the front, without a face."""
    import torch

    model = load_body_model("anny")
    vertices, joints = model.rest(torch.from_numpy(model.shape_default))
    points = model.landmarks_of(vertices[model.landmark_vertices], joints).numpy()
    middle = np.array([0, 1.55, 0])
    pixels = SIZE * (points - middle) * [1, -1, 1] + PLACE
    mask = np.zeros((900, 600), np.float32)
    mask[100:880, 200:400] = 1
    return Subject(
        image=np.full((900, 600, 3), 127, np.uint8),
        mask=mask,
        keypoints=np.column_stack([pixels[:, :2], np.full(33, 0.8)]).astype(np.float32),
        keypoints_3d=(points - points[23:25].mean(axis=0)).astype(np.float32),
        crop=(0, 0, 600, 900),
        photo_size=(600, 900),
    )


def test_only_a_face_that_is_turned_aside_moves_the_evidence(
    model_head: tuple[FloatArray, FloatArray], subject: Subject
) -> None:
    face, head = model_head
    settings = FitSettings(silhouette_weight=0)
    plain = gather_evidence(subject, settings)
    for yaw, moves in ((15.0, False), (60.0, True)):
        turn = Rotation.from_euler("y", yaw, degrees=True)
        looking = dataclasses.replace(subject, face=seen(turn, face).astype(np.float32))
        found = gather_evidence(looking, settings)
        np.testing.assert_array_equal(found.pixels[HEAD:], plain.pixels[HEAD:])
        if not moves:
            np.testing.assert_array_equal(found.pixels, plain.pixels)
            continue
        np.testing.assert_allclose(found.pixels[:HEAD], seen(turn, head)[:, :2], atol=1.0)
        assert (found.confidence[:HEAD] == 1).all()
        assert found.points is not None
        assert plain.points is not None
        nose, ear = LANDMARK_INDEX["nose"], LANDMARK_INDEX["left_ear"]
        ahead = found.points[nose] - found.points[ear]
        np.testing.assert_allclose(ahead, turn.apply(head[nose] - head[ear]), atol=0.01)
        np.testing.assert_allclose(
            found.points[:HEAD].mean(axis=0), plain.points[:HEAD].mean(axis=0), atol=1e-6
        )


def test_landmarks_of_the_user_stay(
    model_head: tuple[FloatArray, FloatArray], subject: Subject
) -> None:
    turn = Rotation.from_euler("y", 60.0, degrees=True)
    given = np.zeros(33, bool)
    given[LANDMARK_INDEX["nose"]] = True
    looking = dataclasses.replace(
        subject, face=seen(turn, model_head[0]).astype(np.float32), given=given
    )
    found = gather_evidence(looking, FitSettings(silhouette_weight=0))
    nose = LANDMARK_INDEX["nose"]
    np.testing.assert_array_equal(found.pixels[nose], subject.keypoints[nose, :2])
    assert (found.pixels[nose + 1] != subject.keypoints[nose + 1, :2]).all()
