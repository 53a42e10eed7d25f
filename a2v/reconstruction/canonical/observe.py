"""Observe the displacement of the body from a reconstructed surface: rays from the posed skin, kept
if they meet the same part of the person."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.parts import PART_NEIGHBORS, PARTS, on_parts
from a2v.geometry.mesh import evened, face_normals, vertex_normals
from a2v.geometry.rays import RayScene
from a2v.geometry.vectors import unit
from a2v.reconstruction.canonical.shape import RestMesh
from a2v.reconstruction.reading.shown import STEP
from a2v.system import thread_count
from a2v.types import BoolArray, Camera, FloatArray, IntArray, Surface

_MOST: dict[str, float] = {
    "head": 0.14,
    "neck": 0.12,
    "torso": 0.16,
    "upper_arm": 0.09,
    "lower_arm": 0.09,
    "hand": 0.03,
    "thigh": 0.14,
    "shin": 0.12,
    "foot": 0.03,
}
"""Largest distance of cloth and hair from the skin of each part, meters."""
_SUNK = 0.035
"""Largest depth of the surface below the fitted skin, meters."""
_AGREE = 0.25
"""Smallest cosine between the normals of skin and surface for which a hit counts."""
_FOREIGN = (0.8, 0.012)
"""A hit counts if the nearest skin of another limb is farther away than the first value times the
hit's own distance plus the second value, meters, so that the limbs do not touch there."""
_GROWN = tuple(("torso", f"{side}_upper_arm") for side in ("left", "right"))
"""Parts that grow into each other and also touch in the photo: a hanging arm lies on the trunk."""
_APART = 0.02
"""Skin of such a part is another limb's if it is farther away at rest than in the photo by this
distance, meters."""
_UNSEEN = 0.35
"""Weight of a displacement that the photo does not show, which only the network predicts."""
_EVENED = 2
"""Number of rings of vertices over which normals are averaged before rays leave along them. Without
it, rays cross in creases."""


@dataclass(frozen=True, eq=False)
class Observed:
    """Displacements of vertices along their normals.

    Attributes
    ----------
    offset : (V,) float64
        Meters; 0 for vertices without an observation.
    weight : (V,) float64
        0 for vertices without an observation, 1 if the photo shows the place.
    normals : (V, 3) float64
        Unit normals of the posed skin, along which the displacements are measured.
    """

    offset: FloatArray
    weight: FloatArray
    normals: FloatArray


def ray_normals(vertices: FloatArray, faces: IntArray) -> FloatArray:
    """Unit normals (V, 3) along which vertices are displaced."""
    return unit(evened(faces, vertex_normals(vertices, faces), _EVENED), least=1e-9)


@dataclass(frozen=True, eq=False)
class PersonView:
    """The camera of the photo, and the pixels of the mask that do not show the person
    (`Reading.taken`)."""

    camera: Camera
    taken: BoolArray


def observe(
    surface: Surface,
    mesh: RestMesh,
    skin: FloatArray,
    allowed: BoolArray,
    *,
    near: float,
    view: PersonView,
) -> Observed:
    """Cast the posed skin onto a surface.

    Parameters
    ----------
    surface : Surface
        Closed, in the photo's pose.
    mesh : RestMesh
        The body's mesh at rest.
    skin : (V, 3)
        Its vertices in the photo's pose, meters.
    allowed : (V,) bool
        Vertices whose displacement is measured.
    near : float
        See `CharacterSettings`.
    view : PersonView
        The photo of the surface.
    """
    from scipy.spatial import cKDTree

    normals = ray_normals(skin, mesh.faces)
    scene = RayScene(surface.vertices, surface.faces)
    flat = face_normals(surface.vertices, np.asarray(surface.faces, np.int64))
    own = np.flatnonzero(allowed)
    inside = scene.crossings(np.asarray(skin[own], np.float32), flat) > 0
    way = np.where(inside, 1.0, -1.0)
    hits = scene.cast(
        np.asarray(skin[own], np.float32), np.asarray(normals[own] * way[:, None], np.float32)
    )
    met = np.where(hits.hit[:, None], flat[np.where(hits.hit, hits.face, 0)], 0.0)
    offset = np.where(hits.hit, hits.distance, 0.0) * way
    thickest = np.array(
        [_MOST[name.removeprefix("left_").removeprefix("right_")] for name in PARTS]
    )[mesh.parts[own]]
    good = (
        hits.hit
        & ((met * normals[own]).sum(axis=1) > _AGREE)
        & (offset < thickest)
        & (offset > -_SUNK)
    )
    places = skin[own] + offset[:, None] * normals[own]
    nearest = cKDTree(skin[allowed]).query(places, workers=1)[1]
    good &= np.linalg.norm(mesh.vertices[own[nearest]] - mesh.vertices[own], axis=1) < near
    least = _FOREIGN[0] * np.abs(offset[good]) + _FOREIGN[1]
    most = 1.001 * float(least.max(initial=_FOREIGN[1]))
    good[good] = _foreign(places[good], skin, mesh.parts, own[good], most) > least
    good[good] = ~_touching(places[good], skin, mesh, own[good], np.abs(offset[good]))
    good &= _of_person(places, view)
    seen = _seen(scene, places, met, view.camera)
    found, weight = np.zeros(len(skin)), np.zeros(len(skin))
    found[own] = np.where(good, offset, 0.0)
    weight[own] = good * np.where(seen, 1.0, _UNSEEN)
    return Observed(found, weight, normals)


def _foreign(
    places: FloatArray, skin: FloatArray, parts: IntArray, own: IntArray, most: float
) -> FloatArray:
    """Distance of each place (n, 3), meters, from the nearest skin of a part that does not grow
    into its own; infinite from `most` on, which makes the search several times as fast."""
    from scipy.spatial import cKDTree

    pairs = {frozenset(map(PARTS.index, pair)) for pair in PART_NEIGHBORS}
    beyond = np.full(len(places), np.inf)
    for part in np.unique(parts):
        asked = np.array(
            [
                part != mine and frozenset((int(part), int(mine))) not in pairs
                for mine in range(len(PARTS))
            ]
        )[parts[own]]
        if asked.any() and (parts == part).any():
            tree = cKDTree(skin[parts == part])
            found = tree.query(places[asked], distance_upper_bound=most, workers=thread_count())[0]
            beyond[asked] = np.minimum(beyond[asked], found)
    return beyond


def _touching(
    places: FloatArray, skin: FloatArray, mesh: RestMesh, own: IntArray, reach: FloatArray
) -> BoolArray:
    """Return for which vertices `own` (n,), displaced by `reach` (n,) to `places` (n, 3), trunk and
    arm touch there. Skin near the armpit is near in every pose and does not count."""
    from scipy.spatial import cKDTree

    result = np.zeros(len(own), bool)
    for pair in _GROWN:
        for mine, other in (pair, pair[::-1]):
            asked = np.flatnonzero(on_parts(mesh.parts[own], mine))
            beside = np.flatnonzero(on_parts(mesh.parts, other))
            if not (len(asked) and len(beside)):
                continue
            away, near = cKDTree(skin[beside]).query(places[asked], workers=thread_count())
            at_rest = mesh.vertices[beside[near]] - mesh.vertices[own[asked]]
            result[asked] |= (away < _FOREIGN[0] * reach[asked] + _FOREIGN[1]) & (
                np.linalg.norm(at_rest, axis=1) > away + _APART
            )
    return result


def _seen(scene: RayScene, places: FloatArray, normals: FloatArray, camera: Camera) -> BoolArray:
    """Return which places (n, 3), with the normals (n, 3) of the surface, the camera sees; places
    on the outline count as seen."""
    ahead = unit(
        camera.raised(camera.flatten(places) + np.array([0.0, 0.0, 0.01])) - places, least=1e-9
    )  # along the pixel's ray
    hidden = scene.occluded(
        np.asarray(places + 0.003 * normals + 0.002 * ahead, np.float32),
        np.asarray(ahead, np.float32),
    )
    return np.asarray(~hidden & ((normals * ahead).sum(axis=1) > -0.15))


def _of_person(places: FloatArray, view: PersonView) -> BoolArray:
    """Return which places (n, 3) lie in pixels of the photo that show the person, and not something
    that the mask took for the person."""
    height, width = view.taken.shape
    pixels = np.floor(view.camera.project(places) / STEP).astype(np.int64)
    return np.asarray(
        ~view.taken[np.clip(pixels[:, 1], 0, height - 1), np.clip(pixels[:, 0], 0, width - 1)]
    )
