"""The papers' baselines learn, resume exactly and sample by seed; other files are refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from a2v.errors import InputError
from a2v.lab.motion.baselines import NAMES
from a2v.lab.motion.baselines.base import Sizes, layers, wasserstein_round
from a2v.lab.motion.baselines.cond_gru import CondGRU
from a2v.lab.motion.baselines.training import (
    FILE,
    KINDS,
    BaselineSettings,
    load_baseline,
    train_baseline,
)
from tests.support.motions import waving

SETTINGS = BaselineSettings(
    iterations=6, batch_size=4, width=0.1, threads=1, device="cpu", log_every=1
)


def first_poses(dataset, count):
    joints = dataset.joints[0][0]
    return np.tile(joints - joints[:1], (count, 1, 1))


@pytest.mark.parametrize("name", NAMES)
def test_a_killed_run_resumes_to_the_same_weights_and_samples_by_seed(tmp_path, name):
    dataset, settings = waving(), dataclasses.replace(SETTINGS, name=name)
    whole = train_baseline(dataset, tmp_path / "whole", settings=settings)

    class Killed(Exception):
        pass

    def kill(_, row):
        if row["iteration"] == 4:  # in the second stage of those that have two
            raise Killed

    with pytest.raises(Killed):
        train_baseline(dataset, tmp_path / "parts", settings=settings, on_log=kill)
    parts = train_baseline(dataset, tmp_path / "parts", settings=settings)
    for (key, a), b in zip(
        whole.model.state_dict().items(), parts.model.state_dict().values(), strict=True
    ):
        assert torch.equal(a, b), key

    labels = np.array([0, 1, 1])
    first, again, other = (
        whole.generate(labels, first_poses(dataset, 3), np.random.default_rng(seed))
        for seed in (1, 1, 2)
    )
    assert first.shape == (3, dataset.length, 20, 3)
    assert np.isfinite(first).all()
    assert np.abs(first[:, 0, 0]).max() < 1e-6
    assert np.array_equal(first, again)
    assert np.array_equal(first, other) == (name == "condgru")  # the only one without noise


def test_condgru_begins_with_the_real_pose_and_its_error_falls(tmp_path):
    dataset, rows = waving(), []
    settings = dataclasses.replace(
        SETTINGS, iterations=60, learning_rate=3e-3, log_every=10, width=0.5
    )
    trained = train_baseline(
        dataset, tmp_path, settings=settings, on_log=lambda _, row: rows.append(row)
    )
    assert rows[-1]["loss"] < 0.3 * rows[0]["loss"]
    first = first_poses(dataset, 2)
    made = trained.generate(np.array([0, 1]), first, np.random.default_rng(0))
    assert np.allclose(made[:, 0], first, atol=1e-6)


def test_following_step_by_step_is_the_roll_out():
    torch.manual_seed(0)
    model, actions = CondGRU(Sizes(6, 2, 5)), torch.eye(2)
    first = torch.randn(2, 6)
    rolled = model.roll_out(first, actions, 5)
    shown = torch.cat([first[:, None], rolled[:, :-1]], 1)
    assert torch.allclose(model.follow(shown, actions)[0], rolled, atol=1e-6)


def test_the_snippets_error_falls(tmp_path):
    rows = []
    settings = dataclasses.replace(
        SETTINGS, name="dancing2music", iterations=240, learning_rate=3e-3, log_every=8
    )
    train_baseline(waving(), tmp_path, settings=settings, on_log=lambda _, row: rows.append(row))
    assert rows[5]["generator"] < 0.8 * rows[0]["generator"]  # the last row of the first stage
    assert rows[5]["discriminator"] == 0 < rows[-1]["discriminator"]


def test_a_critic_and_its_generator():
    """In one dimension the critic separates real from generated samples.

    Samples move to the real ones, and each step changes only its own network.
    """
    torch.manual_seed(0)
    draws = torch.Generator().manual_seed(0)
    generator, critic = layers(1, 16, 1), layers(1, 16, 1)
    both = torch.nn.ModuleList([generator, critic])
    optimizer = torch.optim.Adam(both.parameters(), lr=0.01, betas=(0.5, 0.9))

    def improve(module, loss):
        other = critic if module is generator else generator
        before = [weight.clone() for weight in other.parameters()]
        weights = list(module.parameters())
        optimizer.zero_grad(set_to_none=True)
        for weight, gradient in zip(
            weights, torch.autograd.grad(loss, weights, allow_unused=True), strict=True
        ):
            weight.grad = gradient
        optimizer.step()
        assert all(torch.equal(a, b) for a, b in zip(before, other.parameters(), strict=True))
        return float(loss.detach())

    real = 3 + 0.1 * torch.randn(64, 1, generator=draws)
    noise = torch.randn(64, 1, generator=draws)
    before = float(generator(noise).mean())
    for _ in range(10):
        wasserstein_round(
            lambda count: generator(torch.randn(count, 1, generator=draws)),
            generator,
            critic,
            real,
            real[:, :0],
            improve,
            draws,
        )
    made = generator(noise)
    assert float(critic(real).mean()) > float(critic(made).mean())
    assert before + 0.2 < float(made.mean()) < 3


def test_the_published_sizes():
    sizes = Sizes(72, 12, 60)
    assert KINDS["condgru"](sizes).recurrent.input_size == 144
    transition = KINDS["latent-transition"](sizes)
    assert transition.pose[0].weight.shape == (1024, 12 + 12)  # a latent vector and the class
    assert transition.made["recurrent"].bidirectional  # the journal's Bi-LSTM
    assert transition.judge.recurrent.input_size == 2 * 72 + 12
    judge = KINDS["act-mocogan"](sizes).judge["pose"]
    assert [part.out_features for part in judge if hasattr(part, "out_features")] == [128, 1]
    dance = KINDS["dancing2music"](dataclasses.replace(sizes, width=0.05))
    assert (dance.snippets, dance.window) == (2, 63)


def test_act_mocogan_shares_one_noise_vector_over_time():
    """Without noise per frame, and with states that keep nothing else, all frames depend on the
    same shared vector: other draws of it give other motions."""
    torch.manual_seed(0)
    model = KINDS["act-mocogan"](Sizes(6, 2, 40)).eval()
    with torch.no_grad():  # codes that are always zero
        for weight in model.made["codes"].parameters():
            weight.zero_()
    actions = torch.eye(2)[[0, 0]]
    poses = model.sample(actions, torch.zeros(2, 6), torch.Generator().manual_seed(0))
    still = (poses[:, -1] - poses[:, -2]).abs().max()
    assert still < 1e-3 < 0.02 < (poses[0, -1] - poses[1, -1]).abs().max()


def test_what_is_no_baseline_is_refused(tmp_path):
    with pytest.raises(InputError, match="unknown baseline"):
        dataclasses.replace(SETTINGS, name="vae")
    train_baseline(waving(), tmp_path, settings=SETTINGS)
    content = torch.load(tmp_path / FILE, weights_only=True)
    torch.save(
        content | {"baseline": content["baseline"] | {"name": "other"}}, tmp_path / "other.pt"
    )
    torch.save(content | {"model": {}}, tmp_path / "empty.pt")
    (tmp_path / "text.pt").write_text("no checkpoint")
    for name, words in {
        "other.pt": "holds no baseline",
        "empty.pt": "holds no baseline",
        "text.pt": "cannot be read",
        "none.pt": "not exist",
    }.items():
        with pytest.raises(InputError, match=words):
            load_baseline(tmp_path / name)
