"""Poses of the people in a scene, drawn from several sources."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.frames import MotionFrames
from a2v.lab.studio.posing import Pose, PoseLibrary, joint_noise, natural_pose, open_pose
from a2v.lab.studio.settings import StudioSettings
from a2v.lab.studio.stances import draw_stance


@dataclass(frozen=True, eq=False)
class PoseSource:
    """Sources of poses.

    Attributes
    ----------
    library : PoseLibrary
        Poses from recorded actions.
    frames : MotionFrames, optional
        All frames of the recordings. If given, poses from actions are drawn from these instead.
    varied : callable, optional
        Function that draws the poses of ``settings.varied``.
    stance : str
        Class of `STANCES` that replaces all other poses; "" for none.
    """

    library: PoseLibrary
    frames: MotionFrames | None = None
    varied: Callable[[np.random.Generator], Pose] | None = None
    stance: str = ""


def draw_pose(
    poses: PoseSource, avatar: Avatar, settings: StudioSettings, generator: np.random.Generator
) -> tuple[Pose, str, float]:
    """Draw a pose for an avatar; returns the pose, its name, and the turn about the vertical,
    degrees."""
    if poses.stance:
        pose, yaw = draw_stance(poses.stance, generator)
        return pose, poses.stance, yaw
    if poses.varied is not None and generator.random() < settings.varied:
        pose, name = poses.varied(generator), "varied"
    else:
        recorded = partial(poses.frames.draw, avatar) if poses.frames else None
        pose, name = _common_pose(poses.library, settings, generator, recorded)
    return (
        pose,
        name,
        float(
            generator.normal(0, settings.yaw)
            if generator.random() < settings.facing
            else generator.uniform(-180, 180)
        ),
    )


def _common_pose(
    library: PoseLibrary,
    settings: StudioSettings,
    generator: np.random.Generator,
    recorded: Callable[[np.random.Generator], tuple[Pose, str]] | None,
) -> tuple[Pose, str]:
    """Draw a pose from an action, between A and T, or a natural one; returns it and its name."""
    kind = generator.random()
    if kind < settings.actions and recorded:
        pose, name = recorded(generator)
    elif kind < settings.actions:
        index = int(generator.integers(len(library.actions)))
        pose, name = library.pose(index), library.actions[index]
    elif kind < settings.actions + settings.open:
        pose, name = open_pose(generator), "open"
    else:
        pose, name = natural_pose(generator), "natural"
    return joint_noise(pose, generator), name
