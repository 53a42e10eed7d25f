"""Free text to actions: prompts written before the matcher, and how a prompt is split."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from a2v.errors import InputError
from a2v.motion import MotionModel
from a2v.motion.lexicon import SYNONYMS, canonical_words
from a2v.motion.prompts import Step, explain, parse_prompt
from a2v.motion.splitting import take_duration
from a2v.motion.vocabulary import Vocabulary

PROMPTS = list(csv.DictReader((Path(__file__).parent / "prompts.csv").open(encoding="utf-8")))


@pytest.fixture(scope="module")
def vocabulary() -> Vocabulary:
    return Vocabulary.of(MotionModel.load("cmu-fine").card)


def test_most_prompts_give_what_a_person_would_pick(vocabulary: Vocabulary) -> None:
    wrong, novel = [], 0
    for row in PROMPTS:
        words = canonical_words(row["prompt"])
        novel += len(set(words) & set(vocabulary.weights)) < len(set(words))
        try:
            action = parse_prompt(row["prompt"], vocabulary)[0][-1].action
        except InputError:
            action = "refused"
        if action not in row["accepted"].split(";"):
            wrong.append((row["prompt"], action))
    assert len(PROMPTS) >= 100
    assert novel >= 30
    assert len(wrong) <= 0.05 * len(PROMPTS), wrong


def test_the_prompts_name_actions_that_exist(vocabulary: Vocabulary) -> None:
    assert {action for row in PROMPTS for action in row["accepted"].split(";")} <= set(
        vocabulary.actions
    )


def test_a_prompt_of_three_parts(vocabulary: Vocabulary) -> None:
    steps, matches = parse_prompt(
        "walk slowly, then salsa for 2 s, then jump for 24 frames", vocabulary
    )
    assert steps == [
        Step(action="Walk slowly"),
        Step(action="Salsa", seconds=2.0),
        Step(action="Jump", frames=24),
    ]
    assert [match.score for match in matches[1:]] == [1.0, 1.0]
    assert explain(matches)[1].startswith("'salsa' is taken for Salsa")


@pytest.mark.parametrize(
    ("text", "seconds", "frames", "rest"),
    [
        ("salsa for 2 s", 2.0, None, "salsa"),
        ("salsa for two seconds", 2.0, None, "salsa"),
        ("for half a second jump", 0.5, None, "jump"),
        ("run 1.5 minutes", 90.0, None, "run"),
        ("jump for 30 frames", None, 30, "jump"),
        ("jump", None, None, "jump"),
    ],
)
def test_durations(text: str, seconds: float | None, frames: int | None, rest: str) -> None:
    assert take_duration(text) == (seconds, frames, rest)


def test_tempo_that_no_action_has_is_kept(vocabulary: Vocabulary) -> None:
    steps, _ = parse_prompt("salsa slowly; salsa fast", vocabulary)
    assert [step.action for step in steps] == ["Salsa", "Salsa"]
    assert steps[0].speed < 1 < steps[1].speed


def test_what_nobody_knows_is_refused_with_the_nearest(vocabulary: Vocabulary) -> None:
    with pytest.raises(InputError, match=r"nearest are .*[Jj]ump.*,"):
        parse_prompt("jumble", vocabulary)
    for strange in ("сидеть", "asdfgh"):
        with pytest.raises(InputError, match="describe it in English words"):
            parse_prompt(strange, vocabulary)
    with pytest.raises(InputError, match="empty part"):
        parse_prompt("walk,,jump", vocabulary)
    with pytest.raises(InputError, match="empty part"):
        parse_prompt("  ", vocabulary)


def test_misspelt_words(vocabulary: Vocabulary) -> None:
    assert parse_prompt("hopscoch", vocabulary)[0][0].action == "Hopscotch"


def test_the_table_of_synonyms_has_each_phrase_once() -> None:
    phrases = [row["words"] for row in csv.DictReader(SYNONYMS.open(encoding="utf-8"))]
    assert len(phrases) == len(set(phrases))


def test_steps_are_checked() -> None:
    with pytest.raises(InputError, match="both seconds"):
        Step(action="Walk", seconds=1.0, frames=3)
    with pytest.raises(InputError, match="lasts 0 frames"):
        Step(action="Walk", frames=0)
    with pytest.raises(InputError, match="speed"):
        Step(action="Walk", speed=100)
