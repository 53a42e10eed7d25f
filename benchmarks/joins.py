"""Measure the joins between windows of a motion: python -m benchmarks.joins [--data ../shared/data]

There are two measures of the shipped window models. *Transitions*: for every pair of different
actions, how often the authors' classifier recognizes the second one, in the window after the
change, from there on, and once the first has faded, compared with the second action alone. All
clips end as the data's do, hold their last pose, and begin facing the same direction. *Speed*: mean
speed of all joints in the quarter second before and after each join, relative to the clip's, for
actions without a rest.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from a2v.kinematics.ground import face_forward, heading
from a2v.lab.evaluation.classifier import load_evaluator
from a2v.motion import MotionModel
from a2v.motion.window_sampler import CHANGE_SECONDS, ENDING_FRAMES
from a2v.types import FloatArray

EVALUATORS = {
    "cmu": "action_recognition_model_mocap_new.tar",
    "humanact12": "action_recognition_model_humanact12.tar",
}
STEADY = {
    "cmu": ("Walk", "Run", "Dance"),
    "cmu-fine": ("Walk", "Run", "Jog", "March", "Salsa", "Sneak"),
    "humanact12": ("walk", "run", "boxing"),
}


def transitions(name: str, data: Path, clips: int) -> tuple[float, float, float]:
    """Share of clips whose second action is recognized from the change on, once the first has
    faded, and of clips of that action alone."""
    model, evaluator = (
        MotionModel.load(name),
        load_evaluator(data / "evaluators" / EVALUATORS[name]),
    )
    window, first, generator = model.card.frames, round(4 * model.fps), np.random.default_rng(0)
    fade = max(2, round(CHANGE_SECONDS * model.fps))
    changed: list[bool] = []
    faded: list[bool] = []
    alone: list[bool] = []
    for one in range(len(model.actions)):
        for other in range(len(model.actions)):
            labels = np.repeat([one, other], [first, window])
            if one != other:
                made, _ = model.generate(
                    np.tile(labels, (clips, 1)),
                    np.tile(model.bone_lengths, (clips, 1)),
                    generator,
                    fresh=True,
                )
                for found, begun in ((changed, 0), (faded, fade)):
                    found += (
                        evaluator(
                            _like_data(model, made[:, first + begun :], other, generator, begun)
                        )[1]
                        == other
                    ).tolist()
        made, _ = model.generate(
            np.full((4 * clips, window), one),
            np.tile(model.bone_lengths, (4 * clips, 1)),
            generator,
        )
        alone += (evaluator(_like_data(model, made, one, generator))[1] == one).tolist()
    return float(np.mean(changed)), float(np.mean(faded)), float(np.mean(alone))


def _like_data(
    model: MotionModel,
    joints: FloatArray,
    label: int,
    generator: np.random.Generator,
    begun: int = 0,
) -> FloatArray:
    """Native clips of (N, T, J, 3), without the `begun` first frames, that begin facing where clips
    of an action do, and hold a pose once those end."""
    usable = round(model.sampler.active_share(label) * model.card.frames) - begun  # type: ignore[union-attr]
    joints = joints[:, np.minimum(np.arange(model.card.frames), usable - 1)]
    own, _ = model.generate(
        np.full((len(joints), 2), label), np.tile(model.bone_lengths, (len(joints), 1)), generator
    )
    away = heading(joints[:, 0], model.skeleton) - heading(own[:, 0], model.skeleton)
    return model.to_native(
        face_forward(joints, np.stack([np.cos(away), np.sin(away)], axis=-1)).astype(np.float32)
    )


def speeds(name: str, action: str, clips: int) -> tuple[float, float]:
    """Return the speed before and after joins relative to the clip's mean."""
    model = MotionModel.load(name)
    sampler, card = model.sampler, model.card
    label, given = model.label(action), card.context_frames  # type: ignore[attr-defined]
    whole = round(sampler.active_share(label) * card.window_frames) - ENDING_FRAMES  # type: ignore[union-attr, attr-defined]
    usable = max(whole, given + 4)
    joins = usable + np.arange(max(3, 200 // usable)) * (usable - given)
    frames = int(joins[-1]) + 6
    made, _ = model.generate(
        np.full((clips, frames), label),
        np.tile(model.bone_lengths, (clips, 1)),
        np.random.default_rng(1),
    )
    speed: FloatArray = np.linalg.norm(np.diff(made.astype(np.float64), axis=1), axis=-1).mean(-1)
    speed /= speed.mean(1, keepdims=True)
    around = max(2, round(model.fps / 4))
    before, after = (
        np.mean([speed[:, at - 1 + a : at - 1 + b] for at in joins])
        for a, b in ((-around, 0), (0, around))
    )
    return float(before), float(after)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--clips", type=int, default=4, help="a pair of actions")
    options = parser.parse_args()
    print("| model | action | speed before a join | after |\n|---|---|---|---|")
    for name, actions in STEADY.items():
        for action in actions:
            before, after = speeds(name, action, 16)
            print(f"| {name} | {action} | {before:.2f} | {after:.2f} |")
    print(
        "\n| model | second action recognized from the change on | once the first has faded | the "
        "same action alone |\n|---|---|---|---|"
    )
    for name, file in EVALUATORS.items():
        if (options.data / "evaluators" / file).is_file():
            changed, faded, alone = transitions(name, options.data, options.clips)
            print(f"| {name} | {changed:.3f} | {faded:.3f} | {alone:.3f} |")


if __name__ == "__main__":
    main()
