"""``a2v train`` and ``a2v evaluate`` from the command line, at the smallest size, on the real
data."""

from __future__ import annotations

import copy
import json
import shutil
import zipfile

import numpy as np
import pytest

from a2v.kinematics import bone_lengths, forward_kinematics, skeleton_of
from a2v.lab.datasets import load_dataset
from a2v.motion import MotionModel
from pipelines.cli import main
from tests.support.flows import export_one_step


@pytest.mark.parametrize(
    "arguments",
    [
        [
            "motion",
            "--iterations",
            "2",
            "--batch_size",
            "4",
            "--vae.hidden_size",
            "8",
            "--vae.decoder",
            "lie",
            "--threads",
            "1",
        ],
        [
            "flow",
            "--flow.iterations",
            "2",
            "--flow.code_size",
            "8",
            "--flow.width",
            "8",
            "--flow.pool",
            "50",
            "--flow.threads",
            "1",
        ],
    ],
    ids=["motion", "flow"],
)
def test_train_then_sample_then_evaluate(tmp_path, data_dir, arguments, monkeypatch):
    export_one_step(monkeypatch)
    run = str(tmp_path / "run")
    assert (
        main(
            [
                "train",
                *arguments,
                "--dataset",
                "humanact12",
                "--data",
                str(data_dir),
                "--out",
                run,
                "--license",
                "none",
            ]
        )
        == 0
    )
    model = MotionModel.load(f"{run}/motion.onnx")
    assert model.card.license == "none"
    assert model.sample("walk", frames=7).joints.shape == (7, 24, 3)
    table = tmp_path / "table.md"
    measure = [
        "evaluate",
        "--dataset",
        "humanact12",
        "--data",
        str(data_dir),
        "--model",
        f"{run}/motion.onnx",
        "--out",
        str(table),
    ]
    assert main([*measure, "--clips", "60", "--repeats", "1"]) == 0
    assert "Real motions" in table.read_text()
    scores = json.loads(table.with_suffix(".json").read_text())["scores"]
    assert all(len(row["fid"]) == 1 for row in scores.values())


def test_a_baseline_is_trained_and_measured_in_both_protocols(tmp_path, data_dir, capsys):
    data, run = ["--dataset", "humanact12", "--data", str(data_dir)], tmp_path / "run"
    small = ["--iterations", "2", "--batch_size", "4", "--width", "0.1", "--threads", "1"]
    assert (
        main(["train", "baseline", "--name", "two-stage-gan", *data, "--out", str(run), *small])
        == 0
    )
    table = tmp_path / "table.md"
    models = ["--model", str(run / "baseline.pt"), "--model", "first-frame"]
    assert (
        main(["evaluate", *data, *models, "--out", str(table), "--clips", "300", "--repeats", "1"])
        == 0
    )
    text = table.read_text()
    assert "| two-stage-gan (baseline.pt) |" in text
    assert "| Two-stage GAN | 10.480 | 0.421 |" in text  # as published
    plain, alike = (
        json.loads(table.with_suffix(suffix).read_text()) for suffix in (".json", ".alike.json")
    )
    assert (plain["protocol"]["labels"], alike["protocol"]["labels"]) == ("data", "uniform")
    assert list(alike["scores"])[:2] == ["Real motions", "Real, drawn alike"]
    assert (
        alike["scores"]["Real, drawn alike"]["fid"][0]
        > 3 * alike["scores"]["Real motions"]["fid"][0]
    )
    assert alike["scores"]["a real first pose, then zeros"]["accuracy"][0] < 0.2
    capsys.readouterr()
    assert (
        main(
            [
                "evaluate",
                "--dataset",
                "cmu",
                "--data",
                str(data_dir),
                *models[:2],
                "--out",
                str(table),
            ]
        )
        == 2
    )
    assert "was trained with other actions, joints or lengths than cmu" in capsys.readouterr().err


def test_a_model_of_other_actions_is_refused(tmp_path, data_dir, capsys):
    arguments = [
        "evaluate",
        "--dataset",
        "humanact12",
        "--data",
        str(data_dir),
        "--model",
        "cmu",
        "--out",
        str(tmp_path / "t.md"),
    ]
    assert main(arguments) == 2
    assert "was trained with other actions" in capsys.readouterr().err


@pytest.fixture
def own_actions(data_dir, tmp_path):
    """A user's folder: recorded BVH files of three people in two actions."""
    folder = tmp_path / "mine"
    with zipfile.ZipFile(data_dir / "cmu_bvh.zip") as archive:
        for action, clips in {
            "walk": ("07/07_01", "07/07_02", "08/08_01"),
            "jump": ("09/09_01", "09/09_02", "02/02_04", "07/07_03"),
        }.items():
            (folder / action).mkdir(parents=True)
            for clip in clips:
                (folder / action / f"{clip[3:]}.bvh").write_bytes(
                    archive.read(f"cmu_bvh/{clip}.bvh")
                )
    return folder


def test_a_folder_of_bvh_is_checked_learned_sampled_and_measured(tmp_path, own_actions, capsys):
    data = ["--dataset", "bvh", "--data", str(own_actions), "--bvh.frames", "24"]
    assert main(["data", "bvh", "--data", str(own_actions), "--bvh.frames", "24"]) == 0
    shown = capsys.readouterr().out
    assert "7 clips" in shown
    assert "CMU units" in shown
    small = [
        "--iterations",
        "2",
        "--batch_size",
        "4",
        "--vae.hidden_size",
        "8",
        "--vae.decoder",
        "lie",
        "--threads",
        "1",
    ]
    assert (
        main(["train", "motion", *data, "--held_out", "09", "--out", str(tmp_path / "run"), *small])
        == 0
    )
    model = MotionModel.load(tmp_path / "run" / "motion.onnx")
    assert model.actions == ("jump", "walk")
    assert model.card.held_out == ("09",)
    motion = model.sample("jump", frames=5)
    assert motion.joints.shape == (5, 28, 3)
    # a Motion names its skeleton, and its rotations are that skeleton's
    skeleton = skeleton_of(motion.skeleton, motion.parents.tolist(), motion.joint_names)
    again = forward_kinematics(
        motion.rotations, motion.root, bone_lengths(motion.joints, skeleton), skeleton
    )
    assert np.abs(again - motion.joints).max() < 1e-4

    table = tmp_path / "table.md"
    measure = [
        "evaluate",
        *data,
        "--model",
        str(model.path),
        "--out",
        str(table),
        "--clips",
        "60",
        "--repeats",
        "1",
    ]
    measure += [
        "--held_out",
        "09",
        "--actions",
        "jump,walk",
        "--classifier.iterations",
        "3",
        "--classifier.threads",
        "1",
    ]
    assert main(measure) == 0
    captured = capsys.readouterr()
    assert "the authors published no classifier for bvh; taking ours" in captured.err
    assert "accuracy on 2 clips of 09, not learned from" in captured.err
    text = table.read_text()
    assert "jump FID" in text
    assert "Training clips" in text
    assert "Trained without these people: lie (motion.onnx)" in text
    assert "The classifier was trained without them" in text
    content = json.loads(table.with_suffix(".json").read_text())
    assert (
        content["dataset"]["sha256"]
        != content["held_out"]["training_sha256"]
        == content["models"]["lie (motion.onnx)"]["trained_on"]
    )
    assert content["classifier"]["actions"] == ["jump", "walk"]
    # the classifier stays: the second time it is only loaded, and the numbers are the same
    assert main([*measure, "--state", "zeros"]) == 0
    zeros = json.loads(table.with_suffix(".json").read_text())
    assert zeros["classifier"] == content["classifier"]
    table.with_suffix(".json").unlink()  # or its rows would be kept
    assert main([*measure, "--state", "zeros"]) == 0
    assert json.loads(table.with_suffix(".json").read_text()) == zeros

    # rows of the same protocol and model are kept (this one says so), another model's is added
    known = copy.deepcopy(zeros)
    known["scores"]["lie (motion.onnx)"]["fid"] = known["actions"]["scores"]["jump"][
        "Real motions"
    ]["fid"] = [123.0]
    table.with_suffix(".json").write_text(json.dumps(known))
    other = shutil.copy(model.path, tmp_path / "other.onnx")
    assert main([*measure, "--state", "zeros", "--model", str(other)]) == 0
    both = json.loads(table.with_suffix(".json").read_text())
    assert (
        both["scores"]["lie (motion.onnx)"]["fid"]
        == both["actions"]["scores"]["jump"]["Real motions"]["fid"]
        == [123.0]
    )
    assert both["scores"]["lie (other.onnx)"] == zeros["scores"]["lie (motion.onnx)"]
    assert "| lie (motion.onnx) | 123.000 |" in table.read_text()
    assert "unfinished" not in both
    # under another protocol, or from a file that is no such table, nothing is
    for content in (json.dumps(known | {"protocol": {}}), "[1]"):
        table.with_suffix(".json").write_text(content)
        assert main([*measure, "--state", "zeros"]) == 0
        assert json.loads(table.with_suffix(".json").read_text()) == zeros


def test_what_is_wrong_with_data_is_one_line_and_exit_code_2(tmp_path, own_actions, capsys):
    (own_actions / "walk" / "08_01.bvh").write_text("HIERARCHY\n")
    assert (
        main(
            [
                "train",
                "classifier",
                "--dataset",
                "bvh",
                "--data",
                str(own_actions),
                "--out",
                str(tmp_path / "run"),
            ]
        )
        == 2
    )
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert error.startswith("a2v: ")
    assert "walk/08_01.bvh:" in error
    shutil.rmtree(own_actions / "walk")
    assert main(["data", "bvh", "--data", str(own_actions), "--bvh.fps", "0"]) == 2
    assert "fps" in capsys.readouterr().err


def test_the_same_people_are_held_out_by_every_command(data_dir):
    from pipelines.lab.dataset_options import hold_out

    dataset = load_dataset("humanact12", data_dir)
    (training, unseen), (again, _) = hold_out(dataset, "auto"), hold_out(dataset, "auto")
    assert training.sha256 == again.sha256
    assert not set(unseen.subjects) & set(training.subjects)
    assert hold_out(dataset, "none")[1] is None
