"""The page's script, run by Node, plants feet as Python does."""

from __future__ import annotations

import dataclasses
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from a2v.kinematics.planting import plant_feet
from a2v.motion import MotionModel
from a2v.motion import page as page_module
from a2v.motion.settling import planting, settled
from a2v.motion.smoothing import smooth_actions
from a2v.types import FloatArray, Motion

SCRIPT = Path(page_module.__file__).with_name("browser") / "plant.js"
RUN = """
const fs = require("fs");
const { about, joints, labels } = JSON.parse(fs.readFileSync(0));
const makeFeet = new Function(fs.readFileSync(process.argv[2], "utf8") + "; return makeFeet;")();
const made = makeFeet(about)(Float32Array.from(joints), labels);
process.stdout.write(JSON.stringify(Array.from(made)));
"""


def in_the_page(
    model: MotionModel, joints: FloatArray, labels: list[int], folder: Path
) -> FloatArray:
    node = shutil.which("node")
    if node is None:
        pytest.skip("Node is not installed")
    about = page_module._feet(model) | {
        "fps": model.fps,
        "parents": model.skeleton.parents.tolist(),
    }
    (folder / "run.js").write_text(RUN)
    given = {"about": about, "joints": joints.ravel().tolist(), "labels": labels}
    done = subprocess.run(
        [node, str(folder / "run.js"), str(SCRIPT)],
        input=json.dumps(given),
        capture_output=True,
        text=True,
        check=True,
    )
    return np.array(json.loads(done.stdout), np.float32).reshape(joints.shape)


@pytest.mark.parametrize(
    "actions",
    [["Walk"], ["Salsa"], ["Climb a ladder"], ["Climb stairs"], ["Run", "Jump"], ["Walk", "Sneak"]],
)
def test_feet_stand_where_python_has_them(actions: list[str], tmp_path: Path) -> None:
    model = MotionModel.load("cmu-fine")
    made = model.sample(actions, frames=72, seed=3)
    labels = model.frame_labels(actions, 72).tolist()
    timed = made if len(actions) == 1 else _starting(made, len(actions))
    even = settled(smooth_actions(timed, actions), model.card, actions)
    ours = plant_feet(
        even.joints, model.skeleton, model.fps, settings=planting(model.card, actions)
    )
    found = in_the_page(model, made.joints, labels, tmp_path)
    np.testing.assert_allclose(found, ours, atol=1e-4)
    assert np.abs(ours - made.joints).max() > 0.01


def _starting(made: Motion, parts: int) -> Motion:
    starts = np.arange(parts) * (made.frames // parts) / made.fps
    return dataclasses.replace(made, action_starts=starts)


def test_a_model_without_two_legs_is_left_alone(tmp_path: Path) -> None:
    model = MotionModel.load("cmu-fine")
    few = model.sample("Walk", frames=3, seed=1)
    found = in_the_page(model, few.joints, [model.label("Walk")] * 3, tmp_path)
    assert found.shape == few.joints.shape
