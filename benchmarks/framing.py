"""Measure the size of the person in every view of 20 actions: `python -m benchmarks.framing [--out
FILE]`.

The actions are every sixth of cmu-fine's, in alphabetical order. The sample person makes each of
them for five seconds (seed 4). Vertices move by plain skinning and are projected into the cameras
of `a2v video`: nothing is rendered. Every third frame and every fifth vertex is measured. The
character's height in the picture is that of its vertices' bounding box, over the picture's height.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from a2v.animation import deform
from a2v.animation.root_motion import ground_trajectory_of
from a2v.io import atomic_path
from a2v.motion import MotionModel
from a2v.rendering import extreme_points, follow_cameras
from a2v.types import Body, Character, FloatArray, RenderSettings
from pipelines.engine.store import Store
from pipelines.nodes.values import Poses
from pipelines.requests.video import video_parameters
from pipelines.run import run

_SAMPLE = Path(__file__).resolve().parents[1] / "a2v" / "samples" / "person.jpg"
_ACTIONS, _STEP = 20, 6
_ASPECTS = ("1:1", "9:16", "16:9")
_LEAST, _MOST = 0.55, 0.75
"""Smallest and largest height of the person over that of the picture."""


def sizes(
    clouds: FloatArray, facing: FloatArray, fps: float, aspect: str
) -> tuple[FloatArray, int]:
    """Return the person's height over the picture's (views, frames), and the number of pictures
    that cut the person off.

    Parameters
    ----------
    clouds : (T, V, 3) float
        Vertices, meters.
    facing : (T,) float
        Radians about +y from +z.
    """
    settings = RenderSettings(size=1000, aspect=aspect)
    track = np.stack([extreme_points(cloud) for cloud in clouds])
    cameras = follow_cameras(track, settings, facing=facing, fps=fps)
    width, height = settings.shape
    side = max(width, height)
    heights, cut = [], 0
    for view in settings.views:
        boxes = []
        for frame in range(0, len(clouds), 3):
            pixels = cameras[view][frame].project(clouds[frame], side)
            pixels -= ((side - width) / 2, (side - height) / 2)
            low, high = pixels.min(axis=0), pixels.max(axis=0)
            boxes.append((high[1] - low[1]) / height)
            cut += bool((low < 0).any() or (high > (width, height)).any())
        heights.append(boxes)
    return np.array(heights), cut


def table(actions: list[str]) -> str:
    """Measure all actions in all shapes; Markdown."""
    store, rows, totals = Store(), [], dict.fromkeys(_ASPECTS, 0)
    for action in actions:
        outcome = run(
            ["poses", "character", "body"],
            store=store,
            **video_parameters(store, _SAMPLE, action, seed=4),
        )
        poses, body = outcome.get("poses", Poses), outcome.get("body", Body)
        character = outcome.get("character", Character)
        facing = ground_trajectory_of(poses.bone_transforms, body).heading
        clouds = np.stack([deform(character, pose)[::5] for pose in poses.bone_transforms])
        cells = [action]
        for aspect in _ASPECTS:
            heights, cut = sizes(clouds, facing, poses.fps, aspect)
            medians = np.median(heights, axis=1)
            inside = ((heights >= _LEAST) & (heights <= _MOST)).mean()
            totals[aspect] += int(((medians >= _LEAST) & (medians <= _MOST)).all())
            views = " ".join(f"{100 * one:.0f}" for one in medians)
            low, high = 100 * np.percentile(heights, (5, 95))
            cells += [views, f"{low:.0f} to {high:.0f}", f"{inside:.0%}", str(cut)]
        toward = np.cos(facing - np.angle(np.exp(1j * facing).mean()))
        rows.append(f"| {' | '.join([*cells, f'{(toward > 0).mean():.0%}'])} |")
    head = ["action"]
    for aspect in _ASPECTS:
        head += [f"{aspect}: front back left right", "5 to 95 %", "frames inside", "cut off"]
    head.append("faces the front view")
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|", *rows]
    for aspect in _ASPECTS:
        lines.append(
            f"\n{aspect}: all four views inside in {totals[aspect]} of {len(rows)} actions"
        )
    return "\n".join(lines)


def main() -> None:
    """Print the table, and write it if a file is given."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    actions = sorted(MotionModel.load("cmu-fine").card.actions)[::_STEP][:_ACTIONS]
    text = table(actions)
    print(text)
    if given.out is not None:
        with atomic_path(given.out) as temporary:
            temporary.write_text(text + "\n")


if __name__ == "__main__":
    main()
