"""Training: it learns, resumes exactly, and refuses what cannot work."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from a2v.errors import InputError
from a2v.lab.checkpoints import read_checkpoint
from a2v.lab.motion.networks import VAESettings
from a2v.lab.motion.training import TrainSettings, start, train
from tests.support.motions import waving

SMALL = VAESettings(hidden_size=16, latent_size=4)
SETTINGS = TrainSettings(
    schedule="cosine",
    iterations=30,
    batch_size=8,
    learning_rate=5e-3,
    threads=1,
    device="cpu",
    log_every=5,
)


def test_the_loss_falls(tmp_path):
    rows = []
    train(
        waving(),
        tmp_path,
        vae=SMALL,
        settings=dataclasses.replace(SETTINGS, iterations=60),
        on_log=lambda _, row: rows.append(dict(row)),
    )
    assert rows[-1]["reconstruction"] < 0.5 * rows[0]["reconstruction"]
    assert rows[0]["kl_weight"] < rows[-1]["kl_weight"] == pytest.approx(0.01, rel=0.1)
    assert (tmp_path / "log.csv").read_text().count("\n") == 13


class Killed(Exception):
    pass


@pytest.mark.parametrize("decoder", ["glmi-m", "glmi-r", "lie", "plain"])
def test_a_killed_run_resumes_to_the_same_weights(tmp_path, decoder):
    vae = dataclasses.replace(SMALL, decoder=decoder)
    settings = dataclasses.replace(SETTINGS, iterations=8, log_every=2)
    whole = train(waving(), tmp_path / "whole", vae=vae, settings=settings)

    def kill(state, _row):
        if state.iteration == 4:
            raise Killed

    with pytest.raises(Killed):
        train(waving(), tmp_path / "parts", vae=vae, settings=settings, on_log=kill)
    assert read_checkpoint(tmp_path / "parts" / "checkpoint.pt", ["model"])["iteration"] == 4
    resumed = train(waving(), tmp_path / "parts", vae=vae, settings=settings)
    for (name, a), b in zip(whole.named_parameters(), resumed.parameters(), strict=True):
        assert torch.equal(a, b), name


def test_resuming_with_other_settings_is_refused(tmp_path):
    train(waving(), tmp_path, vae=SMALL, settings=dataclasses.replace(SETTINGS, iterations=2))
    with pytest.raises(InputError, match=r"batch_size=8, not 4"):
        train(
            waving(),
            tmp_path,
            vae=SMALL,
            settings=dataclasses.replace(SETTINGS, iterations=2, batch_size=4),
        )


def test_a_run_begins_with_the_weights_of_another(tmp_path):
    short = dataclasses.replace(SETTINGS, iterations=2)
    first = train(waving(), tmp_path / "first", vae=SMALL, settings=short)
    begun = dataclasses.replace(short, initial=str(tmp_path / "first" / "checkpoint.pt"), seed=1)
    training = start(waving(), SMALL, begun)
    for (name, a), b in zip(first.named_parameters(), training.model.parameters(), strict=True):
        assert torch.equal(a, b), name
    assert train(waving(), tmp_path / "on", vae=SMALL, settings=begun) is not None
    with pytest.raises(InputError, match="other layers"):
        start(waving(), dataclasses.replace(SMALL, decoder="plain"), begun)
    with pytest.raises(InputError, match="does not exist"):
        start(waving(), SMALL, dataclasses.replace(short, initial=str(tmp_path / "none.pt")))


def test_glmi_needs_a_trajectory():
    with pytest.raises(InputError, match="no root trajectory"):
        start(waving(trajectory=False), SMALL, SETTINGS)
    start(waving(trajectory=False), dataclasses.replace(SMALL, decoder="lie"), SETTINGS)


def test_impossible_settings_are_refused():
    with pytest.raises(InputError, match="probability"):
        TrainSettings(teacher_forcing=1.5)
    with pytest.raises(InputError, match="balance is 2"):
        TrainSettings(balance=2)
    with pytest.raises(InputError, match="unknown decoder"):
        VAESettings(decoder="transformer")
    with pytest.raises(InputError, match="unknown roots"):
        VAESettings(roots="last")
    with pytest.raises(InputError, match="unknown prior"):
        VAESettings(prior="uniform")
    with pytest.raises(InputError, match="'plain' has no rotations"):
        VAESettings(decoder="plain", root_rotation=True)


def test_rare_actions_are_learned_from_as_often_as_asked_for():
    data = waving()
    first = int(np.flatnonzero(data.labels == 0)[0])
    kept = np.array([first, *np.flatnonzero(data.labels == 1)])  # one clip of the first action
    rare = dataclasses.replace(
        data, joints=[data.joints[index] for index in kept], labels=data.labels[kept]
    )
    for balance in (0.0, 1.0):
        training = start(rare, SMALL, dataclasses.replace(SETTINGS, balance=balance))
        _, labels, _ = training.sampler.batch(4000, np.random.default_rng(0))
        assert (labels == 0).mean() == pytest.approx(0.5 if balance else 1 / len(kept), abs=0.03)
