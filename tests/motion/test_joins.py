"""Windows that continue one another: how much of each is used, and how smoothly they join."""

from __future__ import annotations

import pytest

from a2v.motion import MotionModel
from benchmarks.joins import speeds


def test_short_clips_are_taken_as_long_as_most_of_them_are() -> None:
    sampler = MotionModel.load("cmu-fine").sampler
    model = MotionModel.load("cmu-fine")
    for action, least, most in (("Run", 0.14, 0.18), ("Walk around", 0.95, 1.0)):
        assert least <= sampler.active_share(model.label(action)) <= most


@pytest.mark.parametrize(
    ("model", "action"),
    [("cmu", "Run"), ("cmu-fine", "Run"), ("cmu-fine", "March"), ("cmu-fine", "Jog")],
)
def test_windows_join_at_an_even_speed(model: str, action: str) -> None:
    for speed in speeds(model, action, 16):
        assert 0.82 < speed < 1.2
