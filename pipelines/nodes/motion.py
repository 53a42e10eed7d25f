"""From an action, or from a recorded file, to a motion."""

from __future__ import annotations

from a2v.types import Motion
from pipelines.memo import memo
from pipelines.store import File, Ref, put


@memo()
def motion(model: File, action: str, frames: int, seed: int, fps: float | None) -> Ref[Motion]:
    """Sample a motion model; a comma between actions makes a transition. `fps` resamples it to a smoother or coarser one."""
    from a2v.kinematics.resample import resample_motion
    from a2v.motion import MotionModel

    made = MotionModel.load(model.path).sample([name.strip() for name in action.split(",")], frames=frames, seed=seed)
    return put(made if fps is None else resample_motion(made, fps))


@memo()
def recorded(motion_file: File, action: str, frames: int, fps: float | None) -> Ref[Motion]:
    """Read a motion file: at `fps` (by default the file's own, at most 30), the first `frames` of it."""
    from a2v.formats import read_motion
    from a2v.kinematics.resample import resample_motion

    made = read_motion(motion_file.path, action=action)
    if made.batch:
        made = made[(0,) * len(made.batch)]
    rate = fps or min(made.fps, 30.0)
    made = resample_motion(made, rate)
    return put(made.first(frames))
