"""The protocol on generators of known quality."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
import torch

from a2v.errors import InputError
from a2v.kinematics.ground import face_forward, first_heading
from a2v.lab.datasets import NativeFrame
from a2v.lab.evaluation.classifier import ActionClassifier, Evaluator
from a2v.lab.evaluation.protocol import (
    ActionRows,
    EvaluationSettings,
    evaluate,
    evaluate_actions,
    report,
)
from a2v.lab.evaluation.scores import (
    METRICS,
    Scores,
    action_table,
    actor_table,
    markdown_table,
    physics_table,
    scores_as_dict,
    scores_from_dict,
)
from a2v.lab.evaluation.sources import generator_of_families, recorded
from a2v.motion import MotionModel
from pipelines.lab.actor_table import make_actor_table
from pipelines.lab.evaluated import Evaluated
from tests.support.motions import mirrored

SETTINGS = EvaluationSettings(clips=60, repeats=3, state="zeros")


@pytest.fixture(scope="module")
def setting():
    dataset = mirrored()
    torch.manual_seed(0)
    return dataset, Evaluator(ActionClassifier(60, 2), "untrained", "0")


def still(dataset):
    return lambda labels, lengths, generator: np.zeros(
        (len(labels), dataset.length, 20, 3), np.float32
    )


def test_real_motions_score_best_and_collapse_is_seen(setting):
    dataset, evaluator = setting
    scores = evaluate(
        {"copies": recorded(dataset), "still": still(dataset)}, dataset, evaluator, SETTINGS
    )
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
        evaluate(
            {"x": record},
            lopsided,
            evaluator,
            EvaluationSettings(clips=60, repeats=2, state="zeros", labels=labels),
        )
    share = [np.mean(np.concatenate(part) == 1) for part in (seen[:2], seen[2:])]
    assert share[0] < 0.3 < share[1]
    first, second = (
        evaluate({"copies": recorded(dataset)}, dataset, evaluator, SETTINGS) for _ in range(2)
    )
    assert [row.values for row in first] == [row.values for row in second]


def test_actors_protocol_takes_every_recording_once(setting):
    dataset, evaluator = setting
    lopsided = dataset.subset([*range(0, 20, 2), 1, 3])
    seen = []

    def record(labels, lengths, generator):
        seen.append(labels.tolist())
        return recorded(lopsided)(labels, lengths, generator)

    settings = EvaluationSettings(clips=60, repeats=2, state="zeros", labels="each")
    rows = evaluate({"x": record}, lopsided, evaluator, settings)
    assert [row.name for row in rows] == ["Real motions", "x"]
    assert [sorted(labels) for labels in seen] == [sorted(lopsided.labels.tolist())] * 2
    assert seen[0] != seen[1]  # another order in each repeat
    assert min(rows[0].values["fid"]) > 0  # other windows than those of the reference
    seen.clear()
    part = dataclasses.replace(settings, clips=40)
    evaluate({"x": record}, dataset.subset([*range(20)] * 3), evaluator, part)
    assert [len(labels) for labels in seen] == [40, 40]


def test_actors_table_has_no_row_of_another_protocol(setting, tmp_path):
    dataset, evaluator = setting
    whole = dataclasses.replace(dataset.subset([*range(20)] * 3), name="humanact12")
    settings = EvaluationSettings(repeats=1, state="zeros")
    opened = {"still": Evaluated(still(dataset), "0", "")}
    answer = make_actor_table(tmp_path / "t.md", settings, whole, evaluator, opened)
    page = (tmp_path / "t.md").read_text(encoding="utf-8")
    assert "60 of 60 recordings" in page
    assert "| MDM | 0.100 | 0.990 |" in page
    assert "glmi" not in page
    numbers = answer.facts["numbers"]
    assert list(numbers["scores"]) == ["Real motions", "still"]
    assert (numbers["protocol"]["labels"], numbers["protocol"]["clips"]) == ("each", 60)


def test_the_interval_of_actors_code_is_of_the_variance():
    values = dict.fromkeys(METRICS, (0.1, 0.3))
    cell = actor_table([Scores("x", values)]).splitlines()[-1].split(" | ")[1]
    assert cell == "0.200 ± 0.139 (0.0196)"  # 1.96 · 0.1 / √2, and 1.96 · 0.01


def test_a_row_does_not_depend_on_the_others_and_known_rows_are_kept(setting):
    dataset, evaluator = setting
    models = {"copies": recorded(dataset), "still": still(dataset)}
    both = evaluate(models, dataset, evaluator, SETTINGS)
    shown = []
    alone = evaluate({"still": models["still"]}, dataset, evaluator, SETTINGS, on_row=shown.append)
    assert [row.values for row in alone] == [both[0].values, both[2].values]
    assert shown == alone

    def never(labels, lengths, generator):
        raise AssertionError("it is known")

    known = scores_from_dict(json.loads(json.dumps(scores_as_dict(alone))))
    assert list(known.values()) == alone
    again = evaluate(
        {"copies": models["copies"], "still": never},
        dataset,
        evaluator,
        SETTINGS,
        known=known,
        on_row=shown.append,
    )
    assert [row.name for row in shown[2:]] == ["copies"]
    assert again == both
    tables = evaluate_actions(
        {"still": never}, dataset, evaluator, ["slow"], SETTINGS, rows=ActionRows({"slow": known})
    )
    assert tables["slow"] == alone
    kept = []
    tables = evaluate_actions(
        models,
        dataset,
        evaluator,
        ["slow"],
        SETTINGS,
        rows=ActionRows({"slow": known}, lambda *row: kept.append(row)),
    )
    assert kept == [("slow", row) for row in tables["slow"] if row.name == "copies"]


def test_tables_and_reports_say_what_was_measured(setting):
    dataset, evaluator = setting
    scores = evaluate({}, dataset, evaluator, SETTINGS)
    assert "| Real motions |" in markdown_table(scores)
    content = json.loads(json.dumps(report(scores, dataset, evaluator, SETTINGS)))
    assert content["dataset"]["sha256"] == dataset.sha256
    assert content["protocol"]["seed"] == 0
    assert len(content["scores"]["Real motions"]["fid"]) == 3


def test_recordings_of_the_wanted_actions_are_drawn(setting):
    dataset, _ = setting
    labels = np.array([1, 0, 1, 1])
    motions = recorded(dataset)(labels, dataset.clip_bone_lengths[:4], np.random.default_rng(0))
    starts = {
        label: [
            j[s : s + 20] - j[s, 0]
            for j in np.array(dataset.joints)[dataset.labels == label]
            for s in range(11)
        ]
        for label in (0, 1)
    }
    for label, motion in zip(labels, motions, strict=True):
        assert min(np.abs(motion - start).max() for start in starts[label]) < 1e-5
    with pytest.raises(InputError, match="no clip of 'fast'"):
        recorded(dataset.subset([0, 2]))(
            labels, dataset.clip_bone_lengths[:4], np.random.default_rng(0)
        )


def test_single_actions_are_compared_with_themselves_alone(setting):
    dataset, evaluator = setting
    seen = []

    def record(labels, lengths, generator):
        seen.append(set(labels.tolist()))
        return recorded(dataset)(labels, lengths, generator)

    for labels in ("data", "uniform"):
        tables = evaluate_actions(
            {"x": record},
            dataset,
            evaluator,
            ["fast", "slow"],
            EvaluationSettings(clips=60, repeats=1, labels=labels),
        )
    assert list(tables) == ["fast", "slow"]
    assert seen == [{1}, {0}, {1}, {0}]
    other = {
        "other arm": lambda labels, lengths, generator: recorded(dataset)(
            1 - labels, lengths, generator
        )
    }
    wrong = evaluate_actions(other, dataset, evaluator, ["slow"], SETTINGS)["slow"]
    assert min(wrong[1].values["fid"]) > 3 * max(wrong[0].values["fid"])
    table = action_table(tables)
    assert (
        table.count("\n") == 4
    )  # two lines of head, real motions, real ones drawn alike, x; no line ends the table
    assert "fast FID↓ | fast Accuracy↑ | fast Diversity→ | slow FID↓" in table
    assert "±" not in table  # one repeat has no interval
    with pytest.raises(InputError, match=r"no action 'fly'; it has slow, fast"):
        evaluate_actions({}, dataset, evaluator, ["fly"])


def test_physics_are_in_meters_and_beside_real_data(setting):
    dataset, evaluator = setting
    half = dataclasses.replace(
        dataset, frame=NativeFrame(meters_per_unit=0.5, signs=(1.0, -1.0, -1.0))
    )
    whole, scaled = (evaluate({"still": still(d)}, d, evaluator, SETTINGS) for d in (dataset, half))
    assert whole[0].physics.jitter > 0 == whole[1].physics.jitter
    assert scaled[0].physics.jitter == pytest.approx(0.5 * whole[0].physics.jitter, rel=1e-3)
    assert "| Real motions |" in physics_table(whole)
    assert report(whole, dataset, evaluator, SETTINGS)["scores"]["still"]["physics"]["jitter"] == 0
    off = evaluate({}, dataset, evaluator, dataclasses.replace(SETTINGS, physics_clips=0))
    assert physics_table(off) == ""


def test_a_classifier_of_other_actions_is_refused(setting):
    dataset, _ = setting
    with pytest.raises(InputError, match="was trained for 3 actions"):
        evaluate({}, dataset, Evaluator(ActionClassifier(60, 3), "other", "0"), SETTINGS)
    other = Evaluator(ActionClassifier(60, 2), "other", "0", {"actions": ["slow", "faster"]})
    with pytest.raises(InputError, match="was trained for other actions"):
        evaluate({}, dataset, other, SETTINGS)
    with pytest.raises(InputError, match="clips=5"):
        EvaluationSettings(clips=5)


def test_families_are_asked_for_like_random_clips_of_theirs():
    whole = mirrored(clips=8)
    lengths = (20, 5, 8, 9, 10, 11, 12, 13)
    away = np.linspace(-3, 3, 8)
    turned = [
        face_forward(joints[None, :length], np.array([[np.cos(a), -np.sin(a)]]))[0]
        for joints, length, a in zip(whole.joints, lengths, away, strict=True)
    ]
    fine = dataclasses.replace(
        whole,
        actions=("stroll", "march", "hop"),
        labels=np.array([0, 0, 0, 1, 0, 0, 2, 0]),
        joints=tuple(x.astype(np.float32) for x in turned),
        length=20,
    )
    coarse = dataclasses.replace(
        whole, actions=("jump", "walk"), labels=np.array([1, 1, 1, 1, 1, 1, 0, 1])
    )
    asked = []

    class Noted:
        def generate_like_data(self, labels, lengths, frames, generator, *, active, headings):
            asked.append((labels, active, headings))
            return np.zeros((len(labels), frames, 20, 3), np.float32)

        def to_native(self, joints):
            return joints

    generate = generator_of_families(Noted(), fine, coarse, 20)
    made = generate(np.array([0, 1] * 300), np.zeros((600, 20)), np.random.default_rng(0))
    assert made.shape == (600, 20, 20, 3)
    labels, active, headings = (np.concatenate(part) for part in zip(*asked, strict=True))
    assert set(labels[::2]) == {2}  # the family "jump" has one action
    assert np.mean(labels[1::2] == 1) == pytest.approx(
        1 / 7, abs=0.05
    )  # "march" has one of the seven clips of "walk"
    known = {
        (int(label), length / 20): joints
        for label, length, joints in zip(fine.labels, lengths, fine.joints, strict=True)
    }
    for label, share, heading in zip(
        labels.tolist(), active.tolist(), headings.tolist(), strict=True
    ):
        ahead = first_heading(known[label, share][None], fine.skeleton)[
            0
        ]  # of the clip that is as long
        assert np.cos(heading) == pytest.approx(ahead[0], abs=1e-5)
        assert np.sin(heading) == pytest.approx(ahead[1], abs=1e-5)
    with pytest.raises(InputError, match="no clips of 'fly'"):
        generator_of_families(
            Noted(), fine, dataclasses.replace(coarse, actions=("jump", "walk", "fly")), 20
        )


def test_a_model_faces_and_lasts_as_it_is_told():
    model = MotionModel.load("cmu-fine")
    labels = np.full(6, model.label("Walk"))
    headings = np.array([0, 1, 2, 3, -1, -2.0])
    active = np.full(6, 0.3)
    made = model.generate_like_data(
        labels,
        np.tile(model.bone_lengths, (6, 1)),
        100,
        np.random.default_rng(0),
        active=active,
        headings=headings,
    )
    ahead = first_heading(made, model.skeleton)
    away = np.angle(np.exp(1j * (np.arctan2(ahead[:, 1], ahead[:, 0]) - headings)))
    assert np.abs(away).max() < 0.15
    steps = np.linalg.norm(np.diff(made, axis=1), axis=-1).mean((0, 2))
    assert steps[40:].max() < 0.2 * steps[:28].mean()  # the last pose is held
