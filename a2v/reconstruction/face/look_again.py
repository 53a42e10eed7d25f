"""Look at the head of a character as a person would: does a face detector find its face again, with
the features where they belong, at rest, with closed eyes and with an open mouth?"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from a2v.body.face import points_on_face
from a2v.body.parts import on_parts
from a2v.perception.face import FaceDetector
from a2v.reconstruction.face.places import BROWS, LEFT_EYE, LIPS, NOSE, RIGHT_EYE
from a2v.rendering.preview import PreviewStyle, preview_surface
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray, Surface

EXPRESSIONS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "rest": {},
        "blink": {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0},
        "open mouth": {"jawOpen": 1.0},
    }
)
"""Expressions in which a face is looked at: ARKit's names and strengths."""
FEATURES: Mapping[str, tuple[int, ...]] = MappingProxyType(
    {
        "right eye": RIGHT_EYE,
        "left eye": LEFT_EYE,
        "brows": BROWS,
        "nose": NOSE,
        "mouth": LIPS,
    }
)
"""Landmarks of each feature."""
MISSING = 9.0
"""Distance that stands for a face that was not found, in distances of the eyes' outer corners."""
_SIZE = 320
"""Width of the pictures, pixels."""
_EXTENT = 2.6
"""Width of the pictures, in distances of the eyes' outer corners."""
_CORNERS = (33, 263)
"""Landmarks of the eyes' outer corners."""


@dataclass(frozen=True)
class Glance:
    """A face seen again in one expression.

    Attributes
    ----------
    off : mapping of feature to float
        Distance of each of `FEATURES` from its place, in distances of the eyes' outer corners;
        `MISSING` if no face was found.
    """

    off: Mapping[str, float]

    @property
    def found(self) -> bool:
        """Whether the detector found a face."""
        return self.worst < MISSING

    @property
    def worst(self) -> float:
        """The largest distance."""
        return max(self.off.values())


def look_again(surface: Surface, rest: FloatArray, parts: IntArray) -> dict[str, Glance]:
    """Look at the face of a canonical character from the front in each of `EXPRESSIONS`.

    Parameters
    ----------
    surface : Surface
        Colored. Its first vertices are those of Anny.
    rest : (V, 3)
        Its vertices at rest, meters, with the face towards +z.
    parts : (V,) int
        Body part of each vertex.

    Returns
    -------
    dict of expression to Glance
        Only "rest" for a surface without expressions.
    """
    known = EXPRESSIONS if surface.face is not None else {"rest": EXPRESSIONS["rest"]}
    head = head_of(surface, parts)
    found = {}
    with FaceDetector() as detector:
        for name, strengths in known.items():
            vertices = expressed(surface, rest, strengths)
            points = points_on_face(vertices)
            middle, wide = points[list(_CORNERS)].mean(axis=0), _wide(points)
            extent = _EXTENT * wide
            picture = picture_of_head(
                head, vertices, middle - [0.0, 0.25 * wide, 0.0], extent, size=_SIZE
            )
            seen = detector.one(picture)
            if seen is None:
                found[name] = Glance(dict.fromkeys(FEATURES, MISSING))
                continue
            place = (points[:, :2] - middle[:2] + [0.0, 0.25 * wide]) * [1, -1] * _SIZE / extent
            away = (seen[:, :2] - _SIZE / 2 - place) * extent / (_SIZE * wide)
            found[name] = Glance(
                {
                    feature: float(np.linalg.norm(away[list(ids)].mean(axis=0)))
                    for feature, ids in FEATURES.items()
                }
            )
    return found


def expressed(surface: Surface, rest: FloatArray, strengths: Mapping[str, float]) -> FloatArray:
    """The vertices (V, 3) at rest of a canonical character with an expression, meters."""
    vertices = np.array(rest, np.float32)
    if surface.face is not None and strengths:
        moved, offsets = surface.face.mixed(strengths)
        vertices[moved] += offsets.astype(np.float32)
    return vertices


def head_of(surface: Surface, parts: IntArray) -> Surface:
    """Head and neck of a surface: all its vertices, only their faces."""
    own: BoolArray = on_parts(np.asarray(parts), "head", "neck")[surface.faces].all(axis=1)
    return dataclasses.replace(
        surface,
        faces=surface.faces[own],
        uv=None if surface.uv is None else surface.uv[own],
        face=None,
        standing=None,
    )


def picture_of_head(
    head: Surface,
    vertices: FloatArray,
    center: FloatArray | Sequence[float],
    extent: float,
    *,
    size: int,
    azimuth: float = 0.0,
) -> ByteArray:
    """A picture (size, size, 3) of a head (`head_of`) with `vertices` (V, 3), meters, around a
    center (3,); `extent` is its width, meters, and `azimuth` as in `preview_surface`."""
    return preview_surface(
        dataclasses.replace(head, vertices=vertices.astype(np.float32)),
        azimuth=azimuth,
        size=size,
        center=np.asarray(center, np.float64),
        extent=extent,
        style=PreviewStyle(shaded=False),
    )


def _wide(points: FloatArray) -> float:
    """Distance of the eyes' outer corners of landmarks (478, 3)."""
    return float(np.linalg.norm(points[_CORNERS[0]] - points[_CORNERS[1]]))
