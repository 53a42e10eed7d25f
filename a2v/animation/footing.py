"""Find steps, ladders and bars of a climb from the places where feet and hands rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a2v.animation.curves import runs, speed_of
from a2v.animation.rig import SIDES, joints_of, place, rig_of, sole_points
from a2v.kinematics.foot_contacts import steps_under
from a2v.kinematics.ground import yaw_to_rotmat
from a2v.props import Props, box, rod
from a2v.types import Body, BoolArray, FloatArray

NEAR_SOLE = 0.03
"""Largest height in meters above its support at which a point of a sole lies on it."""
BORDER = 0.05
"""Margin of a step around the feet, meters."""
WIDTH = 0.6
"""Least width of steps and rungs, meters: a step holds two feet."""
SAME_LEVEL = 0.05
"""Largest difference in height of two places on one step, meters."""
GAP = 0.45
"""Largest horizontal distance of two places on one step, meters."""
SLAB = 0.04
"""Thickness of a step that is open below, meters."""
ROD = 0.018
"""Radius of rungs, rails and bars, meters."""
THROUGH = 0.04
"""Largest share of the frames in which some of the person may be inside a step."""
SHRUNK = 0.025
"""Depth in meters below its surface from which a point counts as inside a solid."""
HEELS = (0.0, 0.35, 0.6)
"""Shares of a foot's length that may stand over the edge of its step."""
HUNG_SECONDS = 0.4
"""Least time in seconds that hands above the head rest on a bar."""
RUNG = 0.3
"""Distance between the rungs of a ladder above the feet, meters."""


@dataclass(frozen=True)
class FootingSettings:
    """Solids that are shown under the feet of a person who climbs.

    Attributes
    ----------
    shown : bool
        Whether steps, ladders and bars are looked for at all.
    """

    shown: bool = True


@dataclass(frozen=True)
class _Tread:
    """A place where feet rest: x and z of its lower and upper corner in the clip's axes, and its
    height, meters."""

    low: FloatArray
    high: FloatArray
    height: float

    def joined(self, other: _Tread) -> _Tread:
        return _Tread(
            np.minimum(self.low, other.low),
            np.maximum(self.high, other.high),
            max(self.height, other.height),
        )

    def is_beside(self, other: _Tread) -> bool:
        gap = np.maximum(self.low - other.high, other.low - self.high).max()
        return bool(abs(self.height - other.height) < SAME_LEVEL and gap < GAP)


def find_props(bone_transforms: FloatArray, body: Body, fps: float) -> Props:
    """Find the solids of a clip that climbs.

    A place where feet rest becomes a step if the person does not pass through it, else a slab. If
    the person passes through the highest step, the places become a ladder.

    Parameters
    ----------
    bone_transforms : (T, B, 4, 4) float
        World from bone, meters, of a clip that was retargeted with steps; the ground is y = 0.
    body : Body
    fps : float

    Returns
    -------
    Props
        Empty if feet and hands rest only on the ground.
    """
    rig, transforms = rig_of(body), np.asarray(bone_transforms, np.float64)
    joints = joints_of(transforms, rig)
    if len(transforms) < 4 or any(f"{side}_foot" not in joints for side in SIDES):
        return Props.of([])
    feet = np.stack(
        [np.stack([joints[f"{side}_ankle"], joints[f"{side}_foot"]], axis=1) for side in SIDES]
    )
    levels, stands = steps_under(feet, joints["pelvis"], fps)
    raised = (levels > 0) & stands
    turn = yaw_to_rotmat(np.array([_facing(joints, raised.any(axis=0))]))[
        0
    ]  # the clip's axes: +z is the direction of the climb
    soles = [sole_points(transforms, rig, side) @ turn for side in SIDES]
    treads = _treads(soles, levels, raised)
    skin = place(rig.skin, transforms)[::2] @ turn
    solids, rungs = list[tuple[str, FloatArray]](), list[_Tread]()
    made = [_solid(tread, skin) for tread in treads]
    if treads and made[-1] is None:  # if the highest step must be a rung, the person is on a ladder
        rungs = treads
    else:
        solids = [
            _slab(tread) if found is None else found
            for tread, found in zip(treads, made, strict=True)
        ]
    hands = {
        side: (
            joints[f"{side}_wrist"]
            + 0.45 * (joints[f"{side}_wrist"] - joints[f"{side}_elbow"]) / 1.3
        )
        @ turn
        for side in SIDES
    }
    solids += _ladder(
        rungs, max(float(np.quantile(points[:, 1], 0.98)) for points in hands.values())
    )
    if not stands.all():
        solids += _bars(
            hands,
            (joints["head"] if "head" in joints else joints["pelvis"] + [0, 0.6, 0])[:, 1],
            ~stands.any(axis=0),
            fps,
        )
    return Props.of([(name, points @ turn.T) for name, points in solids])


def _facing(joints: dict[str, FloatArray], where: BoolArray) -> float:
    """Mean heading of the hips, as an angle about +y from +z, over the frames `where` (T,), or over
    all."""
    across = (joints["left_hip"] - joints["right_hip"])[where if where.any() else slice(None)].mean(
        axis=0
    )
    return float(np.arctan2(-across[2], across[0]))


def _treads(soles: Sequence[FloatArray], levels: FloatArray, raised: BoolArray) -> list[_Tread]:
    """Places where feet rest above the ground, merged for each step, the lowest first."""
    found = list[_Tread]()
    for points, level, on in zip(soles, levels, raised, strict=True):
        for start, end in runs(on):
            if np.ptp(level[start:end]) > SAME_LEVEL:
                continue
            bottom = points[start:end, :, 1].min(axis=1)
            height = float(np.median(bottom))
            touching = points[start:end][points[start:end, :, 1] < height + NEAR_SOLE]
            if len(touching) and height > 0.02:
                flat = touching[:, [0, 2]]
                found.append(
                    _Tread(np.quantile(flat, 0.02, axis=0), np.quantile(flat, 0.98, axis=0), height)
                )
    found.sort(key=lambda tread: tread.height)
    joined = list[_Tread]()
    for tread in found:
        for at, other in enumerate(joined):
            if tread.is_beside(other):
                joined[at] = tread.joined(other)
                break
        else:
            joined.append(tread)
    return joined


def _solid(tread: _Tread, skin: FloatArray) -> tuple[str, FloatArray] | None:
    """A step down to the ground, or else a slab, that the person (T, K, 3) does not pass through;
    None if both fail."""
    middle = 0.5 * (tread.low[0] + tread.high[0])
    half = max(0.5 * WIDTH, 0.5 * (tread.high[0] - tread.low[0]) + BORDER)
    length = tread.high[1] - tread.low[1]
    for name, bottom in (("step", 0.0), ("slab", tread.height - SLAB)):
        for heel in HEELS:
            for toe in HEELS[:2]:
                low = np.array(
                    [
                        middle - half,
                        bottom,
                        tread.low[1] - (BORDER if heel == 0 else -heel * length),
                    ]
                )
                high = np.array(
                    [
                        middle + half,
                        tread.height,
                        tread.high[1] + (BORDER if toe == 0 else -toe * length),
                    ]
                )
                if high[2] - low[2] < 0.08:
                    continue
                if _share_inside(skin, low, high) <= THROUGH:
                    return name, box(low, high)
    return None


def _slab(tread: _Tread) -> tuple[str, FloatArray]:
    """Return a slab only under the feet, for a person who passes through every larger solid."""
    return "slab", box(
        np.array([tread.low[0], tread.height - SLAB, tread.low[1]]),
        np.array([tread.high[0], tread.height, tread.high[1]]),
    )


def _share_inside(skin: FloatArray, low: FloatArray, high: FloatArray) -> float:
    """Return the fraction of frames in which some of the skin (T, K, 3) is inside a box."""
    inset = np.minimum(SHRUNK, 0.3 * (high - low))
    inside = ((skin > low + inset * [1, 0, 1]) & (skin < high - inset)).all(axis=-1).any(axis=-1)
    return float(inside.mean())


def _ladder(rungs: Sequence[_Tread], reach: float) -> list[tuple[str, FloatArray]]:
    """Return rungs under the balls of the feet with rails up to the height `reach` of the hands; a
    single rung stands on two posts."""
    if not rungs:
        return []
    places = np.array(
        [
            [
                0.5 * (one.low[0] + one.high[0]),
                one.height - ROD,
                one.low[1] + 0.7 * (one.high[1] - one.low[1]),
            ]
            for one in rungs
        ]
    )
    middle, half = (
        float(np.median(places[:, 0])),
        0.5 * max(WIDTH, float(np.ptp(places[:, 0])) + 0.4),
    )
    slope, foot = (
        np.polyfit(places[:, 1], places[:, 2], 1) if len(places) > 1 else (0.0, places[0, 2])
    )
    slope = float(np.clip(slope, -0.2, 0.8))
    foot = float(np.mean(places[:, 2] - slope * places[:, 1]))
    top = max(reach, float(places[:, 1].max())) if len(places) > 1 else float(places[0, 1])
    heights = (
        [*places[:, 1].tolist(), *np.arange(places[:, 1].max() + RUNG, top, RUNG).tolist()]
        if len(places) > 1
        else [top]
    )
    side = np.array([half, 0.0, 0.0])

    def at(height: float) -> FloatArray:
        return np.array([middle, height, foot + slope * height])

    solids = [("rung", rod(at(height) - side, at(height) + side, ROD)) for height in heights]
    name = "rail" if len(places) > 1 else "post"
    return solids + [
        (name, rod(at(0.0) + sign * side, at(top + ROD) + sign * side, 1.3 * ROD))
        for sign in (-1, 1)
    ]


def _bars(
    hands: dict[str, FloatArray], head: FloatArray, flies: BoolArray, fps: float
) -> list[tuple[str, FloatArray]]:
    """Return bars on posts where both hands rest above the head (T,) while no foot stands."""
    slow = np.all([speed_of(points, fps) < 0.5 for points in hands.values()], axis=0)
    over = np.minimum(*(points[:, 1] for points in hands.values())) > head + 0.05
    solids = list[tuple[str, FloatArray]]()
    for start, end in runs(slow & over & flies):
        if end - start < HUNG_SECONDS * fps:
            continue
        left, right = (np.median(hands[side][start:end], axis=0) for side in SIDES)
        height = 0.5 * (left[1] + right[1])
        along = (left - right) * [1, 0, 1]
        along /= max(float(np.linalg.norm(along)), 1e-6)
        ends = [
            point * [1, 0, 1] + [0, height, 0] + sign * 0.4 * along
            for point, sign in ((left, 1), (right, -1))
        ]
        solids.append(("bar", rod(ends[0], ends[1], ROD)))
        solids += [("post", rod(point * [1, 0, 1], point, 1.3 * ROD)) for point in ends]
        break
    return solids
