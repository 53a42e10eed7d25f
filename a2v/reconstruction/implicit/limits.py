"""How far from the guide a person can be: the networks' field is cut there, so that no limb becomes a slab and nothing is spun between limbs."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from a2v.geometry.images import sample_image
from a2v.geometry.mesh import laplacian
from a2v.geometry.visibility import visible_vertices
from a2v.reconstruction.implicit.inputs import GUIDE, GuideMesh
from a2v.reconstruction.implicit.model import ImplicitPerson
from a2v.reconstruction.thickness import reach_map, see_layers
from a2v.types import FloatArray, IntArray, OrthographicCamera

MOST = 0.12
"""The networks' maps move the guide by at most so much in depth, metres."""
STIFFNESS = 50.0
"""How far such moves spread over the guide's skin: the square of its edges."""
EDGE = 0.04
"""A step in the guide's depth from pixel to pixel, metres, near which maps tell nothing: they are blurred over it."""


@dataclass(frozen=True, eq=False)
class GuideLimits:
    """Limits around a guide.

    Attributes
    ----------
    guides : tuple of GuideMesh
        The guide where the fit has it, and where the networks' maps have it.
    middle : float
        z of the guides' origin in the frame of `camera`, metres.
    camera : OrthographicCamera
        Of the pixels of `reach`.
    reach : (S, S) float32
        `reach_map`.
    """

    guides: tuple[GuideMesh, ...]
    middle: float
    camera: OrthographicCamera
    reach: FloatArray

    @classmethod
    def of(cls, person: ImplicitPerson) -> GuideLimits:
        """The limits of a person that the networks saw."""
        frame, size = person.frame, GUIDE
        zoom = size / frame.size
        camera = OrthographicCamera(
            scale=frame.camera.scale * zoom, center_u=frame.camera.center_u * zoom, center_v=frame.camera.center_v * zoom
        )
        vertices, faces = person.guide.mesh
        held = person.guide.maps(frame.camera, frame.size, size)
        body = np.isfinite(held.depth_front) & np.isfinite(held.depth_back)
        mask = cv2.resize(frame.mask, (size, size), interpolation=cv2.INTER_AREA) > 0.5
        places = np.stack(np.meshgrid(*(np.arange(size) + 0.5137,) * 2), axis=-1).reshape(-1, 2)
        longest = see_layers(vertices, faces, camera, places).longest.reshape(size, size)
        single = body & (longest > 0.9 * (held.depth_front - held.depth_back))
        told = person.maps["maps"][0][6:8]
        moved = np.zeros((2, len(vertices)))
        trust = np.zeros((2, len(vertices)))
        for side, depth, row in ((1, held.depth_front, 0), (-1, held.depth_back, 1)):
            seen = visible_vertices(vertices * np.array([side, 1, side]), faces)
            pixels = camera.project(vertices[seen])
            moved[row, seen] = sample_image(np.ascontiguousarray(told[row]), pixels, linear=True) - vertices[seen, 2]
            trust[row, seen] = sample_image(_smooth_pixels(depth).astype(np.float32), pixels, linear=True) > 0.99
        shift = spread_over_mesh(np.clip(moved, -MOST, MOST), trust, faces)
        there = vertices + np.array([0, 0, 1]) * shift[:, None]
        return cls((person.guide, GuideMesh(there, faces)), person.middle, camera, reach_map(mask, body, single, camera.scale))

    def beyond(self, points: FloatArray) -> FloatArray:
        """How far points (N, 3), metres, lie beyond the limits (N,), negative within."""
        reach = sample_image(self.reach, self.camera.project(points), linear=True)
        asked = np.asarray(points, np.float32) - np.array([0, 0, self.middle], np.float32)
        result = np.full(len(asked), np.inf, np.float32)
        for guide in self.guides:
            left = np.flatnonzero(result > 0)
            if len(left):
                result[left] = np.minimum(result[left], guide.at(asked[left])[0] - reach[left])
        return result


def _smooth_pixels(depth: FloatArray) -> FloatArray:
    """Pixels (H, W) of a depth map, NaN outside, that are not near a step of over `EDGE` or the border."""
    known = np.isfinite(depth)
    filled = np.where(known, depth, -10.0).astype(np.float32)
    kernel = np.ones((5, 5), np.uint8)
    return np.asarray(known & (cv2.dilate(filled, kernel) - cv2.erode(filled, kernel) < EDGE))


def spread_over_mesh(values: FloatArray, trust: FloatArray, faces: IntArray) -> FloatArray:
    """One value (V,) a vertex from several (K, V) that are trusted as `trust` (K, V) says: smooth over the mesh, 0 far from all that is known."""
    from scipy.sparse import coo_matrix, diags
    from scipy.sparse.linalg import spsolve

    count = values.shape[1]
    beside = coo_matrix((np.ones(faces.size), (faces.ravel(), np.roll(faces, 1, axis=1).ravel())), (count, count))
    matrix = diags(trust.sum(axis=0) + 1e-3) + STIFFNESS * laplacian((beside + beside.T) / 2)
    result: FloatArray = spsolve(matrix.tocsc(), (trust * values).sum(axis=0))
    return result
