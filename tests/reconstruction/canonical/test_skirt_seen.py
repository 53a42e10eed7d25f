"""Skirts that the network sees in a chart of the legs."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest

from a2v.reconstruction.reading.hem import rest_height
from a2v.reconstruction.reading.legs_chart import ALONG, leg_joints, legs_chart
from a2v.reconstruction.reading.skirt import find_skirt, look_for_skirt, skirt_in_chart
from a2v.samples.ready import load_ready_person
from a2v.types import Body
from tests.support.faces import CAMERA, photographed
from tests.support.surfaces import coated


def test_a_chart_follows_the_legs(body: Body) -> None:
    """Each row of the chart shows the photo at the height of the places on the legs."""
    plain = photographed(body)
    image = np.repeat(np.arange(len(plain.image), dtype=np.float64)[:, None], 3, axis=1)
    image = np.repeat((255 * image[:, None] / image.max()), plain.image.shape[1], axis=1)
    legs = leg_joints(body, CAMERA)
    chart = legs_chart(image.astype(np.uint8), plain.mask, legs)
    middle = legs[:, :, 1].mean(axis=0) / (len(plain.image) - 1)
    seen = [np.interp(place, ALONG, chart[0, :, 48]) for place in (0.0, 1.0, 2.0)]
    np.testing.assert_allclose(seen, middle, atol=0.012)
    away = np.abs(chart[4, 20] - chart[4, 20, ::-1])
    assert away.max() < 0.3  # both axes are marked, at about the same distance from the middle
    assert chart[4].max(axis=1).min() > 0.8


def test_both_sides_give_the_same(body: Body) -> None:
    chart = legs_chart(photographed(body).image, photographed(body).mask, leg_joints(body, CAMERA))
    one, other = skirt_in_chart(chart), skirt_in_chart(chart[:, :, ::-1])
    assert one.probability == pytest.approx(other.probability, abs=1e-5)
    assert one.hem == pytest.approx(other.hem, abs=1e-4)


def test_cloth_over_the_legs_is_a_skirt_and_trousers_are_none() -> None:
    """The sample's person wears trousers; then cloth to the knees is painted over both thighs."""
    person = load_ready_person()
    subject, body, camera = person.subject, person.photo_body, person.photo_camera
    assert look_for_skirt(subject, body, camera).probability < 0.1
    legs = leg_joints(body, camera)
    high, low = (int(legs[:, joint, 1].mean()) for joint in (0, 1))
    left, right = legs[:, :, 0].min(), legs[:, :, 0].max()
    wide = 0.12 * (legs[:, 2, 1] - legs[:, 0, 1]).mean()
    columns = slice(int(left - wide), int(right + wide))
    image, mask = subject.image.copy(), subject.mask.copy()
    image[high - 10 : low, columns], mask[high - 10 : low, columns] = (150, 40, 60), 1
    seen = look_for_skirt(dataclasses.replace(subject, image=image, mask=mask), body, camera)
    assert seen.probability > 0.85
    assert 0.8 < seen.hem < 1.2


def test_the_surface_of_a_body_without_cloth_gets_no_skirt(body: Body) -> None:
    surface, plain = coated(body, cell=0.02, coat=0.01).surface, photographed(body)
    corners = np.rint(CAMERA.project(surface.vertices))[surface.faces].astype(np.int32)
    mask = np.zeros(plain.mask.shape, np.uint8)
    for corner in corners:
        cv2.fillConvexPoly(mask, corner, 1)
    image = np.where(mask[..., None] > 0, 70, 190).repeat(3, axis=2).astype(np.uint8)
    subject = dataclasses.replace(plain, image=image, mask=mask.astype(np.float32))
    found, _ = find_skirt(surface, subject, body, CAMERA)
    assert not found


def test_places_on_the_legs_have_heights_at_rest(body: Body) -> None:
    heights = [rest_height(body, place) for place in (0.4, 1.0, 1.6)]
    assert heights == sorted(heights, reverse=True)
    knees = [
        body.rest_transforms[body.bone_names.index(f"lowerleg01{side}"), 1, 3]
        for side in (".L", ".R")
    ]
    assert heights[1] == pytest.approx(np.mean(knees), abs=0.01)
