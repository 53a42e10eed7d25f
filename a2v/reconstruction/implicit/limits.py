"""How far the networks may move a person's surface from that of the dressed body, so that no limb
becomes a slab and nothing is spun between limbs.

A network that is unsure of the depth fills what lies between all places where a limb could be. So
its field has a say within a shell around the fitted body as `dress` dresses it, and nowhere else:
the surface keeps the topology of a person, and limbs that nothing shows are whole.
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
from a2v.types import FloatArray, IntArray, OrthographicCamera

THICKER = 0.06
"""The surface moves out by at most this share of the thickness that the dressed body has there."""
THINNER = 0.2
"""It moves in by at most this share of it."""
GAP = 0.4
"""It moves out by at most this share of the way to what is next to it: limbs that stand apart stay
apart."""
RIM = 0.15
"""It moves by at most this share of the way to the mask's contour: at the contour a body is
round."""
CLOTH = 0.15
"""So much of that where cloth hangs between the legs: the networks are guided by a body that has
nothing there, and would tear it."""
BAND = 0.025
"""It never moves farther, meters."""
THICKEST = 0.25
"""More than so many meters of thickness do not count."""
ROUNDS = 20
"""Thickness is averaged over so many rings of neighbors on the grid's mesh."""


@dataclass(frozen=True, eq=False)
class ShellLimits:
    """A shell around a dressed body.

    Attributes
    ----------
    dressed : DressedBody
        Its distances are known up to `BAND` at least.
    places : scipy.spatial.cKDTree
        Of points (P, 3) on its surface.
    outwards, inwards : (P,)
        How far the surface may move there, meters.
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
        """The limits of a person that the networks saw, around the dressed body in the frame of the
        same camera.

        Raises
        ------
        InputError
            Nothing is left of the body within the mask.
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
        """Signed distances `values` (N,) at points (N, 3), meters, so that their zero level lies
        within the shell."""
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
            place = self.places.query(points[near], workers=1)[1]
            rim = RIM * sample_image(self.inside, self.camera.project(points[near]), linear=True)
            lowest, highest = (
                held[near] - np.minimum(self.outwards[place], rim),
                held[near] + np.minimum(self.inwards[place], rim),
            )
            kept[near] = np.clip(values[near], lowest, highest)
        return kept


def room(vertices: FloatArray, faces: IntArray) -> tuple[FloatArray, FloatArray]:
    """How thick a closed mesh, vertices (V, 3) and faces (F, 3), is behind each vertex (V,), and
    how far it is to what is before it (V,); meters.

    Thickness is at most `THICKEST`; the way is infinite where there is nothing.
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
            "nothing of the body lies within the mask; fit it to this photo first "
            "(a2v.body.fit_body)"
        )
    closed = np.pad(dressed.field, 1, constant_values=BAND)
    vertices, faces, _, _ = marching_cubes(closed, 0.0, gradient_direction="descent")
    return dressed.grid.origin + (
        vertices.astype(np.float64) - 1
    ) * dressed.grid.cell, faces.astype(np.int64)
