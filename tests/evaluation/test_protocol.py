"""The protocol on generators whose quality is known."""

from __future__ import annotations

import json

import numpy as np
import pytest
import torch

from a2v.datasets import ClipSampler
from a2v.errors import InputError
from a2v.evaluation.classifier import ActionClassifier, Evaluator
from a2v.evaluation.protocol import EvaluationSettings, evaluate, markdown_table, report
from tests.motion.test_training import waving

SETTINGS = EvaluationSettings(clips=60, repeats=3, state="zeros")


@pytest.fixture(scope="module")
def setting():
    dataset = waving(clips=20)
    torch.manual_seed(0)
    return dataset, Evaluator(ActionClassifier(60, 2), "untrained", "0")


def real(dataset):
    sampler = ClipSampler(dataset, dataset.length)

    def generate(labels, lengths, generator):
        clips = [generator.choice(np.flatnonzero(dataset.labels == label)) for label in labels]
        return sampler.windows(np.array(clips), generator)

    return generate


def still(dataset):
    return lambda labels, lengths, generator: np.zeros((len(labels), dataset.length, 20, 3), np.float32)


def test_real_motions_score_best_and_collapse_is_seen(setting):
    dataset, evaluator = setting
    scores = evaluate({"copies": real(dataset), "still": still(dataset)}, dataset, evaluator, SETTINGS)
    table = {row.name: row.summary() for row in scores}
    assert list(table) == ["Real motions", "copies", "still"]
    assert table["still"]["fid"][0] > 5 * table["copies"]["fid"][0]
    assert table["copies"]["fid"][0] < 5 * table["Real motions"]["fid"][0] + 1e-3
    assert table["still"]["diversity"][0] == pytest.approx(0, abs=1e-6)
    assert table["copies"]["diversity"][0] > 0


def test_the_seed_reproduces_the_table_and_uniform_labels_are_uniform(setting):
    dataset, evaluator = setting
    seen = []

    def record(labels, lengths, generator):
        seen.append(labels)
        assert lengths.shape == (60, 20)
        return np.zeros((60, dataset.length, 20, 3), np.float32)

    lopsided = dataset.subset([0, 2, 4, 6, 8, 10, 1])
    for labels in ("data", "uniform"):
        evaluate({"x": record}, lopsided, evaluator, EvaluationSettings(clips=60, repeats=2, state="zeros", labels=labels))
    share = [np.mean(np.concatenate(part) == 1) for part in (seen[:2], seen[2:])]
    assert share[0] < 0.3 < share[1]
    first, second = (evaluate({"copies": real(dataset)}, dataset, evaluator, SETTINGS) for _ in range(2))
    assert [row.values for row in first] == [row.values for row in second]


def test_tables_and_reports_say_what_was_measured(setting):
    dataset, evaluator = setting
    scores = evaluate({}, dataset, evaluator, SETTINGS)
    assert "| Real motions |" in markdown_table(scores)
    content = json.loads(json.dumps(report(scores, dataset, evaluator, SETTINGS)))
    assert content["dataset"]["sha256"] == dataset.digest
    assert content["protocol"]["seed"] == 0
    assert len(content["scores"]["Real motions"]["fid"]) == 3


def test_a_classifier_of_other_actions_is_refused(setting):
    dataset, _ = setting
    with pytest.raises(InputError, match="knows 3 actions"):
        evaluate({}, dataset, Evaluator(ActionClassifier(60, 3), "other", "0"), SETTINGS)
    with pytest.raises(InputError, match="clips=5"):
        EvaluationSettings(clips=5)
