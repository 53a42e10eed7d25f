"""Feet that stand are found although the depth of a leg is uncertain."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.footage.figure import NAMES
from a2v.footage.fit import Moves
from a2v.footage.ground import LEGS, on_rays, standing
from a2v.footage.terms import SOLE, SOLES

FRAMES, FPS, GROUND = 60, 30.0, -1.4
TIMES = np.arange(FRAMES) / FPS
HEIGHTS = np.array([0.08, 0.02])  # of ankle and toes above the ground


def feet(error: np.ndarray, lift: np.ndarray) -> np.ndarray:
    """Both feet (2, T, 2, 3) at rest, 4 m in front of a camera at the origin.

    They are lifted by `lift` (T,) meters. Then their distance is too large by the share `error`
    (T,).
    """
    rest = np.zeros((2, FRAMES, 2, 3))
    rest[0, ..., 0], rest[1, ..., 0] = 0.1, -0.1
    rest[..., 1] = GROUND + HEIGHTS
    rest[..., 2] = np.array([-4.0, -3.85])
    rest[..., 1] += lift[:, None]
    return rest * (1 + error)[:, None, None]


def moves(places: np.ndarray) -> Moves:
    """A body with these feet."""
    joints = np.tile([0.0, -0.5, -4.0], (FRAMES, len(NAMES), 1))
    landmarks = np.zeros((FRAMES, 33, 3))
    for leg, rows in enumerate(LEGS):
        joints[:, rows] = places[leg]
        landmarks[:, SOLES[leg]] = places[leg][:, ::-1]
        landmarks[:, SOLES[leg], 1] += SOLE - HEIGHTS[::-1]
    return Moves(
        joints=joints,
        landmarks=landmarks,
        wrists=np.zeros((FRAMES, 2, 3, 3)),
        shape=np.zeros(1),
        tilt=0.0,
    )


def test_a_place_on_the_ground_does_not_depend_on_the_estimated_depth():
    still, none = np.zeros(FRAMES), np.zeros(FRAMES)
    wave = 0.04 * np.sin(2 * np.pi * TIMES)
    true, found = on_rays(feet(still, none)), on_rays(feet(wave, none))
    flat = [0, 2]
    assert np.ptp(found[..., flat], axis=1).max() < 1e-9
    assert np.ptp(feet(wave, none)[..., flat], axis=1).max() > 0.3
    # the ground itself is a little lower than the truth, so that the places are a little farther
    assert np.allclose(found[..., flat] / true[..., flat], found[0, 0, 0, 2] / true[0, 0, 0, 2])


@pytest.mark.parametrize("turns", [1.0, 2.0])
def test_feet_stand_although_their_depth_swings(turns):
    wave = 0.04 * np.sin(2 * np.pi * turns * TIMES)
    found = standing(moves(feet(wave, np.zeros(FRAMES))), TIMES)
    assert found is not None
    assert (found.held.reshape(-1, 2, 2).max(axis=-1) > 0.5).mean() > 0.9
    assert found.ground == pytest.approx(GROUND, abs=0.06)


def test_feet_in_the_air_do_not_stand():
    lift = np.where(abs(TIMES - 1.05) < 0.25, 0.4 * np.sin(np.pi * (TIMES - 0.8) / 0.5), 0.0)
    found = standing(moves(feet(np.zeros(FRAMES), lift)), TIMES)
    assert found is not None
    stood = found.held.max(axis=1) > 0.5
    assert not stood[lift > 0.16].any()
    assert stood[TIMES < 0.7].all()
