"""Actions that are named after their path."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.motion.figures import FIGURE_EIGHT, LEAST_RADIUS, figure_eight, natural_path
from a2v.motion.plan import plan_motion
from a2v.motion.timeline import Take
from a2v.motion.ways import way_along


def turned(points: np.ndarray) -> np.ndarray:
    """Angle walked so far (T,), radians, without jumps."""
    heading = np.unwrap(np.arctan2(*np.gradient(points, axis=0).T))
    return np.asarray(heading - heading[0])


def test_the_two_circles_turn_against_each_other_and_meet_at_the_origin():
    points = figure_eight(1.0).points
    assert np.allclose(points[[0, 96, -1]], 0, atol=1e-12)
    angle = turned(points)
    assert angle[96 - 4] == pytest.approx(2 * np.pi, abs=0.3)  # once round to the left
    assert angle[-1] == pytest.approx(0, abs=0.3)  # and once round to the right
    assert points[:96, 0].min() > -1e-9
    assert points[97:, 0].max() < 1e-9


@pytest.mark.parametrize("seconds", [8.0, 15.0, 60.0])
def test_the_path_lasts_as_long_as_is_asked(seconds):
    path = natural_path(FIGURE_EIGHT, seconds=seconds, pace=1.0, fps=12.0)
    assert path is not None
    assert seconds <= len(way_along(path, pace=1.0, fps=12.0).points) / 12.0 < seconds + 1


def test_a_short_one_is_cut_and_not_shrunk():
    path = natural_path(FIGURE_EIGHT, seconds=2.0, pace=1.0, fps=12.0)
    assert path is not None
    assert np.ptp(path.points[:, 0]) == pytest.approx(4 * LEAST_RADIUS, rel=1e-2)
    assert natural_path("Walk", seconds=2.0, pace=1.0, fps=12.0) is None


def test_somebody_walks_an_eight_and_comes_back():
    plan = plan_motion("walk a figure eight")
    assert plan.seconds == 10.0
    motion = plan.make(Take(frames=300, fps=30.0, seed=3))
    place = motion.root[:, [0, 2]]
    assert motion.frames == 300
    assert np.linalg.norm(place[-1] - place[0]) < 0.2
    assert place[:140, 0].min() > -0.2
    assert place[160:, 0].max() < 0.2
    assert place[:, 0].max() > 0.8
    assert place[:, 0].min() < -0.8


def test_several_clips_are_those_of_the_seeds_in_turn():
    plan = plan_motion("walk a figure eight")
    both = plan.make(Take(frames=60, fps=30.0, seed=1, count=2))
    second = plan.make(Take(frames=60, fps=30.0, seed=2))
    assert both.batch == (2,)
    assert np.array_equal(both.joints[1], second.joints)
    assert not np.allclose(both.joints[0], both.joints[1], atol=0.01)
