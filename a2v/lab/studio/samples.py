"""Samples of a scene: points on the person's surface, and in space around it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.geometry.colors import linear_to_srgb
from a2v.geometry.rays import Hits, RayScene
from a2v.lab.studio.scene import Scene
from a2v.lab.studio.settings import StudioSettings
from a2v.lab.studio.solid import Solid
from a2v.lab.studio.texture import texture_at
from a2v.lab.studio.view import PHOTO_SIZE
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class SurfaceSamples:
    """Points on a person's outer surface.

    Attributes
    ----------
    points : (M, 3) float32
        Meters.
    normals : (M, 3) float32
        Outward, unit.
    colors : (M, 3) uint8
        sRGB: the texture's times the gain.
    visible : (M,) bool
        Whether the photo shows the point: no object occludes it, and it is inside the border.
    parts : (M,) int8
        Index into `a2v.body.PARTS`.
    """

    points: FloatArray
    normals: FloatArray
    colors: ByteArray
    visible: BoolArray
    parts: IntArray


def sample_surface(
    scene: Scene,
    solid: Solid,
    rays: RayScene,
    gain: FloatArray,
    count: int,
    generator: np.random.Generator,
) -> SurfaceSamples:
    """Draw points uniform by area on the outer surface.

    Parameters
    ----------
    scene : Scene
    solid : Solid
        Of the scene.
    rays : RayScene
        Rays of the person and of the objects around it.
    gain : (3,) float
        Gain of the colors, linear RGB.
    count : int
    generator : numpy Generator
    """
    surface = scene.surface
    face, uv = _draw_on_faces(surface.vertices, surface.faces, solid.outer, count, generator)
    hits = Hits(np.ones(len(face), bool), np.zeros(len(face)), face, uv)
    points, normals = (
        hits.interpolate(surface.vertices, surface.faces),
        hits.interpolate(scene.normals, surface.faces),
    )
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    albedo = texture_at(surface, face, uv)
    pixels = scene.camera.project(points)
    visible = ((pixels > 0) & (pixels < PHOTO_SIZE)).all(axis=1)
    visible &= ~rays.occluded(points + 1.5e-3 * normals, np.array([0, 0, 1], np.float32))
    return SurfaceSamples(
        points,
        normals,
        np.rint(255 * linear_to_srgb(albedo * gain)).astype(np.uint8),
        visible,
        scene.parts[surface.faces[face, 0]].astype(np.int8),
    )


def _draw_on_faces(
    vertices: FloatArray,
    faces: IntArray,
    chosen: IntArray,
    count: int,
    generator: np.random.Generator,
) -> tuple[IntArray, FloatArray]:
    """Draw points uniformly by area on the chosen faces: faces (n,) and barycentric coordinates (n,
    2)."""
    corner = vertices[faces[chosen]].astype(np.float64)
    area = np.linalg.norm(
        np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1
    )
    total = np.cumsum(area)
    face = chosen[
        np.minimum(np.searchsorted(total, generator.random(count) * total[-1]), len(chosen) - 1)
    ]
    uv = generator.random((count, 2))
    uv = np.where(uv.sum(axis=1, keepdims=True) > 1, 1 - uv, uv)
    return face, uv.astype(np.float32)


def sample_space(
    scene: Scene, solid: Solid, settings: StudioSettings, generator: np.random.Generator
) -> FloatArray:
    """Draw points (N, 3) float32, meters, near the outer surface and in the person's box, in random
    order.

    The settings have the fraction of each kind.
    """
    vertices = scene.surface.vertices
    near, far = (
        round(settings.near_share * settings.points),
        round(settings.far_share * settings.points),
    )
    face, uv = _draw_on_faces(vertices, scene.surface.faces, solid.outer, near + far, generator)
    on = Hits(np.ones(len(face), bool), np.zeros(len(face)), face, uv).interpolate(
        vertices, scene.surface.faces
    )
    spread = np.concatenate([np.full(near, settings.near), np.full(far, settings.far)])
    on = on + spread[:, None] * generator.standard_normal((near + far, 3))
    low, high = vertices.min(axis=0) - 0.1, vertices.max(axis=0) + 0.1
    box = generator.uniform(low, high, (settings.points - near - far, 3))
    return np.asarray(generator.permutation(np.concatenate([on, box])), np.float32)
