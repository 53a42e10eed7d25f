"""A character always has a face: bad ones fall back by steps, good ones stay untouched."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.perception.face import find_face
from a2v.reconstruction.canonical import CharacterSettings, Sight, canonical_person, face_note
from a2v.reconstruction.coloring import ColorSettings
from a2v.reconstruction.colorings import color_person
from a2v.reconstruction.face import FaceSettings
from a2v.reconstruction.face.look_again import look_again
from a2v.reconstruction.sound_face import is_sound, sound_face
from a2v.samples import ReadyPerson, load_ready_person
from a2v.types import Camera, Reconstruction, Subject, Surface
from tests.support.surfaces import coated

COLOR = ColorSettings(texture=512, synthesis=False, delight=False, tolerance=0.1)


@pytest.fixture(scope="module")
def ready() -> ReadyPerson:
    return load_ready_person()


@pytest.fixture(scope="module")
def dressed(ready: ReadyPerson) -> Reconstruction:
    return coated(ready.body, cell=0.012, coat=0.005)


class Maker:
    """Makes the character of a photo, and remembers with which features."""

    def __init__(
        self, subject: Subject, ready: ReadyPerson, camera: Camera, dressed: Reconstruction
    ) -> None:
        self.sight = Sight(subject, ready.body, camera, dressed)
        self.asked: list[str] = []

    def __call__(self, face: FaceSettings) -> tuple[Reconstruction, Surface]:
        self.asked.append(face.features)
        made = canonical_person(self.sight, settings=CharacterSettings(), face=face)
        return made, color_person(made, [self.sight], settings=COLOR)


def sound(colored: Surface) -> bool:
    assert colored.standing is not None
    return is_sound(look_again(colored, colored.standing.vertices, colored.standing.parts))


def again(subject: Subject) -> Subject:
    """Look for the face in a changed photo."""
    return dataclasses.replace(subject, face=find_face(subject.image, subject.keypoints))


def head_box(subject: Subject) -> tuple[slice, slice]:
    """The square around the head."""
    middle = subject.keypoints[:11, :2].mean(axis=0)
    half = 1.1 * np.ptp(subject.keypoints[[7, 8], 0])
    low, high = np.int64(middle - half), np.int64(middle + half)
    return slice(low[1], high[1]), slice(low[0], high[0])


def covered(subject: Subject) -> Subject:
    image = subject.image.copy()
    image[head_box(subject)] = (90, 110, 60)
    return again(dataclasses.replace(subject, image=image))


def upside_down(subject: Subject) -> Subject:
    image = subject.image.copy()
    box = head_box(subject)
    image[box] = image[box][::-1, ::-1]
    return again(dataclasses.replace(subject, image=image))


def test_a_good_face_is_left_as_it_is(ready: ReadyPerson, dressed: Reconstruction) -> None:
    maker = Maker(ready.subject, ready, ready.photo_camera, dressed)
    drafted, colored = maker(FaceSettings())
    assert sound(colored)
    assert sound_face(drafted, colored, FaceSettings(), maker)[0] is drafted
    assert maker.asked == ["photo"]
    assert not face_note(drafted.surface)


def test_a_smeared_face_falls_back_until_a_face_is_found(
    ready: ReadyPerson, dressed: Reconstruction
) -> None:
    """The photo shows a face where there are only blots: the steps end with a painted one."""
    box = head_box(ready.subject)
    image = ready.subject.image.copy()
    random = np.random.default_rng(0)
    image[box] = np.kron(random.integers(30, 200, (8, 8, 3)), np.ones((40, 40, 1), np.int64))[
        : box[0].stop - box[0].start, : box[1].stop - box[1].start
    ]
    maker = Maker(
        dataclasses.replace(ready.subject, image=image), ready, ready.photo_camera, dressed
    )
    drafted, colored = maker(FaceSettings())
    assert not sound(colored)
    made, colored = sound_face(drafted, colored, FaceSettings(), maker)
    assert maker.asked[:2] == ["photo", "model"]
    assert made.surface.provenance["features"] == "skin"
    assert "body model's own face" in face_note(made.surface)
    assert made.surface.face is not None
    assert len(made.surface.face.names) == 52
    assert sound(colored)


@pytest.mark.parametrize("change", [covered, upside_down])
def test_a_head_without_a_usable_face_gets_one(
    change: object, ready: ReadyPerson, dressed: Reconstruction
) -> None:
    assert callable(change)
    maker = Maker(change(ready.subject), ready, ready.photo_camera, dressed)
    drafted, colored = maker(FaceSettings())
    made, colored = sound_face(drafted, colored, FaceSettings(), maker)
    assert sound(colored)
    if change is covered:
        assert face_note(made.surface)


def test_a_head_cut_off_at_the_forehead_is_painted(
    ready: ReadyPerson, dressed: Reconstruction
) -> None:
    """The picture ends at the mouth."""
    subject, camera = ready.subject, ready.photo_camera
    cut = int(subject.keypoints[9, 1])
    keypoints = subject.keypoints.copy()
    keypoints[:, 1] -= cut
    keypoints[:11, 2] = 0.0
    lower = dataclasses.replace(
        subject,
        image=subject.image[cut:],
        mask=subject.mask[cut:],
        keypoints=keypoints,
        face=None,
        hands=None,
        bodymap=None,
    )
    flat = dataclasses.replace(camera.flat, center_v=camera.flat.center_v - cut)
    maker = Maker(lower, ready, dataclasses.replace(camera, flat=flat), dressed)
    drafted, colored = maker(FaceSettings())
    assert drafted.surface.provenance["features"] == "head"
    assert "does not show the head" in face_note(drafted.surface)
    assert sound(colored)
    assert sound_face(drafted, colored, FaceSettings(), maker)[0] is drafted
