"""The body map's file against PyTorch, and the command that trains and writes it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
import torch

from a2v.errors import InputError
from a2v.lab.bodymap.networks import BodyMapNetwork
from a2v.lab.bodymap.training import stored_weights
from a2v.lab.untracing import fill
from a2v.perception.bodymap import FILE, FORMAT
from export.bodymap import INPUTS, OUTPUTS, blended, export_bodymap, export_network, folded
from tests.support.quick_views import write_invented

Exported = tuple[BodyMapNetwork, Path]


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Exported:
    """The shipped network with other normalizations, and its file; an export takes 8 s."""
    torch.manual_seed(2)
    network = BodyMapNetwork().eval()
    fill(network, stored_weights(FILE.parent), otherwise="")
    with torch.no_grad():
        for layer in network.modules():
            if isinstance(layer, torch.nn.BatchNorm2d):
                layer.running_var.uniform_(0.8, 1.2)
                layer.bias.add_(0.05)
        network.narrow.weight.mul_(1.1)
    path = tmp_path_factory.mktemp("bodymap") / FILE.name
    export_network(network, path, license="Apache-2.0", extra={"seed": 1})
    return network, path


def test_onnx_equals_pytorch_for_any_number_of_pictures(exported: Exported) -> None:
    network, path = exported
    assert path.stat().st_size < 10e6
    said = json.loads(
        next(item.value for item in onnx.load(path).metadata_props if item.key == "a2v")
    )
    assert said["format"] == FORMAT
    assert said["licence"] == "Apache-2.0"
    assert said["seed"] == 1
    session = onnxruntime.InferenceSession(path)
    assert [item.name for item in session.get_outputs()] == list(OUTPUTS)
    for count in (1, 3):
        pictures = torch.rand(count, 4, 256, 256, generator=torch.Generator().manual_seed(count))
        with torch.no_grad():
            told = network(pictures)
        found = session.run(None, {INPUTS[0]: pictures.numpy()})
        for mine, theirs in zip(found, (told.points, told.log_scales, told.maps), strict=True):
            assert mine.shape == tuple(theirs.shape)
            assert theirs.std() > 0.05
            np.testing.assert_allclose(
                mine, theirs.numpy(), atol=2e-3 * max(1.0, float(theirs.abs().max()))
            )


def test_blended_weights_lie_between_and_are_folded_alike(
    exported: Exported, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    network = exported[0]
    monkeypatch.setattr(  # the file is there
        "export.bodymap.export_network", lambda _, path, **__: shutil.copy(exported[1], path)
    )
    own = folded(network)
    shipped = stored_weights(FILE.parent)
    picture = torch.rand(1, 4, 256, 256, generator=torch.Generator().manual_seed(3))
    with torch.no_grad():
        told, nearly = network(picture), blended(own, shipped, 1 - 1e-6)(picture)
    np.testing.assert_allclose(nearly.maps, told.maps, atol=2e-2 * float(told.maps.abs().max()))
    half = blended(own, shipped, 0.5)
    name = "narrow.weight"
    np.testing.assert_allclose(
        half.state_dict()[name], (network.state_dict()[name].numpy() + shipped[name]) / 2, atol=1e-3
    )
    for blend, initial, match in ((0.0, "shipped", "expected a share"), (0.5, "", "give it too")):
        with pytest.raises(InputError, match=match):
            export_bodymap(tmp_path, tmp_path, license="", blend=blend, initial=initial)


def test_the_command_trains_on_what_is_there_and_writes_the_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from pipelines.cli import main

    write_invented(tmp_path / "views")
    small = [
        "--bodymap.iterations",
        "2",
        "--bodymap.batch-size",
        "2",
        "--bodymap.measured",
        "2",
        "--bodymap.log-every",
        "1",
    ]
    command = [
        "train",
        "bodymap",
        "--data",
        str(tmp_path),
        "--out",
        str(tmp_path),
        "--views",
        "64",
        "--validation",
        "64",
    ]
    assert (
        main([*command, *small, "--bodymap.threads", "1", "--bodymap.device", "cpu", "--json"]) == 0
    )
    told = json.loads(capsys.readouterr().out)
    assert [Path(one["path"] if isinstance(one, dict) else one).name for one in told["files"]] == [
        FILE.name
    ]
    said = json.loads(
        next(
            item.value
            for item in onnx.load(tmp_path / FILE.name).metadata_props
            if item.key == "a2v"
        )
    )
    assert said["iterations"] == 2
    assert said["views"] == {"training": 64, "validation": 64}
    assert (
        main([*command[:-4], "--views", "64", "--validation", "64", "--studio.seed", "4", *small])
        == 2
    )
    assert "other settings" in capsys.readouterr().err
