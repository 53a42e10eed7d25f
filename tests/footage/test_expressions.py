"""Expressions of a face are recovered from the detector's landmarks of it."""

from __future__ import annotations

import numpy as np

from a2v.footage.expressions import face_basis, fit_expressions
from a2v.kinematics import rotvec_to_rotmat

FRAMES = 60


def landmarks(strengths: dict[str, np.ndarray], noise: float = 0.004) -> np.ndarray:
    """Landmarks (T, 478, 3) of a face that turns, in a detector's units."""
    basis, random = face_basis(), np.random.default_rng(0)
    weights = np.zeros((FRAMES, len(basis.names)))
    for name, values in strengths.items():
        weights[:, basis.names.index(name)] = values
    points = basis.rest + np.einsum("tb,bnk->tnk", weights, basis.moves)
    turns = rotvec_to_rotmat(0.2 * random.normal(size=(FRAMES, 3)))
    moved = (
        11 * np.einsum("tab,tnb->tna", turns, points)
        + random.normal(size=(FRAMES, 1, 3))
        + noise * random.normal(size=points.shape)
    )
    return np.asarray(moved * [1, -1, 1])


def test_mouth_blinks_and_smile_are_found_and_nothing_else():
    times = np.arange(FRAMES) / 30
    blink = ((np.arange(FRAMES) >= 30) & (np.arange(FRAMES) < 34)).astype(float)
    smile = np.clip(times - 1, 0, 0.6)
    wanted = {
        "jawOpen": 0.7 * np.clip(np.sin(5 * times), 0, 1),
        "eyeBlinkLeft": blink,
        "eyeBlinkRight": blink,
        "mouthSmileLeft": smile,
        "mouthSmileRight": smile,
    }
    found = fit_expressions(
        [face if index % 7 else None for index, face in enumerate(landmarks(wanted))], times
    )
    for name, values in wanted.items():
        assert np.abs(found[name] - values).mean() < 0.08, name
    assert found["eyeBlinkLeft"].max() > 0.7
    assert (
        max((values.max() for name, values in found.items() if name not in wanted), default=0) < 0.3
    )
    assert all(
        values.dtype == np.float32 and 0 <= values.min() <= values.max() <= 1
        for values in found.values()
    )


def test_one_side_is_that_side():
    values = np.where(np.arange(FRAMES) > 40, 0.8, 0.0)
    found = fit_expressions(list(landmarks({"mouthSmileLeft": values})), np.arange(FRAMES) / 30)
    assert found["mouthSmileLeft"].max() > 0.5
    assert "mouthSmileRight" not in found or found["mouthSmileRight"].max() < 0.2


def test_a_face_that_is_hardly_seen_says_nothing_and_one_that_goes_comes_to_rest():
    times = np.arange(FRAMES) / 30
    faces = list(landmarks({"jawOpen": np.where(np.arange(FRAMES) > 15, 0.6, 0.0)}))
    assert fit_expressions(faces[:5] + [None] * 55, times) == {}
    found = fit_expressions(faces[:30] + [None] * 30, times)["jawOpen"]
    assert found[25] > 0.4
    assert found[-5:].max() < 0.01
