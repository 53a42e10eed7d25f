"""The body map: its square of the photo, its landmarks, and its predictions."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.geometry.images import mask_iou
from a2v.kinematics.names import BLAZEPOSE, MIRRORED_BLAZEPOSE
from a2v.kinematics.stance import leg_stance
from a2v.perception import PerceptionSettings, decode_photo, find_person
from a2v.perception import bodymap as bm
from a2v.sessions import WEIGHTS
from a2v.types import Subject
from tests.support.bodies import random_body, subject_of
from tests.support.bodymaps import bodymap_of

SAMPLE = Path(__file__).resolve().parents[2] / "a2v" / "samples" / "person.jpg"


@pytest.mark.parametrize("side", [180.0, 700.0, 1300.0])
def test_the_square_shows_the_photo_where_it_lies(side: float) -> None:
    """A bright spot of the photo appears in the network's picture where `_in_pixels` maps it back."""
    image, mask = np.zeros((900, 1000, 3), np.uint8), np.zeros((900, 1000), np.float32)
    middle, spot = np.array([520.0, 430.0]), np.array([560.5, 380.5])
    rows, columns = np.mgrid[:900, :1000]
    blot = np.exp(
        -((columns + 0.5 - spot[0]) ** 2 + (rows + 0.5 - spot[1]) ** 2) / (2 * (side / 40) ** 2)
    )
    image[..., 1] = np.rint(255 * blot)
    mask[blot > 0.5] = 1
    picture = bm._square(image, mask, middle, side)
    assert picture.shape == (4, 256, 256)
    np.testing.assert_allclose(picture[:3, 0, 0], bm.GRAY, atol=1e-6)  # nobody is there
    uncovered = bm._square(image, np.ones_like(mask), middle, side)
    for channel in (np.where(uncovered[0] < 0.01, uncovered[1], 0), picture[3]):
        v, u = (
            np.array([(channel.sum(axis=axis) * (np.arange(256) + 0.5)).sum() for axis in (1, 0)])
            / channel.sum()
        ) / 256
        back = middle + (np.array([u, v]) - 0.5) * side
        np.testing.assert_allclose(back, spot, atol=side / 256 * 0.3)


def test_landmarks_keep_the_persons_proportions() -> None:
    body = random_body(5)
    subject, camera = subject_of(body)
    keypoints, places = bm.mended(
        subject.keypoints, subject.keypoints_3d, bodymap_of(body, camera, 480)
    )
    np.testing.assert_allclose(keypoints[:, :2], subject.keypoints[:, :2], atol=0.01)
    assert (keypoints[:, 2] > 0.9).all()
    factor = np.linalg.norm(places[11] - places[27]) / np.linalg.norm(
        subject.keypoints_3d[11] - subject.keypoints_3d[27]
    )
    np.testing.assert_allclose(places, factor * subject.keypoints_3d, atol=0.01)
    assert factor == pytest.approx(1.7 / np.ptp(body.vertices[:, 1]), rel=0.08)


def test_the_surer_of_two_counts() -> None:
    """A left wrist with two results 20 cm apart takes the more certain one, with less confidence."""
    body = random_body(5, bend_legs=True)
    subject, camera = subject_of(body)
    found = bodymap_of(body, camera, 480)
    moved = found.landmarks.copy()
    moved[15] += np.array([0.2, 0.0, 0.2]) * camera.scale
    for scale, share in ((0.5, 1.0), (0.1 * camera.scale, 0.0)):
        scales = found.landmark_scales.copy()
        scales[15] = scale
        map_there = dataclasses.replace(found, landmarks=moved, landmark_scales=scales)
        keypoints, places = bm.mended(subject.keypoints, subject.keypoints_3d, map_there)
        np.testing.assert_allclose(
            keypoints[15, 0] - subject.keypoints[15, 0], share * 0.2 * camera.scale, atol=0.01
        )
        assert keypoints[15, 2] <= 0.5 < keypoints[16, 2]
        forward = (places[15, 2] - subject.keypoints_3d[15, 2]) / 0.2
        assert forward == pytest.approx(share, abs=0.15)
    near = found.landmarks.copy()
    near[15, 0] += 0.03 * camera.scale
    scales = np.full((33, 2), 0.01 * 1.7 * camera.scale, np.float32)
    between = bm.mended(
        subject.keypoints,
        subject.keypoints_3d,
        dataclasses.replace(found, landmarks=near, landmark_scales=scales),
    )[0]
    assert 0.2 < (between[15, 0] - subject.keypoints[15, 0]) / (0.03 * camera.scale) < 0.8


def test_of_who_stands_the_surer_depths_count_too() -> None:
    """The map's depth of a standing person's hand counts by what it expects of its error."""
    body = random_body(5)
    subject, camera = subject_of(body)
    found = bodymap_of(body, camera, 480)
    assert all(
        leg_stance(side, subject.keypoints[:, :2], subject.keypoints[:, 2], subject.keypoints_3d)[1]
        for side in ("left", "right")
    )
    moved = found.landmarks.copy()
    moved[15] += np.array([0.02, 0.0, 0.2]) * camera.scale
    forward = []
    for scale in (0.5, camera.scale):
        scales = np.full_like(found.landmark_scales, scale)
        map_there = dataclasses.replace(found, landmarks=moved, landmark_scales=scales)
        _, places = bm.mended(subject.keypoints, subject.keypoints_3d, map_there)
        change = places[[15, 16], 2] - subject.keypoints_3d[[15, 16], 2]
        forward.append((change[0] - change[1]) / 0.2)
    assert forward[0] > 0.85
    assert forward[1] < 0.2


def test_keypoints_of_the_users_stay() -> None:
    body = random_body(5)
    subject, camera = subject_of(body, depth=False)
    found = bodymap_of(body, camera, 480)
    unknown = subject.keypoints.copy()
    unknown[13:19] = 0
    for given in (unknown, subject.keypoints):
        keypoints, places = bm.mended(given, subject.keypoints_3d, found, keep=True)
        np.testing.assert_array_equal(keypoints, given)
        told, _ = subject_of(body)
        assert np.isfinite(places).all()
        for axis in range(3):
            assert np.corrcoef(places[:, axis], told.keypoints_3d[:, axis])[0, 1] > 0.99


@pytest.fixture(scope="module")
def person() -> Subject:
    """The sample's, whose landmarks are mended and whose map is kept."""
    return find_person(decode_photo(SAMPLE.read_bytes()))


def test_the_sample_is_understood(person: Subject) -> None:
    found = person.bodymap
    assert found is not None
    height = bm.height_in_pixels(found.landmarks)
    body = [
        BLAZEPOSE.index(f"{side}_{joint}")
        for side in ("left", "right")
        for joint in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
    ]
    plain = find_person(
        decode_photo(SAMPLE.read_bytes()), settings=PerceptionSettings(bodymap=False)
    )
    assert plain.bodymap is None
    assert (
        np.median(np.linalg.norm(found.landmarks[body, :2] - plain.keypoints[body, :2], axis=1))
        < 0.03 * height
    )
    pixels = found.pixels()
    mask = np.zeros(found.inside.shape, bool)
    inside = (
        (pixels[..., 0] < person.mask.shape[1])
        & (pixels[..., 1] < person.mask.shape[0])
        & (pixels >= 0).all(axis=-1)
    )
    mask[inside] = (
        person.mask[pixels[inside][:, 1].astype(int), pixels[inside][:, 0].astype(int)] > 0.5
    )
    assert mask_iou(found.inside, mask) > 0.85

    def place(name: str) -> np.ndarray:
        away = (
            np.linalg.norm(pixels - person.keypoints[BLAZEPOSE.index(name), :2], axis=-1)
            + 1e6 * ~found.inside
        )
        return found.places[np.unravel_index(away.argmin(), away.shape)]

    assert place("nose")[1] > 0.7
    assert place("left_ankle")[1] < -0.7
    assert place("left_wrist")[0] > 0.4
    assert place("right_wrist")[0] < -0.4


def test_a_mirrored_photo_has_the_mirrored_map(person: Subject) -> None:
    found = person.bodymap
    assert found is not None
    flipped = bm.look_at_body(
        np.ascontiguousarray(person.image[:, ::-1]), np.ascontiguousarray(person.mask[:, ::-1])
    )
    width = person.image.shape[1]
    there = flipped.landmarks[MIRRORED_BLAZEPOSE] * [-1, 1, 1] + [width, 0, 0]
    np.testing.assert_allclose(there, found.landmarks, atol=0.5)
    both = found.inside & flipped.inside[:, ::-1]
    np.testing.assert_allclose(
        flipped.places[:, ::-1][both] * [-1, 1, 1], found.places[both], atol=0.02
    )


def test_another_file_than_a_body_map_is_refused(person: Subject) -> None:
    with pytest.raises(InputError, match="a2v-bodymap/1"):
        bm.look_at_body(person.image, person.mask, weights=WEIGHTS / "person_maps.onnx")


def test_an_empty_mask_is_refused() -> None:
    with pytest.raises(InputError, match="empty"):
        bm.look_at_body(np.zeros((40, 40, 3), np.uint8), np.zeros((40, 40), np.float32))
