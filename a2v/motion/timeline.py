"""Several actions in turn, each with its own length and tempo."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.ndimage import uniform_filter1d

from a2v.errors import InputError
from a2v.kinematics.resample import resample_at
from a2v.motion.card import MAX_FRAMES
from a2v.motion.edit import check_speed
from a2v.motion.model import MotionModel
from a2v.motion.prompts import Step
from a2v.types import FloatArray, Motion

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


def perform(
    model: MotionModel,
    steps: Sequence[Step],
    *,
    frames: int = 60,
    fps: float | None = None,
    speed: float = 1.0,
    count: int = 1,
    seed: int = 0,
    lengths: FloatArray | None = None,
) -> Motion:
    """Clips of `steps` in turn, each as long as it says.

    Parameters
    ----------
    model : MotionModel
    steps : sequence of Step
    frames : int
        Of the result; shared alike by the steps that name no length.
    fps : float or None
        Frames a second of the result; None for the model's own.
    speed : float
        Tempo of the whole, beside that of its steps.
    count : int
        Clips; with 1 the result has no leading dimension.
    seed : int
    lengths : (J,) float or None
        Bone lengths, native units; the model's own without.

    Raises
    ------
    InputError
        An unknown action, or a number out of range.
    """
    rate = model.fps if fps is None else fps
    check_speed(speed)
    lasting = step_frames(steps, frames=frames, fps=rate)
    at, starts = _moments(steps, lasting, ease=EASE_SECONDS * rate, pace=speed * model.fps / rate)
    made = int(np.ceil(at[-1] - 1e-6)) + 1
    names = model.check_request([step.action for step in steps], frames=made, count=count)
    labels = np.array([model.label(name) for name in names])[np.searchsorted(starts, np.arange(made) + 1e-6, side="right") - 1]
    body = model.bone_lengths if lengths is None else np.asarray(lengths, dtype=np.float32)
    joints, rotations = model.generate(np.tile(labels, (count, 1)), np.tile(body, (count, 1)), np.random.default_rng(seed))
    motion = model.to_motion(joints, rotations, lengths=body, names=names, seed=seed)
    if len(at) != made or not np.allclose(at, np.arange(made), atol=1e-6):
        motion = dataclasses.replace(resample_at(motion, np.minimum(at, made - 1)), fps=float(rate))
    return motion if count > 1 else motion[0]


def _moments(steps: Sequence[Step], lasting: Sequence[int], *, ease: float, pace: float) -> tuple[FloatArray, FloatArray]:
    """When the frames of a result (T,) take place, in frames of what is made for it, and when its steps begin (S,).

    `lasting`: frames of each step; `ease`: frames over which the tempo changes; `pace`: frames made for one of a step as recorded.
    """
    paces = np.repeat([step.speed * pace for step in steps], lasting)
    if np.ptp(paces) > 0:
        paces = uniform_filter1d(paces, max(1, round(ease)), mode="nearest")
    at = np.concatenate([[0.0], np.cumsum(paces)])
    return at[:-1], at[np.cumsum([0, *lasting[:-1]])]
