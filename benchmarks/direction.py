"""Measure how closely directed motions meet their constraints, and their cost.

python -m benchmarks.direction [--data ../shared/data]

Three actions that travel, each along three paths with several seeds: distance of the root from the
path; feet and jitter compared with the same undirected actions of equal length (on the ground as
the commands leave them, thirty frames per second); time; and how often the authors' classifier
recognizes the action in the first window. For poses of one clip requested in another, a place, a
heading and a held hand, it measures the error.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path as File
from types import MappingProxyType

import numpy as np

from a2v.kinematics.ground import face_forward, heading
from a2v.kinematics.resample import resample_motion
from a2v.lab.evaluation.classifier import Evaluator, load_evaluator
from a2v.lab.evaluation.physics import physics_metrics
from a2v.motion import MotionModel
from a2v.motion.direct import make_motion
from a2v.motion.direction import Direction, Hold, Keyframe
from a2v.motion.prompts import Step
from a2v.motion.timeline import Take
from a2v.motion.ways import GroundPath
from a2v.types import BoolArray, FloatArray, Motion

FPS = 30.0
EVALUATOR = "action_recognition_model_mocap_new.tar"
FAMILY = MappingProxyType({"Walk": 0, "Jog": 2, "Sneak": 0})
"""Labels of the classifier."""

_ROUND = np.linspace(0, 5, 50)
PATHS = MappingProxyType(
    {
        "line": np.array([[0, 0], [0, 6.0]]),
        "corner": np.array([[0, 0], [0, 3], [3, 3.0]]),
        "circle": np.stack([2 * (1 - np.cos(_ROUND)), 2 * np.sin(_ROUND)], axis=-1),
    }
)


def away(motion: Motion, path: GroundPath) -> FloatArray:
    """Return the distance (T,) of the root from a path, meters."""
    dense = path.at(np.linspace(0, path.lengths[-1], 4000))
    distance: FloatArray = np.linalg.norm(motion.root[:, None, [0, 2]] - dense[None], axis=-1).min(
        1
    )
    return distance


def recognized(model: MotionModel, evaluator: Evaluator, motion: Motion, action: str) -> bool:
    """Return whether the classifier recognizes a clip's first window, turned like the data's clips."""
    window, label = model.card.frames, model.label(action)
    share = model.sampler.active_share(label)  # type: ignore[union-attr]
    joints = resample_motion(motion, model.fps).joints[: round(share * window)]
    joints = joints[np.minimum(np.arange(window), len(joints) - 1)][None]
    turned = float(heading(joints[:, 0], model.skeleton)[0])
    faced = np.random.default_rng(0).choice(model.card.headings[label], 8)  # type: ignore[attr-defined]
    clips = np.concatenate(
        [face_forward(joints, np.array([[np.cos(turned - a), np.sin(turned - a)]])) for a in faced]
    )
    found: BoolArray = evaluator(model.to_native(clips.astype(np.float32)))[1] == FAMILY[action]
    return bool(found.mean() > 0.5)


def along_paths(model: MotionModel, action: str, seeds: int, data: File) -> None:
    """Print a row for each path, and one for the undirected action."""
    file = data / "evaluators" / EVALUATOR
    evaluator = load_evaluator(file) if file.is_file() else None
    free: list[Motion] = []
    for name, points in PATHS.items():
        path, rows, took, plain_took = GroundPath(points), [], 0.0, 0.0
        for seed in range(seeds):
            begun = time.process_time()
            made = make_motion(
                model,
                [Step(action=action)],
                Take(frames=60, fps=FPS, seed=seed),
                direction=Direction(path=path),
            )
            took += time.process_time() - begun
            begun = time.process_time()
            free.append(
                make_motion(
                    model,
                    [Step(action=action, frames=made.frames)],
                    Take(frames=60, fps=FPS, seed=seed),
                )
            )
            plain_took += time.process_time() - begun
            physics, distance = physics_metrics(made, floor=None), away(made, path)
            known = recognized(model, evaluator, made, action) if evaluator else np.nan
            end = float(np.linalg.norm(made.root[-1, [0, 2]] - points[-1]))
            rows.append(
                (
                    100 * distance.mean(),
                    100 * distance.max(),
                    100 * end,
                    physics.skating,
                    physics.slide,
                    physics.jitter,
                    known,
                )
            )
        mean, worst = np.mean(rows, axis=0), np.max(rows, axis=0)
        print(
            f"| {action} | {name} | {mean[0]:.1f} | {worst[1]:.0f} | {worst[2]:.0f} | "
            f"{mean[3]:.3f} | {mean[4]:.1f} | {mean[5]:.1f} | {mean[6]:.2f} | "
            f"{took / plain_took:.1f} |"
        )
    plain = [physics_metrics(motion, floor=None) for motion in free]
    share = (
        np.mean([recognized(model, evaluator, motion, action) for motion in free])
        if evaluator
        else np.nan
    )
    skating, slide, shake = (
        np.mean([getattr(one, name) for one in plain]) for name in ("skating", "slide", "jitter")
    )
    print(
        f"| {action} | undirected | | | | {skating:.3f} | {slide:.1f} | {shake:.1f} | {share:.2f} "
        "| 1 |"
    )


def wishes(model: MotionModel, seeds: int) -> None:
    """Print the errors of keyframes, places, headings and held joints: the worst of all seeds."""
    poses: list[float] = []
    places: list[float] = []
    faces: list[float] = []
    held: list[float] = []
    bodily: list[float] = []
    for seed in range(seeds):
        clips = [model.sample("Walk", frames=60, seed=100 + 2 * seed + one) for one in (0, 1)]
        goal = clips[1].joints[30] - clips[1].joints[30, 0] * (1, 0, 1) + (0.3, 0, 3.0)
        keys = (
            Keyframe(time=0, joints=clips[0].joints[0]),
            Keyframe(time=3, joints=goal.astype(np.float32)),
        )
        made = make_motion(
            model,
            [Step(action="Walk")],
            Take(frames=150, fps=FPS, seed=seed),
            direction=Direction(keyframes=keys),
        )
        poses += [
            np.linalg.norm(made.joints[at] - pose, axis=-1).max()
            for at, pose in ((0, clips[0].joints[0]), (90, goal))
        ]
        keys = (
            Keyframe(time=4, at=(1.0, 3.0)),
            Keyframe(time=12, at=(4.0, 6.0), heading=np.pi / 2),
        )
        made = make_motion(
            model,
            [Step(action="Walk")],
            Take(frames=400, fps=FPS, seed=seed),
            direction=Direction(keyframes=keys),
        )
        places += [
            float(np.linalg.norm(made.root[round(key.time * FPS), [0, 2]] - np.array(key.at)))
            for key in keys
        ]
        hips = model.skeleton.hips or (0, 0)
        across = made.joints[360, hips[0]] - made.joints[360, hips[1]]
        faces.append(abs(np.degrees(np.arctan2(-across[2], across[0])) - 90))
        plain = make_motion(
            model,
            [Step(action="Walk")],
            Take(frames=150, fps=FPS, seed=seed),
            direction=Direction(heading=0.0),
        )
        at, own = plain.joints[75, 6] + (0, 0.2, 0.1), (0.25, 0.3, 0.35)
        holds = (Hold(joint="left_wrist", start=2, end=3, at=tuple(at.astype(float))),)
        made = make_motion(
            model,
            [Step(action="Walk")],
            Take(frames=150, fps=FPS, seed=seed),
            direction=Direction(holds=holds),
        )
        held.append(np.linalg.norm(made.joints[60:91, 6] - at, axis=-1).max())
        holds = (Hold(joint="left_wrist", start=1, end=4, at=own, body=True),)
        made = make_motion(
            model,
            [Step(action="Walk")],
            Take(frames=150, fps=FPS, seed=seed),
            direction=Direction(holds=holds),
        )
        yaw = heading(made.joints, model.skeleton)[30:121]
        turned = np.stack(
            [
                np.cos(yaw) * own[0] + np.sin(yaw) * own[2],
                np.full(len(yaw), own[1]),
                np.cos(yaw) * own[2] - np.sin(yaw) * own[0],
            ],
            -1,
        )
        bodily.append(
            np.linalg.norm(made.joints[30:121, 6] - made.joints[30:121, 0] - turned, axis=-1).max()
        )
    for name, found, unit in (
        ("a pose, its farthest joint", poses, "cm"),
        ("a place", places, "cm"),
        ("a heading by the hips", faces, "°"),
        ("a hand held in place", held, "cm"),
        ("a hand held before the body", bodily, "cm"),
    ):
        factor = 100 if unit == "cm" else 1
        print(
            f"| {name} | {factor * np.mean(found):.1f} {unit} | {factor * np.max(found):.1f} "
            f"{unit} |"
        )


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=File, default=File("../shared/data"))
    parser.add_argument("--seeds", type=int, default=8)
    options = parser.parse_args()
    model = MotionModel.load("cmu-fine")
    print(
        "| action | path | mean cm | worst cm | end cm | skating | slide mm | jitter | recognized "
        "| time |\n" + "|---" * 10 + "|"
    )
    for action in FAMILY:
        along_paths(model, action, options.seeds, options.data)
    print("\n| asked for | mean | worst |\n|---|---|---|")
    wishes(model, options.seeds)


if __name__ == "__main__":
    main()
