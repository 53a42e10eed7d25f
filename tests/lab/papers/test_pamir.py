"""PaMIR: the published layouts, the volume of a posed body, and a checkpoint with a known field."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch
import trimesh

from a2v.body import load_body_model, make_body
from a2v.errors import InputError
from a2v.geometry.mesh import is_closed
from a2v.lab.papers import PapersSettings, pamir, papers_surface
from a2v.lab.papers.converted import Converted
from a2v.lab.papers.pamir import (
    DISTANCE,
    FOCAL,
    PIXELS,
    PamirGeometry,
    PamirTexture,
    _in_picture,
    in_volume,
)
from a2v.lab.papers.pamir_person import FILL, PamirPerson, body_volume
from a2v.lab.papers.surface import _networks
from a2v.reconstruction.implicit.inputs import make_frame
from tests.support.checkpoints import pamir_geometry, pamir_texture, saved
from tests.support.smpl import smpl_arrays

SMALL = {"stacks": 2, "modules": 1, "depth": 1, "widths": (288, 8, 8, 8, 8, 1)}


def body_alone():
    """Build ``pamir_net`` whose person is the body itself.

    Its blurred volume passes all layers, and a threshold cuts it.
    """
    state = {
        name: torch.zeros_like(value) if value.ndim > 1 else value
        for name, value in pamir_geometry(1, 1, 1, SMALL["widths"]).items()
    }
    for name in ("conv1", "conv2"):  # each channel beside its negative: group norms then only scale
        weight = state[f"ve.{name}.weight"]
        for index in range(len(weight)):
            weight[index, :, 2, 2, 2] = 1 - 2 * (index % 2)
    state["mlp.conv0.0.weight"][0, 256], state["mlp.conv0.0.bias"][0] = 1000, -1000
    for index in (1, 2, 3):
        state[f"mlp.conv{index}.0.weight"][0, 288] = 1
    state["mlp.conv4.0.weight"][0, 0] = 5
    return state


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pamir")
    np.savez(folder / "SMPL.npz", **smpl_arrays())
    texture = pamir_texture((544, 8, 8, 8, 8, 4))
    texture["mlp.conv4.0.weight"].zero_()
    texture["mlp.conv4.0.bias"] = torch.tensor([30.0, -30.0, -30.0, 30.0])  # all of the picture
    return {
        "geometry": saved({"pamir_net": pamir_geometry(**SMALL), "epoch": 3}, folder / "latest.pt"),
        "texture": saved({"pamir_tex_net": texture}, folder / "texture.pt"),
        "body": saved({"pamir_net": body_alone()}, folder / "body.pt"),
        "smpl": str(folder / "SMPL.npz"),
        "folder": folder,
    }


@pytest.fixture(autouse=True)
def _own_cache(files, monkeypatch):
    monkeypatch.setenv("A2V_CACHE", str(files["folder"] / "cache"))


@pytest.fixture(scope="module")
def person(scene):
    subject, body, camera = scene
    return subject, dataclasses.replace(body, model="smpl"), camera


@pytest.fixture(scope="module")
def seen(scene, files):
    """SMPL's body as the networks see it."""
    subject, _, camera = scene
    body = make_body(load_body_model(files["smpl"]), grounded=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("A2V_CACHE", str(files["folder"] / "cache"))
        found = PamirPerson(
            subject, body, camera, geometry=files["body"], texture="", smpl=files["smpl"]
        )
    return body, found


def cloud(count=40):
    return torch.rand(count, 3, generator=torch.Generator().manual_seed(0)) - 0.5


def test_the_published_layout_has_its_names():
    names = set(pamir_geometry())
    assert {
        "hg.hourglass.3.low2.low2.low2.low2_.2.conv3.bias",
        "hg.Residual.11.bn2.weight",
        "hg.tmpOut_.2.weight",
    } <= names
    assert {"ve.r3.conv3.weight", "mlp.conv4.0.bias"} <= names


@torch.inference_mode()
def test_onnxruntime_gives_what_the_networks_give(files, monkeypatch):
    monkeypatch.setenv("A2V_CACHE", str(files["folder"] / "small"))
    monkeypatch.setattr(pamir, "VOXELS", 32)
    draws = torch.Generator().manual_seed(1)
    image, body = (
        torch.rand(1, 3, 64, 64, generator=draws),
        torch.rand(1, 3, 32, 32, 32, generator=draws),
    )
    shape = {part.name: part.network.eval() for part in PamirGeometry(files["geometry"]).parts(64)}
    features, volume = shape["features"](image), shape["volume"](body)
    assert features.shape == (1, 256, 16, 16)
    assert volume.shape == (1, 32, 8, 8, 8)
    chance = shape["points"](features, volume, cloud())
    assert chance.shape == (40,)
    assert float(chance.std()) > 0
    converted = Converted("pamir", files["geometry"], 64)
    assert converted.run("features", image=image.numpy()) == pytest.approx(
        features.numpy(), abs=1e-4
    )
    assert converted.run("volume", body=body.numpy()) == pytest.approx(volume.numpy(), abs=1e-3)
    assert converted.at(
        cloud().numpy(), features=features.numpy(), volume=volume.numpy()
    ) == pytest.approx(chance.numpy(), abs=1e-5)
    tint = {part.name: part.network.eval() for part in PamirTexture(files["texture"]).parts(64)}
    both = torch.cat([tint["features"](image), features], 1)
    colors = tint["points"](both, volume, image, cloud())
    assert torch.allclose(colors, _in_picture(image, cloud())[0, :, :, 0].T, atol=1e-5)
    second = Converted("pamir-texture", files["texture"], 64)
    assert second.features == both.shape[1]
    assert second.run("features", image=image.numpy()) == pytest.approx(
        both[:, :256].numpy(), abs=1e-4
    )
    found = second.at(
        cloud().numpy(), features=both.numpy(), volume=volume.numpy(), image=image.numpy()
    )
    assert found == pytest.approx(colors.numpy(), abs=1e-5)


def test_volumes_are_read_between_their_voxels():
    volume = torch.rand(1, 4, 8, 8, 8, generator=torch.Generator().manual_seed(2))
    points = 1.2 * cloud()
    wanted = torch.nn.functional.grid_sample(
        volume, 2 * points[None, None, None], padding_mode="border", align_corners=False
    )
    assert torch.allclose(in_volume(volume, points)[0, :, :, 0], wanted[0, :, 0, 0], atol=1e-5)


def test_a_body_becomes_the_names_of_what_is_near():
    mesh = trimesh.creation.icosphere(subdivisions=4)
    vertices = (mesh.vertices * [0.3, 0.4, 0.2]).astype(np.float32)
    volume = body_volume(vertices, np.asarray(mesh.faces), vertices + np.float32(0.5), 32)
    middles = (np.arange(32) + 0.5) / 32 - 0.5
    z, y, x = np.meshgrid(middles, middles, middles, indexing="ij")
    level = (x / 0.3) ** 2 + (y / 0.4) ** 2 + (z / 0.2) ** 2
    assert (volume[:, level > 1.02] == 0).all()
    assert (volume[:, level < 0.9] > 0).all()
    rim = (level > 0.8) & (level < 0.95)
    assert np.abs(volume[:, rim] - (np.stack([x, y, z])[:, rim] + 0.5)).max() < 0.05


def test_the_networks_camera_sees_points_where_ours_does(scene, seen):
    subject, _, camera = scene
    points = seen[0].vertices[::97]
    places = seen[1].place(points).astype(np.float64)
    frame = make_frame(subject.image, subject.mask, camera, PIXELS, fill=FILL)
    pixels = PIXELS / 2 + places[:, :2] * [1, -1] * FOCAL / (DISTANCE - places[:, 2:])
    assert pixels == pytest.approx(frame.camera.project(points), abs=0.01)
    assert np.abs(places).max() < 0.5
    assert places[:, 2].std() / places[:, 1].std() == pytest.approx(
        points[:, 2].std() / points[:, 1].std(), rel=0.02
    )


def test_a_known_field_becomes_its_surface_in_the_pictures_colors(person, files):
    subject, body, camera = person
    settings = PapersSettings(
        pamir_geometry=files["body"],
        pamir_texture=files["texture"],
        smpl=files["smpl"],
        resolution=200,
    )
    surface, colors = papers_surface(subject, body, camera, settings=settings)
    assert is_closed(surface.vertices, surface.faces)
    assert surface.provenance["geometry"] == "pamir"
    for end in ("min", "max"):  # fingers are thinner than the volume's features are apart
        apart = np.abs(getattr(surface.vertices, end)(axis=0) - getattr(body.vertices, end)(axis=0))
        assert (apart < [0.1, 0.06, 0.06]).all()
    pixels = np.floor(camera.project(surface.vertices)).astype(int)
    within = (subject.mask[pixels[:, 1], pixels[:, 0]] > 0.5) & (
        np.abs(surface.vertices[:, 0]) < 0.05
    )
    assert (
        np.median(
            np.abs(colors[within] * 255 - subject.image[pixels[within, 1], pixels[within, 0]])
        )
        < 6
    )


def test_refining_changes_the_body_that_the_networks_see(scene, seen, files):
    subject, _, camera = scene
    body, unrefined = seen
    probes = body.vertices[::40]
    settings = PapersSettings(pamir_geometry=files["body"], smpl=files["smpl"], pamir_refine=1)
    plain, refined = (
        unrefined.occupancy(probes),
        _networks(subject, body, camera, settings)[1](probes),
    )
    assert np.isfinite(refined).all()
    assert np.abs(refined - plain).max() > 0
    with pytest.raises(InputError, match="pamir_refine is -1"):
        PapersSettings(pamir_refine=-1)


def test_what_does_not_fit_is_refused(scene, files):
    subject, body, camera = scene
    for settings, words in [
        (
            PapersSettings(pamir_geometry=files["geometry"], smpl=files["smpl"]),
            "this one is anny's",
        ),
        (PapersSettings(pamir_geometry=files["geometry"]), "also needs your SMPL file"),
        (
            PapersSettings(pamir_texture=files["texture"], pifu_geometry=files["texture"]),
            "needs --pamir-geometry",
        ),
        (
            PapersSettings(
                pamir_geometry=files["geometry"], pifu_geometry=files["texture"], smpl=files["smpl"]
            ),
            "excludes --pifuhd",
        ),
    ]:
        with pytest.raises(InputError, match=words):
            papers_surface(subject, body, camera, settings=settings)
    lacking = {
        name: value
        for name, value in pamir_geometry(**SMALL).items()
        if name != "ve.r2.conv3.weight"
    }
    for content, words in [
        ({"pamir_net": lacking}, "lacks 've.r2.conv3.weight'"),
        ({"pamir_net": pamir_geometry(**SMALL) | {"hg.more": torch.ones(1)}}, "has 'hg.more'"),
        (pamir_geometry(**SMALL), "under 'pamir_net'"),
        ({"pamir_net": pamir_texture((544, 8, 8, 8, 8, 4))}, "no 'hg.hourglass"),
    ]:
        with pytest.raises(InputError, match=words):
            PamirGeometry(saved(content, files["folder"] / "other.pt"))
