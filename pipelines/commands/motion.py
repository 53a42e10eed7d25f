"""``a2v motion``: an action to motion files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.types import Motion

HELP = "Generate motions of an action (or of several actions in turn) and write them as .npz, .bvh or a stick-figure .mp4."
EXAMPLES = """examples:
  a2v motion --action Walk --out walk.npz
  a2v motion --action Walk,Jump --frames 120 --out walk-jump.bvh        a transition
  a2v motion --model humanact12 --action throw --count 20 --seed 7 --out throw.npz   one file, a leading 20

With --count above 1 an .npz holds all clips; .bvh and .mp4 become numbered files."""


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    parser.add_argument("--action", required=True, help="what to do; several with commas follow each other")
    parser.add_argument("--model", default="cmu", help="cmu, humanact12 or an .onnx file")
    parser.add_argument("--out", required=True, help="the .npz, .bvh or .mp4 to write")
    parser.add_argument("--count", type=int, default=1, help="clips")
    parser.add_argument("--frames", type=int, default=60, help="frames a clip")
    parser.add_argument("--seed", type=int, default=0, help="seed of the noise")
    parser.add_argument("--bone_scale", "--bone-scale", type=float, default=1.0, help="factor on all bone lengths")


def run(settings: Any) -> int:
    """Generate; print the paths."""
    from a2v.motion import MotionModel
    from pipelines.inputs import check_writable

    path = Path(settings.out)
    if path.suffix.lower() not in (".npz", ".bvh", ".mp4"):
        raise InputError(f"cannot write {path}; expected a name that ends in .npz, .bvh or .mp4")
    model = MotionModel.load(settings.model)
    actions = [name.strip() for name in settings.action.split(",")]
    made = model.sample(actions, frames=settings.frames, count=settings.count, seed=settings.seed, bone_scale=settings.bone_scale)
    check_writable(path.parent)
    for target in write(made, path):
        print(target)
    return 0


def write(motion: Motion, path: Path) -> list[Path]:
    """Write a clip, or a batch of clips, by the path's suffix; returns the paths."""
    if path.suffix.lower() == ".npz":
        motion.save(path)
        return [path]
    if not motion.batch:
        _write_one(motion, path)
        return [path]
    targets = [path.with_name(f"{path.stem}_{index:03d}{path.suffix}") for index in range(motion.batch[0])]
    for index, target in enumerate(targets):
        _write_one(motion[index], target)
    return targets


def _write_one(motion: Motion, path: Path) -> None:
    if path.suffix.lower() == ".bvh":
        from a2v.animation import write_bvh

        write_bvh(path, motion)
        return
    from a2v.rendering import write_video

    with atomic_path(path) as temporary:
        write_video(temporary, stick_figure(motion), motion.fps)


def stick_figure(motion: Motion, size: int = 384) -> list[np.ndarray]:
    """Frames (H, W, 3) uint8 of a moving stick figure, from the front (left half) and from its left (right half)."""
    from PIL import Image, ImageDraw

    low, high = motion.joints.min((0, 1)), motion.joints.max((0, 1))
    scale = 0.85 * size / float(max((high - low).max(), 1e-3))
    middle = (low + high) / 2
    frames = []
    for joints in motion.joints:
        image = Image.new("RGB", (2 * size, size), "white")
        pen = ImageDraw.Draw(image)
        for left, right_axis in ((0, np.array([1.0, 0, 0])), (size, np.array([0, 0, -1.0]))):
            u = left + size / 2 + scale * ((joints - middle) @ right_axis)
            v = size / 2 - scale * (joints[:, 1] - middle[1])
            ground = size / 2 - scale * (low[1] - middle[1])
            pen.line([(left, ground), (left + size - 1, ground)], fill="#cccccc", width=2)
            for joint, parent in enumerate(motion.parents):
                if parent >= 0:
                    side = motion.joint_names[joint].lower()
                    color = "#d1495b" if side.startswith("l") else "#2e6f95" if side.startswith("r") else "#333333"
                    pen.line([(u[parent], v[parent]), (u[joint], v[joint])], fill=color, width=5)
        frames.append(np.asarray(image))
    return frames
