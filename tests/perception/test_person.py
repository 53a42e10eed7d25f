from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from a2v.errors import InputError
from a2v.kinematics.names import BLAZEPOSE
from a2v.perception import decode_photo, find_person
from a2v.perception.matting import keep_person, refine_mask

SAMPLE = Path(__file__).resolve().parents[2] / "a2v" / "samples" / "person.jpg"


@pytest.fixture(scope="module")
def photo() -> np.ndarray:
    """The sample photograph at half size: one whole person from the front."""
    full = decode_photo(SAMPLE.read_bytes())
    return cv2.resize(full, None, fx=0.6, fy=0.6, interpolation=cv2.INTER_AREA)


@pytest.fixture(scope="module")
def subject(photo: np.ndarray):
    return find_person(photo)


def iou(a: np.ndarray, b: np.ndarray) -> float:
    return float((a & b).sum() / (a | b).sum())


def in_photo(subject) -> np.ndarray:
    """The mask in the photo's pixels."""
    width, height = subject.photo_size
    left, top, right, bottom = subject.crop
    mask = np.zeros((height, width), bool)
    mask[top:bottom, left:right] = cv2.resize(subject.mask, (right - left, bottom - top)) > 0.5
    return mask


def test_landmarks_lie_on_the_person(subject) -> None:
    for name in ("left_shoulder", "right_hip", "left_knee", "right_ankle", "nose"):
        u, v, confidence = subject.keypoints[BLAZEPOSE.index(name)]
        assert confidence > 0.8
        assert subject.mask[int(v), int(u)] > 0.9
    # the person faces the camera: their left is on the photo's right, and up is up
    assert (
        subject.keypoints[BLAZEPOSE.index("left_shoulder"), 0]
        > subject.keypoints[BLAZEPOSE.index("right_shoulder"), 0]
    )
    assert subject.keypoints_3d[BLAZEPOSE.index("nose"), 1] > 0.3
    assert (
        subject.keypoints_3d[BLAZEPOSE.index("nose"), 2]
        > subject.keypoints_3d[BLAZEPOSE.index("left_ear"), 2]
    )
    assert subject.warnings == ()


def test_who_stands_upright_does_so_in_3d(subject) -> None:
    depth = {
        name: subject.keypoints_3d[
            [BLAZEPOSE.index(f"{side}_{name}") for side in ("left", "right")], 2
        ].mean()
        for name in ("shoulder", "hip", "ankle")
    }
    assert (
        np.ptp(list(depth.values())) < 0.08
    )  # the detector itself leans this person over by 20 cm


def test_given_mask_matches_published_one(data_dir: Path) -> None:
    rgb = decode_photo((data_dir / "photos" / "PIFu_ryota.png").read_bytes())
    truth = cv2.imread(str(data_dir / "photos" / "PIFu_ryota_mask.png"), cv2.IMREAD_GRAYSCALE) > 128
    assert iou(in_photo(find_person(rgb)), truth) > 0.985
    cut_out = find_person(np.dstack([rgb[..., :3], truth.astype(np.uint8) * 255]))
    assert cut_out.provenance["mask"] == "given"
    assert iou(in_photo(cut_out), truth) > 0.999


def test_largest_of_two_people(photo: np.ndarray, subject) -> None:
    height, width = photo.shape[:2]
    person = in_photo(subject)
    scene = np.concatenate(
        [
            photo,
            np.zeros((height, width // 2, 3), np.uint8)
            + photo[:5, :5].mean(axis=(0, 1)).astype(np.uint8),
        ],
        axis=1,
    )
    small, soft = (
        cv2.resize(x, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        for x in (photo, person.astype(np.float32))
    )
    top, left = height // 3, scene.shape[1] - small.shape[1]
    window = scene[top : top + small.shape[0], left:]
    window[:] = (window * (1 - soft[..., None]) + small * soft[..., None]).astype(np.uint8)
    found = find_person(scene)
    assert any("2 people" in warning for warning in found.warnings)
    assert iou(in_photo(found)[:, :width], person) > 0.95


def test_small_person_in_a_large_photo(photo: np.ndarray, subject) -> None:
    factor = 220 / subject.mask.shape[0]
    small = cv2.resize(photo, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    soft = cv2.resize(
        in_photo(subject).astype(np.float32), small.shape[1::-1], interpolation=cv2.INTER_AREA
    )
    meadow = np.full((2400, 3200, 3), (150, 170, 190), np.uint8)
    window = meadow[1900 : 1900 + small.shape[0], 2500 : 2500 + small.shape[1]]
    window[:] = (window * (1 - soft[..., None]) + small * soft[..., None]).astype(np.uint8)
    found = find_person(meadow)
    person = in_photo(found)
    truth = np.zeros_like(person)
    truth[1900 : 1900 + small.shape[0], 2500 : 2500 + small.shape[1]] = soft > 0.5
    assert iou(person, truth) > 0.8
    assert any("pixels tall" in warning for warning in found.warnings)


def test_cut_off_feet_and_head_are_told(photo: np.ndarray, subject) -> None:
    _, _top, _, _bottom = subject.crop
    rows = np.nonzero(in_photo(subject).any(axis=1))[0]
    tall = rows[-1] - rows[0]
    assert any(
        "feet" in warning for warning in find_person(photo[: rows[0] + int(0.8 * tall)]).warnings
    )
    assert any(
        "head" in warning for warning in find_person(photo[rows[0] + int(0.06 * tall) :]).warnings
    )


def test_nobody_is_an_error() -> None:
    noise = np.random.default_rng(0).integers(0, 255, (300, 400, 3), dtype=np.uint8)
    for picture in (
        noise,
        np.full((300, 400, 3), 90, np.uint8),
        np.dstack([noise, np.zeros((300, 400), np.uint8)]),
    ):
        with pytest.raises(InputError, match=r"person"):
            find_person(picture)


def test_masks_and_keypoints_that_do_not_fit(photo: np.ndarray) -> None:
    height, width = photo.shape[:2]
    with pytest.raises(InputError, match="expected the photo's"):
        find_person(photo, mask=np.ones((10, 10), bool))
    with pytest.raises(InputError, match="empty"):
        find_person(photo, mask=np.zeros((height, width), bool))
    with pytest.raises(InputError, match="outside of 0 to 1"):
        find_person(photo, mask=np.full((height, width), 7.0))
    with pytest.raises(InputError, match="33"):
        find_person(photo, keypoints=np.zeros((25, 3)))
    with pytest.raises(InputError, match="this photo"):
        find_person(photo, keypoints=np.full((33, 3), 1e5))


def test_given_keypoints_win(photo: np.ndarray, subject) -> None:
    points = subject.keypoints.copy()
    points[:, :2] += subject.crop[:2]  # the crop is not reduced here
    points[BLAZEPOSE.index("left_wrist"), :2] += (4, -3)
    found = find_person(photo, keypoints=points)
    assert found.keypoints[:, :2] + found.crop[:2] == pytest.approx(points[:, :2], abs=0.01)
    assert iou(in_photo(found), in_photo(subject)) > 0.97


def test_nothing_is_logged(photo: np.ndarray, capfd: pytest.CaptureFixture[str]) -> None:
    find_person(photo)
    captured = capfd.readouterr()
    assert captured.out == ""
    assert captured.err == ""


def test_refinement_finds_the_edge() -> None:
    """A rough mask, displaced by a few pixels, returns to a disc's edge."""
    y, x = np.mgrid[:240, :240]
    disc = np.hypot(x - 120, y - 120) < 70
    rng = np.random.default_rng(1)
    image = np.where(disc[..., None], (180, 60, 50), (60, 110, 170)) + rng.normal(
        0, 6, (240, 240, 3)
    )
    rough = cv2.GaussianBlur((np.hypot(x - 123, y - 118) < 72).astype(np.float32), (0, 0), 3)
    refined = refine_mask(image.clip(0, 255).astype(np.uint8), rough, height=240, band=0.03)
    assert iou(refined > 0.5, disc) > 0.99
    assert iou(rough > 0.5, disc) < 0.95


def test_islands_and_pinholes() -> None:
    mask = np.zeros((200, 200), bool)
    mask[20:180, 60:140] = True
    mask[100, 100] = False
    mask[5:8, 5:8] = True
    clean = keep_person(mask)
    assert clean[100, 100]
    assert not clean[:10, :10].any()
    assert clean[20:180, 60:140].all()
