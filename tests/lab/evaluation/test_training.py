"""Our own classifiers: they learn, resume exactly, and are what the protocol takes."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from a2v.errors import InputError
from a2v.kinematics.ground import yaw_to_rotmat
from a2v.lab.datasets import NativeFrame
from a2v.lab.evaluation.protocol import EvaluationSettings, evaluate
from a2v.lab.evaluation.sources import recorded
from a2v.lab.evaluation.training import ClassifierSettings, held_out_accuracy, train_classifier
from tests.support.motions import mirrored

SETTINGS = ClassifierSettings(
    iterations=40, batch_size=16, learning_rate=1e-2, threads=1, device="cpu", log_every=10
)


@pytest.fixture(scope="module")
def parts():
    return mirrored().split_clips(0.3)


def test_it_tells_clips_apart_that_it_has_not_seen(parts, tmp_path):
    training, unseen = parts
    rows = []
    evaluator = train_classifier(
        training, tmp_path, held_out=unseen, settings=SETTINGS, on_log=rows.append
    )
    assert rows[-1]["loss"] < 0.5 * rows[0]["loss"]
    assert rows[-1]["accuracy"] == held_out_accuracy(evaluator, unseen) > 0.9
    assert evaluator.info["held_out_accuracy"] == rows[-1]["accuracy"]
    assert evaluator.info["actions"] == ["slow", "fast"]
    assert evaluator.info["dataset_digest"] == training.sha256
    assert set(evaluator.info["held_out"]) == set(unseen.subjects)
    assert (tmp_path / "log.csv").read_text().count("\n") == 5


def test_the_protocol_takes_it_under_both_states(parts, tmp_path):
    training, _ = parts
    evaluator = train_classifier(training, tmp_path, settings=SETTINGS)
    for state in ("zeros", "random"):
        settings = EvaluationSettings(clips=60, repeats=1, state=state)
        scores = {
            row.name: row.values
            for row in evaluate({"again": recorded(training)}, training, evaluator, settings)
        }
        assert scores["Real motions"]["accuracy"][0] > 0.9
        assert scores["again"]["fid"][0] < 1


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_one_that_faces_forward_does_not_care_where_people_walked(parts, tmp_path, dtype):
    training, unseen = parts
    short = dataclasses.replace(SETTINGS, iterations=20, face_forward=True, balance=0.5)
    evaluator = train_classifier(training, tmp_path, held_out=unseen, settings=short)
    assert evaluator.facing is not None
    assert evaluator.facing.signs == training.frame.signs
    labels = np.arange(20) % 2
    motions = recorded(training)(
        labels, np.zeros((20, 1), np.float32), np.random.default_rng(0)
    ).astype(dtype)
    turned = training.frame.flip(
        training.frame.flip(motions) @ yaw_to_rotmat(np.float64(2.1)).T.astype(dtype)
    )
    assert not np.allclose(motions, turned, atol=0.1)
    assert np.allclose(evaluator(motions)[0], evaluator(turned)[0], atol=1e-4)
    plain = dataclasses.replace(evaluator, info={})
    assert not np.allclose(plain(motions)[0], plain(turned)[0], atol=1e-2)


class Killed(Exception):
    pass


def test_a_killed_run_resumes_to_the_same_weights(parts, tmp_path):
    training, unseen = parts
    whole = train_classifier(training, tmp_path / "whole", held_out=unseen, settings=SETTINGS)

    def kill(row):
        if row["iteration"] == 20:
            raise Killed

    with pytest.raises(Killed):
        train_classifier(
            training, tmp_path / "parts", held_out=unseen, settings=SETTINGS, on_log=kill
        )
    resumed = train_classifier(
        training, tmp_path / "parts", settings=dataclasses.replace(SETTINGS, log_every=7)
    )
    for (name, a), b in zip(
        whole.network.named_parameters(), resumed.network.parameters(), strict=True
    ):
        assert torch.equal(a, b), name


def test_the_seed_decides_the_weights(parts, tmp_path):
    short = dataclasses.replace(SETTINGS, iterations=2)
    runs = [
        train_classifier(
            parts[0], tmp_path / str(i), settings=dataclasses.replace(short, seed=seed)
        ).network.linear2.weight
        for i, seed in enumerate((3, 3, 4))
    ]
    assert torch.equal(runs[0], runs[1])
    assert not torch.equal(runs[0], runs[2])


def test_runs_of_other_settings_data_or_programs_are_refused(parts, tmp_path):
    short = dataclasses.replace(SETTINGS, iterations=2)
    train_classifier(parts[0], tmp_path, settings=short)
    with pytest.raises(InputError, match=r"classifier\.pt was made with batch_size=16, not 8"):
        train_classifier(parts[0], tmp_path, settings=dataclasses.replace(short, batch_size=8))
    with pytest.raises(InputError, match="made with dataset_digest"):
        train_classifier(parts[1], tmp_path, settings=short)
    (tmp_path / "classifier.pt").write_bytes(b"nonsense")
    with pytest.raises(InputError, match="cannot be read as a checkpoint"):
        train_classifier(parts[0], tmp_path, settings=short)
    torch.save({"model": {}}, tmp_path / "classifier.pt")
    with pytest.raises(InputError, match="not a checkpoint of this training"):
        train_classifier(parts[0], tmp_path, settings=short)


def test_it_sees_the_native_frame(parts, tmp_path):
    """A classifier learns from the same clips that the protocol shows:

    HumanAct12's y points down.
    """
    signs = np.float32([1, -1, -1])
    world = dataclasses.replace(parts[0], frame=NativeFrame(signs=(1.0, -1.0, -1.0)))
    native = dataclasses.replace(
        parts[0], joints=tuple(joints * signs for joints in parts[0].joints)
    )
    short = dataclasses.replace(SETTINGS, iterations=3)
    first, second, plain = (
        train_classifier(dataset, tmp_path / name, settings=short).network.linear1.weight
        for name, dataset in (("world", world), ("native", native), ("plain", parts[0]))
    )
    assert torch.equal(first, second)
    assert not torch.equal(first, plain)
