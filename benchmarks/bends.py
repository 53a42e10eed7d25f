"""Measure whether the authors' classifier recognizes recordings that are bent along circles.

python -m benchmarks.bends [--data ../shared/data]

It is the standard for generated motions along a path: steps and bodies of real clips are turned by
their progress, and shown as `benchmarks.direction` shows generated ones.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from types import MappingProxyType

import numpy as np

from a2v.kinematics.ground import face_forward, first_heading, yaw_to_rotmat
from a2v.lab.datasets import load_dataset
from a2v.lab.evaluation.classifier import load_evaluator
from a2v.motion import MotionModel
from a2v.types import FloatArray

EVALUATOR = "action_recognition_model_mocap_new.tar"
FAMILY = MappingProxyType({"Walk": 0, "Jog": 2})
"""Labels of the classifier."""
CLIPS = 25


def bent(joints: FloatArray, radius: float) -> FloatArray:
    """Return a clip (T, J, 3), meters, from the origin and facing +z, bent to a circle to the left.

    A negative radius bends it to the right.
    """
    ahead = face_forward(
        joints[None], first_heading(joints[None], MotionModel.load("cmu-fine").skeleton)
    )[0].astype(np.float64)
    steps = np.diff(ahead[:, 0], axis=0)
    come = np.concatenate([[0], np.cumsum(np.linalg.norm(steps[:, [0, 2]], axis=-1))])
    turns = yaw_to_rotmat(come / radius)
    root = ahead[:1, 0] + np.concatenate(
        [np.zeros((1, 3)), np.cumsum(np.einsum("tab,tb->ta", turns[:-1], steps), axis=0)]
    )
    led: FloatArray = np.einsum("tab,tjb->tja", turns, ahead - ahead[:, :1]) + root[:, None]
    return led


def main() -> None:
    """Print a row for each action and radius."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    data = parser.parse_args().data
    fine, model, evaluator = (
        load_dataset("cmu-fine", data),
        MotionModel.load("cmu-fine"),
        load_evaluator(data / "evaluators" / EVALUATOR),
    )
    print("| action | clips | radius m | recognized |\n|---|---|---|---|")
    for action in FAMILY:
        label = fine.actions.index(action)
        own = np.flatnonzero(fine.labels == label)[:CLIPS]
        for radius in (np.inf, 4.0, 2.0, -2.0):
            known = []
            for clip in own:
                joints = fine.joints[clip][: fine.length] * np.float32(fine.frame.meters_per_unit)
                led = bent(joints - joints[:1, :1], radius)
                led = led[np.minimum(np.arange(fine.length), len(led) - 1)][None]
                faced = np.random.default_rng(0).choice(model.card.headings[label], 8)  # type: ignore[attr-defined]
                shown = np.concatenate(
                    [face_forward(led, np.array([[np.cos(a), -np.sin(a)]])) for a in faced]
                )
                known.append(
                    (
                        evaluator(model.to_native(shown.astype(np.float32)))[1] == FAMILY[action]
                    ).mean()
                    > 0.5
                )
            print(f"| {action} | {len(own)} | {radius:g} | {np.mean(known):.2f} |")


if __name__ == "__main__":
    main()
