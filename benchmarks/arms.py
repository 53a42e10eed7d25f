"""Measure how often arms lie inside the trunk, before and after `a2v.animation.clear_arms`.

python -m benchmarks.arms [--every 1] [--model cmu-fine] [--body broad]

Four seconds of every action are measured, seed 0, on the average body, a broad one, or that of the
sample photo, which is fitted first.
"""

from __future__ import annotations

import argparse
import itertools
import time
from pathlib import Path

import numpy as np

from a2v.animation import RetargetSettings, retarget
from a2v.animation.clearance import arm_depth, clear_arms
from a2v.animation.rig import rig_of
from a2v.body import load_body_model, make_body
from a2v.motion import MotionModel
from a2v.motion.direct import make_motion
from a2v.motion.prompts import Step
from a2v.motion.timeline import Take
from a2v.types import Body, FloatArray

WITHIN = 0.02
"""Depth in meters from which an arm counts as inside: clothes and flesh hide less."""
FPS = 30.0
BROAD = {"weight": 0.9}
"""Shape of the broad body."""


def body_of(name: str) -> Body:
    """Return the body of a name of ``--body``."""
    if name == "sample":
        import a2v

        return a2v.make_character(
            str(Path(a2v.__file__).parent / "samples/person.jpg")
        ).character.body
    return make_body(load_body_model(), shape=BROAD if name == "broad" else None, grounded=True)


def main() -> None:
    """Print the shares of frames, and the accelerations of wrists."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", default="cmu-fine")
    parser.add_argument("--every", type=int, default=1, help="n-th action only")
    parser.add_argument("--body", choices=("average", "broad", "sample"), default="average")
    parser.add_argument("--actions", default="", help="with commas; all by default")
    parser.add_argument("--seeds", type=int, default=1)
    given = parser.parse_args()
    model, body = MotionModel.load(given.model), body_of(given.body)
    rig = rig_of(body)
    wrists = [rig.bones["left_wrist"], rig.bones["right_wrist"]]

    def jolt(moves: FloatArray) -> float:
        steps = np.diff(moves[:, wrists][..., :3, 3], n=2, axis=0) * FPS**2
        return float(np.quantile(np.linalg.norm(steps, axis=-1), 0.95))

    rows, seconds = [], []
    chosen = (
        [name.strip() for name in given.actions.split(",")]
        if given.actions
        else list(model.actions[:: given.every])
    )
    clips = list(itertools.product(chosen, range(given.seeds)))
    for action, seed in clips:
        motion = make_motion(model, [Step(action=action)], Take(frames=120, fps=FPS, seed=seed))
        before = retarget(motion, body, settings=RetargetSettings(clear_arms=False)).astype(
            np.float64
        )
        started = time.process_time()
        after = clear_arms(before, rig, FPS)
        seconds.append(time.process_time() - started)
        rows.append(
            [
                *((arm_depth(moves, rig).max(1) > WITHIN).mean() for moves in (before, after)),
                jolt(before),
                jolt(after),
            ]
        )
    table = np.array(rows)
    for at in np.argsort(-table[:, 1])[:8]:
        print(
            f"  {clips[at][0]}, seed {clips[at][1]}: {table[at, 0]:.3f} before, {table[at, 1]:.3f} "
            f"after; acceleration {table[at, 3] / table[at, 2]:.2f} times"
        )
    print(
        f"{len(table)} clips: frames with an arm over {WITHIN * 100:.0f} cm within: "
        f"{table[:, 0].mean():.3f} before, {table[:, 1].mean():.3f} after;"
    )
    print(
        f"clips with such frames: {(table[:, 0] > 0).sum()} before, {(table[:, 1] > 0).sum()} "
        f"after; most after {table[:, 1].max():.2f}"
    )
    print(
        f"acceleration of wrists, 95 % quantile: {np.median(table[:, 3] / table[:, 2]):.2f} times, "
        f"at most {(table[:, 3] / table[:, 2]).max():.2f}"
    )
    print(f"{np.median(seconds):.2f} CPU s a clip of 120 frames")


if __name__ == "__main__":
    main()
