"""Measure the error of motions at 12 frames per second that are resampled to 30.

python -m benchmarks.resampling. CMU's BVH recordings (120 Hz) are brought to 12 Hz and from there
to 30 Hz, and compared with the same recordings at 30 Hz, for several interpolations.
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
import zipfile
from pathlib import Path
from unittest import mock

import numpy as np
from scipy.interpolate import (
    Akima1DInterpolator,
    CubicSpline,
    PchipInterpolator,
    make_interp_spline,
)

from a2v.formats import read_bvh
from a2v.kinematics import resample
from a2v.kinematics.names import canonical_joints
from a2v.lab.evaluation.physics import floor_height, foot_slide
from a2v.types import FloatArray, Motion

WAYS = {
    "linear": lambda at, values, axis: make_interp_spline(at, values, k=1, axis=axis),
    "monotone cubic": lambda at, values, axis: PchipInterpolator(at, values, axis=axis),
    "Akima": lambda at, values, axis: Akima1DInterpolator(at, values, axis=axis, method="makima"),
    "cubic spline": lambda at, values, axis: CubicSpline(at, values, axis=axis),
}
LOW, HIGH = 12, 30


def measure(clip: Motion) -> dict[str, tuple[float, ...]]:
    """Return for each interpolation: mean and 99 % error (cm), relative error of speeds, jitter and
    sliding of feet relative to the recording's, and depth below its floor (mm)."""
    arrays = {
        name: getattr(clip, name)[:: round(clip.fps / LOW)]
        for name in ("joints", "rotations", "root")
    }
    low = dataclasses.replace(clip, fps=clip.fps / round(clip.fps / LOW), **arrays)
    real = clip.joints[:: round(clip.fps / HIGH)].astype(np.float64)
    found = {}
    for name, way in WAYS.items():
        with mock.patch.object(
            resample,
            "interpolate",
            lambda values, at, axis, way=way: way(np.arange(values.shape[axis]), values, axis)(at),
        ):
            made = resample.resample_motion(low, clip.fps / round(clip.fps / HIGH)).joints.astype(
                np.float64
            )
        count = min(len(made), len(real))
        error = 100 * np.linalg.norm(made[:count] - real[:count], axis=-1)
        speeds, own = speed(made[:count]), speed(real[:count])
        found[name] = (
            error.mean(),
            np.percentile(error, 99),
            np.abs(speeds - own).mean() / own.mean(),
            jitter(made) / jitter(real),
            slide(made, clip) / slide(real, clip),
            1000 * np.maximum(real[:count, :, 1].min(1) - made[:count, :, 1].min(1), 0).mean(),
        )
    return found


def speed(joints: FloatArray) -> FloatArray:
    """Return the speed of every joint between frames, meters per second."""
    return np.linalg.norm(np.diff(joints, axis=0), axis=-1) * HIGH


def jitter(joints: FloatArray) -> float:
    """Return the mean size of the third difference."""
    return float(np.linalg.norm(np.diff(joints, n=3, axis=0), axis=-1).mean())


def slide(joints: FloatArray, clip: Motion) -> float:
    """Return the path of low feet over the ground, mm per frame at 20 fps; the floor is at the
    usual height of the recording's lowest joint."""
    names = canonical_joints(clip.joint_names, clip.parents.tolist())
    feet = [names[name] for name in ("left_ankle", "left_foot", "right_ankle", "right_foot")]
    return foot_slide(
        joints[:, feet], HIGH, floor=floor_height(clip.joints[:: round(clip.fps / HIGH)])
    )


def main() -> None:
    """Print a table of medians over recordings."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--every", type=int, default=3, help="use every n-th recording")
    options = parser.parse_args()
    if not (options.data / "cmu_bvh.zip").is_file():
        print(f"{options.data}/cmu_bvh.zip is not here; nothing is measured")
        return
    rows = []
    with (
        zipfile.ZipFile(options.data / "cmu_bvh.zip") as archive,
        tempfile.TemporaryDirectory() as folder,
    ):
        for name in sorted(name for name in archive.namelist() if name.endswith(".bvh"))[
            :: options.every
        ]:
            path = Path(folder) / Path(name).name
            path.write_bytes(archive.read(name))
            rows.append(measure(read_bvh(path)))
    print(
        f"{len(rows)} recordings; medians\n\n| {LOW} to {HIGH} fps | mean error, cm | 99 % | "
        "speeds off by | jitter over real | slide over real | under it, mm "
        "|\n|---|---|---|---|---|---|---|"
    )
    for way in WAYS:
        mean, most, off, shake, slid, under = np.median([row[way] for row in rows], axis=0)
        print(
            f"| {way} | {mean:.2f} | {most:.2f} | {off:.1%} | {shake:.2f} | {slid:.2f} | "
            f"{under:.2f} |"
        )


if __name__ == "__main__":
    main()
