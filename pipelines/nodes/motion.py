"""Nodes from actions, or from a recorded file, to a motion."""

from __future__ import annotations

import dataclasses

from a2v.footage import FollowSettings
from a2v.motion.direction import Direction
from a2v.motion.edit import Edit
from a2v.motion.prompts import Step
from a2v.types import Motion
from pipelines.engine.memo import measure, memo, note, progress
from pipelines.engine.refs import File, Ref
from pipelines.engine.store import put
from pipelines.nodes.values import MotionFile


@memo()
def motion(
    model: File,
    steps: tuple[Step, ...],
    frames: int,
    seed: int,
    fps: float,
    edit: Edit,
    direction: Direction | None,
) -> Ref[Motion]:
    """Generate one action after the other with a motion model, or along a path.

    Steps with sources use those, and then `model` stands for all their files. Steps without a
    length share `frames`. The motion still travels.
    """
    from a2v.motion import MotionModel
    from a2v.motion.plan import make_steps
    from a2v.motion.timeline import Take

    opened = None if any(step.source for step in steps) else MotionModel.load(model.path)
    travelling = dataclasses.replace(edit, in_place=False)
    return put(
        make_steps(
            opened,
            steps,
            Take(frames=frames, fps=fps, seed=seed),
            edit=travelling,
            direction=direction,
        )
    )


@memo()
def recorded_motion(
    motion_file: MotionFile,
    action: str,
    frames: int,
    fps: float,
    edit: Edit,
    follow: FollowSettings,
) -> Ref[Motion]:
    """Read a motion file, or track the person in a video.

    The result has the first `frames` at `fps` and in the given tempo. The motion still travels.
    """
    from a2v.footage import is_video
    from a2v.footage.follow import follow_person
    from a2v.formats import read_motion
    from a2v.motion.edit import edited, retimed

    path = motion_file.file.path
    if is_video(path):
        found = follow_person(
            path,
            follow,
            seconds=frames / fps * edit.speed,
            action=action,
            progress=progress(),
        )
        for remark in found.remarks:
            note(remark)
        measure(found.facts)
        made = found.motion
    else:
        table = None if motion_file.bones is None else motion_file.bones.path
        made = read_motion(path, action=action, clip=motion_file.clip, bone_map=table)
        for remark in made.provenance.get("notes", ()):
            note(remark)
    if made.batch:
        made = made[(0,) * len(made.batch)]
    made = retimed(made, fps=fps, speed=edit.speed).first(frames)
    return put(edited(made, dataclasses.replace(edit, speed=1.0, in_place=False)))
