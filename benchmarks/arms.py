"""How often arms lie within the trunk, before and after `a2v.animation.clear_arms`: python -m benchmarks.arms [--every 1] [--model cmu-fine]

Four seconds of every action on the average body, seed 0.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from a2v.animation import RetargetSettings, retarget
from a2v.animation.clearance import arm_depth, clear_arms
from a2v.animation.rig import rig_of
from a2v.body import load_body_model, make_body
from a2v.motion import MotionModel
from a2v.motion.direct import make_motion
from a2v.motion.prompts import Step
from a2v.motion.timeline import Take
from a2v.types import FloatArray

WITHIN = 0.02
"""Metres from which an arm counts as within: clothes and flesh hide less."""
FPS = 30.0


def main() -> None:
    """Print the shares of frames, and the accelerations of wrists."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", default="cmu-fine")
    parser.add_argument("--every", type=int, default=1, help="n-th action only")
    given = parser.parse_args()
    model, body = MotionModel.load(given.model), make_body(load_body_model(), grounded=True)
    rig = rig_of(body)
    wrists = [rig.bones["left_wrist"], rig.bones["right_wrist"]]

    def jolt(moves: FloatArray) -> float:
        steps = np.diff(moves[:, wrists][..., :3, 3], n=2, axis=0) * FPS**2
        return float(np.quantile(np.linalg.norm(steps, axis=-1), 0.95))

    rows, seconds = [], []
    for action in model.actions[:: given.every]:
        motion = make_motion(model, [Step(action=action)], Take(frames=120, fps=FPS, seed=0))
        before = retarget(motion, body, settings=RetargetSettings(clear_arms=False)).astype(np.float64)
        started = time.process_time()
        after = clear_arms(before, rig, FPS)
        seconds.append(time.process_time() - started)
        rows.append([*((arm_depth(moves, rig).max(1) > WITHIN).mean() for moves in (before, after)), jolt(before), jolt(after)])
    table = np.array(rows)
    print(f"{len(table)} actions: frames with an arm over {WITHIN * 100:.0f} cm within: {table[:, 0].mean():.3f} before, {table[:, 1].mean():.3f} after;")
    print(f"actions with such frames: {(table[:, 0] > 0).sum()} before, {(table[:, 1] > 0).sum()} after; most after {table[:, 1].max():.2f}")
    print(f"acceleration of wrists, 95 % quantile: {np.median(table[:, 3] / table[:, 2]):.2f} times, at most {(table[:, 3] / table[:, 2]).max():.2f}")
    print(f"{np.median(seconds):.2f} CPU s a clip of 120 frames")


if __name__ == "__main__":
    main()
