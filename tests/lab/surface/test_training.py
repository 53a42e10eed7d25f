from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import torch

from a2v.errors import InputError
from a2v.lab.studio.view import View
from a2v.lab.surface.losses import depth_loss, distance_loss, normal_loss
from a2v.lab.surface.networks import CoarseField, NetworkSettings, point_values
from a2v.lab.surface.training import (
    STAGES,
    ReconstructionSettings,
    load_networks,
    train_reconstruction,
)
from a2v.reconstruction.extraction import ExtractionSettings, extract_surface
from a2v.reconstruction.implicit.inputs import Frame
from a2v.reconstruction.implicit.model import ImplicitModel
from export.reconstruction import export_reconstruction
from tests.support.ellipsoid import AXES, CAMERA, RED, ellipsoid

SMALL = NetworkSettings(widths=(16, 16, 16, 16), hidden=32, context=8, fine_width=16)
QUICK = ReconstructionSettings(
    iterations=50,
    batch_size=1,
    points=512,
    learning_rate=3e-3,
    crop=256,
    half=False,
    log_every=5,
    threads=1,
    checkpoint_seconds=1e9,
)


@pytest.fixture(scope="module")
def run(
    studio: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, dict[str, list[dict[str, float]]]]:
    """All three stages, trained for seconds on the ellipsoid."""
    folder = tmp_path_factory.mktemp("run")
    logs: dict[str, list[dict[str, float]]] = {stage: [] for stage in STAGES}
    for stage, iterations in zip(STAGES, (50, 15, 50), strict=True):
        settings = dataclasses.replace(QUICK, iterations=iterations)
        train_reconstruction(
            stage, studio, folder, network=SMALL, settings=settings, on_log=logs[stage].append
        )
    return folder, logs


@pytest.fixture(scope="module")
def exported(
    run: tuple[Path, dict[str, list[dict[str, float]]]], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """The trained networks as ONNX files."""
    folder = tmp_path_factory.mktemp("exported")
    export_reconstruction(run[0], folder, license="test", extra={"note": "ellipsoid"})
    return folder


def test_an_untrained_field_lies_between_guide_and_depth_maps() -> None:
    torch.manual_seed(0)
    maps, guide = torch.zeros(1, 8, 16, 16), torch.zeros(1, 10, 16, 16)
    maps[:, 6], maps[:, 7], guide[:, 9] = 0.2, -0.2, -0.3
    depth = torch.tensor([[-0.3, 0.0, 0.25]])
    values = point_values(
        maps,
        guide,
        torch.zeros(1, 3, 2),
        depth,
        torch.tensor([[0.12, -0.15, 0.06]]),
        torch.zeros(1, 3, 3),
    )
    distance, context = CoarseField(SMALL)(torch.zeros(1, 16, 8, 8), values, torch.zeros(1, 3, 2))
    slab = torch.tensor([0.1, -0.2, 0.05])
    assert distance[0].detach() == pytest.approx(
        ((slab + torch.tensor([0.12, -0.15, 0.06])) / 2).numpy(), abs=1e-6
    )
    assert context.shape == (1, 3, SMALL.context)


def test_losses_are_zero_at_the_truth_and_grow_with_errors() -> None:
    true = torch.linspace(-0.2, 0.2, 41)
    far = torch.where(
        true.abs() > 0.05, true * 3, true
    )  # beyond the reach any larger distance is as good
    assert distance_loss(far, true) < distance_loss(true + 0.01, true) < distance_loss(-true, true)
    normals = torch.nn.functional.normalize(
        torch.randn(2, 6, 8, 8).view(2, 2, 3, 8, 8), dim=2
    ).view(2, 6, 8, 8)
    assert normal_loss(normals, normals) < 1e-6
    assert normal_loss(-normals, normals) == pytest.approx(2, abs=1e-5)
    depth = torch.tensor([[[[0.1, float("nan")]]]])
    assert depth_loss(torch.tensor([[[[0.12, 9.0]]]]), depth) == pytest.approx(0.2, abs=1e-6)


def test_every_stage_learns(run: tuple[Path, dict[str, list[dict[str, float]]]]) -> None:
    for stage, name, share in (("shape", "depth", 0.75), ("color", "color", 0.95)):
        rows = run[1][stage]
        assert rows[-1][name] < share * rows[0][name], (
            stage,
            name,
            [round(row[name], 3) for row in rows],
        )
    # an ellipsoid has no detail: the stage must not do harm
    assert run[1]["detail"][-1]["distance"] < 1.3 * run[1]["detail"][0]["distance"]


def test_onnx_equals_torch_and_finds_the_person(
    run: tuple[Path, dict[str, list[dict[str, float]]]], exported: Path, view: View
) -> None:
    model = ImplicitModel.load(exported)
    assert model.metadata["note"] == "ellipsoid"
    thin = ellipsoid(0.9)
    lifted = thin.vertices + np.array([0, 0, 0.5])  # the frame's depth is the guide's affair
    person = model.see_frame(
        Frame(view.image, view.mask.astype(np.float32) / 255, CAMERA), lifted, thin.faces
    )
    shape = load_networks(run[0], "shape")
    for parameter in shape.parameters():
        parameter.requires_grad_(False).copy_(
            parameter.half().float() if parameter.numel() >= 1024 else parameter
        )
    features, maps = shape.encoder(
        torch.from_numpy(person.maps["photo_half"]), torch.from_numpy(person.maps["guide"])
    )
    assert np.abs(maps.numpy() - person.maps["maps"]).max() < 1e-3
    assert (
        np.abs(features.numpy() - person.maps["features"]).max()
        < 1e-2 * np.abs(features.numpy()).max()
    )

    low, high = lifted.min(axis=0) - 0.1, lifted.max(axis=0) + 0.1
    vertices, faces = extract_surface(
        person.distance,
        np.stack([low, high]),
        settings=ExtractionSettings(resolution=200, vertices=25_000),
    )
    radius = np.linalg.norm((vertices - [0, 0, 0.5]) / AXES, axis=1)
    assert abs(np.median(radius) - 1) < 0.06
    colors = person.colors(vertices.astype(np.float32), (vertices - [0, 0, 0.5]) / AXES**2)
    assert np.abs(np.median(colors, axis=0) * 255 - RED).max() < 60
    assert len(faces) > 1000


def test_a_run_resumes_and_refuses_other_settings(studio: Path, tmp_path: Path) -> None:
    from dataclasses import replace

    whole, halves = tmp_path / "whole", tmp_path / "halves"
    few = replace(QUICK, iterations=6, log_every=1, points=64)
    rows: list[dict[str, float]] = []
    train_reconstruction("shape", studio, whole, network=SMALL, settings=few, on_log=rows.append)

    class Stop(Exception):
        pass

    def stop(row: dict[str, float]) -> None:
        if row["iteration"] == 3:
            raise Stop

    with pytest.raises(Stop):
        train_reconstruction("shape", studio, halves, network=SMALL, settings=few, on_log=stop)
    again: list[dict[str, float]] = []
    train_reconstruction("shape", studio, halves, network=SMALL, settings=few, on_log=again.append)
    assert [row["iteration"] for row in again] == [4, 5, 6]
    assert again[-1]["distance"] == pytest.approx(rows[-1]["distance"], rel=1e-4)
    with pytest.raises(InputError, match="points=64"):
        train_reconstruction(
            "shape", studio, halves, network=SMALL, settings=replace(few, points=65)
        )
    with pytest.raises(InputError, match="does not exist; train first"):
        train_reconstruction("color", studio, tmp_path / "empty", network=SMALL, settings=few)
    with pytest.raises(InputError, match="no views"):
        train_reconstruction("shape", tmp_path, tmp_path / "none", network=SMALL, settings=few)


def test_a_run_begins_with_another_ones_networks(
    run: tuple[Path, dict[str, list[dict[str, float]]]], studio: Path, tmp_path: Path
) -> None:
    settings = dataclasses.replace(QUICK, iterations=1, learning_rate=1e-12, initial=str(run[0]))
    for stage in STAGES:
        train_reconstruction(stage, studio, tmp_path, network=SMALL, settings=settings)
        first, second = (
            dict(load_networks(folder, stage).named_parameters()) for folder in (run[0], tmp_path)
        )
        assert all(torch.allclose(first[name], second[name], atol=1e-6) for name in first)
    with pytest.raises(InputError, match="other networks"):
        train_reconstruction(
            "shape",
            studio,
            tmp_path / "other",
            network=dataclasses.replace(SMALL, hidden=16),
            settings=settings,
        )


def test_a_run_begins_with_the_networks_of_onnx_files(
    run: tuple[Path, dict[str, list[dict[str, float]]]],
    exported: Path,
    studio: Path,
    tmp_path: Path,
) -> None:
    """Batch normalizations are folded into the files and restored without changing predictions."""
    settings = dataclasses.replace(QUICK, iterations=1, learning_rate=1e-12, initial=str(exported))
    photo, guide, place = (
        torch.rand(1, 4, 512, 512) - 0.5,
        torch.rand(1, 10, 256, 256) - 0.5,
        2 * torch.rand(1, 50, 2) - 1,
    )
    told = torch.rand(1, 50), 0.1 * torch.rand(1, 50), torch.rand(1, 50, 3)

    def said(folder: Path) -> dict[str, np.ndarray]:
        shape, detail, painter = (load_networks(folder, stage) for stage in STAGES)
        with torch.no_grad():
            features, maps = shape.encoder(photo, guide)
            values = point_values(maps, guide, place, *told)
            distance, context = shape.field(features, values, place)
            fine = detail.encoder(photo, maps[:, :, ::2, ::2])
            colors = painter(painter.features(photo, guide, maps), photo, values, told[2], place)
            found = {
                "maps": maps,
                "distance": distance,
                "fine": detail.field(fine, place, distance, context, values),
                "colors": colors,
            }
        return {name: value.numpy() for name, value in found.items()}

    for stage in STAGES:
        train_reconstruction(stage, studio, tmp_path / "again", network=SMALL, settings=settings)
    before, after = said(run[0]), said(tmp_path / "again")
    for (
        name,
        values,
    ) in (
        before.items()
    ):  # one iteration moves the running statistics by a tenth of what a batch differs
        assert np.abs(after[name] - values).mean() < 0.05 * np.abs(values).mean(), name
    with pytest.raises(InputError, match="no network of this kind and size"):
        train_reconstruction(
            "shape",
            studio,
            tmp_path / "other",
            network=dataclasses.replace(SMALL, hidden=16),
            settings=settings,
        )
