"""Words to actions of every source, measured on prompts written before the matcher."""

from __future__ import annotations

import time

import pytest

from a2v.errors import InputError
from a2v.motion.catalog import RESEARCH, SOURCES, catalog, understand, weaknesses
from a2v.motion.lexicon import mended
from a2v.motion.plan import plan_motion
from a2v.motion.vocabulary import other_names
from benchmarks.words import count, read_rows, today

MOST_WRONG, LEAST_SERVED = 0.03, 0.92


def actions_of(text: str, **options: str) -> list[str]:
    return [step.action for step in understand(text, **options).steps]


@pytest.mark.parametrize(
    ("name", "least"),
    [("words.csv", 200), *((f"words_{name}.csv", 60) for name in ("everyday", "fresh", "blind"))],
)
def test_few_of_the_prompts_are_taken_wrongly_and_most_are_served(name: str, least: int) -> None:
    resolve, actions = today()
    rows = read_rows(name)
    counts, bad = count(rows, resolve, actions)
    assert len(rows) >= least
    assert counts["wrong"] <= MOST_WRONG * len(rows), bad
    assert counts["served"] >= LEAST_SERVED * counts["servable"], bad


def test_there_are_many_actions_and_those_that_are_tried_first() -> None:
    resolve, actions = today()
    assert len(actions) >= 220
    assert count(read_rows("first_fifty.csv"), resolve, actions)[0]["served"] >= 40


def test_every_action_is_found_by_its_own_name_and_has_a_theme() -> None:
    known = catalog()
    for entry in known.entries:
        assert actions_of(entry.name.replace(",", " ")) == [entry.name]
        assert entry.theme
        assert set(entry.sources) <= set(SOURCES)
    assert set(other_names()) <= {entry.name for entry in known.entries}


def test_free_licenses_leave_research_out() -> None:
    assert not any(
        set(entry.sources) & set(RESEARCH) and len(entry.sources) == 1
        for entry in catalog("free").entries
    )
    assert actions_of("drink") == ["drink"]
    with pytest.raises(InputError, match="none of the actions"):
        understand("lift dumbbell with both hands", license="free")
    with pytest.raises(InputError, match="license is 'gratis'"):
        understand("walk", license="gratis")


def test_steps_say_what_makes_them_and_stay_with_one_model_where_they_can() -> None:
    assert understand("walk").sources == ("cmu-fine",)
    assert understand("wash").sources == ("cmu",)
    assert understand("sneak, then walk").sources == ("cmu-fine",)
    assert understand("sneak, then bow, then salsa").sources == ("cmu-fine", "clips")


@pytest.mark.parametrize(
    ("text", "actions"),
    [
        ("don't run but walk", ["Walk"]),
        ("walk, not slowly", ["Walk"]),
        ("run without stopping", ["Run"]),
        ("do not move", ["Idle"]),
        ("sit down, then talk", ["Sit down", "Sit and talk"]),
        ("walk in and sit down", ["Walk", "Sit down"]),
        ("swiming", ["Swim"]),
    ],
)
def test_what_is_not_wanted_is_left_out(text: str, actions: list[str]) -> None:
    assert actions_of(text) == actions


@pytest.mark.parametrize(
    "text", ["don't walk", "no dancing", "play the guitar", "asdfgh", "walk" * 1000]
)
def test_what_cannot_be_served_is_refused(text: str) -> None:
    with pytest.raises(InputError):
        understand(text)


def test_tempo_that_is_not_wanted_is_none() -> None:
    assert understand("run but not fast").steps[0].speed == 1


def test_lengths_need_a_unit() -> None:
    assert understand("walk as fast as you can").steps[0].seconds is None
    assert understand("on all fours like a dog").steps[0].seconds is None
    assert understand("10 pushups").steps[0].seconds is None
    assert understand("dance for half a minute").steps[0].seconds == 30


def test_real_words_are_not_mended() -> None:
    known = catalog().vocabulary.weights
    assert mended("chair", known) == "chair"
    assert mended("wlak", known) == "walk"


@pytest.mark.parametrize(
    "text", ["x " * 50_000, "walk, " * 300, "a and " * 300 + "a", "zzzzz " * 330]
)
def test_long_prompts_are_bounded(text: str) -> None:
    begun = time.process_time()
    with pytest.raises(InputError):
        understand(text)
    assert time.process_time() - begun < 2


def test_actions_that_cannot_be_shown_well_say_so() -> None:
    known, weak = catalog(), weaknesses()
    assert set(weak) <= {entry.name for entry in known.entries}
    for name, note in weak.items():
        assert known.entry(name).note == (
            note if known.entry(name).sources[0] == "cmu-fine" else ""
        )
    (line,) = plan_motion("quail").lines()
    assert line.endswith(weak["Quail"])
    (line,) = plan_motion("walk").lines()
    assert line.endswith("]")
