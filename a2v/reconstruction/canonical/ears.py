"""Find out whether hair or a hat covers the ears, and lay covered ears flat on the head."""

from __future__ import annotations

import functools

import numpy as np

from a2v.body.face import SKIN, teeth
from a2v.body.parts import PARTS
from a2v.body.registry import default_rest, load_body_model
from a2v.geometry.mesh import factored, laplacian, uniform_weights, vertex_normals
from a2v.geometry.rays import RayScene
from a2v.reconstruction.palettes import palette_distance
from a2v.reconstruction.reading.hair import SHADE, head_colors, typical_colors
from a2v.types import BoolArray, Camera, FloatArray, IntArray, Subject

_EAR = np.array([[0.06, 0.735, 0.026], [0.1, 0.803, 0.08]])
"""Box around the left ear of the default body at rest, meters."""
_FACING = 0.1
"""Smallest z of the normal of a place of the ear whose pixel is used."""
_ABOVE = 0.002
"""Distance from the skin at which rays to the camera begin, meters."""
_BLUR = 0.002
"""Blur of the photo, meters."""
_FEW = 40
"""Smallest number of visible vertices of the ears."""
_BARE = 0.2
"""Ears are covered if less than this share of their visible vertices looks more like the skin of
the face than like hair ..."""
_UNLIKE = 13.0
"""... and if the median distance of their colors from that skin is above this, CIELAB units."""


@functools.cache
def ears() -> BoolArray:
    """Return which of Anny's vertices and teeth (13854,) belong to the ears and the skin around
    their roots."""
    model = load_body_model("anny")
    rest = default_rest()
    place = np.abs(rest * [1, 0, 0]) + rest * [0, 1, 1]
    own = (model.parts == PARTS.index("head")) & ((place > _EAR[0]) & (place < _EAR[1])).all(axis=1)
    own[SKIN.stop :] = False
    return np.concatenate([own, np.zeros(len(teeth().vertices), bool)])


def ears_covered(subject: Subject, posed: FloatArray, camera: Camera) -> bool | None:
    """Return whether hair or a hat covers the ears in the photo; None if it does not show them.

    The visible places of both ears are compared with the skin of the face and with the hair above
    the forehead. Both ears count together.

    Parameters
    ----------
    posed : (13854, 3)
        Anny's vertices and teeth in the pose of the photo, with the face of the photo.
    """
    if subject.face is None:
        return None
    column, row = np.floor(camera.project(posed[_visible(posed, camera)])).astype(np.int64).T
    height, width = subject.mask.shape
    row, column = np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)
    own = subject.mask[row, column] > 0.5
    row, column = row[own], column[own]
    if len(row) < _FEW:
        return None
    found = head_colors(subject, camera.scale, rows=int(row.max()) + 1, blur=_BLUR)
    if found is None:
        return None
    if found.crown.sum() < _FEW:
        return False
    hair = typical_colors(found.lab[found.crown])
    from_skin = found.from_skin[row, column]
    bare = (from_skin < palette_distance(found.lab[row, column], hair, SHADE)).mean()
    return bool(bare < _BARE and np.median(from_skin) > _UNLIKE)


def flat_ears(rest: FloatArray) -> FloatArray:
    """Lay the ears of Anny's vertices and teeth (13854, 3) at rest flat: a smooth surface between
    the skin around them."""
    own = np.flatnonzero(ears())
    faces = load_body_model("anny").faces.astype(np.int64)
    faces = faces[faces.max(axis=1) < SKIN.stop]
    plate = laplacian(uniform_weights(faces, SKIN.stop))
    fixed = np.setdiff1d(np.arange(SKIN.stop), own)
    result = rest.copy()
    result[own] = factored(plate[own][:, own].tocsc()).solve(-(plate[own][:, fixed] @ rest[fixed]))
    return result


def _visible(posed: FloatArray, camera: Camera) -> IntArray:
    """Indices (n,) of the vertices of the ears that the camera sees on the bare body."""
    faces = load_body_model("anny").faces.astype(np.int64)
    flat = camera.flatten(posed[: faces.max() + 1])
    normals = vertex_normals(flat, faces)
    own = np.flatnonzero(ears())
    start = flat[own] + _ABOVE * (normals[own] + [0, 0, 1])
    hidden = RayScene(flat, faces).occluded(
        start.astype(np.float32), np.tile(np.array([0, 0, 1], np.float32), (len(own), 1))
    )
    return np.asarray(own[~hidden & (normals[own, 2] > _FACING)])
