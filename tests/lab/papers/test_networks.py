"""PIFu's and PIFuHD's networks: they take the published layouts key by key, and nothing else."""

from __future__ import annotations

import pickle

import pytest
import torch

from a2v.errors import InputError
from a2v.lab.papers.converted import Converted
from a2v.lab.papers.models import PIFuColor, PIFuGeometry, PIFuHD
from a2v.lab.papers.networks import at_points
from tests.support.checkpoints import NARROW, pifu_color, pifu_geometry, pifuhd, saved


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("checkpoints")
    return {
        "geometry": saved(pifu_geometry(1), folder / "net_G"),
        "color": saved(pifu_color(), folder / "net_C"),
        "hd": saved(pifuhd(stacks=1, normals=4, blocks=2), folder / "pifuhd.pt"),
        "folder": folder,
    }


def cloud(count=50):
    return 2 * torch.rand(count, 3, generator=torch.Generator().manual_seed(0)) - 1


def image(pixels):
    return torch.randn(1, 3, pixels, pixels, generator=torch.Generator().manual_seed(1))


def parts(network, pixels):
    return {part.name: part.network.eval() for part in network.parts(pixels)}


@torch.inference_mode()
def test_pifu_sees_and_answers_and_onnxruntime_gives_the_same(files, monkeypatch):
    monkeypatch.setenv("A2V_CACHE", str(files["folder"]))
    geometry, color = PIFuGeometry(files["geometry"]), PIFuColor(files["color"])
    assert sum(weight.numel() for weight in geometry.parameters()) > 2e6
    asked, shape, tint = image(64), parts(geometry, 64), parts(color, 64)
    features = shape["features"](asked)
    assert features.shape == (1, 256, 16, 16)
    chance = shape["points"](features, cloud())
    assert chance.shape == (50,)
    assert float(chance.std()) > 0
    assert ((chance > 0) & (chance < 1)).all()
    both = torch.cat([features, tint["features"](asked)], 1)
    colors = tint["points"](both, cloud())
    assert colors.shape == (50, 3)
    assert ((colors >= 0) & (colors <= 1)).all()
    first, second = (
        Converted("geometry", files["geometry"], 64),
        Converted("color", files["color"], 64),
    )
    found = first.run("features", image=asked.numpy())
    assert found == pytest.approx(features.numpy(), abs=1e-4)
    assert first.at(cloud().numpy(), features=found) == pytest.approx(chance.numpy(), abs=1e-5)
    assert second.features == both.shape[1]
    assert second.run("features", image=asked.numpy()) == pytest.approx(
        both[:, 256:].numpy(), abs=1e-4
    )
    assert second.at(cloud().numpy(), features=both.numpy()) == pytest.approx(
        colors.numpy(), abs=1e-5
    )


@torch.inference_mode()
def test_pifuhd_sees_and_answers_and_its_fine_level_counts(files, monkeypatch):
    monkeypatch.setenv("A2V_CACHE", str(files["folder"]))
    network = PIFuHD(files["hd"])
    assert network.merged == 2
    asked, own = {"image": image(64)}, parts(network, 64)
    sides = {side: own[side](**asked) for side in ("front", "back")}
    coarse, fine = own["coarse"](**asked, **sides), own["fine"](image(128), **sides)
    assert coarse.shape == (1, 256, 16, 16)
    assert fine.shape == (1, 16, 64, 64)
    chance = own["points"](coarse, fine, cloud())
    assert chance.shape == (50,)
    assert not torch.equal(chance, own["points"](coarse, torch.zeros_like(fine), cloud()))
    assert not torch.equal(chance, own["points"](torch.zeros_like(coarse), fine, cloud()))
    converted = Converted("pifuhd", files["hd"], 64)
    given = {name: value.numpy() for name, value in {**asked, **sides}.items()}
    assert converted.run("front", image=given["image"]) == pytest.approx(given["front"], abs=1e-4)
    assert converted.run("coarse", **given) == pytest.approx(coarse.numpy(), abs=1e-4)
    assert converted.run("fine", **given | {"image": image(128).numpy()}) == pytest.approx(
        fine.numpy(), abs=1e-4
    )
    assert converted.at(cloud().numpy(), coarse=coarse.numpy(), fine=fine.numpy()) == pytest.approx(
        chance.numpy(), abs=1e-5
    )


def test_a_checkpoint_is_converted_once_and_anew_when_it_changes(files, monkeypatch, tmp_path):
    monkeypatch.setenv("A2V_CACHE", str(tmp_path / "cache"))
    path, made = tmp_path / "net_G", []
    saved(pifu_geometry(1, NARROW), path)

    def write(part, target):
        made.append(part.name)
        target.write_bytes(b"")
        return target

    monkeypatch.setattr("a2v.lab.papers.converted._write", write)
    for _ in range(2):
        Converted("geometry", path, 32)
    assert made == ["features", "points"]
    saved(pifu_geometry(1, NARROW, seed=5), path)
    Converted("geometry", path, 32)
    assert len(made) == 4
    assert len(list((tmp_path / "cache" / "papers").iterdir())) == 2


def test_maps_are_read_from_corner_to_corner():
    ramp = torch.linspace(0, 1, 5).expand(1, 1, 5, 5)
    places = torch.tensor([[-1.0, 0.3], [0.0, -0.5], [1.0, 1.0]])
    assert torch.allclose(at_points(ramp, places)[0, 0], torch.tensor([0, 0.5, 1]))


class Trap:
    def __reduce__(self):
        return (print, ("executed",))


def test_what_is_another_file_is_refused(files, capsys):
    state, folder = pifu_geometry(stacks=1), files["folder"]
    lacking = {
        name: value for name, value in state.items() if name != "image_filter.m0.b1_2.conv1.weight"
    }
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
