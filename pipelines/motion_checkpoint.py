"""Motions of a checkpoint of the laboratory for ``a2v motion --model FILE.pt``."""

from __future__ import annotations

import importlib
from collections.abc import Sequence

from a2v.errors import InputError
from a2v.types import Motion
from pipelines.requests.motion import PlanOptions, length_of

LABORATORY = "pipelines.lab.baseline_motion"
"""Module that samples checkpoints, imported by name: commands know no laboratory."""


def motion_of_checkpoint(
    plan: PlanOptions, speed: float, count: int, others: Sequence[str]
) -> Motion:
    """Generate `count` clips of one action, `speed` times as fast, by the file of
    ``a2v train baseline`` that the plan names; `others` are options that were given too.

    Raises
    ------
    InputError
        Other options, no action or an unknown one, or the file cannot be used.
    """
    more = [*others, *(["timeline"] if plan.timeline is not None else [])]
    if more:
        raise InputError(f"{more[0]} cannot be given with a baseline's checkpoint; leave it out")
    if not plan.action:
        raise InputError("no action given; name one with --action")
    cut = plan.frames is not None or plan.seconds is not None
    made: Motion = importlib.import_module(LABORATORY).baseline_motion(
        plan.model,
        plan.action,
        frames=length_of(frames=plan.frames, seconds=plan.seconds, fps=plan.fps) if cut else None,
        fps=plan.fps,
        speed=speed,
        count=count,
        seed=plan.seed,
    )
    return made
