"""Charts of heads, imitated photos of them, and the training of the network that completes them."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import torch

from a2v.body.head_chart import HEIGHT, WIDTH, head_cells
from a2v.lab.heads.charts import HAIR, NOTHING, SKIN, HeadCharts, chart_of
from a2v.lab.heads.imitated import TARGETS, HeadImitator
from a2v.lab.heads.networks import HeadCompleter
from a2v.lab.heads.training import HeadSettings, train_heads
from a2v.lab.studio.makehuman.dressing import dress
from a2v.lab.studio.makehuman.people import Wardrobes, draw_person
from a2v.reconstruction.coloring.completing import CHANNELS, OUTPUTS


@pytest.fixture(scope="module")
def charts(data_dir: Path) -> HeadCharts:
    """One person of MakeHuman's with short hair, and the same without it."""
    wardrobes = Wardrobes(data_dir)
    drawn = draw_person(wardrobes, "training", 3, 0)
    arrays = []
    for hair in ("short01", ""):
        dressed = dress(dataclasses.replace(drawn, hair=hair, hat=""), wardrobes)
        arrays.append(chart_of(dressed.prepared.avatar, dressed.guide, made=True))
    columns = [np.stack(column) for column in zip(*arrays, strict=True)]
    names = ("under", "outer", "colors", "kinds", "skin", "bare")
    return HeadCharts(
        **dict(zip(names, columns, strict=True)), sources=np.ones(len(arrays), np.uint8)
    )


def test_hair_lies_on_the_scalp_and_the_face_is_skin(charts: HeadCharts) -> None:
    face = np.s_[int(0.55 * HEIGHT) : int(0.75 * HEIGHT), WIDTH // 2 - 8 : WIDTH // 2 + 8]
    top = np.s_[: HEIGHT // 4]
    haired, bald = charts.kinds
    assert (haired[face] == SKIN).mean() > 0.95
    assert (haired[top] == HAIR).mean() > 0.95
    assert not (bald == HAIR).any()
    assert ((haired == NOTHING) <= ~head_cells().valid).all()
    # the same skin below the hair
    differ = charts.skin[0].astype(int) - charts.skin[1]
    assert (np.abs(differ) > 3).mean() < 1e-3
    away = np.linalg.norm((charts.outer - charts.under).astype(np.float32), axis=-1)
    assert away[0][top].mean() > away[1][top].mean() + 0.003


def test_an_imitated_photo_shows_one_side_in_the_colors_of_the_head(charts: HeadCharts) -> None:
    imitator = HeadImitator(charts)
    first, again = (imitator.draw(np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(first[0], again[0])
    for seed in range(4):
        made, target = imitator.draw(np.random.default_rng(seed))
        assert made.shape == (CHANNELS, HEIGHT, WIDTH)
        assert target.shape == (TARGETS, HEIGHT, WIDTH)
        trust = made[3]
        assert 0.03 < (trust > 0.5).mean() < 0.6
        sure = (trust > 0.9) & (target[7] > 0.8)  # kept colors are those of the head
        away = np.abs(made[:3] / np.maximum(trust, 1e-6) + 0.5 - target[:3])
        assert np.median(away[:, sure]) < 0.06


def test_a_stopped_training_goes_on_and_learns(charts: HeadCharts, tmp_path: Path) -> None:
    torch.set_num_threads(1)
    settings = HeadSettings(iterations=6, batch=4, fresh=2, kept=16, learning_rate=3e-3)
    network = train_heads(charts, tmp_path, settings)
    state = torch.load(tmp_path / "checkpoint.pt", weights_only=True)
    assert state["iteration"] == 6
    again = train_heads(charts, tmp_path, settings)  # nothing is left to do
    for one, other in zip(network.parameters(), again.parameters(), strict=True):
        assert torch.equal(one, other)


def test_the_network_carries_a_color_that_it_has_never_seen() -> None:
    """Without training, the color behind is the mean of what the photo shows."""
    chart = torch.zeros(1, CHANNELS, HEIGHT, WIDTH)
    chart[:, 3, :, 40:90] = 1.0
    chart[:, :3, :, 40:90] = torch.tensor([0.1, 0.9, 0.2])[:, None, None] - 0.5
    found = []
    for seed in range(8):  # one drawing of the weights is off by up to .17
        torch.manual_seed(seed)
        with torch.no_grad():
            found.append(HeadCompleter().eval()(chart))
    assert found[0].shape == (1, OUTPUTS, HEIGHT, WIDTH)
    behind = torch.cat(found)[:, :3, :, :20].mean(dim=(0, 2, 3))
    np.testing.assert_allclose(behind, [0.1, 0.9, 0.2], atol=0.08)
