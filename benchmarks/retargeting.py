"""Measure retargeting on real clips: joint error, foot skating and penetration.

python -m benchmarks.retargeting [--clips 20] [--seed 0] [--out table.md]

All are measured before and after the contact clean-up. The data are ``humanact12.zip``,
``cmu_mocap.zip``, ``cmu_bvh.zip`` and ``motions`` in ``$A2V_DATA`` (default ``../shared/data``);
missing sets are left out.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from a2v.animation import RetargetSettings, retarget
from a2v.body import load_body_model, make_body
from a2v.formats import read_motion
from a2v.io import atomic_path
from a2v.kinematics.resample import resample_motion
from a2v.lab.datasets import load_cmu, load_humanact12
from a2v.lab.evaluation.physics import physics_metrics
from a2v.lab.evaluation.retargeting import measure_retargeting
from a2v.types import Motion

COLUMNS = ("error", "plain_error", "skating", "penetration", "hover")


def sources(data: Path, count: int, seed: int) -> Iterator[tuple[str, list[Motion]]]:
    """Return the name and the clips of each available set."""
    random = np.random.default_rng(seed)
    for name, file, load in (
        ("HumanAct12", "humanact12.zip", load_humanact12),
        ("CMU (12 Hz joints)", "cmu_mocap.zip", load_cmu),
    ):
        if (data / file).exists():
            clips = load(data)
            usable = [
                int(i) for i in random.permutation(len(clips.joints)) if len(clips.joints[i]) >= 10
            ]
            yield f"{name}, {count} clips", [clips.motion(i) for i in usable[:count]]
    if (data / "cmu_bvh.zip").exists():
        with (
            zipfile.ZipFile(data / "cmu_bvh.zip") as archive,
            tempfile.TemporaryDirectory() as folder,
        ):
            names = sorted(name for name in archive.namelist() if name.endswith(".bvh"))[::4]
            files = [Path(archive.extract(name, folder)) for name in names]
            yield (
                f"CMU BVH, {len(files)} files at 30 fps",
                [resample_motion(read_motion(path), 30.0) for path in files],
            )
    if files := sorted((data / "motions").glob("*.txt")):
        yield f"DeepMimic, {len(files)} files", [read_motion(path) for path in files]


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--clips", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    data = Path(os.environ.get("A2V_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
    body = make_body(load_body_model(), grounded=True)
    lines = [
        "| | error, raw / clean (cm) | against plain bone directions | skating, source / raw / "
        "clean | penetration, raw / clean (mm) | hover, raw / clean (mm) |",
        "|---|---|---|---|---|---|",
    ]
    for name, clips in sources(data, given.clips, given.seed):
        rows = []
        for clip in clips:
            both = [
                measure_retargeting(
                    clip,
                    body,
                    retarget(clip, body, settings=RetargetSettings(raw=raw, level="never")),
                )
                for raw in (True, False)
            ]
            rows.append([[getattr(quality, column) for column in COLUMNS] for quality in both])
        (error, plain, skates, deep, hover), clean = np.mean(rows, axis=0)
        source = float(np.mean([physics_metrics(clip, floor=None).skating for clip in clips]))
        lines.append(
            f"| {name} | {100 * error:.1f} / {100 * clean[0]:.1f} | {100 * plain:.1f} / "
            f"{100 * clean[1]:.1f} | {source:.3f} / {skates:.3f} / {clean[2]:.3f} "
            f"| {1000 * deep:.1f} / {1000 * clean[3]:.1f} | {1000 * hover:.0f} / "
            f"{1000 * clean[4]:.0f} |"
        )
        print(lines[-1], file=sys.stderr)
    text = "\n".join(lines) + "\n"
    print(text, end="")
    if given.out:
        with atomic_path(given.out) as temporary:
            temporary.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
