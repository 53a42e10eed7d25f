"""Options of a motion's path, keyframes and held joints, and what reads them."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from a2v.errors import InputError
from pipelines.options import option

if TYPE_CHECKING:
    from a2v.motion import MotionModel
    from a2v.motion.direction import Direction
    from a2v.motion.plan import MotionPlan
    from a2v.motion.prompts import Step

MANY = "cmu-fine"
"""The model with the most actions, which can be directed."""


def direction_of(
    plan: MotionPlan, way: WayOptions, *, fps: float, count: int = 1
) -> Direction | None:
    """Read the requested direction of a plan's motion at `fps`; None without any.

    Raises
    ------
    InputError
        See `read_direction`, `read_clip_direction`.
    """
    if not way.given and way.pace is None:
        return None
    if plan.model is None:
        return read_clip_direction(way, [step.action for step in plan.steps])
    return read_direction(plan.model, plan.steps, way, fps=fps, count=count)


def read_direction(
    model: MotionModel, steps: Sequence[Step], way: WayOptions, *, fps: float, count: int = 1
) -> Direction | None:
    """Read the requested path of the motion, its keyframes and held joints; None without any.

    Raises
    ------
    InputError
        A file or a number is invalid, or the model or the steps do not support it.
    """
    from a2v.motion.direct import check_directed
    from a2v.motion.direction import Direction, Keyframe
    from a2v.motion.keyframes import read_holds, read_keyframes, read_poses
    from a2v.motion.ways import read_path

    if way.path is None and way.pace is not None:
        raise InputError(
            f"pace is {way.pace:g}, but there is no path; give one with --path, or change the "
            "tempo with --speed"
        )
    if not way.given:
        return None
    path = None if way.path is None else read_path(way.path)
    check_directed(model, steps, Direction(path=path), count=count)
    keys, holds = (
        ([], []) if way.keyframes is None else read_keyframes(way.keyframes, model, fps=fps)
    )
    if way.start_pose is not None:
        keys += [Keyframe(time=at, joints=pose) for at, pose in read_poses(way.start_pose, model)]
    if way.end_pose is not None:
        poses = read_poses(way.end_pose, model)
        keys += [Keyframe(time=poses[-1][0] - at, joints=pose, to_end=True) for at, pose in poses]
    holds += [] if way.hold is None else read_holds(way.hold)
    heading = None if way.heading is None else float(np.radians(way.heading))
    direction = Direction(
        path=path, pace=way.pace, heading=heading, keyframes=tuple(keys), holds=tuple(holds)
    )
    check_directed(model, steps, direction)
    return direction


def read_clip_direction(way: WayOptions, actions: Sequence[str]) -> Direction:
    """Read the requested path, pace and heading of a clip.

    Raises
    ------
    InputError
        A file or a number is invalid, or poses, keyframes or held joints are given.
    """
    from a2v.motion.direction import Direction
    from a2v.motion.ways import read_path

    for name in ("keyframes", "start_pose", "end_pose", "hold"):
        if getattr(way, name) is not None:
            raise InputError(
                f"{name} cannot be given with {', '.join(actions)}, a hand-keyed clip; leave it "
                f"out, or choose --model {MANY}"
            )
    return Direction(
        path=None if way.path is None else read_path(way.path),
        pace=way.pace,
        heading=None if way.heading is None else float(np.radians(way.heading)),
    )


@dataclass(frozen=True, kw_only=True)
class WayOptions:
    """Options for the path of a motion, keyframes and held joints (docs/motion.md)."""

    path: str | None = option(
        "path on the ground: points 'x,z x,z ...' in meters, or a .csv, .yaml or .svg file",
        default=None,
    )
    pace: float | None = option(
        "speed along --path, meters per second (default: the speed of the action)",
        default=None,
        rare=True,
    )
    heading: float | None = option(
        "direction in which the person faces throughout, degrees: 0 is ahead, 90 is to the left",
        default=None,
        metavar="DEGREES",
        rare=True,
    )
    keyframes: str | None = option(
        "YAML file of poses, places and headings at given times, and of joints to hold",
        default=None,
        metavar="FILE",
        rare=True,
    )
    start_pose: str | None = option(
        "first pose: a motion file, FILE#12 for one of its frames, or FILE#8-15 for several",
        default=None,
        metavar="FILE",
        rare=True,
    )
    end_pose: str | None = option(
        "last pose, in the same form as --start-pose", default=None, metavar="FILE", rare=True
    )
    hold: str | None = option(
        "joints to hold in place: 'left_wrist 0.3,1.4,0.4 from 1 to 2; ...' in meters and seconds; "
        "'left_wrist body ...' is relative to the root",
        default=None,
        metavar="WHAT",
        rare=True,
    )

    @property
    def given(self) -> bool:
        """Whether any of these options is given."""
        return any(
            getattr(self, item.name) is not None
            for item in dataclasses.fields(WayOptions)
            if item.name != "pace"
        )
