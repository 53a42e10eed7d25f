"""A "person" with known ground truth: an upright ellipsoid, with a slightly too thin guide."""

from __future__ import annotations

import numpy as np
import trimesh

from a2v.lab.studio.view import MAP_SIZE, View, encode_pictures
from a2v.reconstruction.implicit.inputs import FRAME, GUIDE, GuideMaps, GuideMesh
from a2v.types import FloatArray, OrthographicCamera

AXES = np.array([0.25, 0.85, 0.16])
CAMERA = OrthographicCamera(
    scale=0.9 * FRAME / (2 * AXES[1]), center_u=FRAME / 2, center_v=FRAME / 2
)
RED = np.array([200, 60, 50], np.uint8)


def ellipsoid(scale: float = 1.0) -> trimesh.Trimesh:
    mesh = trimesh.creation.icosphere(subdivisions=5)
    mesh.apply_scale(AXES * scale)
    return mesh


def _packed(maps: GuideMaps) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    front, back = (
        np.round(normals * 127).astype(np.int8)
        for normals in (maps.normals_front, maps.normals_back)
    )
    return maps.depth_front.astype(np.float16), maps.depth_back.astype(np.float16), front, back


def make_view(seed: int) -> View:
    generator = np.random.default_rng(seed)
    person, thin = ellipsoid(), ellipsoid(0.9)
    truth, guide = GuideMesh(person.vertices, person.faces), GuideMesh(thin.vertices, thin.faces)
    large = truth.maps(CAMERA, FRAME, FRAME)
    inside = np.isfinite(large.depth_front)
    image = np.full((FRAME, FRAME, 3), 90, np.uint8)
    image[inside] = RED
    depth_front, depth_back, normals_front, normals_back = _packed(
        truth.maps(CAMERA, FRAME, MAP_SIZE)
    )
    guide_front, guide_back, guide_normals_front, guide_normals_back = _packed(
        guide.maps(CAMERA, FRAME, GUIDE)
    )
    maps = {
        "mask": (inside * 255).astype(np.uint8),
        "normals_front": normals_front,
        "normals_back": normals_back,
        "depth_front": depth_front,
        "depth_back": depth_back,
        "parts_front": np.where(np.isfinite(depth_front), 2, -1).astype(np.int8),
        "guide_normals_front": guide_normals_front,
        "guide_normals_back": guide_normals_back,
        "guide_depth_front": guide_front,
        "guide_depth_back": guide_back,
    }
    surface, faces = trimesh.sample.sample_surface(person, 1024, seed=seed)
    points = (surface + generator.normal(0, 0.03, surface.shape)).astype(np.float32)

    def asked(values: FloatArray) -> tuple[np.ndarray, np.ndarray]:
        distance, normals = guide.at(values)
        return distance.astype(np.float16), np.round(normals * 127).astype(np.int8)

    normals = person.face_normals[faces]
    point_distance, point_normals = asked(points)
    surface_distance, surface_normals = asked(surface)
    return View(
        encoded=encode_pictures(image, 95, maps),
        camera=CAMERA,
        points=points,
        distance=truth.at(points)[0].astype(np.float16),
        guide_distance=point_distance,
        guide_normals=point_normals,
        surface_points=surface.astype(np.float32),
        surface_normals=np.round(normals * 127).astype(np.int8),
        surface_colors=np.tile(RED, (len(surface), 1)),
        surface_visible=normals[:, 2] > 0,
        surface_parts=np.full(len(surface), 2, np.int8),
        surface_guide_distance=surface_distance,
        surface_guide_normals=surface_normals,
        guide_vertices=thin.vertices.astype(np.float32),
        avatar="ellipsoid",
        gain=np.ones(3, np.float32),
        yaw=0.0,
        seed=0,
        index=seed,
        split="training",
    )
