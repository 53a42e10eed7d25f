"""How each action of a vocabulary is recognized, and how closely a model repeats its clips."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from a2v.errors import InputError
from a2v.kinematics import CMU
from a2v.kinematics.ground import yaw_to_rotmat
from a2v.lab.evaluation.classifier import ActionClassifier, Evaluator
from a2v.lab.evaluation.sources import recorded
from a2v.lab.evaluation.vocabulary import repetition, score_actions, vocabulary_table
from tests.support.motions import mirrored, waving


def test_a_copy_is_found_wherever_it_stands_and_faces():
    clips = waving(clips=4).joints
    window = clips[0][4:24]
    moved = window @ yaw_to_rotmat(np.float64(2.1)).T.astype(np.float32) + np.float32([3, 1, -7])
    nearest, takes = repetition(moved[None], clips, CMU)
    assert nearest == pytest.approx(0, abs=2e-3)
    assert takes is not None
    assert takes > 10 * max(nearest, 1e-6)


def test_the_distance_is_the_root_mean_square_over_joints():
    clip = waving(clips=1).joints[0][:20]
    raised = clip.copy()
    raised[4:] += np.float32([0, 0.25, 0])  # all but the first of the five poses that are compared
    nearest, takes = repetition(raised[None], [clip], CMU)
    assert nearest == pytest.approx(0.25 * np.sqrt(4 / 5), rel=1e-3)
    assert takes is None  # a single clip has no other take


def test_every_action_has_its_row():
    dataset = mirrored()
    torch.manual_seed(0)
    evaluator = Evaluator(ActionClassifier(60, 2), "untrained", "0")
    rows = score_actions(recorded(dataset), dataset, evaluator, clips=6)
    assert [(row.action, row.clips) for row in rows] == [("slow", 10), ("fast", 10)]
    assert all(row.nearest < row.takes for row in rows)  # recorded windows lie among the recorded
    assert sum(row.accuracy for row in rows) == pytest.approx(
        1
    )  # untrained: it sees one action everywhere
    assert rows == score_actions(recorded(dataset), dataset, evaluator, clips=6)
    table = vocabulary_table(rows)
    assert "| slow | 10 |" in table
    assert "Of the 2 actions with 5 clips or more, 1 " in table
    with pytest.raises(InputError, match="0 clips"):
        score_actions(recorded(dataset), dataset, evaluator, clips=0)
