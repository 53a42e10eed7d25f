"""Measure the errors of landmarks in depth before and after the fit: `python -m benchmarks.depth
--studio FOLDER [--fits] [--panel development]`.

People in action whose truth is known (`a2v.lab.evaluation.reconstruction.panels`), found by a2v's
perception. By class of pose: mean errors in depth of the landmarks of trunk, head, arms and legs,
relative to the trunk's, in cm. First those of perception (seconds a photo); with ``--fits`` also
those of the fit, and of a fit that is given the true depths of all 33 landmarks: what better depths
could bring at most. Of the fits also the naked body's aligned Chamfer distance to the dressed
truth, cm. Needs ``$A2V_DATA`` with avatars and motions.
"""

from __future__ import annotations

import argparse
import dataclasses
import os
from collections import defaultdict
from pathlib import Path

import numpy as np

from a2v.body import fit_body
from a2v.body.limbs import LIMBS, TRUNK
from a2v.lab.evaluation.reconstruction import (
    PANELS,
    BenchmarkSettings,
    Truth,
    open_case,
    open_studio,
)
from a2v.lab.evaluation.reconstruction.cases import Case
from a2v.perception import find_person
from a2v.perception.depth import HIPS, picture_plane
from a2v.types import FloatArray, Subject


def true_depths(case: Case, subject: Subject) -> tuple[FloatArray, float]:
    """Return true depths (33,) from the middle of the hips, and the meters of
    `Subject.keypoints_3d` in one true meter."""
    _, scale = picture_plane(subject.keypoints, subject.keypoints_3d)
    zoom = subject.image.shape[1] / (subject.crop[2] - subject.crop[0])
    factor = case.camera.scale * zoom / scale
    return factor * (case.landmarks[:, 2] - case.landmarks[HIPS, 2].mean()), factor


def by_limb(gap: FloatArray) -> dict[str, float]:
    """Return mean absolute errors by limb, cm, of depths (33,), meters, without the trunk's error."""
    gap = gap - gap[list(TRUNK)].mean()
    return {
        f"depth_{limb}": 100 * float(np.abs(gap[list(places)]).mean())
        for limb, places in LIMBS.items()
    }


def measure(case: Case, fits: bool) -> dict[str, dict[str, float]]:
    """Return the errors of one photo by the source of the depths."""
    subject = find_person(case.image)
    true, factor = true_depths(case, subject)
    found = {"perception": by_limb((subject.keypoints_3d[:, 2] - true) / factor)}
    if fits:
        told = dataclasses.replace(
            subject, keypoints_3d=np.c_[subject.keypoints_3d[:, :2], true].astype(np.float32)
        )
        truth = Truth(case, BenchmarkSettings(size=64, points=20_000))
        found |= {
            name: truth.compare_fit(fit_body(one), one)
            for name, one in {"fit": subject, "fit to true depths": told}.items()
        }
    return found


def main() -> None:
    """Measure and print a table for each source of depths."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--studio",
        required=True,
        help="folder of a2v studio; the photos are kept in its folder cases",
    )
    parser.add_argument("--panel", default="development", choices=sorted(PANELS))
    parser.add_argument("--views", type=int, default=100)
    parser.add_argument("--fits", action="store_true")
    options = parser.parse_args()
    data = os.environ.get("A2V_DATA", str(Path(__file__).resolve().parents[2] / "shared" / "data"))
    studio = open_studio(options.studio, data)
    rows: dict[str, dict[str, list[list[float]]]] = defaultdict(lambda: defaultdict(list))
    for pin in PANELS[options.panel][: options.views]:
        case = open_case(studio, pin, Path(options.studio) / "cases")
        for source, errors in measure(case, options.fits).items():
            arms, legs = (
                (errors[f"depth_left_{limb}"] + errors[f"depth_right_{limb}"]) / 2
                for limb in ("arm", "leg")
            )
            values = [errors["depth_trunk"], errors["depth_head"], arms, legs]
            if "body_aligned" in errors:
                values.append(errors["body_aligned"])
            for name in (pin.stance, "all"):
                rows[source][name].append(values)
        print(pin.avatar, pin.index, pin.stance, flush=True)
    for source, table in rows.items():
        columns = ["trunk", "head", "arms", "legs", "body"][: len(table["all"][0])]
        print(f"\n| {source} | {' | '.join(columns)} |\n{'|---' * (1 + len(columns))}|")
        for name, every in sorted(table.items(), key=lambda item: item[0] == "all"):
            print(
                f"| {name} ({len(every)}) | "
                + " | ".join(f"{value:.2f}" for value in np.mean(every, axis=0))
                + " |"
            )


if __name__ == "__main__":
    main()
