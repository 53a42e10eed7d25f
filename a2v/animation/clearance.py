"""Arms that keep out of the trunk: a motion's joints are thin, the body that wears them is not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from a2v.animation.curves import bridged
from a2v.animation.hands import turn_bones
from a2v.animation.rig import SIDES, Rig, place
from a2v.geometry.vectors import unit
from a2v.kinematics import rotvec_to_rotmat
from a2v.kinematics.ground import smoothed
from a2v.kinematics.skeleton import subtree
from a2v.types import FloatArray, IntArray

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

_FLESH = 0.008
"""How far skin gives way where an arm lies on it, metres."""
_REACH = 0.16
"""Deeper than this, metres, the nearest skin does not say which way out is."""
_SURE = 0.08
"""Towards this depth, metres, the nearest skin may be that of the other side of the trunk: where the arm went in says more."""
_ROUNDS = 6
"""Rounds of finding and smoothing."""
_STEPS = 6
"""Rounds of single points within one round."""
_MOST = 0.45
"""Radians that an arm is turned at most: what would need more is a pose that nobody takes, and is left."""
_SMOOTH_SECONDS = 0.07
_UPPER = 0.5
"""Share of the upper arm, from the shoulder, that may lie on the trunk: armpits do."""


@dataclass(frozen=True)
class _Trunk:
    """The skin of trunk, head and thighs, which no arm moves: world positions and normals (T, K, 3), and a tree of the first for each frame."""

    points: FloatArray
    normals: FloatArray
    trees: list[cKDTree]

    @classmethod
    def of(cls, transforms: FloatArray, rig: Rig) -> _Trunk:
        from scipy.spatial import cKDTree

        owner, local = rig.skin
        away = {bone for name in SIDES for joint in ("shoulder", "knee") for bone in subtree(rig.parents, rig.bones[f"{name}_{joint}"])}
        own = np.flatnonzero(~np.isin(owner, list(away)))
        points = place((owner[own], local[own]), transforms)
        normals = np.einsum("tkab,kb->tka", transforms[:, owner[own], :3, :3], rig.skin_normals[own])
        return cls(points, normals, [cKDTree(frame) for frame in points])


@dataclass(frozen=True)
class _Arm:
    """An arm's bones from the shoulder's on, and the points of its skin, as `Rig.skin` has them, that are to keep out."""

    left: bool
    shoulder: int
    bones: list[int]
    skin: tuple[IntArray, FloatArray]

    @classmethod
    def of(cls, rig: Rig, side: str) -> _Arm:
        owner, local = rig.skin
        shoulder, elbow = rig.bones[f"{side}_shoulder"], rig.bones[f"{side}_elbow"]
        bones = subtree(rig.parents, shoulder)
        rest = np.einsum("kab,kb->ka", rig.rest[owner], local) + rig.heads[owner]
        along = rig.heads[elbow] - rig.heads[shoulder]
        share = (rest - rig.heads[shoulder]) @ along / max(float(along @ along), 1e-9)
        own = np.flatnonzero(np.isin(owner, bones) & (share > _UPPER))
        return cls(side == "left", shoulder, bones, (owner[own], local[own]))


def clear_arms(transforms: FloatArray, rig: Rig, fps: float) -> FloatArray:
    """Turn arms about their shoulders, smoothly and no farther than needed, until they no longer lie within the trunk, the head or the thighs.

    Where an arm's skin is behind the tangent plane of the nearest skin of the trunk, the smallest rotation that brings it before
    that plane is looked for, point after point (projections onto half-spaces); what was found is smoothed over time and looked at again.

    Parameters
    ----------
    transforms : (T, B, 4, 4) float64
        World from bone.
    rig : Rig
    fps : float

    Returns
    -------
    (T, B, 4, 4) float64
        The input where nothing is to be done.
    """
    out, trunk = transforms, _Trunk.of(transforms, rig)
    for side in SIDES:
        arm = _Arm.of(rig, side)
        if not trunk.points.shape[1] or not len(arm.skin[0]):
            continue
        turned = np.zeros((len(out), 3))
        for _ in range(_ROUNDS):
            turn = _turn_out(out, rig, trunk, arm)
            if not turn.any():
                break
            wanted = turned + _widened(turn, _SMOOTH_SECONDS * fps)
            wanted *= _MOST / np.maximum(np.linalg.norm(wanted, axis=-1, keepdims=True), _MOST)
            out = out.copy() if out is transforms else out
            turn_bones(out, arm.bones, rotvec_to_rotmat(smoothed(wanted - turned, _SMOOTH_SECONDS / 2 * fps)))
            turned = wanted
    return out


def arm_depth(transforms: FloatArray, rig: Rig) -> FloatArray:
    """How far the arms are within trunk, head and thighs at most (T, 2), metres, left and right; 0 where they keep out."""
    depth, trunk = np.zeros((len(transforms), 2)), _Trunk.of(transforms, rig)
    for column, side in enumerate(SIDES):
        arm = _Arm.of(rig, side)
        if trunk.points.shape[1] and len(arm.skin[0]):
            for t, skin in enumerate(place(arm.skin, transforms)):
                depth[t, column] = max(0.0, float(_depths(trunk, t, skin)[0].max()))
    return depth


def _depths(trunk: _Trunk, t: int, skin: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Depth (A,) of an arm's `skin` (A, 3) at frame `t` behind the tangent planes of the trunk's nearest points, and the planes' normals (A, 3)."""
    away, nearest = trunk.trees[t].query(skin, k=3, distance_upper_bound=_REACH)
    known = np.isfinite(away)
    nearest = np.where(known, nearest, 0)
    weight = np.where(known, 1 / (away + 0.01) ** 2, 0.0)
    point, normal = trunk.points[t][nearest], trunk.normals[t][nearest]
    behind = -((skin[:, None] - point) * normal).sum(-1)
    total = weight.sum(1)
    near = total > 0
    depth = np.where(near, (np.where(known, behind, 0) * weight).sum(1) / np.where(near, total, 1), -np.inf)
    out = (normal * weight[..., None]).sum(1)
    return depth, out / np.maximum(np.linalg.norm(out, axis=-1, keepdims=True), 1e-9)


def _turn_out(transforms: FloatArray, rig: Rig, trunk: _Trunk, arm: _Arm) -> FloatArray:
    """Rotation vectors (T, 3) about the shoulder that bring the arm out, frame by frame."""
    skin = place(arm.skin, transforms)
    found = [_depths(trunk, t, points) for t, points in enumerate(skin)]
    chest = (rig.chains["spine"] or [rig.bones["pelvis"]])[-1]
    ways = _ways_out(found, transforms[:, chest, :3, :3] @ rig.rest[chest].T, 1.0 if arm.left else -1.0)
    turns = np.zeros((len(transforms), 3))
    for t, (depth, out) in enumerate(found):
        if depth.max() <= _FLESH:
            continue
        deep = depth > 0
        sure = np.clip(1 - depth[deep] / _SURE, 0, 1)[:, None]
        out = unit(sure * out[deep] + (1 - sure) * ways[t])
        lever = np.cross(skin[t][deep] - transforms[t, arm.shoulder, :3, 3], out)
        missing = depth[deep] - _FLESH / 2
        for _ in range(_STEPS):  # Kaczmarz: the farthest half-space first
            left = missing - lever @ turns[t]
            worst = int(left.argmax())
            if left[worst] <= 0:
                break
            turns[t] += left[worst] / max(float(lever[worst] @ lever[worst]), 1e-4) * lever[worst]
    return turns


def _ways_out(found: Sequence[tuple[FloatArray, FloatArray]], chest: FloatArray, aside: float) -> FloatArray:
    """Unit vectors (T, 3) along which a deep arm leaves the trunk: there where it went in, or comes out again, in the axes of the `chest`."""
    ways = np.full((len(found), 3), np.nan)
    for t, (depth, out) in enumerate(found):
        deepest = int(depth.argmax())
        if -_SURE / 2 < depth[deepest] < _SURE / 2:
            ways[t] = chest[t].T @ out[deepest]
    if not np.isfinite(ways[:, 0]).any():
        ways[:] = [aside, 0.0, 0.0]
    world: FloatArray = unit(np.einsum("tab,tb->ta", chest, bridged(ways)))
    return world


def _widened(turns: FloatArray, width: float) -> FloatArray:
    """Rotation vectors (T, 3) smoothed over time, so that the turn is there before the arm would be within."""
    from scipy.ndimage import maximum_filter1d

    size = np.linalg.norm(turns, axis=-1)
    smooth = smoothed(turns, width)
    now = np.linalg.norm(smooth, axis=-1, keepdims=True)
    wanted = smoothed(maximum_filter1d(size, 2 * max(1, round(width)) + 1)[:, None], width)
    return np.asarray(smooth * np.minimum(wanted / np.maximum(now, 1e-9), 3.0))
