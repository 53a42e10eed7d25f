"""Move the fitted body in depth to the networks' maps, vertex by vertex, smoothly over its skin."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.body.skin import skin_vertices
from a2v.geometry.images import sample_image
from a2v.geometry.mesh import factored, laplacian
from a2v.geometry.visibility import visible_vertices
from a2v.reconstruction.implicit.inputs import GUIDE
from a2v.reconstruction.implicit.model import ImplicitPerson
from a2v.types import Body, BoolArray, FloatArray, IntArray, OrthographicCamera

STIFFNESS = 50.0
"""Distance over which moves spread on the guide's skin: the square of the number of edges."""
EDGE = 0.04
"""Step in the guide's depth from pixel to pixel above which maps are not used nearby, meters: they
are blurred over it."""
DOUBT = 0.04
"""Moves of this many meters have a weight of one quarter. Where maps and fit are far apart, often
the maps are wrong."""


def moved_body(person: ImplicitPerson, body: Body) -> Body:
    """Return the body, in the frame of the person's camera, with its skin at the depths of the
    networks' maps."""
    frame = person.frame
    zoom = GUIDE / frame.size
    camera = OrthographicCamera(
        scale=frame.camera.scale * zoom,
        center_u=frame.camera.center_u * zoom,
        center_v=frame.camera.center_v * zoom,
    )
    vertices, faces = person.guide.mesh
    held, told = person.guide.maps(frame.camera, frame.size), person.maps["maps"][0][6:8]
    moves, trust = np.zeros((2, len(vertices))), np.zeros((2, len(vertices)))
    for side, depth, row in ((1, held.depth_front, 0), (-1, held.depth_back, 1)):
        seen = visible_vertices(vertices * np.array([side, 1, side]), faces)
        pixels = camera.project(vertices[seen])
        moves[row, seen] = (
            sample_image(np.ascontiguousarray(told[row]), pixels, linear=True) - vertices[seen, 2]
        )
        trust[row, seen] = (
            sample_image(_smooth_pixels(depth).astype(np.float32), pixels, linear=True) > 0.99
        )
    trust /= (1 + (moves / DOUBT) ** 2) ** 2
    placed = body.vertices.astype(np.float64)
    placed[skin_vertices(len(body.vertices), body.faces), 2] += spread_over_mesh(
        moves, trust, faces
    )
    return dataclasses.replace(body, vertices=placed.astype(np.float32))


def _smooth_pixels(depth: FloatArray) -> BoolArray:
    """Return pixels (H, W) of a depth map, NaN outside, that are not near a step above `EDGE` or
    near the border."""
    import cv2

    known = np.isfinite(depth)
    filled = np.where(known, depth, -10.0).astype(np.float32)
    kernel = np.ones((5, 5), np.uint8)
    return np.asarray(known & (cv2.dilate(filled, kernel) - cv2.erode(filled, kernel) < EDGE))


def spread_over_mesh(values: FloatArray, trust: FloatArray, faces: IntArray) -> FloatArray:
    """Combine several values (K, V) per vertex with their `trust` (K, V) into one value (V,),
    smooth over the mesh.

    It is 0 far from all known values.
    """
    from scipy.sparse import coo_matrix, diags

    count = values.shape[1]
    beside = coo_matrix(
        (np.ones(faces.size), (faces.ravel(), np.roll(faces, 1, axis=1).ravel())), (count, count)
    )
    matrix = diags(trust.sum(axis=0) + 1e-3) + STIFFNESS * laplacian((beside + beside.T) / 2)
    return np.asarray(factored(matrix).solve((trust * values).sum(axis=0)))
