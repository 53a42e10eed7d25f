"""Keep arms out of the trunk: joints of a motion have no volume, but the body has."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from a2v.animation.curves import bridged
from a2v.animation.hands import turn_bones
from a2v.animation.rig import SIDES, Rig, place
from a2v.animation.smooth_turns import smooth_turns
from a2v.geometry.steps import smoothstep
from a2v.geometry.vectors import unit
from a2v.kinematics import rotvec_to_rotmat
from a2v.kinematics.skeleton import subtree
from a2v.types import FloatArray, IntArray

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

_FLESH = 0.008
"""Depth in meters by which skin yields where an arm lies on it."""
_REACH = 0.16
"""Depth in meters below which the nearest skin no longer gives the direction to the outside."""
_SURE = 0.08
"""Near this depth, meters, the nearest skin may belong to the other side of the trunk. The place
where the arm entered is then more reliable."""
_ASIDE = 1.5
"""Weight of the direction to the arm's own side relative to the place of entry: an arm that enters
the trunk at the front and leaves it at the back has to go around the side."""
_ROUNDS = 10
"""Largest number of rounds of finding the points inside and turning the arms."""
_POINTS = 10
"""Number of the deepest points of an arm that are used in a frame."""
_MARGIN = 0.02
"""Points within this distance outside, meters, are used too: a turn that frees one point must not
push another one inside."""
_MOST = 1.2
"""Largest turn of an upper arm, radians. A pose that would need more is implausible and stays as it
is."""
_MOST_BENT = 0.5
"""Largest change of an elbow's bend, radians."""
_BENDS = (0.2, 0.6)
"""Bends of an elbow, radians, from which its plane of bending is usable, and is reliable."""
_FOLDED = 2.4
"""Largest bend of an elbow, radians."""
_NOTHING = 4e-3
"""Smaller turns, radians, are dropped."""
_UPPER = 0.5
"""Share of the upper arm, from the shoulder, that may touch the trunk, as armpits do."""


@dataclass(frozen=True)
class _Trunk:
    """The skin of trunk, head and thighs: world positions and normals (T, K, 3), and a search tree
    of the positions for each frame."""

    points: FloatArray
    normals: FloatArray
    trees: list[cKDTree]

    @classmethod
    def of(cls, transforms: FloatArray, rig: Rig) -> _Trunk:
        from scipy.spatial import cKDTree

        owner, local = rig.skin
        away = {
            bone
            for name in SIDES
            for joint in ("shoulder", "knee")
            for bone in subtree(rig.parents, rig.bones[f"{name}_{joint}"])
        }
        own = np.flatnonzero(~np.isin(owner, list(away)))
        points = place((owner[own], local[own]), transforms)
        normals = np.einsum(
            "tkab,kb->tka", transforms[:, owner[own], :3, :3], rig.skin_normals[own]
        )
        quick = {"leafsize": 32, "compact_nodes": False, "balanced_tree": False}  # few queries each
        return cls(points, normals, [cKDTree(frame, **quick) for frame in points])


@dataclass(frozen=True)
class _Arm:
    """Bones of an arm from the shoulder on and from the elbow on, and those points of its skin (as
    in `Rig.skin`) that must stay outside the trunk."""

    left: bool
    shoulder: int
    elbow: int
    wrist: int
    bones: list[int]
    fore: list[int]
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
        fore = subtree(rig.parents, elbow)
        return cls(
            side == "left",
            shoulder,
            elbow,
            rig.bones[f"{side}_wrist"],
            bones,
            fore,
            (owner[own], local[own]),
        )


def clear_arms(transforms: FloatArray, rig: Rig, fps: float) -> FloatArray:
    """Turn arms and bend elbows, smoothly and as little as needed, until no arm is inside the body.

    Arms turn about their shoulders and must leave the trunk, the head and the thighs. Skin of an
    arm that is behind the tangent plane of the nearest skin must move in front of that plane. All
    frames are solved together for the smallest and smoothest turns (`smooth_turns`); then the
    depths are measured again.

    Parameters
    ----------
    transforms : (T, B, 4, 4) float64
        World from bone.
    rig : Rig
    fps : float

    Returns
    -------
    (T, B, 4, 4) float64
        The input if no arm is inside.
    """
    out, trunk = transforms, _Trunk.of(transforms, rig)
    for side in SIDES:
        arm = _Arm.of(rig, side)
        if trunk.points.shape[1] and len(arm.skin[0]):
            out = _cleared(out, rig, trunk, arm, fps)
    return out


def _cleared(transforms: FloatArray, rig: Rig, trunk: _Trunk, arm: _Arm, fps: float) -> FloatArray:
    """Return the clip with one arm moved out of the trunk."""
    chest = (rig.chains["spine"] or [rig.bones["pelvis"]])[-1]
    axes = transforms[:, chest, :3, :3] @ rig.rest[chest].T
    out, turned = transforms, np.zeros((len(transforms), 4))
    moved, skin = np.arange(len(out)), place(arm.skin, out)
    depth, normal = _depths(trunk, moved, skin)
    ways: FloatArray | None = None
    for _ in range(_ROUNDS):
        if depth.max() <= _FLESH:
            break
        if ways is None:
            ways = _ways_out(depth, normal, axes, 1.0 if arm.left else -1.0)
        planes = _half_spaces(out, arm, axes, skin, (depth, normal), ways)
        before = turned
        turned = _limited(smooth_turns(*planes, turned, fps), _bend_of(transforms, arm)[0])
        out = _turned(transforms, arm, axes, turned)
        moved = np.flatnonzero((turned != before).any(1))
        skin[moved] = place(arm.skin, out[moved])
        depth[moved], normal[moved] = _depths(trunk, moved, skin[moved])
    return out


def arm_depth(transforms: FloatArray, rig: Rig) -> FloatArray:
    """Return the largest depth (T, 2) of the left and the right arm inside trunk, head and thighs,
    meters; 0 outside."""
    depth, trunk = np.zeros((len(transforms), 2)), _Trunk.of(transforms, rig)
    for column, side in enumerate(SIDES):
        arm = _Arm.of(rig, side)
        if trunk.points.shape[1] and len(arm.skin[0]):
            found = _depths(trunk, np.arange(len(depth)), place(arm.skin, transforms))[0]
            depth[:, column] = np.maximum(found.max(1), 0)
    return depth


def _depths(trunk: _Trunk, frames: IntArray, skin: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Depth (F, A) of an arm's `skin` (F, A, 3) in `frames` (F,) behind the tangent planes of the
    trunk's nearest points, and the planes' normals (F, A, 3)."""
    found = [
        trunk.trees[t].query(points, k=3, distance_upper_bound=_REACH)
        for t, points in zip(frames, skin, strict=True)
    ]
    away = np.reshape([each for each, _ in found], (*skin.shape[:2], 3))
    nearest = np.reshape([each for _, each in found], away.shape)
    depth, out = np.full(skin.shape[:2], -np.inf), np.zeros(skin.shape)
    row, one = np.nonzero(np.isfinite(away[..., 0]))  # the others are near no skin
    away, nearest, t = away[row, one], nearest[row, one], frames[row, None]
    known = np.isfinite(away)
    nearest = np.where(known, nearest, 0)
    weight = np.where(known, 1 / (away + 0.01) ** 2, 0.0)
    point, normal = trunk.points[t, nearest], trunk.normals[t, nearest]
    behind = -((skin[row, one, None] - point) * normal).sum(-1)
    depth[row, one] = (np.where(known, behind, 0) * weight).sum(1) / weight.sum(1)
    out[row, one] = (normal * weight[..., None]).sum(1)
    return depth, out / np.maximum(np.linalg.norm(out, axis=-1, keepdims=True), 1e-9)


def _half_spaces(
    out: FloatArray,
    arm: _Arm,
    axes: FloatArray,
    skin: FloatArray,
    found: tuple[FloatArray, FloatArray],
    ways: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return how far the deepest points of an arm move outward per radian of its turns (T, M, 4),
    meters, and how far they must move (T, M), meters."""
    depth, normal = found
    deepest = np.argpartition(-depth, min(_POINTS, depth.shape[1] - 1), axis=1)[:, :_POINTS]
    rows = np.arange(len(out))[:, None]
    points, deep, away = skin[rows, deepest], depth[rows, deepest], normal[rows, deepest]
    sure = np.clip(1 - deep / _SURE, 0, 1)[..., None]
    away = unit(sure * away + (1 - sure) * ways[:, None])
    shoulder, elbow = (out[:, None, bone, :3, 3] for bone in (arm.shoulder, arm.elbow))
    turns = np.cross(points - shoulder, away) @ axes
    bend, hinge = _bend_of(out, arm)
    known = smoothstep(bend, *_BENDS)[:, None] * np.isin(arm.skin[0][deepest], arm.fore)
    bends = known * np.einsum("tmk,tk->tm", np.cross(points - elbow, away), hinge)
    near = deep > -_MARGIN
    slopes = np.where(near[..., None], np.concatenate([turns, bends[..., None]], axis=-1), 0.0)
    return slopes, np.where(near, deep - _FLESH / 2, -1.0)


def _bend_of(transforms: FloatArray, arm: _Arm) -> tuple[FloatArray, FloatArray]:
    """Bend of the elbow (T,), radians, and the unit axis (T, 3) about which it bends further."""
    shoulder, elbow, wrist = (
        transforms[:, bone, :3, 3] for bone in (arm.shoulder, arm.elbow, arm.wrist)
    )
    upper, fore = unit(elbow - shoulder), unit(wrist - elbow)
    across = np.cross(upper, fore)
    bend: FloatArray = np.arctan2(np.linalg.norm(across, axis=-1), (upper * fore).sum(-1))
    return bend, unit(across)


def _limited(turned: FloatArray, bend: FloatArray) -> FloatArray:
    """Limit turns (T, 4) to the range of an arm and drop turns that are too small to be visible."""
    size = np.linalg.norm(turned[:, :3], axis=-1, keepdims=True)
    turns = (
        turned[:, :3]
        * np.minimum(_MOST / np.maximum(size, 1e-9), 1)
        * np.maximum(1 - _NOTHING / np.maximum(size, 1e-9), 0)
    )
    bends = np.clip(
        turned[:, 3],
        -np.clip(bend - _BENDS[0], 0, _MOST_BENT),
        np.clip(_FOLDED - bend, 0, _MOST_BENT),
    )
    bends = np.sign(bends) * np.maximum(np.abs(bends) - _NOTHING, 0)
    return np.concatenate([turns, bends[:, None]], axis=1)


def _turned(transforms: FloatArray, arm: _Arm, axes: FloatArray, turned: FloatArray) -> FloatArray:
    """Turn the arm of a clip by `turned` (T, 4): a rotation vector in the axes of the chest, and
    the additional bend of the elbow."""
    out = transforms.copy()
    _, hinge = _bend_of(out, arm)
    turn_bones(out, arm.fore, rotvec_to_rotmat(turned[:, 3:] * hinge))
    turn_bones(out, arm.bones, rotvec_to_rotmat(np.einsum("tab,tb->ta", axes, turned[:, :3])))
    return out


def _ways_out(depth: FloatArray, normal: FloatArray, axes: FloatArray, aside: float) -> FloatArray:
    """Unit vectors (T, 3) along which a deep arm leaves the trunk, from the frames in which it
    enters or leaves, in the `axes` of the chest."""
    deepest = depth.argmax(axis=1)
    rows = np.arange(len(depth))
    most = depth[rows, deepest]
    shallow = (most > -_SURE / 2) & (most < _SURE / 2)
    ways = np.where(shallow[:, None], np.einsum("tab,ta->tb", axes, normal[rows, deepest]), np.nan)
    world: FloatArray = unit(
        np.einsum("tab,tb->ta", axes, bridged(ways) + np.array([_ASIDE * aside, 0.0, 0.0]))
    )
    return world
