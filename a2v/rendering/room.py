"""The area of the photo's place where a person may walk: the visible floor, and a path that stays
on it and in the picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from a2v.geometry.steps import smoothstep
from a2v.record import Record
from a2v.rendering.camera import ViewCamera
from a2v.types import BoolArray, ByteArray, FloatArray, IntArray

SIDE = 240
"""Side of the picture in which the floor is searched, pixels."""
_STOOD = 0.4
"""Ground within this distance of the feet in the photo is floor, meters."""
_MOST = 0.5
"""Smallest fraction of the ground around the feet that one region must cover."""
_GROUND = 0.85
"""Smallest fraction of a floor region that lies below the horizon and near enough."""
_ALIKE = np.array([20.0, 7.0, 14.0])
"""Largest differences of the mean colors of two regions of one floor, CIELAB."""
_SPREADS = 4
"""Number of times that the floor is extended from region to neighboring region."""
_AROUND = 1.0
"""Ground within this distance of the feet is floor unless its colors differ; farther ground is
floor only if its colors match, meters."""
_FARTHEST = 15.0
"""Ground farther than this from the camera is not walked on, meters."""
_WIDTH = 0.3
"""Half the width of a walking person, meters."""
_ENTRANCE = 0.9
"""A clip that begins in the photo's pose turns into its own direction within this time, s."""
_TURNS = np.radians(np.arange(-180, 180, 15))
"""Candidate turns, radians."""
_CURVES = np.array([0.0, 0.35, -0.35, 0.7, -0.7, 1.1, -1.1, 1.7, -1.7])
"""Candidate curvatures, radians per meter."""
_SHORTER = np.array([1.0, 0.6, 0.3, 0.1])
"""Candidate fractions of the path length; the rest is walked in place."""
_COSTS = (0.02, 0.08, 1.0)
"""Costs of a radian of turn, of a radian per meter, and of leaving out the whole path. For
comparison: frames that are not allowed cost 10 if all are."""


@dataclass(frozen=True, kw_only=True)
class Spot(Record):
    """Position and turn of one frame of a clip in a place.

    Attributes
    ----------
    turn : float
        Turn about the vertical through the root, radians, counter-clockwise seen from above.
    root, place : tuple of 2 float
        Position of the root in the clip and in the place, x and z, meters, world.
    """

    turn: float
    root: tuple[float, ...]
    place: tuple[float, ...]

    def moved(self, vertices: FloatArray) -> FloatArray:
        """Move vertices (V, 3) from the clip's frame to the place, float32."""
        flat = np.asarray(vertices, np.float64)[:, [0, 2]] - self.root
        result = np.array(vertices, np.float32)
        result[:, [0, 2]] = _turned(flat, np.full(len(flat), self.turn)) + self.place
        return result


@dataclass(frozen=True, eq=False)
class Detour:
    """A path over the floor that replaces a clip's own.

    Attributes
    ----------
    turns : (T,) float64
        As `Spot.turn`.
    roots, places : (T, 2) float64
        As of `Spot`.
    share : float
        Fraction of the frames that stand on the floor and in the picture.
    """

    turns: FloatArray
    roots: FloatArray
    places: FloatArray
    share: float

    @property
    def spots(self) -> list[Spot]:
        """One spot per frame."""
        rows = zip(self.turns.tolist(), self.roots.tolist(), self.places.tolist(), strict=True)
        return [Spot(turn=turn, root=tuple(root), place=tuple(place)) for turn, root, place in rows]


def find_floor(
    picture: ByteArray, camera: ViewCamera, stood: FloatArray, regions: IntArray | None = None
) -> BoolArray:
    """Find the pixels that show the floor on which the person stood, in a picture without the
    person.

    Pixels above the horizon are not floor; the ground around the feet is. Colors decide about the
    pixels between (GrabCut, OpenCV). The floor is the part that is connected to the feet.

    Parameters
    ----------
    picture : (S, S, 3) uint8
    camera : ViewCamera
        Of the picture.
    stood : (2,)
        Where the person stood, x and z, meters, world.
    regions : (h, h) int, optional
        Regions of uniform color of the picture. The floor is the region around the feet and its
        neighbors of the same color. If that region extends up a wall, only GrabCut decides.

    Returns
    -------
    (h, h) bool
        With at most 240 pixels a side.
    """
    import cv2

    side = min(SIDE, len(picture))
    small = cv2.resize(picture, (side, side), interpolation=cv2.INTER_AREA)
    ground, below = ground_under(camera, side)
    near = below & (np.linalg.norm(ground - stood, axis=-1) < _STOOD)
    labels = np.full((side, side), cv2.GC_BGD, np.uint8)
    labels[below] = cv2.GC_PR_BGD
    labels[below & (np.linalg.norm(ground - stood, axis=-1) < _AROUND)] = cv2.GC_PR_FGD
    labels[near] = cv2.GC_FGD
    if not near.any() or below.all():
        return below
    if regions is not None:
        found = _floor_regions(small, regions, near, below)
        if found is not None:
            return found
    cv2.setRNGSeed(0)
    colors = cv2.cvtColor(cv2.GaussianBlur(small, (0, 0), 1.0), cv2.COLOR_RGB2Lab)
    cv2.grabCut(
        colors, labels, None, np.zeros((1, 65)), np.zeros((1, 65)), 5, cv2.GC_INIT_WITH_MASK
    )
    floor = np.isin(labels, (cv2.GC_FGD, cv2.GC_PR_FGD)).astype(np.uint8)
    floor = cv2.morphologyEx(
        cv2.morphologyEx(floor, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)),
        cv2.MORPH_CLOSE,
        np.ones((7, 7), np.uint8),
    )
    _, names = cv2.connectedComponents(floor)
    joined = np.unique(names[near & (floor > 0)])
    return np.asarray((floor > 0) & np.isin(names, joined[joined > 0]))


def _floor_regions(
    picture: ByteArray, regions: IntArray, near: BoolArray, below: BoolArray
) -> BoolArray | None:
    """Return the floor (h, h): the region around the feet and the adjacent ones of its color.

    Returns None if that region is not only ground, or does not clearly surround the feet.
    """
    import cv2

    side = len(near)
    names = cv2.resize(regions.astype(np.float32), (side, side), interpolation=cv2.INTER_NEAREST)
    names = names.astype(np.int32)
    colors = cv2.cvtColor(picture.astype(np.float32) / 255, cv2.COLOR_RGB2Lab)
    main = int(np.bincount(names[near]).argmax())
    own = names == main
    if own[near].mean() < _MOST or below[own].mean() < _GROUND:
        return None
    floor = own
    for _ in range(_SPREADS):
        rim = cv2.dilate(floor.astype(np.uint8), np.ones((5, 5), np.uint8)).astype(bool) & ~floor
        joined = floor
        for name in np.unique(names[rim]):
            part = names == name
            off = np.abs(colors[part].mean(axis=0) - colors[own].mean(axis=0))
            if (off < _ALIKE).all() and below[part].mean() > _GROUND:
                joined = joined | part
        if (joined == floor).all():
            break
        floor = joined
    closed = cv2.morphologyEx(
        np.asarray(floor & below, np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8)
    )
    return np.asarray(closed > 0)


def ground_under(camera: ViewCamera, side: int) -> tuple[FloatArray, BoolArray]:
    """Return the ground points under the pixels of a picture of `side` pixels.

    The points are x and z (S, S, 2), meters; the mask (S, S) marks pixels that show ground within
    15 m.
    """
    reach = side / 2 / np.tan(np.radians(camera.fov) / 2)
    at = np.arange(side) + 0.5 - side / 2
    across, down = np.meshgrid(at / reach, at / reach)
    rays = np.stack([across, -down, -np.ones_like(across)], axis=-1) @ camera.axes
    falls = rays[..., 1] < -1e-6
    far = np.where(falls, camera.origin[1] / np.maximum(-rays[..., 1], 1e-6), np.inf)
    far = np.minimum(far, 1e4)
    ground = np.stack(
        [camera.origin[0] + far * rays[..., 0], camera.origin[2] + far * rays[..., 2]], axis=-1
    )
    away = np.linalg.norm(ground - np.array([camera.origin[0], camera.origin[2]]), axis=-1)
    return ground, falls & (away < _FARTHEST)


def standing_room(
    floor: BoolArray, camera: ViewCamera, frame: tuple[int, ...], size: int, tall: float
) -> Callable[[FloatArray], BoolArray]:
    """Return a test of which places (N, 2), x and z, a person `tall` meters may stand on.

    The person must be on the `floor` (h, h) and wholly inside the photo. `frame` is the photo's box
    in the picture of `size` pixels (`Place.frame`).
    """
    side = len(floor)
    left, top, right, bottom = (edge * side / size for edge in frame)

    def allowed(places: FloatArray) -> BoolArray:
        good = np.ones(len(places), bool)
        toward = np.array([camera.origin[0], camera.origin[2]])
        for aside in (-_WIDTH, _WIDTH):
            direct = toward - places
            direct = direct / np.maximum(np.linalg.norm(direct, axis=1, keepdims=True), 1e-9)
            edge = places + aside * direct[:, ::-1] * np.array([1.0, -1.0])
            for height in (0.0, tall):
                pixels = camera.project(
                    np.stack([edge[:, 0], np.full(len(edge), height), edge[:, 1]], axis=1), side
                )
                inside = (
                    (pixels[:, 0] >= left)
                    & (pixels[:, 0] <= right)
                    & (pixels[:, 1] >= top)
                    & (pixels[:, 1] <= bottom)
                )
                good &= np.where(np.isfinite(pixels).all(axis=1), inside, False)
                if height == 0.0:
                    at = np.clip(np.nan_to_num(pixels, nan=-1.0), 0, side - 1).astype(np.int64)
                    good &= floor[at[:, 1], at[:, 0]]
        return good

    return allowed


def find_detour(
    roots: FloatArray, allowed: Callable[[FloatArray], BoolArray], *, fps: float, entering: bool
) -> Detour:
    """Turn and bend a clip's path as little as needed to stay where it is `allowed`.

    Parameters
    ----------
    roots : (T, 2)
        The root's x and z in the clip, meters; the first one stays fixed.
    allowed : callable
        Whether places (N, 2) are allowed. The clip's start always counts as allowed.
    fps : float
    entering : bool
        The clip begins in the photo's pose: its first frame is unchanged, and the turn happens
        within 0.9 s.
    """
    roots = np.asarray(roots, np.float64)
    steps = np.diff(roots, axis=0)
    walked = np.concatenate([[0.0], np.cumsum(np.linalg.norm(steps, axis=1))])
    ramp = (
        smoothstep(np.arange(len(roots)) / fps, 0, _ENTRANCE) if entering else np.ones(len(roots))
    )
    best, found = np.inf, None
    for share in _SHORTER:
        for curve in _CURVES:
            for turn in _TURNS:
                turns = turn * ramp + curve * share * walked
                places = roots[0] + np.concatenate(
                    [np.zeros((1, 2)), np.cumsum(share * _turned(steps, turns[:-1]), axis=0)]
                )
                home = np.linalg.norm(places - roots[0], axis=1) < _WIDTH
                good = float((allowed(places) | home).mean())
                price = (
                    10 * max(0.0, 0.995 - good)
                    + _COSTS[0] * abs(turn)
                    + _COSTS[1] * abs(curve)
                    + _COSTS[2] * (1 - share)
                )
                if price < best:
                    best, found = price, (turns, places, good)
        if best < _COSTS[2] * (1 - 0.6):  # no shorter path is cheaper
            break
    assert found is not None
    turns, places, good = found
    return Detour(turns=turns, roots=roots, places=places, share=good)


def _turned(steps: FloatArray, turns: FloatArray) -> FloatArray:
    """Turn steps (T, 2), x and z, about the vertical by (T,) radians, counter-clockwise seen from
    above."""
    sine, cosine = np.sin(turns), np.cos(turns)
    return np.stack(
        [cosine * steps[:, 0] + sine * steps[:, 1], -sine * steps[:, 0] + cosine * steps[:, 1]],
        axis=1,
    )
