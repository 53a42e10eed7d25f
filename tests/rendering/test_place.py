"""The photo's place: its lights and its frame."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import trimesh

from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.geometry.mesh import vertex_normals
from a2v.rendering import LookSettings, Renderer, ViewCamera
from a2v.rendering.place import DIRECTED, estimate_light, exposed, light_on, square, without_light
from a2v.types import RenderSettings, Surface


def board(depth: float) -> Surface:
    """A square meter that faces the camera at z = `depth`."""
    corners = np.float32([[0, 0, depth], [1, 0, depth], [1, 1, depth], [0, 1, depth]])
    return Surface(
        vertices=corners,
        faces=np.int32([[0, 1, 2], [0, 2, 3]]),
        colors=np.zeros((4, 3), np.float32),
    )


@pytest.mark.parametrize("shape", [(50, 80), (80, 50), (60, 60)])
def test_the_photo_lies_unchanged_in_the_middle_of_its_square(shape):
    photo = np.random.default_rng(0).integers(0, 256, (*shape, 3), dtype=np.uint8)
    whole, (left, top, right, bottom) = square(photo)
    assert whole.shape == (max(shape), max(shape), 3)
    np.testing.assert_array_equal(whole[top:bottom, left:right], photo)
    assert abs(left - (max(shape) - right)) <= 1
    assert abs(top - (max(shape) - bottom)) <= 1


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_light_comes_from_the_bright_side(side):
    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices, faces = ball.vertices.astype(np.float32), ball.faces.astype(np.int32)
    toward = np.array([side, 0.8, 0.6]) / np.linalg.norm([side, 0.8, 0.6])
    shading = 0.3 + 0.7 * np.maximum(vertex_normals(vertices, faces) @ toward, 0)
    albedo = 0.5 + 0.2 * np.random.default_rng(0).standard_normal(len(vertices))
    colors = linear_to_srgb(np.clip(albedo * shading, 0, 1))[:, None] * np.ones(3)
    scene = estimate_light(
        Surface(vertices=vertices, faces=faces, colors=colors.astype(np.float32))
    )
    assert scene.sun_direction @ toward > 0.9
    assert max(scene.spot) == scene.grid == 0
    flat = estimate_light(
        Surface(vertices=vertices, faces=faces, colors=np.full((len(vertices), 3), 0.5, np.float32))
    )
    assert max(flat.sun) < 0.05 < max(scene.sun)
    assert srgb_to_linear(np.array(scene.background)).min() >= 1 - DIRECTED - 1e-6


def test_lights_can_be_made_brighter_up_to_white():
    scene = estimate_light(board(0))
    brighter = exposed(scene, np.array([1.0, 0.5, 2.0]))
    np.testing.assert_allclose(brighter.sun, np.array(scene.sun) * (1, 0.5, 2))
    assert max(brighter.background) <= 1


def test_light_is_taken_out_of_colors_and_texture_alike():
    """Two triangles of a texture of their own: what is divided by the light at its place, and given
    back by it."""
    draw = np.random.default_rng(1)
    texture = draw.integers(40, 120, (64, 64, 3), dtype=np.uint8)
    uv = np.float32([[[0.1, 0.1], [0.9, 0.1], [0.9, 0.9]], [[0.1, 0.1], [0.9, 0.9], [0.1, 0.9]]])
    plain = dataclasses.replace(
        board(0), uv=uv, texture=texture, colors=np.full((4, 3), 0.4, np.float32)
    )
    light = np.float32([[0.5], [0.5], [1.5], [1.5]]) * np.float32([1, 0.8, 1.2])  # brighter upwards
    bare = without_light(plain, light)
    np.testing.assert_allclose(
        srgb_to_linear(bare.colors) * light, srgb_to_linear(plain.colors), rtol=1e-4
    )
    assert bare.texture is not None
    height = np.clip((1 - (np.arange(64) + 0.5) / 64 - 0.1) / 0.8, 0, 1)
    inside = slice(8, 56)
    given = (0.5 + height)[inside, None, None] * np.array([1, 0.8, 1.2])
    before = srgb_to_linear(texture[inside, inside] / 255)
    after = srgb_to_linear(bare.texture[inside, inside] / 255)
    np.testing.assert_allclose(after * given, before, rtol=0.03, atol=2e-3)


def test_a_person_without_its_light_looks_under_it_as_in_the_photo():
    """A ball whose texture holds any shading: the first frame shows it again with any lights."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    vertices, faces = (
        (0.9 * ball.vertices + (0, 1.0, 0)).astype(np.float32),
        ball.faces.astype(np.int32),
    )
    shown = 0.25 + 0.2 * np.maximum(vertex_normals(vertices, faces) @ np.array([-0.8, 0.0, 0.6]), 0)
    person = Surface(
        vertices=vertices, faces=faces, colors=np.float32(shown[:, None] * [1.0, 0.9, 0.7])
    )
    camera = ViewCamera(origin=(0.0, 1.0, 25.0), target=(0.0, 1.0, 0.0), fov=5)
    settings = RenderSettings(size=96, spp=16, threads=1)
    scene = LookSettings(
        sun=(0.7, 0.7, 0.7),
        sun_direction=(0.9, 1.0, 0.3),
        spot=(0, 0, 0),
        background=(0.7, 0.7, 0.7),
        grid=0,
        gloss=False,
    )
    light = light_on(person, vertices, camera, scene, settings)
    pictures = [
        Renderer(one, dataclasses.replace(settings, background="transparent"), scene).cutout(
            vertices, camera
        )
        for one in (person, without_light(person, light))
    ]
    wanted = Renderer(person, settings, scene).layers(vertices, camera, spp=4).albedo
    middle = (pictures[0].alpha > 0.98) & (np.hypot(*(np.indices((96, 96)) - 47.5)) < 30)
    off = [
        255 * np.abs(linear_to_srgb(picture.color[middle]) - linear_to_srgb(wanted[middle])).mean()
        for picture in pictures
    ]
    assert off[1] < 3 < off[0] / 3
