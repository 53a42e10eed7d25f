"""The effect of a rule: over the photos on which it acts, held against the seeds."""

from __future__ import annotations

import pytest

from a2v.lab.evaluation.moved.rules import Trial, effect_of, noise_of, rules_table

SEEDS = range(4)
PLAIN = {"a": 1.0, "b": 3.0}


def scores(other: float) -> dict[str, float]:
    return {"other": other, "psnr": 20.0, "ssim": 0.5}


def trials() -> list[Trial]:
    """Rule "good" acts on photo a alone and takes .5 % of other parts' color away; "idle" acts on
    none; "loud" changes as much up as down. Seeds differ by .1 %."""
    found = [
        Trial(photo, "", seed, scores(value + 0.1 * (seed % 2)))
        for photo, value in PLAIN.items()
        for seed in SEEDS
    ]
    for seed in SEEDS:
        plain = PLAIN["a"] + 0.1 * (seed % 2)
        found.append(Trial("a", "good", seed, scores(plain + 0.5), 0.2))
        found.append(Trial("a", "loud", seed, scores(plain + (-1) ** seed), 0.3))
    found += [Trial(photo, "idle", 0, scores(value), 0.0) for photo, value in PLAIN.items()]
    return [*found, Trial("b", "good", 0, scores(PLAIN["b"]), 0.0), Trial("c", "good", 0, {}, 0.4)]


def test_an_effect_is_that_on_the_photos_where_the_rule_acts() -> None:
    good = effect_of(trials(), "good", "other")
    assert good.mean == pytest.approx(-0.5)
    assert good.half == pytest.approx(0.0, abs=1e-9)
    assert good.clear
    loud = effect_of(trials(), "loud", "other")
    assert loud.mean == pytest.approx(0.0)
    assert loud.half == pytest.approx(3.18 * 1.1547 / 2, rel=0.01)
    assert not loud.clear
    assert not effect_of(trials(), "idle", "other").clear


def test_the_noise_is_that_between_seeds() -> None:
    assert noise_of(trials(), "other") == pytest.approx(3.18 * 0.0577 / 2, rel=0.01)
    assert noise_of(trials(), "psnr") == 0.0


def test_a_line_says_on_how_many_photos_a_rule_acts() -> None:
    lines = rules_table(trials(), {"good": "for good", "idle": "for nothing"}).splitlines()
    assert "acts on, of 3" in lines[0]
    cells = [cell.strip() for cell in lines[2].split("|")]
    assert cells[1:4] == ["good", "for good", "2"]
    assert cells[-2] == "yes"
    assert [cell.strip() for cell in lines[3].split("|")][3] == "0"
