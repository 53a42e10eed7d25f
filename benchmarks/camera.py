"""Fits with and without perspective, and with and without the body map, beside the truth:
`python -m benchmarks.camera --studio FOLDER [--panel phone] [--fits perspective+map,...]`.

Measures the fitted body, which takes 3 to 10 s per photo and fit, and with ``--surface`` also the
surface that is reconstructed from it (20 s more). Photos and perception are kept in the folder of
the studio, and finished fits in ``--out``: a run that was stopped continues. By class of pose
(standing, action) it prints the aligned Chamfer distance of the surface and its distance from
points to the truth (P2S), in the photo's frame, and its Chamfer distance in the world; the same
Chamfer distances of the naked body to the dressed truth; the error of the landmarks in the world;
the errors in depth of trunk, head, arms and legs (all cm); the rank correlation of expected and
true errors of arms and legs; and processor seconds of the fit. Needs ``$A2V_DATA`` with avatars
and motions.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from a2v.body import FitSettings, fit_body
from a2v.body.limbs import LIMBS
from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.lab.evaluation.reconstruction import (
    PANELS,
    BenchmarkSettings,
    Pin,
    Truth,
    open_case,
    open_studio,
)
from a2v.lab.evaluation.reconstruction.cases import Case
from a2v.lab.evaluation.reconstruction.maps import mask_in_photo
from a2v.lab.studio.studio import Studio
from a2v.perception import PerceptionSettings, find_person
from a2v.perception.bodymap import look_at_body, mended
from a2v.reconstruction.backends import DEFAULT_BACKEND, reconstruct, settings_of
from a2v.types import Subject

FITS = ("perspective+map", "perspective", "orthographic+map", "orthographic")
"""Kinds of fits: the camera, and whether the body map is used."""
SURFACE = {
    "surface_chamfer_aligned": "surface",
    "surface_p2s_aligned": "P2S",
    "surface_chamfer_world": "surface in the world",
}
"""Scores of the surface in the table, and their titles."""
LIMBS_OF_INTEREST = [limb for limb in LIMBS if limb.endswith(("arm", "leg"))]


def seen(case: Case, path: Path) -> Subject:
    """Return the person of a photo without a body map, and the body map, which is not merged yet;
    both are stored at `path`."""
    if path.exists():
        return Subject.load(path)
    settings = PerceptionSettings(bodymap=False, face=False, hands=False)
    subject = find_person(case.image, settings=settings)
    subject = dataclasses.replace(subject, bodymap=look_at_body(subject.image, subject.mask))
    subject.save(path)
    return subject


def measure(
    case: Case, subject: Subject, fit: str, *, surface: bool = False
) -> dict[str, float | str]:
    """Compare one of `FITS`, and on request the surface made from it, with the truth."""
    camera, _, mapped = fit.partition("+")
    if mapped:
        assert subject.bodymap is not None
        points, space = mended(subject.keypoints, subject.keypoints_3d, subject.bodymap)
        subject = dataclasses.replace(subject, keypoints=points, keypoints_3d=space)
    else:
        subject = dataclasses.replace(subject, bodymap=None)
    settings = FitSettings(distance=0.0 if camera == "orthographic" else None)
    begun = time.process_time()
    found = fit_body(subject, settings=settings)
    spent = time.process_time() - begun
    size = {"size": 256} if surface else {"size": 64, "points": 10_000}
    truth = Truth(case, BenchmarkSettings(**size))
    scores = {name: float(value) for name, value in truth.compare_fit(found, subject).items()}
    if surface:
        backend = settings_of(DEFAULT_BACKEND, "")
        made = reconstruct(subject, found.body, found.camera, backend).surface
        shape = truth.compare_shape(truth.place(made, found.camera, subject))
        scores |= {f"surface_{name}": float(value) for name, value in shape.items()}
    return {
        **scores,
        "stance": str(case.facts["pose"]),
        "seconds": spent,
        "distance": found.camera.distance,
        "true_distance": case.photo_camera.distance,
    }


def measured(studio: Studio, pin: Pin, fits: Sequence[str], options: argparse.Namespace) -> None:
    """Measure the fits of one photo that are missing in the folder of results."""
    folder = Path(options.studio)
    for fit in fits:
        path = Path(options.out) / fit / f"{pin.index}.json"
        if path.exists():
            continue
        case = open_case(studio, pin, folder / "cases")
        (folder / "seen").mkdir(exist_ok=True)
        subject = seen(case, folder / "seen" / f"{pin.index}.npz")
        person, true = mask_in_photo(subject) > 0.5, case.mask > 127
        if (person & true).sum() < 0.5 * (person | true).sum():
            print(
                pin.avatar, pin.index, "perception took something else for the person", flush=True
            )
            return
        try:
            found = measure(case, subject, fit, surface=options.surface)
        except InputError as error:
            print(pin.avatar, pin.index, fit, error, flush=True)
            continue
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_path(path) as temporary:
            Path(temporary).write_text(json.dumps({**found, "stance": pin.stance}))
        print(pin.avatar, pin.index, pin.stance, fit, f"{found['body_aligned']:.2f}", flush=True)


def table(results: Mapping[str, Mapping[str, dict[str, float]]]) -> str:
    """Return a table of the photos for which all fits are finished; `results` are by fit and
    photo."""
    from scipy.stats import spearmanr

    common = sorted(set.intersection(*(set(rows) for rows in results.values())))
    shapes = {"body_aligned": "body", "body_world": "body in the world"}
    if all(
        name in every[photo] for name in SURFACE for every in results.values() for photo in common
    ):
        shapes = {**SURFACE, **shapes}
    columns = [*shapes.values(), "landmarks", "trunk", "head", "arms", "legs", "rank", "s"]
    lines = [f"| pose | fit | {' | '.join(columns)} |", "|---" * (len(columns) + 2) + "|"]
    for kind in ("standing", "action"):
        for fit, every in results.items():
            rows = [
                every[photo]
                for photo in common
                if (every[photo]["stance"] == "standing") == (kind == "standing")
            ]
            if not rows:
                continue
            errors = {
                name: np.array([[row[f"{name}_{limb}"] for limb in LIMBS] for row in rows])
                for name in ("depth", "expected")
            }
            limbs = [list(LIMBS).index(limb) for limb in LIMBS_OF_INTEREST]
            rank = spearmanr(*(error[:, limbs].ravel() for error in errors.values()))[0]
            depths = errors["depth"].mean(axis=0)
            values = [
                *(np.mean([row[name] for row in rows]) for name in (*shapes, "landmarks_world")),
                depths[0],
                depths[1],
                depths[2:4].mean(),
                depths[4:6].mean(),
                rank,
                np.mean([row["seconds"] for row in rows]),
            ]
            cells = " | ".join(f"{value:.2f}" for value in values)
            lines.append(f"| {kind} ({len(rows)}) | {fit} | {cells} |")
    return "\n".join(lines)


def main() -> None:
    """Measure what is missing and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--studio", required=True, help="folder of a2v studio; photos are kept in it"
    )
    parser.add_argument("--panel", default="phone", choices=sorted(PANELS))
    parser.add_argument("--views", type=int, default=100, help="at most this number of photos")
    parser.add_argument("--fits", default=",".join(FITS), help=f"of {', '.join(FITS)}")
    parser.add_argument("--surface", action="store_true", help="measure the surface as well")
    parser.add_argument("--out", required=True, help="folder of finished fits")
    options = parser.parse_args()
    fits = options.fits.split(",")
    if unknown := set(fits) - set(FITS):
        parser.error(f"unknown fits {', '.join(sorted(unknown))}; choose from {', '.join(FITS)}")
    data = os.environ.get("A2V_DATA", str(Path(__file__).resolve().parents[2] / "shared" / "data"))
    studio = open_studio(options.studio, data, options.panel)
    pins = PANELS[options.panel][: options.views]
    for pin in pins:
        measured(studio, pin, fits, options)
    results = {
        fit: {
            path.stem: json.loads(path.read_text())
            for path in sorted((Path(options.out) / fit).glob("*.json"))
        }
        for fit in fits
    }
    print(table(results))


if __name__ == "__main__":
    main()
