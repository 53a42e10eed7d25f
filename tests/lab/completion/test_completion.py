from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from a2v.geometry.mesh import within
from a2v.lab.completion.layout import COLUMNS, ROWS, default_rest, frame, skin_sheets
from a2v.lab.completion.networks import (
    RESIDUAL,
    Completion,
    CompletionSettings,
    filled_up,
)
from a2v.lab.completion.people import place_on_sheets, sheet_colors, sheet_trust
from a2v.lab.completion.training import CompletionTraining, known_maps, train_completion
from a2v.lab.studio.makehuman.dressing import Dresser
from a2v.lab.studio.scene import Dressed
from a2v.lab.studio.stand import Outfit
from a2v.lab.studio.variation import Build

SMALL = CompletionSettings(widths=(8, 8, 8), palette=4)


@pytest.fixture(scope="module")
def person(data_dir: Path) -> Dressed:
    return Dresser(data_dir, 0).dressed("validation", 1)


def test_each_pixel_of_a_sheet_shows_the_place_that_projects_to_it():
    sheets, faces, kept = skin_sheets()
    scale, left, top = frame()
    side, row, column = np.nonzero(sheets.filled)
    weight = sheets.barycentric[side, row, column][..., None].astype(np.float64)
    place = within(default_rest()[kept], faces[sheets.face[side, row, column]], weight)
    assert np.abs(left + scale * place[:, 0] - column - 0.5).max() < 0.01
    assert np.abs(top - scale * place[:, 1] - row - 0.5).max() < 0.01
    np.testing.assert_allclose(place[:, 2], sheets.depth[side, row, column], atol=1e-3)
    both = sheets.filled.all(axis=0)
    assert (sheets.depth[0] >= sheets.depth[1] - 1e-3)[both].all()
    assert (sheets.filled != sheets.filled[..., ::-1]).mean() < 0.002  # bodies are symmetric


def test_sheets_hold_the_colors_of_the_garment_that_is_worn_there(person: Dressed):
    avatar, texture = person.prepared.avatar, person.prepared.avatar.texture.copy()
    clothes = person.prepared.clothes
    texture[clothes.rows, clothes.columns] = (255, 0, 0)
    colors = sheet_colors(avatar, texture, place_on_sheets(avatar, person.guide))
    red = (colors[..., 0] > 200) & (colors[..., 1:].max(axis=-1) < 60)
    waist, head = slice(100, 120), slice(8, 24)  # long hair hangs down above
    middle = slice(COLUMNS // 2 - 12, COLUMNS // 2 + 12)
    assert red[1, waist, middle].mean() > 0.95
    assert red[:, head].sum() < 0.02 * skin_sheets()[0].filled[:, head].sum()


def test_a_photo_shows_the_side_that_faces_it(person: Dressed):
    avatar = person.prepared.avatar
    placed = place_on_sheets(avatar, person.guide)
    outfit = Outfit(person.prepared, Build(), avatar, avatar.texture)
    for yaw, shown in ((0.0, 0), (180.0, 1)):
        trust = sheet_trust(outfit, placed, {}, yaw, np.random.default_rng(0)) / 255
        filled = skin_sheets()[0].filled
        assert trust[shown][filled[shown]].mean() > 0.6
        assert trust[1 - shown][filled[1 - shown]].mean() < 0.15


def test_filling_keeps_what_is_seen_and_fills_the_rest_from_it():
    colors = torch.zeros(1, 3, 32, 24)
    colors[:, :, :16], colors[:, :, 16:] = 0.2, 0.8
    trust = torch.zeros(1, 1, 32, 24)
    trust[..., 4:28, :12] = 1
    made = filled_up(colors, trust)
    torch.testing.assert_close(made[..., 6:26, :10], colors[..., 6:26, :10], atol=2e-3, rtol=0)
    assert float(made.min()) > 0.19
    assert float(made.max()) < 0.81
    assert (made[:, :, 4:12, 13:17] < made[:, :, 20:28, 13:17].min()).all()


def test_the_network_can_only_choose_among_visible_colors():
    torch.manual_seed(0)
    network = Completion(SMALL, known_maps()).eval()
    trust = (torch.rand(1, 2, 1, ROWS // 2, COLUMNS // 2) > 0.6).float()
    colors = 0.3 + 0.2 * torch.rand(1, 2, 3, ROWS // 2, COLUMNS // 2)
    colors = torch.where(trust > 0, colors, torch.full_like(colors, 5.0))  # unseen, so unused
    made = network(colors, trust).detach()
    assert float(made.min()) > 0.3 - RESIDUAL - 0.02
    assert float(made.max()) < 0.5 + RESIDUAL + 0.02


def test_training_learns_and_resumes_where_it_stopped(tmp_path: Path):
    generator = np.random.default_rng(0)
    shape = (4, 2, ROWS // 2, COLUMNS // 2)
    trust = np.zeros(shape, np.uint8)
    trust[:, 0] = 255
    shades = generator.integers(30, 220, (4, 1, 1, 1, 3))
    colors = np.broadcast_to(shades, (*shape, 3)).astype(np.uint8)
    for split in ("training", "validation"):
        np.savez(tmp_path / f"{split}-000.npz", colors=colors, trust=trust, names=np.arange(4))
    rows: list[dict[str, float]] = []
    whole, half = (
        CompletionTraining(
            iterations=count, batch_size=2, half=False, log_every=2, threads=1, learning_rate=5e-3
        )
        for count in (16, 16)
    )
    network = train_completion(
        tmp_path, tmp_path / "whole", network=SMALL, settings=whole, on_log=rows.append
    )
    assert rows[-1]["color"] < 0.8 * rows[0]["color"]

    class Stopped(Exception):
        pass

    def stop(row: dict[str, float]) -> None:
        if row["iteration"] == 8:
            raise Stopped

    with pytest.raises(Stopped):
        train_completion(tmp_path, tmp_path / "half", network=SMALL, settings=half, on_log=stop)
    resumed = train_completion(tmp_path, tmp_path / "half", network=SMALL, settings=half)
    for one, two in zip(network.parameters(), resumed.parameters(), strict=True):
        torch.testing.assert_close(one, two)
