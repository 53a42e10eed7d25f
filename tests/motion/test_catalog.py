"""Words to actions of every source, measured on prompts written before the matcher."""

from __future__ import annotations

import csv
import time

import pytest

from a2v.errors import InputError
from a2v.motion.catalog import RESEARCH, SOURCES, catalog, understand, weaknesses
from a2v.motion.lexicon import mended
from a2v.motion.plan import plan_motion
from a2v.motion.vocabulary import other_names
from benchmarks.words import MEANT, TESTS, count, read_rows, today, untold

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


def test_what_is_meant_is_understood_and_every_wish_is_kept_or_said() -> None:
    resolve, actions = today(strict=False)
    rows = [row for name in MEANT for row in read_rows(name)]
    counts, bad = count(rows, resolve, actions)
    assert len(rows) == 290
    assert counts["wrong"] <= 0.02 * len(rows), bad
    assert counts["served"] >= 0.93 * counts["servable"], bad
    raw = []
    for name in MEANT:
        with (TESTS / name).open(newline="", encoding="utf-8") as stream:
            raw += list(csv.DictReader(stream))
    assert sum(bool(row["wishes"]) for row in raw) > 130
    lost = [row["prompt"] for row in raw if untold(row["prompt"], row["wishes"])]
    assert len(lost) <= 3, lost


def test_there_are_many_actions_and_those_that_are_tried_first() -> None:
    resolve, actions = today()
    assert len(actions) >= 330
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
    assert actions_of("drink") == ["Drink"]
    with pytest.raises(InputError, match="none of the actions"):
        understand("turn the steering wheel", license="free")
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
    "text", ["don't walk", "no dancing", "play the tuba", "asdfgh", "walk" * 1000]
)
def test_what_cannot_be_served_is_refused(text: str) -> None:
    with pytest.raises(InputError):
        understand(text)


def told_of(text: str) -> list[tuple[str, bool]]:
    return [(told.name, told.kept) for match in understand(text).matches for told in match.told]


def test_wishes_are_kept_or_said() -> None:
    (step,) = understand("wave three times with the left hand").steps
    assert (step.wishes.count, step.wishes.side) == (3, "left")
    assert understand("walk ten feet").steps[0].wishes.distance == pytest.approx(3.048)
    assert understand("turn 90 degrees to the right").steps[0].wishes.angle == 90
    assert understand("walk without moving the arms").steps[0].wishes.still == ("arms",)
    assert told_of("salute for 5 meters") == [("distance", False)]
    sure, unsure = understand("walk 5 meters"), understand("salute for 5 meters")
    assert unsure.steps[0].wishes.distance is None
    assert unsure.matches[0].score < sure.matches[0].score
    with pytest.raises(InputError, match="count is 999; expected 1 to 50"):
        understand("jump 999 times")


def test_two_actions_at_once_are_layers() -> None:
    for text in ("walk while waving", "wave while walking", "upper body wave, lower body walk"):
        (step,) = understand(text).steps
        assert (step.action, step.wishes.over, step.wishes.over_source) == ("Walk", "Wave", "clips")
    assert understand("run with hands up").steps[0].wishes.over == "Hands up"
    assert understand("sit and talk").steps[0].action == "Sit and talk"


def test_a_part_that_is_unknown_is_named_and_the_rest_is_made() -> None:
    found = understand("walk, then flibber the glorp, then clap")
    assert [step.action for step in found.steps] == ["Walk", "Clap"]
    assert ("part", False) in told_of("walk, then flibber the glorp, then clap")
    with pytest.raises(InputError, match="flibber"):
        understand("walk, then flibber the glorp, then clap", strict=True)


def test_sources_for_research_are_the_last_choice() -> None:
    for text in ("run, then sit", "walk, then drink"):
        assert not set(understand(text).sources) & set(RESEARCH)
    plan = plan_motion("lift dumbbell overhead")
    assert "research only" in plan.lines()[0]


@pytest.mark.parametrize(
    ("text", "action"),
    [("bailar", "Dance"), ("tanzen", "Dance"), ("走路", "Walk"), ("ходить", "Walk")],
)
def test_words_of_other_languages_are_translated(text: str, action: str) -> None:
    assert actions_of(text) == [action]
    assert told_of(text)[0] == ("language", True)


def test_an_unknown_language_is_said_to_be_one() -> None:
    with pytest.raises(InputError, match="language is unknown; known: English, German"):
        understand("kävellä")


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
