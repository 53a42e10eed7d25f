"""Measure foot contact, liveliness and variation between seeds, for every action as the commands
make it: python -m benchmarks.standing [--model cmu-fine] [--clips 4]

The same as ``a2v evaluate --stand``, without a classifier, and on request at another tempo or along
a circle. Writes Markdown to --out.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import numpy as np

from a2v.io import atomic_path
from a2v.lab.datasets import load_dataset
from a2v.lab.evaluation.standing import FPS, SECONDS, score_standing, standing_table, summary
from a2v.motion import MotionModel
from a2v.motion.direct import make_motion
from a2v.motion.direction import Direction
from a2v.motion.edit import Edit
from a2v.motion.prompts import Step
from a2v.motion.timeline import Take
from a2v.motion.ways import GroundPath
from a2v.types import Motion

TURN = np.linspace(0, 5, 50)
CIRCLE = GroundPath(np.stack([2 * (1 - np.cos(TURN)), 2 * np.sin(TURN)], axis=-1))
"""Path along a circle of 2 m, five radians long."""


def main() -> None:
    """Print the summary, write the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", default="cmu-fine")
    parser.add_argument("--data", default=os.environ.get("A2V_DATA", "../shared/data"))
    parser.add_argument("--clips", type=int, default=4)
    parser.add_argument("--speed", type=float, default=1.0)
    parser.add_argument("--circle", action="store_true", help="along a circle")
    parser.add_argument("--actions", default="", help="with commas; all by default")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    model = MotionModel.load(given.model)
    dataset = load_dataset(model.card.dataset, given.data)

    def make(action: str, seed: int) -> Motion:
        way = Direction(path=CIRCLE) if given.circle else None
        return make_motion(
            model,
            [Step(action=action)],
            Take(frames=round(SECONDS * FPS), fps=FPS, seed=seed),
            edit=Edit(speed=given.speed),
            direction=way,
        )

    chosen = [name.strip() for name in given.actions.split(",")] if given.actions else None
    scores = score_standing(make, dataset, clips=given.clips, actions=chosen)
    print(summary(scores))
    if given.out is not None:
        with atomic_path(given.out) as temporary:
            temporary.write_text(standing_table(scores) + "\n")


if __name__ == "__main__":
    main()
