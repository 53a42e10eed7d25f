"""Removing the shading of known light gives the known albedo."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from a2v.geometry.colors import linear_to_srgb, srgb_to_linear
from a2v.geometry.mesh import vertex_normals
from a2v.reconstruction import ColorSettings, color_surface
from a2v.reconstruction.coloring.shading import (
    LIMITS,
    estimate_shading,
    openness,
    photo_without_shading,
)
from a2v.types import FloatArray, IntArray, OrthographicCamera, Subject, Surface

CAMERA = OrthographicCamera(scale=100.0, center_u=128.0, center_v=128.0)
STUFFS = np.array([[0.5, 0.15, 0.12], [0.1, 0.2, 0.45], [0.35, 0.33, 0.3], [0.06, 0.06, 0.05]])


def ball() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Vertices, faces, normals and albedo (linear) of a ball in blocks of four stuffs."""
    mesh = trimesh.creation.icosphere(subdivisions=5)
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces)
    normals = vertex_normals(vertices, faces)
    return vertices, faces, normals, STUFFS[blocks(vertices)]


def blocks(points: FloatArray) -> IntArray:
    """Return the material of each point (..., 3); every side has some of each."""
    return np.asarray(np.floor(points * (3, 4, 2)).astype(int).sum(axis=-1) % 4)


def lit(normals: FloatArray, toward: tuple[float, float, float]) -> FloatArray:
    """Light from one side and from all around, with mean 1 over the visible side."""
    way = np.array(toward) / np.linalg.norm(toward)
    light = 0.6 + 0.6 * np.maximum(normals @ way, 0)
    return np.asarray(light / np.average(light, weights=np.maximum(normals[:, 2], 0)))


@pytest.mark.parametrize("toward", [(1.0, 0.6, 0.5), (-0.8, 1.0, 0.2)])
def test_known_light_on_known_albedo_comes_back(toward: tuple[float, float, float]) -> None:
    vertices, faces, normals, albedo = ball()
    light = lit(normals, toward)
    free = openness(vertices, faces, normals)
    np.testing.assert_allclose(free, 1, atol=0.03)  # nothing hides the light of a ball
    weight = np.maximum(normals[:, 2], 0)
    draw = np.random.default_rng(0)
    noisy = linear_to_srgb(albedo * light[:, None]) + 0.01 * draw.standard_normal(albedo.shape)
    found = estimate_shading(normals, free, noisy, weight)
    seen = weight > 0.2
    assert np.abs(found / light - 1)[seen].mean() < 0.06
    assert np.abs(1 / light - 1)[seen].mean() > 0.15  # what there was to find


def test_even_light_is_left_alone() -> None:
    vertices, faces, normals, albedo = ball()
    found = estimate_shading(
        normals,
        openness(vertices, faces, normals),
        linear_to_srgb(albedo),
        np.maximum(normals[:, 2], 0),
    )
    assert np.abs(found - 1)[normals[:, 2] > 0.2].max() < 0.05


def test_what_is_hidden_is_less_open_and_limits_hold() -> None:
    vertices, faces, normals, albedo = ball()
    plate = trimesh.creation.box((3, 0.02, 3)).subdivide().subdivide()
    both = np.concatenate([vertices, plate.vertices - np.array([0, 1.05, 0])])
    every = np.concatenate([faces, np.asarray(plate.faces) + len(vertices)])
    free = openness(both, every, vertex_normals(both, every))[: len(vertices)]
    assert free[vertices[:, 1] < -0.9].max() < 0.5 < 0.9 < free[vertices[:, 1] > 0.3].min()
    harsh = linear_to_srgb(albedo * (0.02 + 3 * np.maximum(normals[:, :1], 0)) * 0.3)
    found = estimate_shading(normals, np.ones(len(vertices)), harsh, np.maximum(normals[:, 2], 0))
    assert found.min() >= LIMITS[0]
    assert found.max() <= LIMITS[1]
    assert (
        estimate_shading(normals, np.ones(len(vertices)), harsh, np.zeros(len(vertices))) == 1
    ).all()  # nothing visible, nothing estimated


def photo_of(toward: tuple[float, float, float]) -> tuple[FloatArray, FloatArray, Surface]:
    """A photo (256, 256, 3) of the ball, the same in even light, and the ball."""
    vertices, faces, _, albedo = ball()
    v, u = np.indices((256, 256)) + 0.5
    x, y = (u - 128) / 100, (128 - v) / 100
    inside = x**2 + y**2 < 1
    here = np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1)
    stuff = STUFFS[blocks(here)]
    way = np.array(toward) / np.linalg.norm(toward)
    light = 0.6 + 0.6 * np.maximum(here @ way, 0)
    light = light / light[inside].mean()
    photo = np.where(inside[..., None], linear_to_srgb(stuff * light[..., None]), 0.2).astype(
        np.float32
    )
    even = np.where(inside[..., None], linear_to_srgb(stuff), 0.2).astype(np.float32)
    surface = Surface(
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        colors=np.full(albedo.shape, 0.5, np.float32),
    )
    return photo, even, surface


def test_a_photo_loses_its_shading_and_keeps_its_hues() -> None:
    photo, even, surface = photo_of((1.0, 0.5, 0.5))
    pixels = CAMERA.project(surface.vertices).astype(int).clip(0, 255)
    normals = vertex_normals(surface.vertices, surface.faces)
    colors = photo[pixels[:, 1], pixels[:, 0]]
    bare = photo_without_shading(
        photo,
        CAMERA,
        surface.vertices,
        surface.faces,
        normals,
        colors=colors,
        seen=normals[:, 2] > 0.3,
    )
    v, u = np.indices((256, 256)) + 0.5
    middle = np.hypot(u - 128, v - 128) < 85
    off = [
        float(np.abs(srgb_to_linear(one) / srgb_to_linear(even) - 1)[middle].mean())
        for one in (photo, bare)
    ]
    assert off[1] < 0.06 < 0.13 < off[0]
    assert bare.max() <= 1
    before, after = (srgb_to_linear(one)[middle] for one in (photo, bare))
    np.testing.assert_allclose(
        after / after.sum(axis=1, keepdims=True),
        before / before.sum(axis=1, keepdims=True),
        atol=2e-3,
    )


def test_coloring_takes_the_shading_out_unless_told_not_to() -> None:
    photo, even, surface = photo_of((1.0, 0.5, 0.5))
    v, u = np.indices((256, 256)) + 0.5
    mask = (np.hypot(u - 128, v - 128) < 100).astype(np.float32)
    person = Subject(
        image=np.rint(255 * photo).astype(np.uint8),
        mask=mask,
        keypoints=np.zeros((33, 3), np.float32),
        keypoints_3d=np.full((33, 3), np.nan, np.float32),
        crop=(0, 0, 256, 256),
        photo_size=(256, 256),
    )
    pixels = CAMERA.project(surface.vertices).astype(int).clip(0, 255)
    seen = surface.vertices[:, 2] > 0.5
    off = []
    rule = ColorSettings(texture=256, without="delight")
    for settings in (rule, ColorSettings(texture=256, delight=False), ColorSettings(texture=256)):
        colored = color_surface(surface, person, CAMERA, settings=settings)
        wanted = srgb_to_linear(even[pixels[seen, 1], pixels[seen, 0]])
        off.append(float(np.median(np.abs(srgb_to_linear(colored.colors[seen]) / wanted - 1))))
        assert colored.texture is not None
    assert off[0] == off[1]
    assert off[2] < 0.08 < 0.12 < off[1]
