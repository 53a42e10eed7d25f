"""Fit the correction of the detector's depths that `a2v.perception.depth` ships.

    python scripts/fit_depth_correction.py --data ../shared/data --studio runs/studio --out
    a2v/perception/data/depth_correction.npz

The detector looks at the views of a studio's data set (`a2v studio`), whose landmarks are known; a
ridge regression on its training identities, with every view mirrored too, learns the difference to
the true depths. The script prints the errors on the validation identities.
"""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path

import cv2
import numpy as np
from tqdm import tqdm

from a2v.kinematics.names import BLAZEPOSE
from a2v.lab.evaluation.reconstruction import open_studio
from a2v.lab.studio.studio import Studio
from a2v.lab.studio.view import View, list_views
from a2v.perception.depth import (
    HIPS,
    DepthCorrection,
    detector_features,
    picture_plane,
    put_upright,
)
from a2v.perception.detector import Detector

OTHER_SIDE = np.array(
    [
        BLAZEPOSE.index(name.replace("left", "#").replace("right", "left").replace("#", "right"))
        for name in BLAZEPOSE
    ]
)
GROUPS = ("nose", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "foot_index")


@dataclasses.dataclass(frozen=True)
class Sample:
    """Detected landmarks of a view (``keypoints``, ``keypoints_3d``), and the true depths (33,).

    The depths are in the detector's meters.
    """

    keypoints: np.ndarray
    keypoints_3d: np.ndarray
    depth: np.ndarray

    def mirrored(self) -> Sample:
        """Exchange left and right."""
        flip = np.array([-1.0, 1.0, 1.0])
        return Sample(
            self.keypoints[OTHER_SIDE] * flip,
            self.keypoints_3d[OTHER_SIDE] * flip,
            self.depth[OTHER_SIDE],
        )

    @property
    def missing(self) -> np.ndarray:
        """Return the values to learn (33,), meters."""
        points = self.keypoints_3d
        return self.depth - (points[:, 2] - points[HIPS, 2].mean())


def collect(studio: Studio, folder: Path, split: str, size: int = 512) -> list[Sample]:
    """Return one sample for each view in which the detector finds the person."""
    samples = []
    with Detector() as detector:
        for path in tqdm(list_views(folder, split), desc=split):
            view, scene = View.load(path), studio.scene(split, int(path.stem))
            person = detector.one(
                cv2.resize(view.image, (size, size), interpolation=cv2.INTER_AREA)
            )
            if person is None:
                continue
            seen = person.keypoints * np.array(
                [view.image.shape[1] / size, view.image.shape[0] / size, 1.0], np.float32
            )
            _, scale = picture_plane(seen, person.keypoints_3d)
            true = scene.landmarks[:, 2] - scene.landmarks[HIPS, 2].mean()
            samples.append(Sample(seen, person.keypoints_3d, true * scene.camera.scale / scale))
    return samples


def fit(samples: list[Sample], strength: float) -> DepthCorrection:
    """Fit a ridge regression in closed form."""
    every = [*samples, *(sample.mirrored() for sample in samples)]
    features = np.array(
        [detector_features(sample.keypoints, sample.keypoints_3d) for sample in every]
    )
    missing = np.array([sample.missing for sample in every])
    mean, scale, offset = features.mean(axis=0), features.std(axis=0) + 1e-3, missing.mean(axis=0)
    standard = (features - mean) / scale
    weights = np.linalg.solve(
        standard.T @ standard + strength * np.eye(len(mean)), standard.T @ (missing - offset)
    )
    return DepthCorrection(
        **{
            name: value.astype(np.float32)
            for name, value in {
                "mean": mean,
                "scale": scale,
                "weights": weights,
                "offset": offset,
            }.items()
        }
    )


def report(name: str, errors: np.ndarray) -> None:
    """Print mean absolute errors, centimeters."""
    columns = {
        group: [i for i, landmark in enumerate(BLAZEPOSE) if landmark.endswith(group)]
        for group in GROUPS
    }
    print(
        f"{name:>12}: "
        + ", ".join(
            f"{group} {100 * np.abs(errors[:, index]).mean():.1f}"
            for group, index in columns.items()
        )
        + f"; all {100 * np.abs(errors).mean():.2f} cm"
    )


def main() -> None:
    """Collect, fit, report, save."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", required=True)
    parser.add_argument("--studio", required=True, help="folder that `a2v studio` filled")
    parser.add_argument("--out", required=True)
    parser.add_argument("--strength", type=float, default=30.0, help="of the ridge")
    options = parser.parse_args()
    studio = open_studio(options.studio, options.data)
    training, validation = (
        collect(studio, Path(options.studio), split) for split in ("training", "validation")
    )
    correction = fit(training, options.strength)
    report("detector", np.array([-sample.missing for sample in validation]))
    put = np.array(
        [
            put_upright(sample.keypoints, sample.keypoints_3d, correction)[:, 2] - sample.depth
            for sample in validation
        ]
    )
    report("corrected", put)
    correction = dataclasses.replace(
        correction,
        provenance={
            "training_views": len(training),
            "validation_views": len(validation),
            "strength": options.strength,
            "validation_error_cm": round(float(100 * np.abs(put).mean()), 2),
        },
    )
    correction.save(options.out)
    print(options.out)


if __name__ == "__main__":
    main()
