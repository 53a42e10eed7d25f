"""`export.retune` changes guidance and temperature without changing the weights."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import onnx
import pytest

from a2v.errors import InputError
from a2v.motion import MotionModel
from a2v.sessions import WEIGHTS
from export.retune import read_factors, retune

ROOT = Path(__file__).parents[2]
FLOW = WEIGHTS / "motion_cmu_fine.onnx"


def window(model: MotionModel, noise: np.ndarray) -> np.ndarray:
    made = model.sampler.run(
        np.array([3, 70]),
        active=np.ones(2),
        noise=noise,
        lengths=np.tile(model.bone_lengths, (2, 1)),
    )  # type: ignore[call-arg]
    return np.asarray(made[0])


def test_a_retuned_flow_is_the_same_under_another_noise_and_push(tmp_path: Path) -> None:
    model = MotionModel.load(FLOW)
    noise = np.random.default_rng(0).standard_normal((2, 384), dtype=np.float32)
    said = json.loads(onnx.load(FLOW).metadata_props[0].value)
    before = said["guidance"], said["temperature"]
    retune(FLOW, tmp_path / "cold.onnx", guidance=before[0], temperature=0.5)
    cold = MotionModel.load(tmp_path / "cold.onnx")
    np.testing.assert_allclose(
        window(cold, noise * before[1] / 0.5), window(model, noise), atol=1e-3
    )
    assert np.abs(window(cold, noise) - window(model, noise)).max() > 0.01
    retune(FLOW, tmp_path / "pushed.onnx", guidance=6, temperature=before[1])
    pushed = MotionModel.load(tmp_path / "pushed.onnx")
    assert np.abs(window(pushed, noise) - window(model, noise)).max() > 0.01
    retune(
        tmp_path / "pushed.onnx", tmp_path / "back.onnx", guidance=before[0], temperature=before[1]
    )
    np.testing.assert_allclose(
        window(MotionModel.load(tmp_path / "back.onnx"), noise), window(model, noise), atol=1e-5
    )
    assert json.loads(onnx.load(tmp_path / "back.onnx").metadata_props[0].value) == said


def test_actions_have_temperatures_of_their_own(tmp_path: Path) -> None:
    said = json.loads(onnx.load(FLOW).metadata_props[0].value)
    noise = np.random.default_rng(0).standard_normal((2, 384), dtype=np.float32)
    settings = {"guidance": said["guidance"], "temperature": said["temperature"]}
    retune(FLOW, tmp_path / "plain.onnx", **settings, factors={})
    retune(
        tmp_path / "plain.onnx",
        tmp_path / "own.onnx",
        **settings,
        factors={said["actions"][70]: 1.5},
    )
    plain, own = (
        window(MotionModel.load(tmp_path / f"{name}.onnx"), noise) for name in ("plain", "own")
    )
    np.testing.assert_allclose(own[0], plain[0], atol=1e-5)
    assert np.abs(own[1] - plain[1]).max() > 0.01
    louder = window(MotionModel.load(tmp_path / "plain.onnx"), noise * np.float32([[1.0], [1.5]]))
    np.testing.assert_allclose(own, louder, atol=1e-4)
    with pytest.raises(InputError, match="no action 'Moonwalk'"):
        retune(FLOW, tmp_path / "x.onnx", **settings, factors={"Moonwalk": 1.2})


def test_the_shipped_factors_are_those_of_the_table() -> None:
    said = json.loads(onnx.load(FLOW).metadata_props[0].value)
    assert said["temperature_factors"] == read_factors(ROOT / "export" / "factors_cmu_fine.csv")


def test_what_cannot_be_retuned_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not a window flow"):
        retune(WEIGHTS / "motion_cmu_glmi_m.onnx", tmp_path / "x.onnx", guidance=2, temperature=0.9)
    with pytest.raises(InputError, match="has no temperature"):  # a factor of 1 is not in the graph
        retune(WEIGHTS / "motion_humanact12.onnx", tmp_path / "x.onnx", guidance=2, temperature=0.9)
    for guidance, temperature in ((1.0, 0.9), (2.0, 0.0)):
        with pytest.raises(InputError, match=r"guidance is|temperature is"):
            retune(FLOW, tmp_path / "x.onnx", guidance=guidance, temperature=temperature)
    assert not list(tmp_path.iterdir())
