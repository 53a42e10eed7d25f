"""Surfaces around a body, such as backends give."""

from __future__ import annotations

import numpy as np

from a2v.types import Body, Reconstruction, Surface


def coated(
    body: Body,
    *,
    cell: float,
    coat: float,
    above: float = -np.inf,
    ball: tuple[np.ndarray, float] | None = None,
) -> Reconstruction:
    """One closed piece `coat` meters around the body's skin, in cells of `cell` meters.

    Finer detail is lost. `above` limits it to vertices over a height.

    A `ball` (middle, radius) is one with it.
    """
    from skimage.measure import marching_cubes

    from a2v.geometry.mesh import keep_pieces

    low, high = body.vertices.min(axis=0) - 0.03, body.vertices.max(axis=0) + 0.03
    if ball is not None:
        low, high = (
            np.minimum(low, ball[0] - ball[1] - 0.03),
            np.maximum(high, ball[0] + ball[1] + 0.03),
        )
    low[1] = max(low[1], above)
    counts = np.ceil((high - low) / cell).astype(int)
    axes = [low[k] + cell * np.arange(counts[k]) for k in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).astype(np.float32)
    distance = _distance(body, grid, cell=cell, coat=coat)
    if ball is not None:
        distance = np.minimum(distance, np.linalg.norm(grid - ball[0], axis=-1) - ball[1])
    distance[0], distance[-1], distance[:, 0], distance[:, -1] = (
        np.maximum(edge, 0.004)
        for edge in (distance[0], distance[-1], distance[:, 0], distance[:, -1])
    )
    vertices, faces, _, _ = marching_cubes(distance, 0.0, spacing=(cell,) * 3)
    faces = faces.astype(np.int64)
    vertices, faces = keep_pieces(
        vertices + low, faces[:, ::-1] if _inside_out(vertices, faces) else faces
    )
    surface = Surface(
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        colors=np.full(vertices.shape, 0.5, np.float32),
    )
    return Reconstruction(surface=surface, backend="test", expected_colors=surface.colors)


def _inside_out(vertices: np.ndarray, faces: np.ndarray) -> bool:
    corners = vertices[faces]
    return float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))) < 0


def _distance(body: Body, grid: np.ndarray, *, cell: float, coat: float) -> np.ndarray:
    """Signed distance of the nodes of a `grid` (I, J, K, 3) from what lies `coat` meters around the
    skin.

    Nodes that are surely not beside it have the distance of a node nearby, as a distance changes
    by at most the way.
    """
    import open3d

    skin = body.faces[body.faces.max(axis=1) < 13348]
    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(body.vertices[:13348].astype(np.float64)),
        open3d.utility.Vector3iVector(skin),
    )
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(open3d.t.geometry.TriangleMesh.from_legacy(mesh))

    def measured(points: np.ndarray) -> np.ndarray:
        return scene.compute_signed_distance(np.ascontiguousarray(points)).numpy() - coat

    sides = [np.minimum(np.arange(count) // 3 * 3 + 1, count - 1) for count in grid.shape[:3]]
    coarse = measured(grid[np.ix_(*(side[::3] for side in sides))])
    distance = coarse[np.ix_(*(np.arange(count) // 3 for count in grid.shape[:3]))]
    beside = np.abs(distance) < 2.1 * np.sqrt(3) * cell  # to that node, and on to the next
    distance[beside] = measured(grid[beside])
    return distance
