"""PIFu's and PIFuHD's networks: they take the published layouts key by key, and nothing else."""

from __future__ import annotations

import pickle

import pytest
import torch

from a2v.errors import InputError
from a2v.reconstruction.papers.models import PIFuColor, PIFuGeometry, PIFuHD
from a2v.reconstruction.papers.networks import at_points
from tests.support.checkpoints import pifu_color, pifu_geometry, pifuhd, saved


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("checkpoints")
    return {
        "geometry": saved(pifu_geometry(), folder / "net_G"),
        "color": saved(pifu_color(), folder / "net_C"),
        "hd": saved(pifuhd(stacks=1, normals=4, blocks=2), folder / "pifuhd.pt"),
        "folder": folder,
    }


def cloud(count=50):
    return 2 * torch.rand(count, 3, generator=torch.Generator().manual_seed(0)) - 1


@torch.inference_mode()
def test_pifu_sees_and_answers(files):
    image = torch.randn(1, 3, 64, 64, generator=torch.Generator().manual_seed(1))
    geometry, color = PIFuGeometry(files["geometry"]), PIFuColor(files["color"])
    assert sum(weight.numel() for weight in geometry.parameters()) > 10e6
    features = geometry.see(image)
    assert features.shape == (1, 256, 16, 16)
    chance = geometry.occupancy(features, cloud())
    assert chance.shape == (50,)
    assert float(chance.std()) > 0
    assert ((chance > 0) & (chance < 1)).all()
    both = color.see(image, features)
    assert torch.equal(both[:, :256], features)  # the geometry's stand first
    colors = color.colors(both, cloud())
    assert colors.shape == (50, 3)
    assert ((colors >= 0) & (colors <= 1)).all()


@torch.inference_mode()
def test_pifuhd_sees_and_answers_and_its_fine_level_counts(files):
    network = PIFuHD(files["hd"])
    assert network.merged == 2
    image = torch.randn(1, 3, 128, 128, generator=torch.Generator().manual_seed(1))
    coarse, fine = network.see(image)
    assert coarse.shape == (1, 256, 16, 16)
    assert fine.shape == (1, 16, 64, 64)
    chance = network.occupancy((coarse, fine), cloud())
    assert chance.shape == (50,)
    assert not torch.equal(chance, network.occupancy((coarse, torch.zeros_like(fine)), cloud()))
    assert not torch.equal(chance, network.occupancy((torch.zeros_like(coarse), fine), cloud()))


def test_maps_are_read_from_corner_to_corner():
    ramp = torch.linspace(0, 1, 5).expand(1, 1, 5, 5)
    places = torch.tensor([[-1.0, 0.3], [0.0, -0.5], [1.0, 1.0]])
    assert torch.allclose(at_points(ramp, places)[0, 0], torch.tensor([0, 0.5, 1]))


class Trap:
    def __reduce__(self):
        return (print, ("executed",))


def test_what_is_another_file_is_refused(files, capsys):
    state, folder = pifu_geometry(stacks=1), files["folder"]
    lacking = {name: value for name, value in state.items() if name != "image_filter.m0.b1_2.conv1.weight"}
    reshaped = state | {"image_filter.bn1.weight": torch.ones(3)}
    more = state | {"image_filter.extra": torch.ones(3)}
    infinite = state | {"image_filter.bn1.weight": torch.full((64,), torch.nan)}
    (folder / "text").write_text("no checkpoint")
    (folder / "trap").write_bytes(pickle.dumps({"a": Trap()}))
    cases = [
        (PIFuGeometry, saved(lacking, folder / "a"), "lacks 'image_filter.m0.b1_2.conv1.weight'"),
        (PIFuGeometry, saved(reshaped, folder / "b"), "bn1.weight' has shape"),
        (PIFuGeometry, saved(more, folder / "c"), "has 'image_filter.extra'"),
        (PIFuGeometry, saved(infinite, folder / "d"), "NaN"),
        (PIFuGeometry, files["color"], "no hourglass"),
        (PIFuGeometry, files["hd"], "no named tensors"),
        (PIFuColor, files["geometry"], "no block"),
        (PIFuHD, files["geometry"], "under 'model_state_dict'"),
        (PIFuGeometry, str(folder / "text"), "cannot be read"),
        (PIFuGeometry, str(folder / "trap"), "cannot be read"),
        (PIFuGeometry, saved({"a": Trap()}, folder / "e"), "cannot be read"),
        (PIFuGeometry, str(folder / "none"), "does not exist"),
    ]
    for network, path, words in cases:
        with pytest.raises(InputError, match=words):
            network(path)
    assert "executed" not in capsys.readouterr().out
