"""Measure the fit of Eq. 15-18 on posed, clothed avatars with ground truth: `python -m
benchmarks.fit [--avatars 6]`.

Each avatar stands in a pose of its own and is photographed; a2v's own perception finds the person;
the body is fitted to the photo and then to the avatar's own surface (so that errors of the
reconstruction do not count). Needs ``$A2V_DATA/avatars``. Columns: mean distance from the surface
to the body, mean distance of the joints from the avatar's rig, both after the surface fit, and
processor seconds of both fits. Rigs place hips and shoulders differently, which is part of the
joints' error.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

import numpy as np

from a2v.body import fit_body, load_body_model
from a2v.lab.studio.avatar_files import list_avatars, load_avatar
from a2v.lab.studio.avatars import a_pose
from a2v.lab.studio.portrait import PortraitSettings, take_portrait
from a2v.perception import find_person
from a2v.types import OrthographicCamera

JOINTS = {
    "Arm": "upperarm01",
    "ForeArm": "lowerarm01",
    "Hand": "wrist",
    "UpLeg": "upperleg01",
    "Leg": "lowerleg01",
    "Foot": "foot",
}
"""The avatars' joints (behind Left and Right) and Anny's."""


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--avatars", type=int, default=6)
    parser.add_argument("--size", type=int, default=640)
    options = parser.parse_args()
    data = Path(os.environ.get("A2V_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
    every = list_avatars(data / "avatars")
    model, random = load_body_model(), np.random.default_rng(0)
    print(
        "| avatar | surface, cm | joints, cm (worst) | without hips, cm | photo fit, s | surface "
        "fit, s |\n|---|---|---|---|---|---|"
    )
    table = []
    for path in every[:: max(1, len(every) // options.avatars)][: options.avatars]:
        avatar = load_avatar(path)
        pose = a_pose(
            arms=random.uniform(20, 75), feet=random.uniform(2, 10), elbows=random.uniform(5, 45)
        )
        surface, transforms = avatar.surface(pose), avatar.bone_transforms(pose)
        shift = surface.vertices[0] - avatar.skin(transforms)[0]
        photo = take_portrait(surface, PortraitSettings(size=options.size, spp=16))
        subject = find_person(photo.image)
        # the camera is a perspective one; the orthographic camera that agrees with it in the plane
        # of the person
        points = surface.vertices[::97].astype(np.float64)
        pixels = photo.camera.project(points, options.size)
        columns = np.stack([points[:, 0], -points[:, 1]], axis=-1)
        scale = float((np.ptp(pixels, axis=0) / np.ptp(columns, axis=0)).mean())
        center = (pixels - scale * columns).mean(axis=0)
        left, top, right, _ = subject.crop
        zoom = subject.image.shape[1] / (right - left)
        camera = OrthographicCamera(
            scale=scale * zoom,
            center_u=(center[0] - left) * zoom,
            center_v=(center[1] - top) * zoom,
        )
        clock = time.process_time()
        first = fit_body(subject)
        middle = time.process_time()
        result = fit_body(subject, surface=surface, camera=camera)
        seconds = middle - clock, time.process_time() - middle
        names = [
            (f"{side}{ours}", f"{theirs}.{side[0]}")
            for side in ("Left", "Right")
            for ours, theirs in JOINTS.items()
        ]
        found = {name.split(":")[-1]: index for index, name in enumerate(avatar.bone_names)}
        truth = np.array([transforms[found[ours], :3, 3] + shift for ours, _ in names])
        fitted = np.array(
            [result.body.bone_transforms[model.bone(theirs), :3, 3] for _, theirs in names]
        )
        errors = 100 * np.linalg.norm(truth - fitted, axis=1)
        worst = names[int(errors.argmax())][0]
        other = errors[["UpLeg" not in name for name, _ in names]].mean()
        distance = 100 * result.residuals["surface_mean"]
        table.append((distance, errors.mean(), other, *seconds))
        print(
            f"| {path.stem} | {distance:.2f} | {errors.mean():.1f} ({worst} {errors.max():.1f}) | "
            f"{other:.1f} | {seconds[0]:.1f} | {seconds[1]:.1f} |",
            flush=True,
        )
        assert np.isfinite(first.residuals["keypoint_mean"])
    mean = np.mean(table, axis=0)
    print(
        f"| mean | {mean[0]:.2f} | {mean[1]:.1f} | {mean[2]:.1f} | {mean[3]:.1f} | {mean[4]:.1f} |"
    )


if __name__ == "__main__":
    main()
