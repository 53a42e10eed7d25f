"""Make the first pictures of the page of `a2v serve`: a stick figure for every action, and the
sample person.

    python scripts/make_page_pictures.py [--figures] [--sample] [--posters]

Writes ``figures.json``, ``person.glb``, ``sample.webp`` and the posters of the stage into ``pipelines/serve/page``. Figures
are motions of the shipped models (seed 0), seen from the front left; they take a minute.
"""

from __future__ import annotations

import argparse
import base64
import io
import json
import sys
import tempfile
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image

from a2v.animation import EngineSettings
from a2v.animation.engine import engine_ready
from a2v.io import atomic_path
from a2v.kinematics.ground import face_forward, first_heading
from a2v.kinematics.names import canonical_joints
from a2v.kinematics.skeleton import skeleton_of
from a2v.motion.plan import plan_motion
from a2v.motion.timeline import Take
from a2v.samples import load_ready_person
from a2v.types import Motion
from pipelines.serve.figure import write_figure
from pipelines.serve.records import PERSON
from pipelines.serve.wishes import MODELS, actions_of

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
PAGE = ROOT / "pipelines" / "serve" / "page"
Scheme = Literal["light", "dark"]
POSTERS: tuple[tuple[Scheme, str], ...] = (("light", "poster.webp"), ("dark", "poster-dark.webp"))
"""Color schemes and the posters' names."""
SMALL = EngineSettings(triangles=8000, texture=1024, normal_map=512, one_material=True)
"""The shipped person has fewer triangles than one who is made."""
MADE, FRAMES, FPS = 60, 24, 10.0
"""Number of frames of a motion, number of shown ones, and their rate."""
JOINTS = (
    "head",
    "neck",
    "pelvis",
    "left_shoulder",
    "left_elbow",
    "left_wrist",
    "right_shoulder",
    "right_elbow",
    "right_wrist",
    "left_hip",
    "left_knee",
    "left_ankle",
    "right_hip",
    "right_knee",
    "right_ankle",
)
BONES = (
    (0, 1),
    (1, 2),
    (3, 6),
    (3, 4),
    (4, 5),
    (6, 7),
    (7, 8),
    (9, 12),
    (9, 10),
    (10, 11),
    (12, 13),
    (13, 14),
)
"""Bones of the drawing, as positions in `JOINTS`."""
METERS = 2.4
"""Height of a picture from the ground up, and its width around the pelvis, meters."""
ANGLE = np.radians(35.0)
"""Direction of the camera from the front to the figure's left."""


def figure(motion: Motion) -> str:
    """A clip as bytes in base64: u and v of every joint of every frame in 255ths of the picture, v
    downwards."""
    skeleton = skeleton_of(motion.skeleton, motion.parents.tolist(), motion.joint_names)
    places = canonical_joints(motion.joint_names, motion.parents.tolist())
    speed = np.linalg.norm(np.diff(motion.joints - motion.joints[:, :1], axis=0), axis=-1).mean(
        axis=1
    )
    first = int(np.argmax(np.convolve(speed, np.ones(FRAMES - 1), "valid")))  # where most happens
    chosen_frames = motion.joints[first : first + FRAMES]
    told = skeleton.hips is not None  # a clip of the library faces +z as it is
    joints = (
        face_forward(chosen_frames, first_heading(chosen_frames, skeleton))
        if told
        else chosen_frames
    )
    joints = joints - joints[:, :1] * np.array([1.0, 0.0, 1.0])
    across = joints[..., 0] * np.cos(ANGLE) - joints[..., 2] * np.sin(ANGLE)
    chosen = [places[name] for name in JOINTS]
    u = 0.5 + across[:, chosen] / METERS
    v = 0.95 - joints[:, chosen, 1] / METERS
    return base64.b64encode(
        np.clip(np.stack([u, v], axis=-1) * 255 + 0.5, 0, 255).astype(np.uint8).tobytes()
    ).decode()


def figures() -> dict[str, object]:
    """The figures of all actions that the page offers."""
    names = sorted({action for model in MODELS for action in actions_of(model)})
    found = {
        name: figure(plan_motion(name).make(Take(frames=MADE, fps=FPS, seed=0))) for name in names
    }
    return {"frames": FRAMES, "fps": FPS, "joints": len(JOINTS), "bones": BONES, "actions": found}


def person(path: Path) -> None:
    """Write the sample person as the stage shows it, small enough to be shipped."""
    ready = load_ready_person()
    write_figure(path, engine_ready(ready.character, SMALL), ready.body, quality=80)


KEEP_DRAWN = """const get = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, how) { return get.call(this, kind, { ...how, preserveDrawingBuffer: true }); };"""
"""Script: a canvas can be read after it was drawn."""


def poster(scheme: Scheme) -> Image.Image:
    """The stage with the sample person as a browser draws it, before the viewer is loaded."""
    from playwright.sync_api import sync_playwright

    from benchmarks.first_use import FLAGS, serving
    from tests.support.page import find_browser

    with (
        tempfile.TemporaryDirectory() as folder,
        serving(Path(folder), None) as (address, _),
        sync_playwright() as engine,
    ):
        browser = engine.chromium.launch(executable_path=find_browser(), args=list(FLAGS))
        page = browser.new_page(
            viewport={"width": 1440, "height": 900}, color_scheme=scheme, reduced_motion="reduce"
        )
        page.add_init_script(KEEP_DRAWN)
        page.goto(address)
        page.locator("body[data-person]").wait_for(timeout=120_000)
        page.wait_for_timeout(3000)
        told = page.evaluate("document.querySelector('#stage canvas').toDataURL()")
        browser.close()
    with Image.open(io.BytesIO(base64.b64decode(told.partition(",")[2]))) as whole:
        middle, half = whole.width // 2, whole.height // 2
        square = whole.convert("RGB").crop((middle - half, 0, middle + half, 2 * half))
    return square.resize((640, 640))


def portrait() -> Image.Image:
    """The sample person's head and shoulders, of the photo."""
    with Image.open(ROOT / "a2v" / "samples" / "person.jpg") as photo:
        box = [round(photo.width * share) for share in (0.38, 0.05, 0.62, 0.29)]
        return photo.convert("RGB").crop((box[0], box[1], box[2], box[3])).resize((96, 96))


def main() -> None:
    """Make the requested files, or all of them."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--figures", action="store_true")
    parser.add_argument("--sample", action="store_true")
    parser.add_argument("--posters", action="store_true")
    given = parser.parse_args()
    every = not (given.figures or given.sample or given.posters)
    if given.figures or every:
        with atomic_path(PAGE / "figures.json") as temporary:
            temporary.write_text(json.dumps(figures(), separators=(",", ":")) + "\n")
    if given.sample or every:
        person(PAGE / PERSON)
        with atomic_path(PAGE / "sample.webp") as temporary:
            portrait().save(temporary, "webp", quality=80)
    if given.posters or every:
        for scheme, name in POSTERS:
            with atomic_path(PAGE / name) as temporary:
                poster(scheme).save(temporary, "webp", quality=80)


if __name__ == "__main__":
    main()
