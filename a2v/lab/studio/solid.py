"""People as solids: inside and signed distance of open, layered meshes, and the photo's frame.

Avatars are open (the eyes' backs, wigs) and layered (a wig over the scalp, a mouth behind the
lips). A point is inside if its generalized winding number exceeds one half (Jacobson et al. 2013;
fast evaluation: Barill et al. 2018). Distances are measured only to the outer layer.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.geometry.mesh import face_normals
from a2v.geometry.rays import RayScene, coherent
from a2v.geometry.sampling import cosine_directions
from a2v.types import BoolArray, FloatArray, IntArray

INSIDE = 0.5
"""Winding number above which a point is inside."""

_SHELL = (0.4, 0.75, 0.25)
# An open shell (a wig) has a winding number of one half in the plane of its opening, which lies in
# front of the face. A point is inside above the second number and outside below the first. Between
# them it is inside if at most the third number's fraction of directions is free.


def weld(vertices: FloatArray, tolerance: float = 1e-5) -> IntArray:
    """Return the number of each vertex's place (V, 3): vertices closer than about `tolerance`
    meters share one."""
    _, place = np.unique(
        np.round(vertices / tolerance).astype(np.int64), axis=0, return_inverse=True
    )
    return np.asarray(place).reshape(-1)


def smooth_normals(vertices: FloatArray, faces: IntArray, places: IntArray) -> FloatArray:
    """Return area-weighted unit normals (V, 3) float32, the same for all vertices of a place
    (`weld`), so that texture seams are invisible."""
    corner = vertices[faces].astype(np.float64)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    index = places[faces].ravel()
    count = int(places.max()) + 1
    total = np.stack(
        [np.bincount(index, np.repeat(normal[:, axis], 3), count) for axis in range(3)], axis=1
    )
    unit = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)
    return np.asarray(unit[places], np.float32)


def winding_number(vertices: FloatArray, faces: IntArray, points: FloatArray) -> FloatArray:
    """Return generalized winding numbers (N,) float64 of points (N, 3): 1 inside and 0 outside of a
    closed mesh, in between near openings."""
    import igl

    mesh = np.ascontiguousarray(vertices, np.float64), np.ascontiguousarray(faces, np.int64)
    if not len(points):
        return np.zeros(0)
    return np.asarray(igl.fast_winding_number(*mesh, np.ascontiguousarray(points, np.float64)))


OPEN_RAYS = 24
"""Number of rays of each face by which people's faces are sorted into visible ones and others."""


def open_faces(
    vertices: FloatArray, faces: IntArray, *, rays: int = 96, share: float = 0.04, seed: int = 0
) -> BoolArray:
    """Return the faces (F,) that see at least `share` of the hemisphere around their normal.

    These exclude mouths, scalps under wigs and the backs of eyes.
    """
    scene = RayScene(vertices, faces)
    normal = face_normals(vertices, faces)
    middle = vertices[faces].mean(axis=1)
    generator = np.random.default_rng(seed)
    free = np.zeros(len(faces))
    for _ in range(rays):
        direction = cosine_directions(normal, generator)
        free += ~scene.occluded(middle + 1e-3 * normal, direction)
    return np.asarray(free >= share * rays)


def caps(faces: IntArray, places: IntArray) -> IntArray:
    """Return faces (C, 3) that close every hole of a mesh: fans over the loops of edges with only
    one face.

    `places` (V,) are the result of `weld`: there is no hole between parts that meet in space. A
    loop that runs through a place twice is closed in the order in which it is found.
    """
    corner = places[faces]
    edges = np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]], corner[:, [2, 0]]])
    vertex = np.concatenate(
        [faces[:, 0], faces[:, 1], faces[:, 2]]
    )  # with the place of the edge's start
    edges, vertex = edges[edges[:, 0] != edges[:, 1]], vertex[edges[:, 0] != edges[:, 1]]
    count = int(places.max()) + 1
    key, twin = edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]
    lonely = ~np.isin(key, twin)
    following: dict[int, list[int]] = {}
    for start, end in edges[lonely].tolist():
        following.setdefault(start, []).append(end)
    vertex_at = dict(zip(edges[lonely][:, 0].tolist(), vertex[lonely].tolist(), strict=True))
    fans: list[tuple[int, int, int]] = []
    while following:
        start = next(iter(following))
        loop = [start]
        while (ends := following.get(loop[-1])) is not None:
            at = ends.pop()
            if not ends:
                del following[loop[-1]]
            if at == start:
                break
            loop.append(at)
        ring = [vertex_at[place] for place in loop if place in vertex_at]
        fans += [(ring[0], ring[index + 1], ring[index]) for index in range(1, len(ring) - 1)]
    return np.array(fans, np.int64).reshape(-1, 3)


class Solid:
    """A mesh as a solid.

    Parameters
    ----------
    vertices : (V, 3) meters, faces : (F, 3)
    wall : (F,) bool, optional
        Faces that bound the solid for the winding number. Leave out pockets (mouths) that should
        count as filled.
    outer : (F,) bool, optional
        Faces to which distances are measured. Faces that another part of the person covers (an arm
        pressed into the trunk) are left out, too: a ray along their normal soon meets a wall from
        inside.
    shell : (F,) bool, optional
        Faces of an open shell over the solid (a wig), tested separately. A point inside either of
        them, or enclosed by both, is inside.
    closing : (C, 3) int, optional
        Faces that close all holes of the wall (`caps`). With them, inside is counted along a ray,
        which is faster.
    layered : (F,) bool, optional
        Faces of many thin layers (wigs, and the faces below). For these the slower but exact test
        is used: whether a point just above them is inside.
    """

    def __init__(
        self,
        vertices: FloatArray,
        faces: IntArray,
        *,
        wall: BoolArray | None = None,
        outer: BoolArray | None = None,
        layered: BoolArray | None = None,
        shell: BoolArray | None = None,
        closing: IntArray | None = None,
    ):
        """See the class."""
        self.vertices, self.faces = np.asarray(vertices, np.float32), np.asarray(faces)
        own = np.ones(len(self.faces), bool) if shell is None else ~shell
        self._wall = self.faces[own if wall is None else own & wall]
        self._shell = self.faces[~own]
        self._closed: RayScene | None = None
        if closing is not None:
            self._wall = np.concatenate([self._wall, closing])
            self._closed = RayScene(self.vertices, self._wall)
        self._all = RayScene(self.vertices, self.faces)
        candidates = np.arange(len(self.faces)) if outer is None else np.flatnonzero(outer)
        chosen = self.faces[candidates]
        # an outward ray from a covered face first meets the inside of another part
        outwards = face_normals(self.vertices, chosen)
        met = self._all.cast(self.vertices[chosen].mean(axis=1) + 1e-3 * outwards, outwards)
        leaving = (face_normals(self.vertices, self.faces[met.face * met.hit]) * outwards).sum(
            axis=1
        ) > 0
        covered = met.hit & leaving
        if layered is not None and layered.any():
            asked = np.flatnonzero(layered[candidates] & ~covered)
            above = self.vertices[chosen[asked]].mean(axis=1) + 2e-3 * outwards[asked]
            covered[asked] = self.inside(above)
        self.outer: IntArray = candidates[~covered]
        """Indices of the faces of the outer layer."""
        self._scene = RayScene(self.vertices, self.faces[self.outer])

    def inside(self, points: FloatArray) -> BoolArray:
        """Return whether points (N, 3) are inside."""
        if self._closed is not None:
            inside = self._closed.crossings(points, face_normals(self.vertices, self._wall)) > 0
        else:
            inside = winding_number(self.vertices, self._wall, points) > INSIDE
        if len(self._shell):
            low, high, free = _SHELL
            worn = self.vertices[self._shell]
            near = np.flatnonzero(
                ~inside
                & ((points > worn.min(axis=(0, 1))) & (points < worn.max(axis=(0, 1)))).all(axis=1)
            )
            shell = winding_number(self.vertices, self._shell, points[near])
            inside[near] = shell > high
            unsure = near[(shell > low) & (shell <= high)]
            inside[unsure] = self._openness(points[unsure]) < free
        return np.asarray(inside)

    def _openness(self, points: FloatArray, directions: int = 48) -> FloatArray:
        """Return the fraction (N,) of directions, evenly over the sphere, in which nothing is
        hit."""
        steps = np.arange(directions) + 0.5
        polar, around = np.arccos(1 - 2 * steps / directions), np.pi * (1 + 5**0.5) * steps
        sphere = np.stack(
            [np.cos(around) * np.sin(polar), np.cos(polar), np.sin(around) * np.sin(polar)], axis=-1
        )
        met = self._all.occluded(
            np.repeat(points, directions, axis=0), np.tile(sphere, (len(points), 1))
        )
        return np.asarray(1 - met.reshape(len(points), directions).mean(axis=1))

    def signed_distance(self, points: FloatArray) -> FloatArray:
        """Return the distance (N,) float32 to the outer layer, meters, negative inside."""
        order = coherent(points)
        distance = np.empty(len(points), np.float32)
        distance[order] = self._scene.closest(points[order]).distance
        return np.where(self.inside(points), -distance, distance)


@dataclass(frozen=True)
class PhotoFrame:
    """The weak-perspective frame in which a perspective photo is an exact orthographic front view
    of upright people.

    In the axes of the camera (x right, y up, z towards the camera), around the person's middle at
    the distance d: ``x' = x d / (d - z)``, ``y' = y d / (d - z)``. So all points in one pixel of
    the camera have the same x' and y'. The depth is measured over the floor, ``z' = z cos p - y sin
    p`` with the camera's pitch p. So an upright person is upright in this frame, too, at any height
    of the camera. (The pitch can hardly be seen in a photo, and `a2v.body.fit_body` assumes upright
    people.) Along each ray z' grows with z, so that rays along -z' first meet the surface that the
    camera sees. The unit is a meter at the person's middle.

    Attributes
    ----------
    axes : (3, 3) float64
        Rows: the camera's axes in the world.
    middle : (3,) float64
        The point aimed at, world.
    distance : float
        From the camera to `middle`, meters.
    """

    axes: FloatArray
    middle: FloatArray
    distance: float

    @classmethod
    def looking(cls, middle: FloatArray, *, distance: float, height: float) -> PhotoFrame:
        """Return a camera on +z of the person's middle, `distance` meters away over the floor and
        `height` meters above the floor."""
        camera = np.array([middle[0], height, middle[2] + distance])
        back = camera - middle
        reach = float(np.linalg.norm(back))
        z = back / reach
        x = np.cross([0.0, 1.0, 0.0], z)
        x /= np.linalg.norm(x)
        return cls(np.stack([x, np.cross(z, x), z]), np.asarray(middle, np.float64), reach)

    @property
    def height(self) -> float:
        """Height of the camera above the floor, meters."""
        return float(self.middle[1] + self.distance * self.axes[2, 1])

    @property
    def pitch(self) -> float:
        """Angle by which the camera looks down, radians."""
        return float(np.arcsin(self.axes[2, 1]))

    @property
    def over_floor(self) -> float:
        """Distance from the camera to `middle`, measured over the floor, meters."""
        return float(self.distance * self.axes[1, 1])

    def warp(self, points: FloatArray) -> FloatArray:
        """Map points (..., 3) of the world to the frame, float64."""
        local = (points.astype(np.float64) - self.middle) @ self.axes.T
        zoom = self.distance / (self.distance - local[..., 2:])
        cosine, sine = self.axes[1, 1], self.axes[2, 1]
        return np.concatenate(
            [local[..., :2] * zoom, cosine * local[..., 2:] - sine * local[..., 1:2]], axis=-1
        )
