"""From an action, or from a recorded file, to a motion."""

from __future__ import annotations

from a2v.motion.prompts import Step
from a2v.types import Motion
from pipelines.memo import memo
from pipelines.store import File, Ref, put


@memo()
def motion(model: File, steps: tuple[Step, ...], frames: int, seed: int, fps: float) -> Ref[Motion]:
    """Sample a motion model, one action after the other; steps without a length share `frames`."""
    from a2v.motion import MotionModel
    from a2v.motion.timeline import perform

    return put(perform(MotionModel.load(model.path), steps, frames=frames, fps=fps, seed=seed))


@memo()
def recorded(motion_file: File, action: str, frames: int, fps: float) -> Ref[Motion]:
    """Read a motion file: the first `frames` of it at `fps`."""
    from a2v.formats import read_motion
    from a2v.kinematics.resample import resample_motion

    made = read_motion(motion_file.path, action=action)
    if made.batch:
        made = made[(0,) * len(made.batch)]
    return put(resample_motion(made, fps).first(frames))
