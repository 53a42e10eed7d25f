"""Liquid Warping GAN: the published layout key by key, and the sources of its pixels."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from a2v.errors import InputError
from a2v.lab.evaluation.liquid import Generator
from a2v.lab.evaluation.liquid_warp import LiquidWarp, read_face_texture
from a2v.rendering import ViewCamera
from tests.support.checkpoints import liquid_warping, saved
from tests.support.photographs import dressed_scene

PIXELS = 64


@pytest.fixture(scope="module")
def scene():
    return dressed_scene()


@pytest.fixture(scope="module")
def obj(scene, tmp_path_factory):
    """Texture coordinates of the body's mesh: each vertex has its own position."""
    _, body, _ = scene
    path = tmp_path_factory.mktemp("uv") / "mapper.txt"
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    places = (body.vertices[:, :2] - low[:2]) / (high - low)[:2]
    lines = [f"v {x} {y} {z}" for x, y, z in body.vertices.tolist()] + [
        f"vt {u} {v}" for u, v in places.tolist()
    ]
    lines += [
        "f " + " ".join(f"{corner + 1}/{corner + 1}/1" for corner in face)
        for face in body.faces[::-1].tolist()
    ]
    path.write_text("\n".join(lines))
    return path, places


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    return Generator(
        saved(liquid_warping(), tmp_path_factory.mktemp("liquid") / "net_epoch_30_id_G.pth")
    )


def front(body):
    """Return a distant camera in front of the body that sees what the photo's camera does."""
    middle = (body.vertices.min(axis=0) + body.vertices.max(axis=0)) / 2
    height, away = float(np.ptp(body.vertices[:, 1])), 200.0
    origin = middle + np.float32([0, 0, away])
    return ViewCamera(
        origin=tuple(map(float, origin)),
        target=tuple(map(float, middle)),
        fov=float(np.degrees(2 * np.arctan(0.6 * height / away))),
    )


@torch.inference_mode()
def test_the_moved_person_is_fed_by_what_was_read_of_the_photo(network):
    draws = torch.Generator().manual_seed(0)
    picture, condition = (
        torch.randn(1, 3, PIXELS, PIXELS, generator=draws),
        torch.randn(1, 3, PIXELS, PIXELS, generator=draws),
    )
    straight = torch.nn.functional.affine_grid(
        torch.eye(2, 3)[None], [1, 1, PIXELS, PIXELS], align_corners=True
    )
    features = network.read(picture, condition)
    assert [tuple(value.shape[1:]) for value in features] == [
        (8, 64, 64),
        (16, 32, 32),
        (32, 16, 16),
    ] + 3 * [(64, 8, 8)]
    drawn, behind = network.draw(features, picture, condition, straight)
    assert drawn.shape == (1, 3, PIXELS, PIXELS)
    assert behind.shape == (1, 1, PIXELS, PIXELS)
    assert ((behind > 0) & (behind < 1)).all()
    nowhere = torch.full_like(straight, -2)
    assert not torch.allclose(drawn, network.draw(features, picture, condition, nowhere)[0])
    first = [
        torch.zeros_like(features[0]),
        *features[1:],
    ]  # of one size with the picture: not added
    assert torch.equal(drawn, network.draw(first, picture, condition, straight)[0])
    person = torch.zeros(1, 1, PIXELS, PIXELS)
    person[..., 20:40, 20:40] = 1
    other = torch.where(person > 0, torch.zeros(()), picture)
    assert torch.equal(network.background(picture, person), network.background(other, person))


def test_depths_and_names_are_the_published_ones(tmp_path):
    network = Generator(saved(liquid_warping(width=4, blocks=6), tmp_path / "net"))
    names = {
        "bg_model.model.27.weight",
        "bg_model.model.17.main.3.weight",
        "src_model.resnets.5.main.4.bias",
        "tsf_model.attetion_reg.0.weight",
    }
    assert names <= set(network.state_dict())
    assert network.tsf_model.encoders[3][0].weight.shape == (32, 16, 3, 3)


def test_faces_are_found_by_their_corners(scene, obj):
    _, body, _ = scene
    path, places = obj
    texture = read_face_texture(path, body.faces)
    assert texture.shape == (len(body.faces), 3)
    wanted = places[body.faces[:, :2]].mean(axis=1)
    assert texture[:, 0] == pytest.approx(wanted[:, 0], abs=1e-5)
    assert texture[:, 1] == pytest.approx(1 - wanted[:, 1], abs=1e-5)


def test_an_unmoved_body_takes_its_pixels_from_where_they_are(scene, obj, network):
    subject, body, camera = scene
    warp = LiquidWarp(
        network, read_face_texture(obj[0], body.faces), subject, body, camera, pixels=PIXELS
    )
    hits = warp._seen_in_photo()
    places = warp.places(hits)
    middles = (np.arange(PIXELS) + 0.5) / (PIXELS / 2) - 1
    grid = np.stack(np.meshgrid(middles, middles), axis=-1).reshape(-1, 2)
    assert 0.05 < hits.hit.mean() < 0.6
    assert places[hits.hit] == pytest.approx(grid[hits.hit], abs=1e-3)
    assert (places[~hits.hit] == -2).all()
    condition = warp._condition(hits)[0].permute(1, 2, 0).reshape(-1, 3).numpy()
    assert (condition[~hits.hit] == [0, 0, 1]).all()
    assert (condition[hits.hit][:, 2] == 0).all()


def test_a_generator_that_shows_the_background_alone_shows_it(scene, obj, tmp_path):
    subject, body, camera = scene
    state = liquid_warping()
    for name in ("skippers.2.1.weight", "img_reg.0.weight"):
        state[f"tsf_model.{name}"].zero_()
    state["tsf_model.skippers.2.1.bias"].fill_(1)  # the last features are 1 wherever
    state["tsf_model.attetion_reg.0.weight"].fill_(1)
    texture = read_face_texture(obj[0], body.faces)
    behind = LiquidWarp(
        Generator(saved(state, tmp_path / "a")), texture, subject, body, camera, pixels=PIXELS
    )
    pictures = [
        behind.frame(body.vertices + np.float32([shift, 0, 0]), front(body), PIXELS)
        for shift in (0, 0.3)
    ]
    assert np.array_equal(*pictures)
    assert pictures[0].std() > 1
    state["tsf_model.attetion_reg.0.weight"].fill_(
        -1
    )  # and the other way round: the picture, of tanh 0
    person = LiquidWarp(
        Generator(saved(state, tmp_path / "b")), texture, subject, body, camera, pixels=PIXELS
    )
    assert np.abs(person.frame(body.vertices, front(body), 2 * PIXELS).astype(int) - 127).max() <= 1


def test_what_is_another_file_is_refused(scene, obj, tmp_path):
    _, body, _ = scene
    state = liquid_warping()
    lacking = {
        name: value for name, value in state.items() if name != "src_model.resnets.1.main.0.weight"
    }
    for content, words in [
        (lacking, "lacks 'src_model.resnets.1.main.0.weight'"),
        (state | {"tsf_model.more": torch.ones(2)}, "has 'tsf_model.more'"),
        (liquid_warping(inputs=5), r"\[4, 5, 5\] channels"),
        ({"a": torch.ones(1)}, "lacks"),
    ]:
        with pytest.raises(InputError, match=words):
            Generator(saved(content, tmp_path / "net"))
    (tmp_path / "short").write_text("vt 0 0\nf 1/1 2/1 3/1\n")
    (tmp_path / "none").write_bytes(b"\xff\x00")
    with pytest.raises(InputError, match="lacks faces"):
        read_face_texture(tmp_path / "short", body.faces)
    with pytest.raises(InputError, match="not an OBJ"):
        read_face_texture(tmp_path / "none", body.faces)
    with pytest.raises(InputError, match="lacks faces"):
        read_face_texture(obj[0], dataclasses.replace(body, faces=body.faces[:, [0, 1, 1]]).faces)
