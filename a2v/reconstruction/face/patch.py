"""The front of the head of the body model as a patch: its faces, its rim, and the kinds of its
vertices."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from a2v.body.face import EYES, SKIN, TONGUE, points_on_face, teeth
from a2v.body.registry import default_rest, load_body_model
from a2v.geometry.mesh import border_loops
from a2v.geometry.rays import ray_scene
from a2v.geometry.sewing import single_rim
from a2v.reconstruction.face.places import BROWS, LEFT_EYE, LIPS, RIGHT_EYE, SURROUNDINGS
from a2v.types import BoolArray, FloatArray, IntArray

_MARGIN = 0.008
"""Distance of the rim from eyes, brows, lips and chin, meters on the body at rest."""


@dataclass(frozen=True)
class Patch:
    """The front of Anny's head.

    Attributes
    ----------
    vertices : (K,) int
        Anny's vertices; from 13718 on its teeth.
    faces : (F, 3) int
        Into `vertices`.
    rim : (n,) int
        Into `vertices`, in order, counter-clockwise seen from the front.
    kinds : (K,) uint8
        Kind of each vertex, an index into `a2v.types.FACE_KINDS`.
    front : (F2,) int
        Faces of Anny's skin that are visible from the front.
    within : (13718-face,) bool
        Which faces of Anny belong to the patch.
    """

    vertices: IntArray
    faces: IntArray
    rim: IntArray
    kinds: IntArray
    front: IntArray
    within: BoolArray


@functools.cache
def face_patch() -> Patch:
    """The patch, found once on Anny at rest."""
    model = load_body_model("anny")
    rest = default_rest()
    faces = model.faces.astype(np.int64)
    visible = _front_faces(rest, faces)
    skin_faces = faces.max(axis=1) < SKIN.stop
    front = np.flatnonzero(visible & skin_faces & (rest[faces].mean(axis=1)[:, 1] > 0.6))
    inside = _enclosed(rest, faces, front)
    own = skin_faces & inside[faces].all(axis=1)
    own = single_rim(faces, own)
    rim = border_loops(faces[own])
    extra = faces[faces.min(axis=1) >= SKIN.stop]
    rows = teeth()
    every = np.concatenate([faces[own], extra, rows.faces + EYES.stop])
    vertices = np.unique(every)
    place = np.full(EYES.stop + len(rows.vertices), -1)
    place[vertices] = np.arange(len(vertices))
    kinds = np.zeros(len(place), np.uint8)
    seen = np.zeros(len(place), bool)
    seen[faces[front]] = True
    lips = points_on_face(rest)[list(LIPS)]
    near = np.abs(rest - lips.mean(axis=0)).max(axis=1) < 0.06
    low, high = lips[:, :2].min(axis=0) - 0.004, lips[:, :2].max(axis=0) + 0.004
    across = (
        (rest[:, :2] > low - np.array([0, 0.01])) & (rest[:, :2] < high + np.array([0, 0.01]))
    ).all(axis=1)
    behind = _flood(
        faces[own],
        ~seen,
        np.flatnonzero(
            near & across & ~seen[: len(rest)] & (rest[:, 2] < lips[:, 2].mean() - 0.01)
        ),
    )
    kinds[behind] = 2
    kinds[TONGUE], kinds[EYES], kinds[EYES.stop :] = 3, 1, 4
    return Patch(vertices, place[every], place[rim[0]], kinds[vertices], front, own)


def _front_faces(vertices: FloatArray, faces: IntArray) -> BoolArray:
    """Return which faces (F,) a camera in front of the body sees."""
    middle = vertices[faces].mean(axis=1)
    rays = np.concatenate(
        [middle + np.array([0, 0, 5.0]), np.tile([0, 0, -1.0], (len(middle), 1))], axis=1
    ).astype(np.float32)
    hit = ray_scene(vertices, faces).cast_rays(rays)["t_hit"].numpy()
    return np.asarray(np.abs(hit - 5.0) < 1e-3)


def _enclosed(rest: FloatArray, faces: IntArray, front: IntArray) -> BoolArray:
    """Return Anny's vertices that cannot be reached from the crown without crossing the front
    between brows and chin."""
    import cv2

    marks = points_on_face(rest)[:, :2]
    outline = marks[[*RIGHT_EYE, *LEFT_EYE, *LIPS, *BROWS, *SURROUNDINGS]]
    hull = cv2.convexHull((outline * 1e4).astype(np.float32))
    on_front = np.zeros(len(rest), bool)
    on_front[faces[front]] = True
    marked = np.array(
        [
            cv2.pointPolygonTest(hull, (float(x), float(y)), True) > -_MARGIN * 1e4
            for x, y in rest[:, :2] * 1e4
        ]
    )
    marked &= on_front
    skin = faces[faces.max(axis=1) < SKIN.stop]
    outside = _flood(skin, ~marked, np.array([int(rest[: SKIN.stop, 1].argmax())]))
    inside = np.zeros(len(rest), bool)
    inside[SKIN] = True
    inside[outside] = False
    return inside


def _flood(faces: IntArray, allowed: BoolArray, seeds: IntArray) -> IntArray:
    """Vertices that are connected to the `seeds` by edges between `allowed` ones."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    pairs = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    pairs = pairs[allowed[pairs].all(axis=1)]
    count = len(allowed)
    _, label = connected_components(
        sp.coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count)),
        directed=False,
    )
    return np.flatnonzero(np.isin(label, np.unique(label[seeds[allowed[seeds]]])) & allowed)
