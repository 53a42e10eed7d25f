"""The effect of a rule: over the photos on which it acts, held against the seeds."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.lab.evaluation.moved.measures import MovedSettings
from a2v.lab.evaluation.moved.rules import Bench, Trial, effect_of, noise_of, rules_table
from a2v.reconstruction import ColorSettings
from a2v.reconstruction.canonical import Sight
from a2v.reconstruction.colorings import color_person
from a2v.samples import load_ready_person
from a2v.types import Reconstruction

SEEDS = range(4)
PLAIN = {"a": 1.0, "b": 3.0}


def scores(other: float) -> dict[str, float]:
    return {"other": other, "head": 9.0, "psnr": 20.0, "ssim": 0.5}


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
    assert cells[-2] == "better"
    assert [cell.strip() for cell in lines[3].split("|")][3] == "0"


def test_a_trial_colors_as_the_product_does() -> None:
    """With all rules the colors are the product's; without one they are those of its setting."""
    ready = load_ready_person()
    person = Reconstruction(surface=ready.colored_surface, backend="pifu")
    sight = Sight(ready.subject, ready.body, ready.photo_camera, person)
    settings = ColorSettings(texture=256, delight=False, tolerance=0.1)
    bench = Bench("sample", sight, person, None, settings, MovedSettings())
    found = {trial.rule: trial for trial in bench.trials(["comb", "even", "smooth_borders"], 1)}
    assert found["comb"].changed == 0.0  # he has short hair
    assert found["even"].changed > 0.02
    assert 0 < found["smooth_borders"].changed < 1e-3  # in the texture only
    for rule in ("", "even"):
        own = dataclasses.replace(settings, without=rule)
        product = color_person(person, [sight], settings=own)
        made = bench._finished(*bench._without(rule), 0) if rule else bench._plain[0]
        assert made.texture is not None
        assert product.texture is not None
        assert np.array_equal(made.colors, product.colors), rule
        assert np.array_equal(made.texture, product.texture), rule
