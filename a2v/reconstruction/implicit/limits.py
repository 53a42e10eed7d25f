"""Limits on the networks' surface relative to the dressed body: no limb becomes a slab, and nothing
is spanned between limbs.

A network that is unsure of a limb's depth fills the space between all its possible positions. So
its field is used only within a shell around the fitted body after `dress`. The surface then keeps
the topology of a person, and occluded limbs are complete.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.geometry.images import sample_image
from a2v.geometry.mesh import evened, vertex_normals
from a2v.geometry.rays import RayScene
from a2v.reconstruction.body_prior.columns import sample_columns
from a2v.reconstruction.body_prior.surface import DressedBody
from a2v.reconstruction.implicit.inputs import mask_distance
from a2v.reconstruction.implicit.model import ImplicitPerson
from a2v.system import thread_count
from a2v.types import FloatArray, IntArray, OrthographicCamera

THICKER = 0.06
"""Largest move outward, as a fraction of the dressed body's thickness there."""
THINNER = 0.2
"""Largest move inward, as a fraction of that thickness."""
GAP = 0.4
"""Largest move outward, as a fraction of the distance to the next surface, so that separate limbs
stay separate."""
RIM = 0.15
"""Largest move, as a fraction of the distance to the mask's contour: at the contour a body is
round."""
CLOTH = 0.15
"""The same fraction for cloth between the legs. The guide of the networks has nothing there, so
that they would tear the cloth."""
BAND = 0.025
"""Largest move, meters."""
THICKEST = 0.25
"""Larger thickness is clipped to this, meters."""
ROUNDS = 20
"""Number of rings of neighbors on the grid's mesh over which the thickness is averaged."""


@dataclass(frozen=True, eq=False)
class ShellLimits:
    """A shell around a dressed body.

    Attributes
    ----------
    dressed : DressedBody
        Its distances are known at least up to `BAND`.
    places : scipy.spatial.cKDTree
        Tree of points (P, 3) on its surface.
    outwards, inwards : (P,)
        Largest moves of the surface there, meters.
    inside : (S, S) float32
        Distance to the mask's contour, meters, 0 outside.
    camera : OrthographicCamera
        Of the pixels of `inside`.
    """

    dressed: DressedBody
    places: Any
    outwards: FloatArray
    inwards: FloatArray
    inside: FloatArray
    camera: OrthographicCamera

    @classmethod
    def of(cls, person: ImplicitPerson, dressed: DressedBody) -> ShellLimits:
        """Build the limits of a person around the dressed body in the frame of the same camera.

        Raises
        ------
        InputError
            No part of the body lies within the mask.
        """
        from scipy.spatial import cKDTree

        vertices, faces = _mesh_of(dressed)
        thickness, gap = room(vertices, faces)
        thickness = evened(faces, thickness, ROUNDS)
        camera = person.frame.camera
        trust = 1 - (1 - CLOTH) * np.clip(
            sample_columns(dressed.cloth, vertices, dressed.grid), 0, 1
        )
        return cls(
            dressed,
            cKDTree(vertices),
            trust * np.minimum(np.minimum(THICKER * thickness, GAP * gap), BAND),
            trust * np.minimum(THINNER * thickness, BAND),
            np.maximum(-mask_distance(person.frame.mask, camera.scale), 0),
            camera,
        )

    def keep(self, points: FloatArray, values: FloatArray) -> FloatArray:
        """Clamp signed distances `values` (N,) at points (N, 3), meters, so that their zero level
        lies within the shell."""
        from scipy.ndimage import map_coordinates

        grid = self.dressed.grid
        index = (np.asarray(points, np.float64) - grid.origin) / grid.cell
        held = map_coordinates(
            self.dressed.field, index.T, order=1, mode="nearest", prefilter=False
        )
        kept = np.where(held > 0, np.maximum(values, BAND), np.minimum(values, -BAND)).astype(
            np.float32
        )
        near = np.flatnonzero(np.abs(held) < BAND)
        if len(near):
            place = self.places.query(points[near], workers=thread_count())[1]
            rim = RIM * sample_image(self.inside, self.camera.project(points[near]), linear=True)
            lowest, highest = (
                held[near] - np.minimum(self.outwards[place], rim),
                held[near] + np.minimum(self.inwards[place], rim),
            )
            kept[near] = np.clip(values[near], lowest, highest)
        return kept


def room(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    """Measure the thickness of a closed mesh behind each vertex (V,), and the free distance in
    front of it (V,); meters.

    The mesh has vertices (V, 3) and faces (F, 3). Thickness is at most `THICKEST`; the distance is
    infinite if nothing is in front.
    """
    normals = vertex_normals(vertices, faces)
    rays = RayScene(vertices, faces)
    off = 1e-4 * normals
    behind, before = (
        rays.cast((vertices - side * off).astype(np.float32), (-side * normals).astype(np.float32))
        for side in (1, -1)
    )
    thickness = np.where(behind.hit, np.minimum(behind.distance, THICKEST), THICKEST)
    return thickness, np.where(before.hit, before.distance, np.inf)


def _mesh_of(dressed: DressedBody) -> tuple[FloatArray, IntArray]:
    """Extract the surface where a dressed body's distance is zero.

    Returns vertices (V, 3) in meters and faces (F, 3) that point outward.
    """
    from skimage.measure import marching_cubes

    if not (dressed.field < 0).any():
        raise InputError(
            "no part of the body lies within the mask; fit it to this photo first "
            "(a2v.body.fit_body)"
        )
    closed = np.pad(dressed.field, 1, constant_values=BAND)
    vertices, faces, _, _ = marching_cubes(closed, 0.0, gradient_direction="descent")
    return dressed.grid.origin + (
        vertices.astype(np.float64) - 1
    ) * dressed.grid.cell, faces.astype(np.int64)
