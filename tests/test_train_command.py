"""``a2v train`` and ``a2v evaluate`` from the command line, at the smallest size, on the real data."""

from __future__ import annotations

import json

import pytest

from a2v.motion import MotionModel
from pipelines.cli import main


@pytest.mark.parametrize(
    "arguments",
    [
        ["motion", "--iterations", "2", "--batch_size", "4", "--vae.hidden_size", "8", "--vae.decoder", "lie", "--threads", "1"],
        ["flow", "--flow.iterations", "2", "--flow.code_size", "8", "--flow.width", "8", "--flow.pool", "50", "--flow.threads", "1"],
    ],
    ids=["motion", "flow"],
)
def test_train_then_sample_then_evaluate(tmp_path, data_dir, arguments):
    run = str(tmp_path / "run")
    assert main(["train", *arguments, "--dataset", "humanact12", "--data", str(data_dir), "--out", run, "--licence", "none"]) == 0
    model = MotionModel.load(f"{run}/motion.onnx")
    assert model.metadata["licence"] == "none"
    assert model.sample("walk", frames=7).joints.shape == (7, 24, 3)
    table = tmp_path / "table.md"
    measure = ["evaluate", "--dataset", "humanact12", "--data", str(data_dir), "--model", f"{run}/motion.onnx", "--out", str(table)]
    assert main([*measure, "--clips", "60", "--repeats", "1"]) == 0
    assert "Real motions" in table.read_text()
    scores = json.loads(table.with_suffix(".json").read_text())["scores"]
    assert all(len(row["fid"]) == 1 for row in scores.values())


def test_a_model_of_other_actions_is_refused(tmp_path, data_dir, capsys):
    arguments = ["evaluate", "--dataset", "humanact12", "--data", str(data_dir), "--model", "cmu", "--out", str(tmp_path / "t.md")]
    assert main(arguments) == 2
    assert "knows other actions" in capsys.readouterr().err
