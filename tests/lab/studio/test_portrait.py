"""The path-traced portrait."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.lab.studio.avatars import Avatar, a_pose
from a2v.lab.studio.portrait import PortraitSettings, portrait_camera, take_portrait


def test_portrait_and_its_truth_agree(avatar: Avatar) -> None:
    person = avatar.surface(a_pose())
    settings = PortraitSettings(size=160, spp=16, threads=1, yaw=25)
    photo = take_portrait(person, settings)
    assert photo.image.shape == (160, 160, 3)
    # the person stands centered and whole, in the requested size
    rows, columns = np.nonzero(photo.mask > 0.5)
    assert np.ptp(rows) + 1 == pytest.approx(settings.fill_frame * 160, abs=3)
    assert (columns.min() + columns.max()) / 2 == pytest.approx(79.5, abs=2)
    pixels = portrait_camera(person.vertices, settings).project(person.vertices, 160)
    assert columns.min() == pytest.approx(pixels[:, 0].min(), abs=2)
    inside, outside = (
        photo.image[photo.mask == 1].astype(float),
        photo.image[photo.mask == 0].astype(float),
    )
    assert np.abs(inside.mean(axis=0) - outside.mean(axis=0)).max() > 10
    again = take_portrait(person, settings)
    assert np.abs(again.image.astype(int) - photo.image).max() <= 1  # seeded
