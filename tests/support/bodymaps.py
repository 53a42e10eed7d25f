"""Body maps as a network without errors would predict them."""

from __future__ import annotations

import numpy as np

from a2v.body import load_body_model
from a2v.body.places import canonical_places
from a2v.body.silhouette import rasterize
from a2v.types import Body, BodyMap, OrthographicCamera
from tests.support.bodies import landmarks_of


def bodymap_of(body: Body, camera: OrthographicCamera, side: float, *, cells: int = 64) -> BodyMap:
    """The true map of a body's front on a square of `side` pixels at the photo's origin."""
    step = side / cells
    seen = rasterize(body.vertices, body.faces, camera, (cells, cells), step=step)
    canonical = canonical_places()
    place = np.zeros((len(body.vertices), 3), np.float32)
    place[canonical.vertex_ids] = canonical.places
    weights = np.concatenate(
        [1 - seen["barycentric"].sum(axis=-1, keepdims=True), seen["barycentric"]], axis=-1
    )
    places = (weights[..., None] * place[body.faces[np.maximum(seen["face"], 0)]]).sum(axis=2)
    points = landmarks_of(load_body_model(), body)
    hips = points[[23, 24], 2].mean()
    depth = np.where(seen["mask"], (seen["depth"] - hips) * camera.scale, 0)
    small = np.full((cells, cells), 0.01)
    return BodyMap(
        landmarks=np.concatenate(
            [camera.project(points), camera.scale * (points[:, 2:] - hips)], axis=1
        ).astype(np.float32),
        landmark_scales=np.full((33, 2), 0.5, np.float32),
        places=places.astype(np.float32),
        place_scales=small.astype(np.float32),
        depths=np.stack([depth, depth - 0.2 * camera.scale], axis=-1).astype(np.float32),
        depth_scales=np.full((cells, cells, 2), 1.0, np.float32),
        inside=seen["mask"],
        corner=(0.0, 0.0),
        step=step,
    )
