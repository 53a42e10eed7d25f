"""BlazePose's layers, and the network on them."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

import a2v
from a2v.errors import InputError
from a2v.lab.bodymap import blazepose
from a2v.lab.bodymap.blazepose import FILE, LANDMARKS, BlazePoseLayers, read_blazepose
from a2v.lab.bodymap.networks import CHANNELS, EDGES, MAPS, Backbone, BodyMapNetwork


@pytest.fixture(scope="module")
def picture() -> torch.Tensor:
    """The sample's photo (1, 3, 256, 256)."""
    image = cv2.imread(str(Path(a2v.__file__).parent / "samples" / "person.jpg"))[..., ::-1]
    return torch.from_numpy(
        cv2.resize(image, (256, 256)).transpose(2, 0, 1)[None].astype(np.float32) / 255
    )


@pytest.mark.parametrize("output", [LANDMARKS, 297])
def test_the_layers_are_what_opencv_makes_of_the_same_file(
    picture: torch.Tensor, output: int
) -> None:
    """OpenCV's reader of TensorFlow Lite gives the same landmarks and heat maps.

    The heat maps need the end of the decoder.
    """
    package = Path(str(importlib.util.find_spec("mediapipe").origin)).parent  # type: ignore[union-attr]
    reference = cv2.dnn.readNetFromTFLite(str(package / FILE))
    reference.setInput(picture.numpy())
    expected = reference.forward({LANDMARKS: "Identity", 297: "Identity_2"}[output])
    with torch.no_grad():
        (found,) = BlazePoseLayers((output,))(picture)
    assert np.abs(expected).max() > 1
    np.testing.assert_allclose(found.numpy(), expected, atol=2e-3 * np.abs(expected).max())


def test_the_backbone_keeps_what_sees_edges(picture: torch.Tensor) -> None:
    backbone = Backbone()
    with torch.no_grad():
        features, own = backbone(picture)
    assert [tuple(one.shape[1:]) for one in features] == [
        (channels, side, side) for channels, side in zip(CHANNELS, (64, 32, 16, 8, 4), strict=True)
    ]
    assert own.shape == (1, 33, 5)
    assert float(own[..., :2].abs().max()) < 2
    frozen = {name for name, weight in backbone.named_parameters() if not weight.requires_grad}
    steps = read_blazepose().needed_for((EDGES,))
    assert {f"layers.numbers.w{step.weights}" for step in steps if step.weights >= 0} <= frozen
    assert 0 < len(frozen) < sum(1 for _ in backbone.parameters())


def test_another_version_of_the_file_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blazepose, "DIGEST", "0" * 64)
    with pytest.raises(InputError, match=r"0\.10\.21"):
        read_blazepose.__wrapped__()


def test_the_network_begins_near_blazeposes_landmarks(picture: torch.Tensor) -> None:
    torch.manual_seed(0)
    network = BodyMapNetwork().eval()
    with torch.no_grad():
        told = network(
            torch.cat([picture, torch.ones_like(picture[:, :1])], dim=1).repeat(2, 1, 1, 1)
        )
        own = network.backbone(picture)[1]
    assert told.points.shape == (2, 33, 3)
    assert told.log_scales.shape == (2, 33, 2)
    assert told.maps.shape == (2, len(MAPS), 64, 64)
    share = float(torch.sigmoid(torch.tensor(-2.0)))
    expected = own[..., :2] + share * (told.first[:1, :, :2] - own[..., :2])
    torch.testing.assert_close(told.points[:1, :, :2], expected, atol=1e-4, rtol=0)
    assert float(told.points[:, [23, 24], 2].mean().abs()) < 0.2
