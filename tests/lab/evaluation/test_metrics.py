"""Metrics against closed forms, and the authors' classifiers on the real clips."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg

from a2v.errors import InputError
from a2v.lab.datasets import ClipSampler, load_dataset
from a2v.lab.evaluation.classifier import load_evaluator
from a2v.lab.evaluation.metrics import (
    accuracy,
    confidence_interval,
    diversity,
    fid,
    frechet_distance,
    multimodality,
)


def test_fid_of_equal_sets_is_zero_and_of_a_shift_its_square():
    x = np.random.default_rng(0).normal(size=(500, 30))
    assert fid(x, x) == pytest.approx(0, abs=1e-8)
    assert fid(x, x + 0.5) == pytest.approx(30 * 0.25, rel=1e-9)


def test_frechet_distance_agrees_with_the_matrix_square_root():
    rng = np.random.default_rng(1)
    a, b = (
        np.cov(rng.normal(size=(200, 8)) @ rng.normal(size=(8, 8)), rowvar=False) for _ in range(2)
    )
    m, n = rng.normal(size=(2, 8))
    expected = ((m - n) ** 2).sum() + np.trace(a + b - 2 * linalg.sqrtm(a @ b).real)
    assert frechet_distance((m, a), (n, b)) == pytest.approx(expected, rel=1e-8)


def test_frechet_distance_of_singular_covariances_is_finite():
    flat = np.zeros((30, 30))
    flat[0, 0] = 4
    assert frechet_distance(
        (np.zeros(30), flat), (np.zeros(30), np.zeros((30, 30)))
    ) == pytest.approx(4)


def test_diversity_and_multimodality():
    rng = np.random.default_rng(0)
    labels = np.repeat([0, 1], 1000)
    features = np.zeros((2000, 30))
    features[labels == 1, 0] = 8
    assert multimodality(features, labels, rng) == pytest.approx(0)
    assert diversity(features, rng, pairs=20_000) == pytest.approx(4, rel=0.05)
    spread = rng.normal(size=(2000, 30))
    assert multimodality(spread, labels, rng, pairs=5000) == pytest.approx(np.sqrt(60), rel=0.02)


def test_accuracy_and_interval():
    assert accuracy(np.array([0, 1, 2, 2]), np.array([0, 1, 1, 2])) == 0.75
    mean, half = confidence_interval(np.array([1.0, 3.0]))
    assert (mean, half) == (2.0, pytest.approx(1.96 / np.sqrt(2)))


@pytest.mark.parametrize(
    ("name", "file", "expected"),
    [
        ("humanact12", "humanact12", (0.092, 0.997)),
        ("humanact12-fine", "humanact12_fineG", (0.133, 0.991)),
        ("cmu", "mocap_new", (0.064, 0.936)),
    ],
)
def test_authors_classifiers_reproduce_the_real_rows(data_dir, name, file, expected):
    dataset = load_dataset(name, data_dir)
    evaluator = load_evaluator(data_dir / "evaluators" / f"action_recognition_model_{file}.tar")
    rng = np.random.default_rng(0)
    sampler, signs = (
        ClipSampler(dataset, dataset.length),
        np.asarray(dataset.frame.signs, dtype=np.float32),
    )
    results = []
    for _ in range(2):
        # FID of two draws of N clips falls as 1/N; the papers' three rows are those of 2,000 clips
        # (docs/research/evaluation.md)
        motions, labels, _ = sampler.batch(2000, rng)
        results.append((*evaluator(motions * signs, state="random", generator=rng), labels))
    (a, predicted, labels), (b, _, _) = results
    assert fid(a, b) == pytest.approx(expected[0], abs=0.05)
    assert accuracy(predicted, labels) == pytest.approx(expected[1], abs=0.01)
    zeros, _ = evaluator((motions * signs)[:64])
    again, _ = evaluator((motions * signs)[:64])
    assert np.array_equal(zeros, again)


def test_foreign_classifier_files_are_refused(tmp_path):
    (tmp_path / "x.tar").write_bytes(b"\x80\x04cos\nsystem\n(S'true'\ntR.")
    with pytest.raises(InputError, match="no action classifier"):
        load_evaluator(tmp_path / "x.tar")
    with pytest.raises(InputError, match="does not exist"):
        load_evaluator(tmp_path / "y.tar")
