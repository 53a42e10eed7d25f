"""Continue borders of garments around the body at their height, where the photo does not show the
hem, the sleeve or the belt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.parts import PARTS, on_parts
from a2v.reconstruction.backs.seen import LOWER, SHOES, SKIN, UPPER, BackEvidence
from a2v.types import BoolArray, FloatArray, IntArray

_SIDES = ("left", "right")
_PAIRS: tuple[tuple[str, tuple[str, ...], tuple[int, ...], tuple[int, ...]], ...] = (
    ("trunk", ("torso", "left_thigh", "right_thigh"), (UPPER,), (LOWER,)),
    ("leg", ("thigh", "shin", "foot"), (UPPER, LOWER), (SKIN,)),
    ("leg", ("shin", "foot"), (UPPER, LOWER, SKIN), (SHOES,)),
    ("arm", ("upper_arm", "lower_arm", "hand"), (UPPER,), (SKIN,)),
)
"""Borders that may continue around a limb or the trunk: the tube, its parts, the label toward the
trunk (on the trunk: above), and the label beyond."""
_LEAST = 25
"""Smallest number of visible vertices on each side of a border."""
_EXPLAINED = 0.9
"""Smallest fraction of the visible vertices that a curve separates correctly; both sides have equal
weight."""
_BAND = 0.12
"""Largest distance from the middle of the border of visible vertices that are used, meters."""
_OTHER = 0.3
"""Weight of the mirrored limb."""
_OUTERMOST = 0.02
"""Share of the visible vertices of a side that may lie beyond its outermost ones: patches of
another color."""
_UPRIGHT = 0.5
"""Share of the visible length of a tube beyond which a border runs along it, as that of an open
coat does, and tells no height."""
_WIDTH = 0.008
"""Uncertainty of the place of a border, meters."""
_TILT = 0.03
"""Usual rise of borders from the middle to one side of the visible arc, meters."""
_UNSEEN_TILT = 0.004
"""Usual rise from the visible to the hidden side, which is not observed, meters."""
_MOST_TILT = 0.06
"""Largest rise, meters."""
_HALF = 0.4
"""Length of the mean of the unit vectors towards the visible parts of a border above which it is
visible from one side only."""
_ROUNDS = 25
"""Number of steps of Newton's method."""


@dataclass(frozen=True, eq=False)
class _Tube:
    """A limb, or the trunk, at rest.

    Attributes
    ----------
    own : (n,) int
        Its vertices.
    along : (n,) float64
        Meters towards the trunk; on the trunk, upwards.
    turn : (n, 2) float64
        Cosine and sine of the angle around the axis; mirrored limbs have mirrored angles.
    """

    own: IntArray
    along: FloatArray
    turn: FloatArray


def run_around(seen: BackEvidence, labels: IntArray) -> IntArray:
    """Return labels (V,) whose borders run around the body at rest (`around`)."""
    if seen.rest is None:
        return labels
    trunk = PARTS.index("torso")
    parts = seen.parts if seen.cloth is None else np.where(seen.cloth, trunk, seen.parts)
    return around(labels, seen.rest, parts, seen.known)


def around(labels: IntArray, rest: FloatArray, parts: IntArray, known: BoolArray) -> IntArray:
    """Continue the borders between garments, skin and shoes of labels (V,) around the body, where
    the photo does not show them.

    The border on each limb is a plane curve, ``height = a + b cos + c sin`` of the angle around the
    limb, that separates the visible vertices of both sides best (logistic regression; the mirrored
    limb counts, too). Where no such curve separates them, as below an open jacket, the unseen
    border stays within the range of the visible one. Only vertices that are not `known` change, and
    only between these two labels.

    Parameters
    ----------
    labels : (V,) int
        Index into `a2v.reconstruction.backs.seen.KINDS`.
    rest : (V, 3)
        Vertices at rest, meters, the person's left on +x.
    parts : (V,) int
        Index into `a2v.body.PARTS`.
    known : (V,) bool
        Vertices whose labels the photo shows.
    """
    result = labels.copy()
    for kind, names, near, far in _PAIRS:
        tubes = _tubes(kind, names, rest, parts)
        for number, tube in enumerate(tubes):
            others = [other for index, other in enumerate(tubes) if index != number]
            curve = _curve(tube, others, result, known, near, far)
            hidden = ~known[tube.own] & np.isin(result[tube.own], (*near, *far))
            if curve is None:
                lowest, highest = _bounds(tube, result, known, near, far)
                within = np.isin(result[tube.own], near) & (tube.along > lowest)
                within |= tube.along > highest
            else:
                within = tube.along > curve[0] + tube.turn @ curve[1:]
            _relabel(result, tube, hidden, within, near, far)
    return result


def _bounds(
    tube: _Tube,
    labels: IntArray,
    known: BoolArray,
    near: tuple[int, ...],
    far: tuple[int, ...],
) -> tuple[float, float]:
    """Range, meters along a tube, in which an unseen border that is no plane may lie: from the
    lowest visible place on its near side to the highest one on its far side. Infinite if a side is
    not visible or the border tells no height."""
    shown = known[tube.own]
    inner, outer = (tube.along[shown & np.isin(labels[tube.own], kinds)] for kinds in (near, far))
    if min(len(inner), len(outer)) < _LEAST:
        return -np.inf, np.inf
    lowest, highest = np.quantile(inner, _OUTERMOST), np.quantile(outer, 1 - _OUTERMOST)
    if highest - lowest > _UPRIGHT * np.ptp(tube.along[shown]):
        return -np.inf, np.inf
    return float(lowest), float(max(lowest, highest))


def _relabel(
    labels: IntArray,
    tube: _Tube,
    hidden: BoolArray,
    within: BoolArray,
    near: tuple[int, ...],
    far: tuple[int, ...],
) -> None:
    """Give each hidden vertex of a tube the label of its side of the border.

    If several labels are possible on a side, it is the one of the nearest visible vertices along
    the tube.
    """
    for kinds, side in ((near, within), (far, ~within)):
        wrong = hidden & side & ~np.isin(labels[tube.own], kinds)
        right = np.isin(labels[tube.own], kinds) & side
        if not wrong.any() or not right.any():
            continue
        at = tube.along[right]
        order = np.argsort(at, kind="stable")
        place = np.clip(np.searchsorted(at[order], tube.along[wrong]), 0, len(at) - 1)
        labels[tube.own[wrong]] = labels[tube.own[right]][order][place]


def _tubes(kind: str, names: tuple[str, ...], rest: FloatArray, parts: IntArray) -> list[_Tube]:
    """The trunk, or both limbs of one kind."""
    if kind == "trunk":
        own = np.flatnonzero(on_parts(parts, *names))
        return [_tube(rest, own, np.array([0.0, 1.0, 0.0]), 1.0)] if len(own) else []
    found = []
    for side, sign in zip(_SIDES, (1.0, -1.0), strict=True):
        own = np.flatnonzero(on_parts(parts, *(f"{side}_{name}" for name in names)))
        if not len(own):
            continue
        up = np.array([0.0, 1.0, 0.0])
        if kind == "arm":
            ends = [rest[on_parts(parts, f"{side}_{name}")] for name in ("upper_arm", "lower_arm")]
            if not all(map(len, ends)):
                continue
            up = ends[0].mean(axis=0) - ends[1].mean(axis=0)
        found.append(_tube(rest, own, up / np.linalg.norm(up), sign))
    return found


def _tube(rest: FloatArray, own: IntArray, up: FloatArray, sign: float) -> _Tube:
    """The tube of the vertices `own` (n,) along the unit vector `up` (3,); `sign` is -1 on the
    right."""
    points = rest[own]
    ahead = np.array([0.0, 0.0, 1.0]) - up[2] * up
    ahead /= np.linalg.norm(ahead)
    side = np.cross(up, ahead)
    along = points @ up
    order = np.argsort(along, kind="stable")
    cut = np.array_split(order, max(1, round(float(np.ptp(along)) / 0.03)))
    middles = np.stack(
        [(points[one].min(axis=0) + points[one].max(axis=0)) / 2 for one in cut if len(one)]
    )
    heights = np.array([along[one].mean() for one in cut if len(one)])
    axis = np.stack([np.interp(along, heights, middles[:, k]) for k in range(3)], axis=1)
    away = points - axis
    flat = np.stack([away @ ahead, sign * (away @ side)], axis=1)
    return _Tube(own, along, flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-9))


def _curve(
    tube: _Tube,
    others: list[_Tube],
    labels: IntArray,
    known: BoolArray,
    near: tuple[int, ...],
    far: tuple[int, ...],
) -> FloatArray | None:
    """Height and tilt (3,), meters, of a border between two labels on a tube; None if it is not
    visible."""
    along, turn, inner, weight = [], [], [], []
    for one, count in ((tube, 1.0), *((other, _OTHER) for other in others)):
        shown = known[one.own] & np.isin(labels[one.own], (*near, *far))
        along.append(one.along[shown])
        turn.append(one.turn[shown])
        inner.append(np.isin(labels[one.own[shown]], near))
        weight.append(np.full(int(shown.sum()), count))
    height, angle, y, w = (
        np.concatenate(along),
        np.concatenate(turn),
        np.concatenate(inner),
        np.concatenate(weight),
    )
    if min(y.sum(), (~y).sum()) < _LEAST:
        return None
    middle = _cut(height, y, w)
    asked = np.abs(height - middle) < _BAND
    height, angle, y, w = height[asked], angle[asked], y[asked], w[asked]
    if min(y.sum(), (~y).sum()) < _LEAST:
        return None
    w = w * np.where(y, 1 / max(w[y].sum(), 1e-9), 1 / max(w[~y].sum(), 1e-9)) * len(y) / 2
    curve = _newton(height, angle, y, w, middle)
    right = (height > curve[0] + angle @ curve[1:]) == y
    good = min(np.average(right[y], weights=w[y]), np.average(right[~y], weights=w[~y]))
    return (
        curve if good > 2 * _EXPLAINED - 1 and np.average(right, weights=w) > _EXPLAINED else None
    )


def _cut(height: FloatArray, inner: BoolArray, weight: FloatArray) -> float:
    """Return the height that best separates the `inner` vertices, above it, from the others; both
    sides have equal weight."""
    order = np.argsort(height, kind="stable")
    w = weight * np.where(inner, 1 / weight[inner].sum(), 1 / weight[~inner].sum())
    below = np.cumsum(
        np.where(inner, w, -w)[order]
    )  # inner vertices below, minus outer vertices below
    return float(height[order[below.argmin()]])


def _stiffness(angle: FloatArray) -> FloatArray:
    """Cost (3, 3) of squared tilts, per square meter: a pocket in the front does not lift the
    seat."""
    middle = angle.mean(axis=0)
    long = float(np.linalg.norm(middle))
    result = np.zeros((3, 3))
    result[1:, 1:] = np.eye(2) / _TILT**2
    if long > _HALF:
        result[1:, 1:] += np.outer(middle, middle) / long**2 * (1 / _UNSEEN_TILT**2 - 1 / _TILT**2)
    return result


def _newton(
    height: FloatArray, angle: FloatArray, inner: BoolArray, weight: FloatArray, middle: float
) -> FloatArray:
    """Height and tilt (3,) of the border by logistic regression at a fixed width (`_WIDTH`), with a
    penalty on the tilt."""
    design = np.concatenate([np.ones((len(height), 1)), angle], axis=1)
    ridge = 0.02 * len(height) * _WIDTH**2 * _stiffness(angle)
    curve = np.array([middle, 0.0, 0.0])
    for _ in range(_ROUNDS):
        share = 1 / (1 + np.exp(-np.clip((height - design @ curve) / _WIDTH, -30, 30)))
        slope = design.T @ (weight * (share - inner)) / _WIDTH - ridge @ curve / _WIDTH**2
        bend = (
            design * (weight * share * (1 - share) + 1e-6)[:, None]
        ).T @ design / _WIDTH**2 + ridge / _WIDTH**2
        step = np.linalg.solve(bend + 1e-6 * np.eye(3), slope)
        curve = curve + np.clip(step, -0.02, 0.02)
        curve[1:] *= min(1.0, _MOST_TILT / max(float(np.linalg.norm(curve[1:])), 1e-9))
    return curve
