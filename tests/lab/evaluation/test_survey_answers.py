"""Answers to user studies: checked, and counted by hand."""

from __future__ import annotations

import json
import math
import re

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.lab.evaluation.survey import REAL
from a2v.lab.evaluation.survey_answers import (
    MAX_ANSWER_BYTES,
    analyze,
    read_answers,
    read_key,
    survey_table,
    wilson_interval,
)

HAND_KEY = {
    "format": "a2v-survey-key/1",
    "survey": "s",
    "title": "t",
    "clips": {
        name: {"source": source}
        for name, source in {
            "a1": "A",
            "b1": "B",
            "r1": REAL,
            "a2": "A",
            "b2": "B",
            "r2": REAL,
            "x": "A",
            "y": REAL,
        }.items()
    },
    "questions": [
        {"id": "q1", "kind": "preference", "action": "walk", "clips": ["a1", "b1", "r1"]},
        {"id": "q2", "kind": "preference", "action": "jump", "clips": ["r2", "a2", "b2"]},
        {"id": "q3", "kind": "real", "action": "walk", "clips": ["x"]},
        {"id": "q4", "kind": "real", "action": "walk", "clips": ["y"]},
    ],
}


def answers(name="p1", **given):
    values = {"q1": ["r1", "a1", "b1"], "q2": ["a2", "r2", "b2"], "q3": True, "q4": True} | given
    listed = [
        {"question": q, **({"real": v} if isinstance(v, bool) else {"ranking": v})}
        for q, v in values.items()
        if v is not None
    ]
    return {"format": "a2v-survey-answers/1", "survey": "s", "participant": name, "answers": listed}


def write(path, content):
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("successes", "total", "low", "high"),
    [
        (8, 10, 0.490162, 0.943318),
        (0, 10, 0.0, 0.277533),
        (10, 10, 0.722467, 1.0),
        (50, 100, 0.403832, 0.596168),
        (1, 1, 0.206549, 1.0),
    ],
)
def test_wilson_intervals_of_tables(successes, total, low, high):
    assert wilson_interval(successes, total) == pytest.approx((low, high), abs=2e-6)


def test_wilson_intervals_cover():
    """The true share lies in about 95 % of the intervals."""
    rng = np.random.default_rng(0)
    for share in (0.1, 0.5, 0.8):
        hits = [
            low <= share <= high
            for low, high in (wilson_interval(int(k), 40) for k in rng.binomial(40, share, 2000))
        ]
        assert 0.93 < np.mean(hits) < 0.98
    with pytest.raises(InputError, match="not a share"):
        wilson_interval(3, 2)


def test_percentages_counted_by_hand():
    people = [
        answers("p1"),
        answers("p2", q1=["a1", "r1", "b1"], q3=False, q4=None),
        answers("p3", q2=None, q3=True, q4=False),
    ]
    result = analyze(HAND_KEY, people)
    # five rankings: R A B, A R B, A R B, A R B, R A B
    assert result.participants == 3
    assert result.ranks == {"A": (3, 2, 0), "B": (0, 0, 5), REAL: (2, 3, 0)}
    over = {pair: (share.count, share.total) for pair, share in result.over.items()}
    assert over["A", REAL] == (3, 5)
    assert over[REAL, "A"] == (2, 5)
    assert over["A", "B"] == over[REAL, "B"] == (5, 5)
    assert over["B", "A"] == (0, 5)
    # walk (q1): R A B, A R B, R A B; jump (q2): A R B, A R B
    walk, jump = (result.by_action[action]["A", REAL] for action in ("walk", "jump"))
    assert (walk.count, walk.total, jump.count, jump.total) == (1, 3, 2, 2)
    # q3 (A): real, fake, real; q4 (real): real, not asked, fake
    assert (result.judged_real["A"].count, result.judged_real["A"].total) == (2, 3)
    assert (result.judged_real[REAL].count, result.judged_real[REAL].total) == (1, 2)
    assert (result.correct.count, result.correct.total) == (2, 5)
    table = survey_table(result)
    assert "| A over real | 60.0 % [23.1, 88.2] |" in table
    assert "| action | A over B | A over real | B over real |" in table
    assert "| walk | 100.0 % [43.9, 100.0] | 33.3 % [6.1, 79.2] | 0.0 % [0.0, 56.1] |" in table
    assert "| A | 66.7 % [20.8, 93.9] | 3 |" in table
    assert "40.0 % [11.8, 76.9] of 5" in table
    written = json.loads(json.dumps(result.as_dict()))
    assert written["over"]["A over real"]["share"] == 0.6
    assert written["by_action"]["jump"]["real over A"]["share"] == 0
    assert math.isclose(
        sum(
            share.value for pair, share in result.over.items() if pair in {("A", REAL), (REAL, "A")}
        ),
        1,
    )


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("no json", "is not JSON"),
        ("[" * 100_000, "cannot be read as JSON"),
        ("[1]", "no JSON object"),
        ({"format": "other"}, "holds no answers"),
        (answers() | {"survey": "else"}, "answers the survey else"),
        (answers() | {"participant": 3}, "a participant"),
        (answers() | {"answers": {}}, "list of answers"),
        (answers() | {"answers": [{"question": "q9"}]}, "unknown question 'q9'"),
        (answers() | {"answers": [{"question": ["q1"]}]}, "unknown question"),
        (answers() | {"answers": [3]}, "unknown question"),
        (answers(q3="yes"), "q3 needs real"),
        (answers(q1=["r1", "a1"]), "each of its 3 clips once"),
        (answers(q1=["r1", "a1", "a1"]), "each of its 3 clips once"),
        (answers(q1=["r1", "a1", "a2"]), "each of its 3 clips once"),
        (answers(q1=[1, 2, 3]), "each of its 3 clips once"),
        (answers(q1={"a1": 1}), "each of its 3 clips once"),
        (answers() | {"answers": [{"question": "q3", "real": True}] * 2}, "q3 is answered twice"),
        ("[" + " " * MAX_ANSWER_BYTES + "]", "larger than 1 MiB"),
    ],
)
def test_bad_answers_are_named(tmp_path, content, words):
    path = write(tmp_path / "answers.json", content)
    with pytest.raises(InputError, match=re.escape(words)) as error:
        read_answers(path, HAND_KEY)
    assert str(path) in str(error.value)


def test_bad_keys_and_doubles_are_named(tmp_path):
    for content in (
        {},
        {"format": "a2v-survey-key/1", "survey": "s", "clips": {"a": {}}, "questions": []},
        HAND_KEY | {"clips": {}},
    ):
        with pytest.raises(InputError, match="not a key of a survey"):
            read_key(write(tmp_path / "key.json", content))
    with pytest.raises(InputError, match="does not exist"):
        read_key(tmp_path / "none.json")
    with pytest.raises(InputError, match="p1 has two files"):
        analyze(HAND_KEY, [answers(), answers()])
    with pytest.raises(InputError, match="no answers"):
        analyze(HAND_KEY, [])
