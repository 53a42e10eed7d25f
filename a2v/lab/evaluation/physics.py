"""Physical plausibility of a motion: foot skating, penetration, float, jitter, bone lengths.

Definitions as in the literature on motion generation (docs/evaluation.md): always print the real
data's value beside a generated one, since it is never zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from a2v.errors import InputError
from a2v.types import FloatArray, IntArray, Motion


@dataclass(frozen=True)
class PhysicsMetrics:
    """Physical plausibility of one or more clips.

    Attributes
    ----------
    skating : float
        Fraction of frame pairs in which a foot joint is lower than 5 cm in both frames and moves
        faster than 0.5 m/s over the ground, at 20 fps.
    penetration : float
        Mean over frames of the depth of the lowest joint under the floor beyond 5 mm, mm.
    floating : float
        Mean over frames of the height of the lowest joint over the floor beyond 5 mm, mm.
    slide : float
        Mean path over the ground of foot joints while they are lower than 5 cm, mm per frame at 20
        fps.
    bone_variation : float
        Standard deviation over mean of bone lengths over time, mean over bones.
    contact_slide : float
        Median speed over the ground of the ends of the feet while they are within 3 cm of their own
        lowest levels, m/s. The measures above use one floor for both feet, and count the feet of a
        floating clip as clean.
    contact_fast : float
        Fraction of those frames with more than 0.3 m/s.
    """

    skating: float
    penetration: float
    floating: float
    slide: float
    jitter: float
    bone_variation: float
    contact_slide: float = float("nan")
    contact_fast: float = float("nan")

    def as_dict(self) -> dict[str, float]:
        """Return the values by name."""
        return asdict(self)


RATE = 20.0
"""Frame rate at which feet are measured."""

LOW = 0.05
"""Height below which a foot counts as on the ground, meters."""

FAST = 0.5
"""Speed over the ground above which a low foot skates, meters per second."""

DOWN = 0.03
"""Height over its own lowest level below which a foot is down, meters."""
LOWEST = 0.05
"""Quantile of a foot's heights that is its lowest level."""

SLIDES = 0.3
"""Speed over the ground, meters per second, above which a foot that is down visibly slides."""

TOLERANCE = 0.005
"""Distance to the floor that counts as zero, meters."""


def foot_skating(feet: FloatArray, fps: float, *, floor: float = 0.0) -> float:
    """Fraction of steps in which any foot joint skates.

    Parameters
    ----------
    feet : (..., T, F, 3) float
        Foot joints (ankles, toes), meters, y up.
    fps : float
        Their frame rate; they are sampled down or interpolated linearly to 20 fps.
    floor : float
        Height of the ground, meters.
    """
    feet = _at_rate(np.asarray(feet, dtype=np.float64), fps)
    if feet.shape[-3] < 2:
        return 0.0
    low = feet[..., 1] - floor < LOW
    step = np.linalg.norm(np.diff(feet[..., ::2], axis=-3), axis=-1) * RATE
    skates = low[..., 1:, :] & low[..., :-1, :] & (step > FAST)
    return float(skates.any(-1).mean())


def foot_slide(feet: FloatArray, fps: float, *, floor: float = 0.0) -> float:
    """Return the mean path over the ground, mm per frame at 20 fps, of foot joints (..., T, F, 3)
    while lower than 5 cm."""
    feet = _at_rate(np.asarray(feet, dtype=np.float64), fps)
    if feet.shape[-3] < 2:
        return 0.0
    low = feet[..., 1] - floor < LOW
    both = low[..., 1:, :] & low[..., :-1, :]
    step = np.linalg.norm(np.diff(feet[..., ::2], axis=-3), axis=-1)
    return float(1000 * step[both].mean()) if both.any() else 0.0


def ground_distance(points: FloatArray, *, floor: float = 0.0) -> tuple[float, float]:
    """Return penetration and float in mm of points (..., T, P, 3): means over frames of the lowest
    point, beyond 5 mm of tolerance."""
    lowest = np.asarray(points)[..., 1].min(-1) - floor
    return float(1000 * np.maximum(-lowest - TOLERANCE, 0).mean()), float(
        1000 * np.maximum(lowest - TOLERANCE, 0).mean()
    )


def jitter(joints: FloatArray, fps: float) -> float:
    """Mean |third difference| * fps^3, m/s^3, of joints (..., T, J, 3); 0 for fewer than 4
    frames."""
    joints = np.asarray(joints, dtype=np.float64)
    if joints.shape[-3] < 4:
        return 0.0
    return float(np.linalg.norm(np.diff(joints, 3, axis=-3), axis=-1).mean() * fps**3)


def bone_variation(joints: FloatArray, parents: IntArray) -> float:
    """Standard deviation over mean of bone lengths over time, mean over bones and clips; joints
    (..., T, J, 3)."""
    joints, parents = np.asarray(joints, dtype=np.float64), np.asarray(parents, dtype=np.int64)
    lengths = np.linalg.norm(joints[..., 1:, :] - joints[..., parents[1:], :], axis=-1)
    mean = lengths.mean(-2)
    return (
        float((lengths.std(-2) / np.maximum(mean, 1e-9))[mean > 1e-6].mean())
        if (mean > 1e-6).any()
        else 0.0
    )


def floor_height(joints: FloatArray) -> float:
    """Height of the ground under a clip (..., T, J, 3): the lowest joint's 5 % quantile over
    frames."""
    return float(np.quantile(np.asarray(joints)[..., 1].min(-1), 0.05))


def physics_metrics(
    motion: Motion, *, feet: tuple[int, ...] | None = None, floor: float | None = 0.0
) -> PhysicsMetrics:
    """All measures of a clip or a batch.

    Parameters
    ----------
    motion : Motion
        Meters, y up.
    feet : indices of foot joints, or None
        None takes ankles and toes by their names.
    floor : float or None
        Height of the ground, meters; None finds it for every clip by `floor_height`.

    Raises
    ------
    InputError
        No foot joints are known.
    """
    if feet is None:
        from a2v.kinematics.names import canonical_joints

        found = canonical_joints(motion.joint_names, motion.parents.tolist())
        feet = tuple(
            found[name]
            for name in ("left_ankle", "left_foot", "right_ankle", "right_foot")
            if name in found
        )
    if not feet:
        raise InputError(
            f"no foot joints among {', '.join(motion.joint_names[:8])}; give their indices"
        )
    return joints_physics(motion.joints, motion.fps, motion.parents, feet, floor=floor)


def joints_physics(
    joints: FloatArray,
    fps: float,
    parents: IntArray,
    feet: Sequence[int],
    *,
    floor: float | None = None,
) -> PhysicsMetrics:
    """All measures of plain joints, as `physics_metrics` gives them for a Motion.

    Parameters
    ----------
    joints : (..., T, J, 3) float
        Meters, y up.
    fps : float
    parents : (J,) int
    feet : indices of foot joints
    floor : float or None
        Height of the ground, meters; None finds it for every clip by `floor_height`.
    """
    rows = []
    for clip in joints.reshape((-1, *joints.shape[-3:])).astype(np.float64):
        level = floor_height(clip) if floor is None else floor
        depth, over = ground_distance(clip, floor=level)
        ankles = clip[:, list(feet)]
        rows.append(
            (
                foot_skating(ankles, fps, floor=level),
                depth,
                over,
                foot_slide(ankles, fps, floor=level),
                jitter(clip, fps),
                bone_variation(clip, parents),
            )
        )
    speeds = np.concatenate(
        [
            contact_speeds(clip[:, ends_of(feet, parents)], fps)
            for clip in joints.reshape((-1, *joints.shape[-3:]))
        ]
    )
    slides = (
        (float(np.median(speeds)), float((speeds > SLIDES).mean())) if len(speeds) else (0.0, 0.0)
    )
    return PhysicsMetrics(*(float(value) for value in (*np.mean(rows, axis=0), *slides)))


def ends_of(feet: Sequence[int], parents: IntArray) -> list[int]:
    """Return the foot joints that have no child among the foot joints: toes, or ankles if there are
    no toes."""
    above = {int(parents[joint]) for joint in feet}
    return [joint for joint in feet if joint not in above]


def contact_speeds(feet: FloatArray, fps: float) -> FloatArray:
    """Speeds (n,) over the ground, m/s, of feet (T, F, 3) in the frames in which they are within
    `DOWN` of their own lowest level."""
    if len(feet) < 2:
        return np.zeros(0)
    down = feet[..., 1] - np.quantile(feet[..., 1], LOWEST, axis=0) < DOWN
    speeds: FloatArray = (
        np.linalg.norm(np.gradient(feet[..., [0, 2]].astype(np.float64), axis=0), axis=-1)[down]
        * fps
    )
    return speeds


def _at_rate(points: FloatArray, fps: float) -> FloatArray:
    """Points (..., T, F, 3) at 20 fps by linear interpolation."""
    frames = points.shape[-3]
    if abs(fps - RATE) < 1e-6 or frames < 2:
        return points
    at = np.arange(int(np.floor((frames - 1) * RATE / fps + 1e-9)) + 1) * (fps / RATE)
    first = np.minimum(at.astype(np.int64), frames - 2)
    share = (at - first)[:, None, None]
    resampled: FloatArray = (
        np.take(points, first, axis=-3) * (1 - share) + np.take(points, first + 1, axis=-3) * share
    )
    return resampled
