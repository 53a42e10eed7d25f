"""Measure how well cycles close, over all actions.

python -m benchmarks.loops [--every 3] [--seeds 2] [--model cmu-fine]

For cycles in place from five seconds at 30 frames per second: mean acceleration of all joints at
the seam relative to the 95 % quantile of the clip's own, and mean speed of the joints (about the
root's place on the ground) relative to the clip's.
"""

from __future__ import annotations

import argparse

import numpy as np

from a2v.motion import MotionModel
from a2v.motion.direct import make_motion
from a2v.motion.edit import make_loop
from a2v.motion.prompts import Step
from a2v.motion.timeline import Take
from a2v.types import Motion

FPS = 30.0


def speed(motion: Motion) -> float:
    """Return the mean speed of all joints about the root's place, meters per second."""
    local = motion.joints - motion.joints[:, :1] * np.array([1, 0, 1], np.float32)
    return float(np.linalg.norm(np.diff(local, axis=0), axis=-1).mean()) * motion.fps


def main() -> None:
    """Print the results."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", default="cmu-fine")
    parser.add_argument("--every", type=int, default=1, help="n-th action only")
    parser.add_argument("--seeds", type=int, default=2)
    given = parser.parse_args()
    model = MotionModel.load(given.model)
    rows, names = [], []
    for action in model.actions[:: given.every]:
        for seed in range(given.seeds):
            clip = make_motion(
                model, [Step(action=action)], Take(frames=round(5 * FPS), fps=FPS, seed=seed)
            )
            loop = make_loop(clip, in_place=True)
            last = loop.frames - 2
            closed, own = (
                np.linalg.norm(np.diff(joints, n=2, axis=0), axis=-1).mean(-1)
                for joints in (np.concatenate([loop.joints] * 2), clip.joints)
            )
            rows.append(
                (
                    closed[last : last + 2].max() / np.percentile(own, 95),
                    speed(loop) / speed(clip),
                    loop.frames / FPS,
                )
            )
            names.append(f"{action} ({seed})")
    table = np.array(rows)
    print(f"{len(table)} cycles of {np.median(table[:, 2]):.1f} s (median)")
    print(
        f"acceleration at the seam: median {np.median(table[:, 0]):.2f}, over 1.2 in "
        f"{(table[:, 0] > 1.2).mean():.3f}, most {table[:, 0].max():.2f}"
    )
    print(
        f"speed over the clip's: median {np.median(table[:, 1]):.2f}, least {table[:, 1].min():.2f}"
    )
    print(
        "over 1.2: "
        + ", ".join(f"{names[i]} {table[i, 0]:.2f}" for i in np.flatnonzero(table[:, 0] > 1.2))
    )


if __name__ == "__main__":
    main()
