"""Move hands onto the rungs, rails and bars of a climb while they rest near them."""

from __future__ import annotations

import numpy as np

from a2v.animation.curves import bridged, near, runs, speed_of
from a2v.animation.footing import find_props
from a2v.animation.hands import turn_bones
from a2v.animation.rig import SIDES, Rig, joints_of
from a2v.kinematics import rotvec_to_rotmat, swing_between
from a2v.kinematics.limbs import bend_to
from a2v.kinematics.skeleton import subtree
from a2v.props import Props
from a2v.types import Body, FloatArray

HOLDS = ("rung", "rail", "bar")
"""Names of the solids that hands hold."""
GRIP = 0.45 / 1.3
"""Distance from the wrist to the middle of the palm, as a share of the forearm's length."""
SLOW = 0.4
"""Speed in m/s below which a hand may be holding."""
WITHIN = 0.25
"""Distance in meters from a solid below which a slow hand holds it."""
LEAST_SECONDS = 0.2
"""Shortest hold, seconds."""
EASE_SECONDS = 0.2
"""Time in seconds in which a hand moves to a hold, and from it."""
ROUNDS = 4
"""Rounds of inverse kinematics: the palm turns with the forearm, so one round is not enough."""


def hold_solids(transforms: FloatArray, rig: Rig, body: Body, fps: float) -> FloatArray:
    """Move hands that rest near a rung, a rail or a bar onto it, as far as the arms reach.

    Each hold keeps the palm at one point of the solid: the point nearest to the resting palm.
    Shoulders do not move; elbows bend in their own plane.

    Parameters
    ----------
    transforms : (T, B, 4, 4) float64
        World from bone, meters, of a clip that climbs, with the feet already in contact.
    rig : Rig
    body : Body
    fps : float

    Returns
    -------
    (T, B, 4, 4) float64
        The input if there is nothing to hold.
    """
    lines = axes_of(find_props(transforms, body, fps))
    if not len(lines):
        return transforms
    out = transforms
    for side in SIDES:
        palm = palm_of(transforms, rig, side)
        goal, weight = _goals(palm, lines, fps)
        if not weight.any():
            continue
        if out is transforms:
            out = transforms.copy()
        for _ in range(ROUNDS):
            move = weight[:, None] * (goal - palm_of(transforms, rig, side))
            move -= palm_of(out, rig, side) - palm_of(transforms, rig, side)
            _reach(out, rig, side, move)
    return out


def axes_of(props: Props) -> FloatArray:
    """Both ends (N, 2, 3) of the axis of each solid that hands hold, meters."""
    found = []
    for name, solid in props.surfaces():
        if not name.startswith(HOLDS):
            continue
        points = solid.vertices.astype(np.float64)
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        along = np.linalg.svd(points - middle, full_matrices=False)[2][0]
        share = (points - middle) @ along
        found.append(middle + np.array([[share.min()], [share.max()]]) * along)
    return np.array(found).reshape(-1, 2, 3)


def palm_of(transforms: FloatArray, rig: Rig, side: str) -> FloatArray:
    """Position (T, 3) of the middle of a palm, in line with the forearm."""
    joints = joints_of(transforms, rig)
    wrist = joints[f"{side}_wrist"]
    palm: FloatArray = wrist + GRIP * (wrist - joints[f"{side}_elbow"])
    return palm


def nearest_on(lines: FloatArray, point: FloatArray) -> FloatArray:
    """The points (N, 3) of segments (N, 2, 3) that are nearest to a `point` (3,)."""
    along = lines[:, 1] - lines[:, 0]
    share = ((point - lines[:, 0]) * along).sum(-1) / np.maximum((along**2).sum(-1), 1e-12)
    found: FloatArray = lines[:, 0] + np.clip(share, 0, 1)[:, None] * along
    return found


def _goals(palm: FloatArray, lines: FloatArray, fps: float) -> tuple[FloatArray, FloatArray]:
    """Target positions (T, 3) of a palm (T, 3) and their weights (T,) in [0, 1]."""
    goal, on = np.full(palm.shape, np.nan), np.zeros(len(palm), bool)
    for start, end in runs(speed_of(palm, fps) < SLOW):
        if end - start < LEAST_SECONDS * fps:
            continue
        points = nearest_on(lines, np.median(palm[start:end], axis=0))
        away = np.linalg.norm(palm[start:end, None] - points, axis=-1).max(axis=0)
        if away.min() < WITHIN:
            goal[start:end], on[start:end] = points[away.argmin()], True
    return bridged(goal), near(on, EASE_SECONDS * fps)


def _reach(out: FloatArray, rig: Rig, side: str, move: FloatArray) -> None:
    """Move a wrist by `move` (T, 3), in place, by turns of shoulder and elbow."""
    shoulder, elbow, wrist = (
        rig.bones[f"{side}_{name}"] for name in ("shoulder", "elbow", "wrist")
    )
    top, middle, end = (out[:, bone, :3, 3].copy() for bone in (shoulder, elbow, wrist))
    new_elbow, new_wrist = bend_to(top, middle, end, end + move)
    upper, below = subtree(rig.parents, shoulder), subtree(rig.parents, elbow)
    swing = swing_between(middle - top, new_elbow - top)
    turn_bones(out, upper, rotvec_to_rotmat(swing))
    turned = out[:, wrist, :3, 3] - out[:, elbow, :3, 3]
    swing = swing_between(turned, new_wrist - out[:, elbow, :3, 3])
    turn_bones(out, below, rotvec_to_rotmat(swing))
