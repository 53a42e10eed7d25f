"""Make long hair: a closed layer that hangs from the head over neck and shoulders."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from a2v.body.face import SKIN
from a2v.body.parts import PARTS, on_parts
from a2v.geometry.images import sample_image
from a2v.geometry.mesh import vertex_normals
from a2v.geometry.rays import RayScene
from a2v.geometry.steps import smoothstep
from a2v.geometry.vectors import unit
from a2v.reconstruction.canonical.hair_seen import HairSeen
from a2v.types import Body, BoolArray, Camera, FloatArray, IntArray, Standing

COLUMNS = 97
"""Number of strands, from the left temple around the back of the head to the right one."""
ROWS = 48
"""Number of vertices of a strand."""
_FRONT = 48.0
"""Angle of the foremost strands from straight ahead, degrees."""
_RING = 0.062
"""Depth of the strands' roots below the top of the head, meters."""
_EARS = 0.115
"""Depth of the ears' upper ends below the top of the head, meters."""
_TUCKED = 0.07
"""Length over which the layer comes out of the head, meters."""
_UNDER = 0.007
"""Depth of the roots within the head, meters."""
_LIFTED = 0.008
"""Distance of hair from head and neck below it, meters."""
_LYING = 0.009
"""Distance of hair that lies on shoulders, back and chest, meters."""
_STEP = 0.008
"""Length of a step along a strand, meters."""
_STEPS = 56
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
_SMOOTH = 0.03
"""Length over which displacements to the outline are smoothed, meters."""
_FADE = 0.05
"""Height above and below the base of the neck over which these displacements fade out: lower hair
lies on the trunk, meters."""
_TEMPLE = 65.0
"""Angle from straight ahead, degrees, of the strand at the outline of a head below which the
outline is that of the face."""
_ROUNDS = 2
"""Number of displacements to the outline."""
_FEW_ROWS = 4
"""Smallest number of rows in which the outline is seen."""
_MOST = 0.11
"""Largest displacement to the outline, meters."""
_CLEAR = 0.03
"""Height above the base of the neck down to which the surface is hair, and not a shoulder, meters.
"""
_THICK = (0.004, 0.001)
"""Thickness of the layer at the roots and at the tips, meters."""
_NEAR = 0.012
"""Radius around a place within which pixels decide whether there is hair, meters."""
_SHOWS = 0.12
"""Share of pixels of hair below which a visible place is not hair."""
_GAP = 4
"""Number of successive visible places without hair that end a strand."""
_LONG = 0.17
"""Length of hair at the back below the base of the neck if it reaches the shoulders, meters: the
photo does not show it."""
_ROUNDED = 0.12
"""Height by which strands at the sides are shorter, meters at a right angle from the back."""
_SHORT = 0.03
"""Height above the base of the neck; hair whose visible ends are higher has this length all around,
meters."""
_LEAST = 0.12
"""Smallest length of a strand, meters."""
_EVEN = 2.5
"""Standard deviation of the smoothing of the ends over neighboring strands, strands."""
SHARE = 0.14
"""Height of the strip of the hair in the texture."""
_INNER = 0.03
"""Height of the strip of the inner side."""
_SPINE = ("spine04", "spine03", "spine02", "spine01")


@dataclass(frozen=True, eq=False)
class Hair:
    """The layer: the outer side row by row from the roots, then the inner side.

    Attributes
    ----------
    vertices : (n, 3) float64
        At rest, meters.
    weights : (n, 4) float64
    bones : (n, 4) int64
    anchors : (n,) int64
        Nearest vertices of the body.
    """

    vertices: FloatArray
    weights: FloatArray
    bones: IntArray
    anchors: IntArray


@dataclass(frozen=True, eq=False)
class Person:
    """A person without the layer.

    Attributes
    ----------
    rest : (V, 3)
        Vertices of the dressed surface at rest, meters.
    posed : (V, 3)
        The same in the pose of the photo.
    faces : (F, 3)
        Faces of its outer skin.
    """

    rest: FloatArray
    posed: FloatArray
    faces: IntArray


def under_hair(body: Body, rest: FloatArray, parts: IntArray, normals: FloatArray) -> BoolArray:
    """Return which vertices (V, 3) at rest, with `normals` (V, 3), on `parts` (V,), lie under long
    hair: ears, nape and the sides of the neck. There the surface is hair, and not skin."""
    top, middle = _head(rest, parts)
    ahead = rest[:, 2] - middle
    beside = np.abs(np.degrees(np.arctan2(rest[:, 0], ahead))) > _FRONT - 4
    head = on_parts(parts, "head") & beside & (rest[:, 1] < top - _EARS)
    return np.asarray(head | (on_parts(parts, "neck") & (normals[:, 2] < 0.6)))


def make_hair(
    person: Person, parts: IntArray, body: Body, seen: HairSeen, camera: Camera
) -> Hair | None:
    """Make the layer of long hair.

    1. Strands run down from a ring around the head, outside the body, and end where they lie flat.
    2. They are moved to the outline of the hair in the photo.
    3. They end where the photo shows that hair ends. Unseen strands have the length of the mirrored
       ones, or `_LONG`.

    None if there is too little hair.
    """
    from scipy.spatial import cKDTree

    names = body.bone_names
    base = float(body.rest_transforms[names.index("neck01"), 1, 3])
    solid = _Solid(person.rest, person.faces)
    paths = _strands(person.rest, parts, solid)
    grid = paths.transpose(1, 0, 2).reshape(-1, 3)
    weights, bones = _bound(grid, body)
    turn = _turns(weights, bones, body)
    posed = np.einsum("nab,nb->na", turn[..., :3], grid) + turn[..., 3]
    away = grid * [1, 0, 1] - [0, 0, _head(person.rest, parts)[1]]
    ways = unit(away, least=1e-9)
    fade = smoothstep(grid[:, 1], base - _FADE, base + _FADE)
    for _ in range(_ROUNDS):
        turned = np.einsum("nab,nb->na", turn[..., :3], ways)
        offset = fade * _to_outline(posed, turned, seen, camera).ravel()
        grid = _even(grid + offset[:, None] * ways)
        grid = solid.pushed(grid, _lift(grid, base))
        posed = np.einsum("nab,nb->na", turn[..., :3], grid) + turn[..., 3]
    weights, bones = _bound(grid, body)
    turn = _turns(weights, bones, body)
    posed = np.einsum("nab,nb->na", turn[..., :3], grid) + turn[..., 3]
    shown = _shown(posed, person, camera)
    hair = _hair_around(posed, seen, camera)
    ends = _ends(grid.reshape(_STEPS, COLUMNS, 3), shown, hair, base)
    if np.median(ends) * _STEP < _LEAST:
        return None
    outer = _resampled(grid.reshape(_STEPS, COLUMNS, 3), ends).reshape(-1, 3)
    weights, bones = _bound(outer, body)
    normals = vertex_normals(outer, _sheet(ROWS)).astype(np.float64)
    along = np.repeat(np.linspace(0, 1, ROWS), COLUMNS)
    thick = _THICK[0] + (_THICK[1] - _THICK[0]) * smoothstep(along, 0.6, 1.0)
    skin = np.asarray(body.vertices[: SKIN.stop])
    own = on_parts(body.parts[: SKIN.stop], "head")
    turn = _turns(weights, bones, body)
    posed = np.einsum("nab,nb->na", turn[..., :3], outer) + turn[..., 3]
    anchors = np.flatnonzero(own)[cKDTree(skin[own]).query(posed, workers=1)[1]]
    return Hair(
        np.concatenate([outer, outer - thick[:, None] * normals]),
        np.tile(weights, (2, 1)),
        np.tile(bones, (2, 1)),
        np.tile(anchors, 2),
    )


def with_hair(standing: Standing, hair: Hair) -> Standing:
    """Append the hair, as a part of the head, to the standing surface of a body."""
    head = np.full(len(hair.vertices), PARTS.index("head"))
    return Standing(
        vertices=np.concatenate([standing.vertices, hair.vertices]).astype(np.float32),
        weights=np.concatenate([standing.weights, hair.weights]).astype(np.float32),
        bones=np.concatenate([standing.bones, hair.bones]).astype(np.int32),
        anchors=np.concatenate([standing.anchors, hair.anchors]).astype(np.int32),
        parts=np.concatenate([standing.parts, head]).astype(np.int8),
    )


@functools.cache
def hair_faces() -> IntArray:
    """The faces (f, 3) of the layer: both sides, and the strips that join them."""
    outer, half = _sheet(ROWS), ROWS * COLUMNS
    number = np.arange(half).reshape(ROWS, COLUMNS)
    rims = []
    for edge, turned in (
        (number[0], False),
        (number[-1], True),
        (number[:, 0], True),
        (number[:, -1], False),
    ):
        one, two = edge[:-1], edge[1:]
        ring = np.concatenate(
            [
                np.stack([one, two, two + half], axis=1),
                np.stack([one, two + half, one + half], axis=1),
            ]
        )
        rims.append(ring[:, ::-1] if turned else ring)
    return np.concatenate([outer, outer[:, ::-1] + half, *rims])


@functools.cache
def hair_layout() -> FloatArray:
    """The texture coordinates (f, 3, 2) of `hair_faces` in a strip at the bottom, of height
    `SHARE`: strands run up, the inner side is below."""
    faces, half = hair_faces(), ROWS * COLUMNS
    inner = (faces >= half).all(axis=1)
    own = faces % half
    column, v = own % COLUMNS, 1 - own // COLUMNS / (ROWS - 1)
    high = np.where(
        inner[:, None], 0.004 + (_INNER - 0.008) * v, _INNER + 0.004 + (SHARE - _INNER - 0.012) * v
    )
    across = 0.004 + 0.992 * column / (COLUMNS - 1)
    return np.asarray(np.stack([across, high], axis=-1), np.float32)


def hair_twins() -> IntArray:
    """Index (n,) of the mirrored vertex of each vertex."""
    count = 2 * ROWS * COLUMNS
    return np.asarray(np.arange(count).reshape(-1, COLUMNS)[:, ::-1].ravel())


def strand_numbers(count: int) -> IntArray:
    """Number of the strand (count,) of the last vertices of `count`, which are the layer."""
    return np.asarray((np.arange(count) - count) % COLUMNS)


class _Solid:
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


def _head(rest: FloatArray, parts: IntArray) -> tuple[float, float]:
    """Height of the top of the head, and z of its middle, meters at rest."""
    own = rest[on_parts(parts, "head")]
    top = float(own[:, 1].max())
    high = own[own[:, 1] > top - 0.1]
    return top, float((high[:, 2].min() + high[:, 2].max()) / 2)


def _strands(rest: FloatArray, parts: IntArray, solid: _Solid) -> FloatArray:
    """Paths (COLUMNS, _STEPS, 3) of strands at rest: down, around the body.

    From the left temple (+x) around the back to the right one.
    """
    from scipy.ndimage import gaussian_filter1d

    top, middle = _head(rest, parts)
    angle = np.radians(np.linspace(_FRONT, 360 - _FRONT, COLUMNS))
    way = np.stack([np.sin(angle), np.zeros(COLUMNS), np.cos(angle)], axis=1)
    center = np.array([0.0, top - _RING, middle])
    place = center + solid.reach(np.tile(center, (COLUMNS, 1)), way)[:, None] * way
    shoulders = float(rest[on_parts(parts, "neck"), 1].min())
    around = np.minimum(np.degrees(angle), 360 - np.degrees(angle))
    drift = smoothstep(-around, -_BESIDE[0], 15 - _BESIDE[0]) - smoothstep(
        around, _BESIDE[1], _BESIDE[1] + 15
    )
    paths, alive = [], np.ones(COLUMNS, bool)
    for step in range(_STEPS):
        out = smoothstep(np.full(COLUMNS, step * _STEP), 0.0, _TUCKED)
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
        place = place + _STEP * np.where(alive[:, None], move, 0.0)
    return np.stack(paths, axis=1)


def _lift(points: FloatArray, base: float) -> FloatArray:
    """Smallest distance (n,) of hair (n, 3), row by row, from the body."""
    step = np.repeat(np.arange(_STEPS), COLUMNS) * _STEP
    out = smoothstep(step, 0.0, _TUCKED)
    lift = np.where(points[:, 1] > base + _CLEAR, _LIFTED, _LYING)
    return np.asarray(out * lift - (1 - out) * _UNDER)


def _bound(points: FloatArray, body: Body) -> tuple[FloatArray, IntArray]:
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


def _turns(weights: FloatArray, bones: IntArray, body: Body) -> FloatArray:
    """Blended transforms (n, 3, 4) from rest to the pose of the photo."""
    moved = body.bone_transforms.astype(np.float64) @ np.linalg.inv(
        body.rest_transforms.astype(np.float64)
    )
    return np.asarray(np.einsum("nk,nkab->nab", weights, moved[bones][..., :3, :]))


def _even(grid: FloatArray) -> FloatArray:
    """Average strands (n, 3), row by row, a little over neighbors; roots stay."""
    from scipy.ndimage import gaussian_filter1d

    rows = grid.reshape(_STEPS, COLUMNS, 3)
    even = gaussian_filter1d(gaussian_filter1d(rows, 1.0, axis=0), 1.5, axis=1, mode="nearest")
    share = smoothstep(np.arange(_STEPS) * _STEP, 0.0, _TUCKED)[:, None, None]
    return np.asarray((rows + share * (even - rows)).reshape(-1, 3))


def _to_outline(posed: FloatArray, ways: FloatArray, seen: HairSeen, camera: Camera) -> FloatArray:
    """Displacements (_STEPS, COLUMNS), meters, of the posed layer (n, 3) along outward `ways` (n,
    3) to the outline of the hair in the photo.

    In each row, the outermost strand on each side of the picture moves to the outermost pixel of
    hair, and the strands beside it follow. Unseen strands move like the mirrored ones.
    """
    from scipy.ndimage import gaussian_filter1d

    flat = camera.project(posed).reshape(_STEPS, COLUMNS, 2)
    aside = (camera.project(posed + 0.01 * ways)[:, 0] - flat[..., 0].ravel()) / camera.scale / 0.01
    around = _FRONT + (360 - 2 * _FRONT) * np.arange(COLUMNS) / (COLUMNS - 1)
    around = np.minimum(around, 360 - around)
    total, weight = np.zeros((2, _STEPS, COLUMNS))
    steps = np.arange(_STEPS)
    for side in (-1.0, 1.0):
        away = side * (flat[..., 0] - flat[..., 0].mean(axis=1, keepdims=True))
        last = away.argmax(axis=1)
        found = _outermost(seen, flat, side, camera)
        missing = side * (found - flat[steps, last, 0]) / camera.scale
        good = np.isfinite(missing) & (np.abs(missing) < _MOST) & (steps * _STEP > _TUCKED / 2)
        good &= around[last] > _TEMPLE
        if good.sum() < _FEW_ROWS:
            continue
        even = np.interp(steps, steps[good], missing[good])
        even = gaussian_filter1d(even, _SMOOTH / _STEP, mode="nearest")
        turned = np.clip(side * aside.reshape(_STEPS, COLUMNS), 0.0, 1.0)
        share = turned**2 * np.clip(away / away.max(axis=1, keepdims=True), 0.0, 1.0)
        total += share * even[:, None] / np.maximum(turned, 0.5)
        weight += share
    both = total + 0.5 * total[:, ::-1], weight + 0.5 * weight[:, ::-1]
    moved = both[0] / np.maximum(both[1], 0.3)
    moved = gaussian_filter1d(moved, 0.5 * _SMOOTH / _STEP, axis=0, mode="nearest")
    moved = gaussian_filter1d(moved, _COHESION, axis=1, mode="nearest")
    return np.asarray(moved * smoothstep(steps * _STEP, 0.0, _TUCKED)[:, None])


def _outermost(seen: HairSeen, flat: FloatArray, side: float, camera: Camera) -> FloatArray:
    """Column (_STEPS,) of the photo, pixels, at which hair beside the strands at `flat` (_STEPS,
    COLUMNS, 2) ends toward the left (`side` -1) or the right (1); NaN without hair."""
    result = np.full(len(flat), np.nan)
    high, wide = seen.pixels.shape
    for step, strands in enumerate(flat):
        last = strands[(side * strands[:, 0]).argmax()]
        row = int(np.clip(last[1], 0, high - 1))
        middle = strands[:, 0].mean()
        ends = sorted((middle + side * 0.03 * camera.scale, last[0] + side * _MOST * camera.scale))
        first, end = (int(np.clip(value, 0, wide)) for value in ends)
        found = np.flatnonzero(seen.pixels[row, first:end])
        if len(found):
            result[step] = first + (found[-1] + 1 if side > 0 else found[0])
    return result


def _shown(posed: FloatArray, person: Person, camera: Camera) -> BoolArray:
    """Return which places (n, 3) of the layer nothing of the body hides in the photo."""
    scene = RayScene(np.asarray(person.posed, np.float32), np.asarray(person.faces, np.int32))
    ahead = unit(
        camera.raised(camera.flatten(posed) + np.array([0.0, 0.0, 0.01])) - posed, least=1e-9
    )
    return ~scene.occluded(
        np.asarray(posed + 0.004 * ahead, np.float32), np.asarray(ahead, np.float32)
    )


def _hair_around(places: FloatArray, seen: HairSeen, camera: Camera) -> FloatArray:
    """Share (n,) of pixels of hair around places (n, 3)."""
    import cv2

    size = 2 * max(1, round(_NEAR * camera.scale)) + 1
    share = cv2.blur(seen.pixels.astype(np.float32), (size, size))
    return np.asarray(sample_image(share, camera.project(places)), np.float64)


def _ends(grid: FloatArray, shown: BoolArray, hair: FloatArray, base: float) -> FloatArray:
    """Steps (COLUMNS,) at which strands (_STEPS, COLUMNS, 3) end; `shown` and `hair` (n,) are
    whether they are visible, and the share of hair in the photo there."""
    from scipy.ndimage import gaussian_filter1d, median_filter

    shown, bare = shown.reshape(_STEPS, COLUMNS), (hair < _SHOWS).reshape(_STEPS, COLUMNS)
    low = grid[..., 1] < base + 0.09  # from the jaw down
    ends, told = np.full(COLUMNS, np.nan), np.zeros(COLUMNS, bool)
    for column in range(COLUMNS):
        run = 0
        for step in np.flatnonzero(low[:, column]):
            run = run + 1 if shown[step, column] and bare[step, column] else 0
            if run == _GAP:
                ends[column], told[column] = step - _GAP, True
                break
    twin = ends[::-1]
    visible = (shown & low).any(axis=0)
    ends = np.where(told | visible, ends, twin)
    heights = np.array(
        [grid[int(end), column, 1] for column, end in enumerate(ends) if np.isfinite(end)]
    )
    high = float(np.median(heights)) if len(heights) else -np.inf
    aside = np.abs(np.linspace(-1, 1, COLUMNS)) * np.radians(180 - _FRONT)
    lowest = high if high > base + _SHORT else base - _LONG + _ROUNDED * (1 - np.cos(aside))
    usual = (grid[..., 1] > lowest).sum(axis=0).astype(np.float64)
    ends = np.where(np.isfinite(ends), ends, usual)
    moving = np.linalg.norm(np.diff(grid, axis=0), axis=2) > 0.2 * _STEP
    ends = median_filter(np.minimum(ends, moving.sum(axis=0)), 11, mode="nearest")
    return np.asarray(np.clip(gaussian_filter1d(ends, _EVEN, mode="nearest"), 8, _STEPS - 1))


def _resampled(grid: FloatArray, ends: FloatArray) -> FloatArray:
    """Strands (ROWS, COLUMNS, 3) of which each ends at its step of `ends` (COLUMNS,)."""
    place = np.linspace(0, 1, ROWS)[:, None] * ends
    step = np.minimum(place.astype(np.int64), _STEPS - 2)
    share = (place - step)[..., None]
    column = np.arange(COLUMNS)
    return np.asarray((1 - share) * grid[step, column] + share * grid[step + 1, column])


def _sheet(rows: int) -> IntArray:
    """Faces (f, 3) of an open sheet of `rows` rows, oriented outwards."""
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(COLUMNS - 1), indexing="ij")
    one, two = row * COLUMNS + column, row * COLUMNS + column + 1
    below, beside = one + COLUMNS, two + COLUMNS
    return np.concatenate(
        [
            np.stack([one, below, two], axis=-1).reshape(-1, 3),
            np.stack([two, below, beside], axis=-1).reshape(-1, 3),
        ]
    )
