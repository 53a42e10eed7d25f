"""Measure how people stand in the data sets: the tables of `a2v.animation.posture`.

    python scripts/fit_posture.py --data ../shared/data

Prints, beside the shipped values: lean, neck, dip and knee, medians over clips of medians over the
frames in which the person stands still and upright; a foot's dip is the mean of that and of the
median over feet at rest in clips whose action is a walk. And the spine, medians over all frames of
every twelfth clip with an upright back, in the file's own vertical.

The shipped values are older than this script, whose thresholds are chosen to come near them: it
remakes lean and knee within 2 degrees, dips and the spine within 3, necks within 4.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from a2v.animation import posture
from a2v.animation.rig import SIDES
from a2v.animation.source import middle, source_joints, source_leg_length, upright_rotmat
from a2v.kinematics.ground import smoothed
from a2v.lab.datasets import load_dataset
from a2v.types import FloatArray, Motion

ARCHIVES = {"humanact12": "humanact12.zip", "cmu": "cmu_mocap.zip"}
STILL = 0.2
"""Speed of hips and ankles in meters per second below which a person stands still."""
STRAIGHT = 0.93
"""Distance from hip to ankle as a fraction of thigh plus shin from which a leg counts as straight:
both must be."""
UPRIGHT = 15.0
"""Maximum lean of the back in any direction, degrees."""
LEAST = 3
"""Minimum number of standing frames in a clip."""
REST = 0.1
"""Speed of ankle and ball in meters per second below which a foot is at rest in a walk.

Its ankle must also be in its lowest tenth.
"""


def motions(name: str, data: Path) -> Iterator[Motion]:
    """Return every clip of a data set, meters."""
    dataset = load_dataset(name, data / ARCHIVES[name])
    for index in range(len(dataset.joints)):
        yield dataset.motion(index)


def prepared(motion: Motion, *, level: bool = True) -> dict[str, FloatArray]:
    """Canonical joints (T, 3), smooth, upright as in retargeting where `level`, each frame turned
    about y to face +z."""
    source = {
        name: smoothed(points, 0.02 * motion.fps) for name, points in source_joints(motion).items()
    }
    if level and motion.skeleton == "humanact12":
        rotmat = upright_rotmat(source, motion.fps)
        source = {name: points @ rotmat.T for name, points in source.items()}
    across = (
        source["left_hip"]
        - source["right_hip"]
        + 0.5 * (source["left_shoulder"] - source["right_shoulder"])
    )
    yaw = np.arctan2(across[:, 2], across[:, 0])
    cos, sin, zero, one = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw), np.ones_like(yaw)
    facing = np.stack(
        [
            np.stack([cos, zero, sin], -1),
            np.stack([zero, one, zero], -1),
            np.stack([-sin, zero, cos], -1),
        ],
        -2,
    )
    return {name: np.einsum("tab,tb->ta", facing, points) for name, points in source.items()}


def speeds(motion: Motion, names: tuple[str, ...]) -> FloatArray:
    """Return the speed (T,) of the fastest of some canonical joints, meters per second."""
    source = source_joints(motion)
    if motion.frames < 2:
        return np.full(motion.frames, np.inf)
    return np.max(
        [np.linalg.norm(np.gradient(source[name], axis=0), axis=-1) * motion.fps for name in names],
        axis=0,
    )  # type: ignore[no-any-return]


def forward(vectors: FloatArray) -> FloatArray:
    """Degrees (T,) by which vectors (T, 3) lean from +y to +z."""
    return np.degrees(np.arctan2(vectors[:, 2], vectors[:, 1]))


def dips(source: dict[str, FloatArray], side: str) -> FloatArray:
    """Degrees (T,) from the ankle to the ball of a foot over the horizon."""
    foot = source[f"{side}_foot"] - source[f"{side}_ankle"]
    return np.degrees(np.arcsin(foot[:, 1] / np.maximum(np.linalg.norm(foot, axis=-1), 1e-9)))


def upright(back: FloatArray) -> FloatArray:
    """Return which backs (T, 3) lean by at most `UPRIGHT` from +y, (T,) bool."""
    return back[:, 1] > np.cos(np.deg2rad(UPRIGHT)) * np.linalg.norm(back, axis=-1)  # type: ignore[no-any-return]


def measure_spine(name: str, data: Path) -> dict[str, float]:
    """Medians over upright frames of every twelfth clip, degrees: how the spine leans below and
    above its joints."""
    found: dict[str, list[float]] = {}
    for motion in itertools.islice(motions(name, data), 0, None, 12):
        source = prepared(motion, level=False)
        hips, shoulders = middle(source, "hip"), middle(source, "shoulder")
        frames = upright(shoulders - hips)
        for joint in ("spine1", "spine2"):
            if joint in source:
                found.setdefault(f"{joint} below", []).extend(forward(source[joint] - hips)[frames])
                found.setdefault(f"{joint} above", []).extend(
                    forward(shoulders - source[joint])[frames]
                )
    return {key: float(np.median(values)) for key, values in found.items()}


def measure(name: str, data: Path) -> tuple[int, dict[str, float]]:
    """Return the number of standing clips, and the medians over them, degrees."""
    rows: list[dict[str, float]] = []
    walking: list[float] = []
    for motion in motions(name, data):
        source = prepared(motion)
        still = speeds(motion, ("left_hip", "right_hip", "left_ankle", "right_ankle")) < STILL
        length = source_leg_length(source)
        legs = np.min(
            [
                np.linalg.norm(source[f"{side}_hip"] - source[f"{side}_ankle"], axis=-1)
                for side in SIDES
            ],
            axis=0,
        )
        back = middle(source, "shoulder") - middle(source, "hip")
        standing = still & upright(back) & (legs > STRAIGHT * length)
        if "walk" in motion.action.lower():
            for side in SIDES:
                low = source[f"{side}_ankle"][:, 1] < np.quantile(
                    source[f"{side}_ankle"][:, 1], 0.1
                )
                rest = (speeds(motion, (f"{side}_ankle", f"{side}_foot")) < REST) & low
                walking += dips(source, side)[rest].tolist()
        if standing.sum() < LEAST:
            continue
        row = {"lean": float(np.median(forward(back[standing])))}
        row["neck"] = float(np.median(forward((source["head"] - source["neck"])[standing])))
        row["dip"] = float(np.mean([np.median(dips(source, side)[standing]) for side in SIDES]))
        row["knee"] = float(
            np.mean(
                [np.degrees(np.median(posture.knee_bend(source, side)[standing])) for side in SIDES]
            )
        )
        rows.append(row)
    found = {key: float(np.median([row[key] for row in rows])) for key in rows[0]}
    if walking:
        found["dip in walks"] = float(np.median(walking))
        found["dip"] = (found["dip"] + found["dip in walks"]) / 2
    return len(rows), found


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    options = parser.parse_args()
    for name in ARCHIVES:
        shipped = posture.table_of(name)
        count, found = measure(name, options.data)
        print(f"{name}: {count} clips stand")
        for key, value in {**found, **measure_spine(name, options.data)}.items():
            print(
                f"  {key:14s} {value:6.1f}   shipped {shipped[key]:6.1f}"
                if key in shipped
                else f"  {key:14s} {value:6.1f}"
            )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
