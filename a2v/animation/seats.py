"""Find the seats of a person who sits: stools, chairs and low boxes, from contacts.

A person sits in a frame in which the pelvis rests, is lower than standing, lies behind the feet by
more than a crouch could balance, and is higher than the ground.
"""

from __future__ import annotations

import numpy as np

from a2v.animation.curves import runs
from a2v.animation.rig import SIDES, Rig, joints_of, place, rig_of
from a2v.kinematics.ground import smoothed
from a2v.props import box, rod
from a2v.types import Body, BoolArray, FloatArray

BEHIND = 0.24
"""Least distance in meters of the pelvis behind the middle of the ankles: a crouching person keeps
it nearer, or falls."""
RESTS = 0.35
"""Speed in meters per second below which the pelvis rests."""
BENT = 0.25
"""Largest height of the pelvis above the knees, meters, of a person who sits."""
LEAST_SECONDS = 0.5
"""Shortest time on a seat."""
LEAST_HEIGHT = 0.25
"""Lowest seat, meters; lower ones are the ground."""
UNDER = 0.16
"""Distance from the middle of the pelvis, meters, within which skin rests on the seat."""
SEAT = (0.42, 0.4)
"""Width and depth of a seat, meters."""
THICK = 0.045
LEG = 0.016
"""Radius of the legs of a seat, meters."""
BACK = 0.42
"""Height of a chair's back over its seat, meters."""
CLEAR = 0.02
"""Share of skin points that may be within a chair's back before it is left out."""


def find_seats(bone_transforms: FloatArray, body: Body, fps: float) -> list[tuple[str, FloatArray]]:
    """Find the seats of a clip.

    Parameters
    ----------
    bone_transforms : (T, B, 4, 4) float
        World from bone, meters, y up; the ground is y = 0.
    body : Body
    fps : float

    Returns
    -------
    list of (str, (N, 3) float)
        Names and points of convex solids (`a2v.props.Props.of`): "seat", four "leg" and, where the
        person never is, a "back". Empty if nobody sits.
    """
    rig, transforms = rig_of(body), np.asarray(bone_transforms, np.float64)
    joints = joints_of(transforms, rig)
    if len(transforms) < 4 or any(f"{side}_knee" not in joints for side in SIDES):
        return []
    seated = _seated(joints, fps)
    solids: list[tuple[str, FloatArray]] = []
    places: list[FloatArray] = []
    for begin, end in runs(seated):
        if (end - begin) / fps < LEAST_SECONDS:
            continue
        middle = np.median(joints["pelvis"][begin:end], axis=0)
        if any(np.linalg.norm((middle - other)[[0, 2]]) < SEAT[0] for other in places):
            continue
        own = _seat(rig, transforms, joints, slice(begin, end), middle)
        if own:
            places.append(middle)
            solids += own
    return solids


def _seated(joints: dict[str, FloatArray], fps: float) -> BoolArray:
    """Return the frames (T,) in which the person sits."""
    pelvis = joints["pelvis"]
    ankles, knees = (
        0.5 * (joints[f"left_{name}"] + joints[f"right_{name}"]) for name in ("ankle", "knee")
    )
    speed = np.linalg.norm(np.gradient(smoothed(pelvis, 0.1 * fps), axis=0), axis=-1) * fps
    way = (ankles - pelvis) * [1, 0, 1]
    hips = joints["left_hip"] - joints["right_hip"]
    ahead = np.cross(hips, [0.0, 1.0, 0.0])
    ahead /= np.maximum(np.linalg.norm(ahead, axis=-1, keepdims=True), 1e-9)
    behind = (way * ahead).sum(-1)
    low = pelvis[:, 1] - knees[:, 1] < BENT
    floor = np.minimum(joints["left_ankle"], joints["right_ankle"])[:, 1] < 0.25
    found: BoolArray = (
        (speed < RESTS) & (behind > BEHIND) & low & floor & (pelvis[:, 1] > LEAST_HEIGHT + 0.1)
    )
    return found


def _seat(
    rig: Rig,
    transforms: FloatArray,
    joints: dict[str, FloatArray],
    span: slice,
    middle: FloatArray,
) -> list[tuple[str, FloatArray]]:
    """Return the solids of one seat."""
    skin = place(rig.skin, transforms[span][:: max(1, (span.stop - span.start) // 12)])
    near = np.linalg.norm((skin - middle)[..., [0, 2]], axis=-1) < UNDER
    lowest = [points[own, 1].min() for points, own in zip(skin, near, strict=True) if own.any()]
    height = float(np.median(lowest)) if lowest else 0.0
    if height < LEAST_HEIGHT:
        return []
    hips = np.median((joints["left_hip"] - joints["right_hip"])[span], axis=0)
    yaw = np.arctan2(-hips[2], hips[0])
    cos, sin = np.cos(yaw), np.sin(yaw)
    axes = np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]])  # left, up, ahead
    wide, deep = SEAT[0] / 2, SEAT[1] / 2

    def world(points: FloatArray) -> FloatArray:
        placed: FloatArray = points @ axes + middle * [1, 0, 1]
        return placed

    top = box(np.array([-wide, height - THICK, -deep]), np.array([wide, height, deep]))
    solids = [("seat", world(top))]
    for x in (-wide + 0.03, wide - 0.03):
        for z in (-deep + 0.03, deep - 0.03):
            leg = rod(np.array([x, 0.0, z]), np.array([x, height - THICK, z]), LEG)
            solids.append(("leg", world(leg)))
    everything = place(rig.skin, transforms[:: max(1, len(transforms) // 24)])
    local = (everything - middle * [1, 0, 1]) @ axes.T
    inside = (
        (np.abs(local[..., 0]) < wide)
        & (local[..., 2] < -deep + 0.04)
        & (local[..., 2] > -deep - 0.04)
        & (local[..., 1] > height + 0.1)
        & (local[..., 1] < height + BACK)
    )
    if inside.mean() < CLEAR / 100:
        back = box(
            np.array([-wide, height + 0.12, -deep - 0.03]),
            np.array([wide, height + BACK, -deep]),
        )
        solids.append(("back", world(back)))
        for x in (-wide + 0.03, wide - 0.03):
            post = rod(
                np.array([x, height - THICK, -deep - 0.015]),
                np.array([x, height + BACK, -deep - 0.015]),
                LEG,
            )
            solids.append(("post", world(post)))
    return solids
