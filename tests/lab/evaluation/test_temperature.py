"""VAEs are sampled from the prior of Eq. 10, and once more at the temperature of their file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from a2v.lab.evaluation.sources import generator_of
from a2v.motion import MotionModel
from a2v.motion.card import StepCard
from pipelines.lab.evaluated import open_models
from tests.support.motions import waving


def test_the_scale_of_the_noise_takes_the_files_temperature_out() -> None:
    """With noise of no size a clip is that of the means; between is what the temperature says."""
    model = MotionModel.load("cmu-lie")
    assert isinstance(model.card, StepCard)
    assert model.card.temperature == 1.1
    labels, lengths = np.zeros(4, np.int64), np.tile(model.card.bone_lengths, (4, 1))

    def clips(scale: float) -> np.ndarray:
        draw = generator_of(model, 5, noise_scale=scale)
        return draw(labels, lengths, np.random.default_rng(0))

    means, own, at_one = clips(0.0), clips(1.0), clips(1 / 1.1)
    # in the second frame nothing has been fed back yet but the first one's noise
    spread = np.linalg.norm(own[:, 1] - means[:, 1], axis=-1).mean()
    smaller = np.linalg.norm(at_one[:, 1] - means[:, 1], axis=-1).mean()
    assert 0.85 < smaller / spread < 0.97
    assert np.array_equal(own, clips(1.0))


def test_a_table_has_a_row_for_each_temperature() -> None:
    card = MotionModel.load("cmu-lie").card
    dataset = replace(waving(), skeleton=card.skeleton, actions=card.actions)
    found = open_models(["cmu-lie"], dataset, "")
    assert {name: one.temperature for name, one in found.items()} == {
        "lie (cmu-lie)": 1.0,
        "lie (cmu-lie) at its temperature of 1.1": 1.1,
    }
