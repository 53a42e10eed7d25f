"""How far rounding moves a fitted body: `python -m benchmarks.rounding [PHOTO ...] [--times 4]`.

Each photo's landmarks and body map are perturbed by 1e-5 of their sizes, and the body is fitted to
each version. Columns: the largest distance of a joint between two fits, its median over the
versions from their median, millimeters; least and largest objective; rounds; processor seconds of a
fit. Without photos: the sample. To compare kernels, run it again with ``ATEN_CPU_CAPABILITY=default``
and the same ``--out``: joints of earlier runs count as further versions.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from pathlib import Path

import numpy as np

from a2v.body import fit_body
from a2v.io import read_npz, write_npz
from a2v.perception import decode_photo, find_person
from a2v.samples.ready import PHOTO
from a2v.types import FloatArray, Subject

SIZE = 1e-5
"""Standard deviation of a perturbation, relative to the picture, the person's height or the unit."""


def perturbed(subject: Subject, seed: int) -> Subject:
    """Return the subject with landmarks and map moved by `SIZE`; seed 0 returns it as it is."""
    if seed == 0:
        return subject
    random = np.random.default_rng(seed)

    def moved(values: FloatArray, unit: float) -> FloatArray:
        noise = SIZE * unit * random.standard_normal(values.shape)
        return np.asarray(values + noise, np.float32)

    points, found = subject.keypoints.copy(), subject.bodymap
    points[:, :2] = moved(points[:, :2], max(subject.image.shape[:2]))
    height = float(np.ptp(points[:, 1]))
    if found is not None:
        found = dataclasses.replace(
            found,
            places=moved(found.places, 1.0),
            depths=moved(found.depths, height),
            landmarks=moved(found.landmarks, height),
        )
    return dataclasses.replace(
        subject,
        keypoints=points,
        keypoints_3d=moved(subject.keypoints_3d, 1.0),
        bodymap=found,
    )


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("photos", nargs="*", type=Path, default=[PHOTO])
    parser.add_argument("--times", type=int, default=4)
    parser.add_argument("--out", type=Path, help="folder with the joints of earlier runs")
    options = parser.parse_args()
    print(
        "| photo | largest, mm | median, mm | objective | rounds | CPU s |\n|---|---|---|---|---|---|"
    )
    for path in options.photos:
        subject = find_person(decode_photo(path.read_bytes(), path.name))
        joints, values, rounds, seconds = [], [], [], []
        for seed in range(options.times):
            start = time.process_time()
            result = fit_body(perturbed(subject, seed))
            seconds.append(time.process_time() - start)
            joints.append(result.body.bone_transforms[:, :3, 3])
            values.append(sum(result.residuals["loss"].values()))
            rounds.append(result.residuals["rounds"])
        every = np.stack(joints)
        if options.out is not None:
            kept = options.out / f"{path.stem}.npz"
            if kept.exists():
                every = np.concatenate([read_npz(kept)["joints"], every])
            options.out.mkdir(parents=True, exist_ok=True)
            write_npz(kept, {"joints": every})
        apart = np.linalg.norm(every[:, None] - every[None], axis=-1).max()
        usual = np.linalg.norm(every - np.median(every, axis=0), axis=-1).max(axis=1)
        print(
            f"| {path.stem} | {1000 * apart:.2f} | {1000 * np.median(usual):.2f} | "
            f"{min(values):.2f} to {max(values):.2f} | {min(rounds)} to {max(rounds)} | "
            f"{np.median(seconds):.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
