"""Draw contact sheets of actions: several seeds of each on the sample's character.

python scripts/make_motion_sheets.py [ACTION ...] [--model auto] [--seeds 3] [--frames 7]
[--seconds 4] [--loops] [--hands]

They are written to an ignored folder. Without an ACTION all are drawn, a dozen per page; several
`--azimuth` show each clip from several sides. An ACTION may be several in turn ("Walk, then Salsa"), which shows joins. `--loops` shows one
cycle and its beginning again, `--hands` the left and the right hand of each picture instead.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from a2v.animation import deform
from a2v.animation.rig import SIDES, rig_of
from a2v.io import atomic_path
from a2v.motion.catalog import SOURCES, catalog
from a2v.motion.edit import Edit
from a2v.motion.on_rig import retarget_edited
from a2v.motion.plan import AUTO, plan_motion
from a2v.motion.timeline import Take
from a2v.rendering.lighter import lighter
from a2v.rendering.preview import preview_surface
from a2v.types import Character, Surface
from pipelines.bar import Bars
from pipelines.engine.store import Store
from pipelines.requests.video import video_parameters
from pipelines.run import run

ROOT = Path(__file__).resolve().parent.parent
PAGE = 12
"""Number of actions per page."""
FPS = 30.0
LIGHT = {"triangles": 14000, "texture": 1024}


def sample_character() -> Character:
    """Return the character of the sample photo, with few triangles."""
    store, bars = Store(), Bars()
    outcome = run(
        ["character"],
        store=store,
        progress=bars,
        **video_parameters(store, ROOT / "a2v" / "samples" / "person.jpg", "Walk"),
    )
    bars.close()
    return lighter(outcome.get("character", Character), **LIGHT)


def row(
    character: Character, prompt: str, seed: int, azimuth: float, given: argparse.Namespace
) -> np.ndarray:
    """Pictures (size, frames * size, 3) of a clip, over its length."""
    plan = plan_motion(prompt, model=given.model)
    edit = plan.merged(Edit(loop=given.loops))
    seconds = plan.seconds or given.seconds
    motion = plan.make(Take(frames=round(seconds * FPS), fps=FPS, seed=seed), edit=edit)
    moves = retarget_edited(motion, character.body, edit)
    shown = np.linspace(0, len(moves) - (0 if given.loops else 1), given.frames).astype(int) % len(
        moves
    )
    rig = rig_of(character.body)
    pictures = []
    for at in shown:
        surface: Surface = dataclasses.replace(
            character.surface, vertices=deform(character, moves[at]), face=None
        )
        if given.hands:
            knuckles = [moves[at][rig.bones[f"{side}_wrist"], :3, 3] for side in reversed(SIDES)]
            pictures += [
                preview_surface(
                    surface, azimuth=20, size=given.size, center=place - [0, 0.06, 0], extent=0.34
                )
                for place in knuckles
            ]
        else:
            center = moves[at][rig.bones["pelvis"], :3, 3] * [1, 0, 1] + [0, 0.9, 0]
            pictures.append(
                preview_surface(
                    surface,
                    azimuth=azimuth,
                    elevation=8,
                    size=given.size,
                    center=center,
                    extent=2.15,
                )
            )
    return np.hstack(pictures)


def main() -> int:
    """Write the pages; print their paths."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("actions", nargs="*", metavar="ACTION")
    parser.add_argument("--model", default=AUTO)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--frames", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--size", type=int, default=120)
    parser.add_argument("--azimuth", type=float, nargs="+", default=[25.0])
    parser.add_argument("--loops", action="store_true")
    parser.add_argument("--hands", action="store_true")
    parser.add_argument("--out", type=Path, default=ROOT / "sheets" / "motions")
    given = parser.parse_args()
    character = sample_character()
    sources = SOURCES if given.model == AUTO else (given.model,)
    asked = given.actions or [entry.name for entry in catalog("any", sources).entries]
    given.out.mkdir(parents=True, exist_ok=True)
    for first in range(0, len(asked), PAGE):
        rows = []
        for prompt in asked[first : first + PAGE]:
            clips = np.hstack(
                [
                    row(character, prompt, seed, azimuth, given)
                    for azimuth in given.azimuth
                    for seed in range(given.seeds)
                ]
            )
            title = Image.new("RGB", (clips.shape[1], 14), "white")
            ImageDraw.Draw(title).text((4, 1), prompt, fill="black")
            rows += [np.asarray(title), clips]
        target = (
            given.out
            / f"{given.model}{'_loops' * given.loops}{'_hands' * given.hands}_{first // PAGE:02d}.png"
        )
        with atomic_path(target) as temporary:
            Image.fromarray(np.vstack(rows)).save(temporary)
        print(target, flush=True)
    return 0


if __name__ == "__main__":  # worker processes import this file again
    sys.exit(main())
