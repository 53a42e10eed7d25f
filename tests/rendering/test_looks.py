"""Looks by name and from files; traced parts match the empty stage in each of them."""

from __future__ import annotations

import dataclasses

import cv2
import numpy as np
import pytest

from a2v.errors import InputError
from a2v.geometry.colors import linear_to_srgb
from a2v.rendering import LOOKS, LookSettings, Renderer, ViewCamera, read_look
from a2v.rendering.empty import empty_stage
from a2v.rendering.region import region
from a2v.rendering.scene import ground_pattern
from a2v.types import FloatArray, RenderSettings
from tests.support.blocks import block

SIZE = 160
CAMERA = ViewCamera(origin=(2.2, 1.1, 4.4), target=(0.1, 0.9, 0.0), fov=34)
SKIES = ("outdoor", "night")


def levels(linear: FloatArray) -> FloatArray:
    return 255 * linear_to_srgb(linear)


def smooth(picture: FloatArray) -> FloatArray:
    """Return means of 7 x 7 pixels, in which little noise is left."""
    return np.asarray(cv2.blur(picture.astype(np.float32), (7, 7)))


def test_the_studio_is_what_settings_are_without_a_look() -> None:
    assert read_look("studio") == LookSettings()
    assert len({read_look(name).sun for name in LOOKS}) == len(LOOKS)


@pytest.mark.parametrize("name", LOOKS)
def test_the_skys_light_on_the_ground_is_its_integral(name: str) -> None:
    scene = read_look(name)
    sine = (np.arange(20000) + 0.5) / 20000
    np.testing.assert_allclose(
        scene.sky_on_ground, 2 * (scene.sky(sine) * sine[:, None]).mean(axis=0), rtol=1e-4
    )
    np.testing.assert_allclose(scene.sky(np.array([-0.4, 0.0])), [scene.fill, scene.fill])


def test_a_look_of_ones_own(tmp_path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("sun: [1, 0.5, 0.25]\nzenith: [0.1, 0.2, 0.3]\nbounces: 1\n")
    scene = read_look(path)
    assert scene == LookSettings(sun=(1.0, 0.5, 0.25), zenith=(0.1, 0.2, 0.3), bounces=1)
    for text, told in (
        ("sunn: [1, 1, 1]", "did you mean sun"),
        ("sun: [1, 1]", "expected three numbers"),
        ("sun: [1, yes, 1]", "expected a number"),
        ("bounces: 1.5", "whole number"),
        ("sun_direction: [0, -1, 0]", "above the ground"),
        ("zenith: [3, 0, 0]", "zenith"),
        ("haze: 0", "haze"),
        ("mottle: 0.5", "mottle is 0.5"),
        ("mottle: 0.1\nmottle_size: 0.01", "0.01 m"),
        ("- sun", "not a mapping"),
        ("sun: [", "mine.yaml"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=told):
            read_look(path)
    with pytest.raises(InputError, match="studio, outdoor, night"):
        read_look("nigth")


def test_a_mottled_ground_is_as_light_as_a_plain_one_and_ends_at_its_rim() -> None:
    plain = LookSettings(grid=0.0)
    assert (ground_pattern(plain, 64) == 1).all()
    assert plain.plain_ground
    scene = dataclasses.replace(plain, mottle=0.15, mottle_size=1.0)
    pattern = ground_pattern(scene, 1024)
    middle = pattern[300:724, 300:724]
    assert middle.mean() == pytest.approx(1, abs=0.02)
    assert middle.std() == pytest.approx(0.15, rel=0.1)
    np.testing.assert_allclose(pattern[[0, -1]], 1, atol=1e-6)
    np.testing.assert_array_equal(pattern, ground_pattern(scene, 1024))
    steps = np.abs(np.diff(middle, axis=0)).mean()
    assert steps < 0.3 * 0.15  # patches, not grains


@pytest.mark.parametrize("name", SKIES)
def test_no_seam_shows_under_a_sky(name: str) -> None:
    """Compare with Mitsuba's path tracer, where traced and empty stage meet, and beyond."""
    surface, scene = block(), read_look(name)
    renderer = Renderer(surface, RenderSettings(size=SIZE, spp=8, threads=1), scene)
    if not renderer.variant.startswith("llvm"):
        pytest.skip("without LLVM whole frames are path traced")
    truth = levels(renderer.layers(surface.vertices, CAMERA, spp=196, seed=9).color)
    error = smooth(levels(renderer.linear(surface.vertices, CAMERA)) - truth)
    empty = empty_stage(scene, CAMERA, SIZE)
    found = region(surface.vertices, surface.faces, CAMERA, scene, empty)
    person = (
        cv2.dilate((renderer.mask(surface.vertices, CAMERA) > 0).astype(np.uint8), np.ones((9, 9)))
        > 0
    )
    ramp = (found.weight > 0) & (found.weight < 1) & ~person
    border = (
        cv2.dilate((found.weight > 0).astype(np.uint8), np.ones((7, 7))).astype(bool)
        & (found.weight < 0.34)
        & ~person
    )
    assert min(ramp.sum(), border.sum()) > 400
    assert np.abs(error[border]).max() < 1
    assert np.quantile(np.abs(error[ramp]), 0.99) < 1
    assert np.abs(error[(found.weight == 0) & ~person]).max() < 1
    if name == "outdoor":  # the sky shows: the horizon's color below, another one above
        assert np.abs(levels(empty.color)[0, 0] - levels(empty.color)[SIZE // 3, 0]).max() > 10


@pytest.mark.parametrize("name", SKIES)
def test_the_person_is_lit_as_the_path_tracer_lights_it(name: str) -> None:
    surface, scene = block(), dataclasses.replace(read_look(name), grid=0.0)
    renderer = Renderer(surface, RenderSettings(size=64, spp=8, threads=1), scene)
    if not renderer.variant.startswith("llvm"):
        pytest.skip("without LLVM whole frames are path traced")
    truth = renderer.layers(surface.vertices, CAMERA, spp=256, seed=4)
    every = np.arange(64 * 64)
    assert renderer._tracer is not None
    traced = renderer._tracer.trace(every, 64, CAMERA, 64, 0)
    inside = (traced.person == 1).reshape(64, 64)
    assert inside.sum() > 100
    np.testing.assert_allclose(
        traced.color.reshape(64, 64, 3)[inside].mean(axis=0),
        truth.color[inside].mean(axis=0),
        rtol=0.015,
    )
