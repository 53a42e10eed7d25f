"""Solids, rays and the photo's frame, against shapes with known answers."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from a2v.geometry.mesh import face_normals
from a2v.geometry.rays import RayScene, signed_distance_and_normals
from a2v.lab.studio.solid import (
    PhotoFrame,
    Solid,
    caps,
    open_faces,
    smooth_normals,
    weld,
    winding_number,
)


def ball(
    radius: float = 0.3, center: tuple[float, float, float] = (0, 0, 0)
) -> tuple[np.ndarray, np.ndarray]:
    mesh = trimesh.creation.icosphere(4, radius)
    return np.asarray(mesh.vertices + center, np.float32), np.asarray(mesh.faces, np.int32)


def joined(*parts: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    return np.concatenate([v for v, _ in parts]), np.concatenate(
        [f + o for (_, f), o in zip(parts, offsets, strict=False)]
    )


@pytest.fixture(scope="module")
def points() -> np.ndarray:
    return np.random.default_rng(0).uniform(-0.5, 0.5, (4000, 3)).astype(np.float32)


def test_signed_distance_of_a_ball_and_a_box(points: np.ndarray) -> None:
    solid = Solid(*ball())
    assert (
        np.abs(solid.signed_distance(points) - (np.linalg.norm(points, axis=1) - 0.3)).max() < 2e-3
    )
    box = trimesh.creation.box((0.4, 0.6, 0.2))
    half = np.array([0.2, 0.3, 0.1])
    beyond = np.abs(points) - half
    truth = np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)
    got = Solid(box.vertices.astype(np.float32), box.faces.astype(np.int32)).signed_distance(points)
    assert np.abs(got - truth).max() < 1e-5


def test_an_open_mesh_is_still_solid(points: np.ndarray) -> None:
    vertices, faces = ball()
    kept = faces[vertices[faces].mean(axis=1)[:, 1] < 0.27]  # a hole of 13 cm at the top
    away = np.linalg.norm(points - [0, 0.3, 0], axis=1) > 0.15
    inside = Solid(vertices, kept).inside(points[away])
    assert (inside == (np.linalg.norm(points[away], axis=1) < 0.3)).mean() > 0.995


def test_a_limb_pressed_into_the_trunk_leaves_no_surface_inside(points: np.ndarray) -> None:
    vertices, faces = joined(ball(0.25), ball(0.2, (0.2, 0, 0)))
    solid = Solid(vertices, faces)
    truth = np.minimum(
        np.linalg.norm(points, axis=1) - 0.25, np.linalg.norm(points - [0.2, 0, 0], axis=1) - 0.2
    )
    got = solid.signed_distance(points)
    assert (np.sign(got) == np.sign(truth))[np.abs(truth) > 3e-3].all()
    outside = truth > 0  # inside, the distance to a union is not the minimum of the distances
    assert np.abs(got - truth)[outside].max() < 3e-3
    middle = vertices[faces[solid.outer]].mean(axis=1)
    covered = np.minimum(
        np.linalg.norm(middle, axis=1) - 0.25, np.linalg.norm(middle - [0.2, 0, 0], axis=1) - 0.2
    )
    assert covered.min() > -6e-3


def test_a_pocket_counts_as_filled() -> None:
    outer, inner = ball(0.3), ball(0.1)
    vertices, faces = joined(
        outer, (inner[0], inner[1][:, ::-1])
    )  # a hollow, its faces looking inwards
    visible = open_faces(vertices, faces, rays=16)
    assert visible[: len(outer[1])].all()
    assert not visible[len(outer[1]) :].any()
    plain, filled = Solid(vertices, faces), Solid(vertices, faces, wall=visible, outer=visible)
    assert not plain.inside(np.zeros((1, 3)))[0]
    assert filled.signed_distance(np.zeros((1, 3), np.float32))[0] == pytest.approx(-0.3, abs=2e-3)


def test_a_wig_is_solid_down_to_the_scalp_and_leaves_the_face_free() -> None:
    head = ball(0.1)
    vertices, faces = ball(0.13)
    kept = vertices[faces].mean(axis=1)[:, 2] < 0.06  # open in front, where the face is
    wig = vertices, faces[kept]
    both = joined(head, wig)
    shell = np.arange(len(both[1])) >= len(head[1])
    solid = Solid(*both, shell=shell, layered=np.ones(len(both[1]), bool))
    between, before, deep = (
        np.array([[0, 0.115, 0], [0, 0, -0.115]]),
        np.array([[0, 0, 0.107], [0.01, 0, 0.115]]),
        np.zeros((1, 3)),
    )
    assert solid.inside(between).all()
    assert not solid.inside(before).any()
    assert solid.inside(deep).all()
    normals = face_normals(*both)[solid.outer]
    assert (~shell[solid.outer] & (normals[:, 2] > 0.9)).sum() > 50  # the face is outer surface...
    assert not (~shell[solid.outer] & (normals[:, 2] < -0.5)).any()  # ...and the scalp is not


def test_caps_close_every_hole(points: np.ndarray) -> None:
    vertices, faces = ball()
    split = vertices[faces].reshape(-1, 3)
    own = np.arange(len(split)).reshape(-1, 3)
    assert not len(caps(own, weld(split)))
    middle = vertices[faces].mean(axis=1)
    kept = (middle[:, 1] < 0.27) & (middle[:, 0] < 0.25)
    closing = caps(own[kept], weld(split))
    all_edges = weld(split)[np.concatenate([own[kept], closing])][
        :, [[0, 1], [1, 2], [2, 0]]
    ].reshape(-1, 2)
    forth, back = (
        {(int(a), int(b)) for a, b in edges} for edges in (all_edges, all_edges[:, ::-1])
    )
    assert forth == back  # every edge is run through both ways: closed, and oriented alike
    hull = ConvexHull(split[own[kept]].reshape(-1, 3))
    depth = -(points @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
    by_ray = Solid(split, own, wall=kept, closing=closing).inside(points)
    assert (by_ray == (depth > 0))[
        np.abs(depth) > 0.012
    ].all()  # the rims of the holes are a little uneven


def test_crossings_are_the_winding_number_of_closed_meshes(points: np.ndarray) -> None:
    vertices, faces = joined(ball(0.25), ball(0.2, (0.2, 0, 0)))
    got = RayScene(vertices, faces).crossings(points, face_normals(vertices, faces))
    exact = (np.linalg.norm(points, axis=1) < 0.25).astype(int) + (
        np.linalg.norm(points - [0.2, 0, 0], axis=1) < 0.2
    )
    assert (got == exact).mean() > 0.99  # facets cut the round corners
    assert np.abs(winding_number(vertices, faces, points) - got).mean() < 0.02
    normals = smooth_normals(vertices, faces, weld(vertices))
    distance, normal = signed_distance_and_normals(
        vertices, faces, normals, RayScene(vertices, faces), points
    )
    assert ((distance < 0) == (got > 0)).all()
    assert np.allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-5)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_normals_ignore_seams_of_the_texture(dtype: type) -> None:
    vertices, faces = ball()
    split = vertices[faces].reshape(-1, 3).astype(dtype)  # every face with corners of its own
    own = np.arange(len(split)).reshape(-1, 3)
    normals = smooth_normals(split, own, weld(split))
    assert np.abs(normals - split / 0.3).max() < 0.01
    assert np.abs(smooth_normals(split, own, np.arange(len(split))) - split / 0.3).max() > 0.02


def test_the_photo_is_an_orthographic_view_of_the_warped_person() -> None:
    middle, generator = np.array([0.1, 0.85, -0.2]), np.random.default_rng(1)
    frame = PhotoFrame.looking(middle, distance=2.6, height=1.8)
    assert np.allclose(frame.axes @ frame.axes.T, np.eye(3))
    camera = middle + frame.distance * frame.axes[2]
    assert camera == pytest.approx([0.1, 1.8, 2.4])
    points = middle + generator.uniform(-0.8, 0.8, (500, 3))
    seen = frame.warp(points)
    # one pixel: all points of one ray from the camera
    along = camera + generator.uniform(0.7, 1.2, (500, 1)) * (points - camera)
    assert np.allclose(frame.warp(along)[:, :2], seen[:, :2])
    # and the nearer one has the larger z
    nearer = np.linalg.norm(along - camera, axis=1) < np.linalg.norm(points - camera, axis=1)
    assert ((frame.warp(along)[:, 2] > seen[:, 2]) == nearer).all()
    # a pinhole's picture, in meters at the person's middle
    local = (points - camera) @ frame.axes.T
    assert np.allclose(seen[:, :2], frame.distance * local[:, :2] / -local[:, 2:])
    # uprights are upright
    assert np.allclose(frame.warp(points + np.array([0, 0.3, 0]))[:, 2], seen[:, 2])
    assert np.allclose(frame.warp(middle), 0)
