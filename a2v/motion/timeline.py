"""Several actions in turn, each with its own length and tempo."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import uniform_filter1d

from a2v.errors import InputError
from a2v.kinematics.resample import resample_at
from a2v.motion.card import MAX_FRAMES
from a2v.motion.model import MotionModel
from a2v.motion.prompts import Step
from a2v.types import Motion

#: Seconds over which tempo changes from one step to the next.
EASE_SECONDS = 0.5


def step_frames(steps: Sequence[Step], *, frames: int, fps: float) -> list[int]:
    """Frames of each step at `fps`: what it asks for, else an equal share of `frames`.

    Raises
    ------
    InputError
        There is no step, or they are longer than a model makes.
    """
    if not steps:
        raise InputError("no action given")
    share = -(-frames // len(steps))
    counts = [step.frames or (round(step.seconds * fps) if step.seconds else share) for step in steps]
    if not any(step.frames or step.seconds for step in steps):
        counts[-1] = max(1, frames - share * (len(steps) - 1))  # as a transition without lengths has it
    counts = [max(1, count) for count in counts]
    if sum(counts) > MAX_FRAMES:
        raise InputError(f"the steps take {sum(counts)} frames; expected at most {MAX_FRAMES}")
    return counts


def perform(model: MotionModel, steps: Sequence[Step], *, frames: int = 60, count: int = 1, seed: int = 0) -> Motion:
    """Clips of `steps` in turn, each as long as it says.

    Parameters
    ----------
    model : MotionModel
    steps : sequence of Step
    frames : int
        Shared alike by the steps that name no length, at the model's rate.
    count : int
        Clips; with 1 the result has no leading dimension.
    seed : int

    Raises
    ------
    InputError
        An unknown action, or a number out of range.
    """
    lasting = step_frames(steps, frames=frames, fps=model.fps)
    made_of = [max(1, round(length * step.speed)) for length, step in zip(lasting, steps, strict=True)]
    names = model.check_request([step.action for step in steps], frames=sum(made_of), count=count)
    labels = np.repeat([model.label(name) for name in names], made_of)
    body = np.tile(model.bone_lengths, (count, 1))
    joints, rotations = model.generate(np.tile(labels, (count, 1)), body, np.random.default_rng(seed))
    motion = model.to_motion(joints, rotations, lengths=model.bone_lengths, names=names, seed=seed)
    if any(step.speed != 1 for step in steps):
        pace = np.repeat([made / length for made, length in zip(made_of, lasting, strict=True)], lasting)
        eased = uniform_filter1d(pace, max(1, round(EASE_SECONDS * model.fps)), mode="nearest")
        at = np.concatenate([[0.0], np.cumsum(eased)[:-1]])
        motion = resample_at(motion, np.minimum(at * (sum(made_of) - 1) / max(at[-1], 1e-9), sum(made_of) - 1))
    return motion if count > 1 else motion[0]
