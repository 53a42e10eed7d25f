"""The exchange of parts of clips, and of latents, in scripts/diagnose_locomotion.py."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest
import torch

from a2v.lab.datasets import ClipSampler
from a2v.lab.motion.networks import VAESettings
from a2v.lab.motion.vae import MotionVAE
from tests.support.motions import waving

PATH = Path(__file__).resolve().parents[2] / "scripts" / "diagnose_locomotion.py"


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


def test_a_decoder_goes_its_own_way_from_the_latents_that_it_is_given(script):
    data = waving()
    torch.manual_seed(0)
    model = MotionVAE(data.skeleton, len(data.actions), VAESettings(decoder="glmi-m")).eval()
    clips, labels, bones = ClipSampler(data, 12).batch(4, np.random.default_rng(0))
    latents = script.Latents(model, data, clips, labels, bones)
    # the posterior's latents in units of the prior give the posterior's clips
    assert latents.made(latents.residual) == pytest.approx(latents.posterior, abs=1e-4)
    assert np.abs(latents.made(latents.noise) - latents.posterior).max() > 1e-3


def test_actions_alike_are_measured_for_recordings_and_both_sources(script, capsys):
    data = waving()
    model = MotionVAE(data.skeleton, len(data.actions), VAESettings(decoder="lie")).eval()

    def evaluator(clips):
        return clips.reshape(len(clips), -1)[:, ::40], np.zeros(len(clips), int)

    script.compare_alike(model, data, evaluator, 8)
    rows = capsys.readouterr().out.splitlines()[1:]
    assert [row[:28].strip() for row in rows] == [
        "recordings",
        "latents of the posterior",
        "latents of the prior",
    ]
