"""The exchange of parts of clips in scripts/diagnose_locomotion.py."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

PATH = Path(__file__).resolve().parents[1] / "scripts" / "diagnose_locomotion.py"


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("diagnose_locomotion", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def clips():
    return np.random.default_rng(0).normal(size=(3, 10, 5, 3)).astype(np.float32)


def test_the_rise_is_scaled_and_poses_stay(script, clips):
    moved = script.with_rise(clips, 3.0)
    assert script.rise(moved, 1.0) == pytest.approx(3 * script.rise(clips, 1.0), rel=1e-5)
    assert script.without_root(moved) == pytest.approx(script.without_root(clips), abs=1e-5)
    assert moved[..., 0] == pytest.approx(clips[..., 0])


def test_poses_and_roots_of_two_sets_are_exchanged(script, clips):
    real, made, seen = clips, clips[::-1] + 1, {}
    script.exchange_parts(real, made, lambda name, one: seen.setdefault(name, one))
    mixed = seen["generated poses, recorded roots"]
    assert mixed[:, :, 0] == pytest.approx(real[:, :, 0], abs=1e-5)
    assert script.without_root(mixed) == pytest.approx(script.without_root(made), abs=1e-5)
    mixed = seen["recorded poses, generated roots"]
    assert mixed[:, :, 0] == pytest.approx(made[:, :, 0], abs=1e-5)
