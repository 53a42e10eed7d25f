"""Motions of a trained baseline for ``a2v sample``, which imports this module by name."""

from __future__ import annotations

from a2v.errors import InputError
from a2v.lab.evaluation.baselines import baseline_motions
from a2v.lab.motion.baselines.training import load_baseline
from a2v.motion.edit import retimed
from a2v.motion.names import find_action
from a2v.motion.timeline import stack_clips
from a2v.types import Motion


def baseline_motion(
    path: str, action: str, *, frames: int | None, fps: float, speed: float, count: int, seed: int
) -> Motion:
    """Generate clips of one action by the baseline in a file of ``a2v train baseline``.

    They are as it generates them: feet are not planted, bones may change. `frames`, at `fps`, cuts
    them; a baseline makes no longer clip than those that it was trained with.

    Raises
    ------
    InputError
        The file holds no baseline, or one without first poses, or it has no such action.
    """
    trained = load_baseline(path)
    if trained.starts is None:
        raise InputError(
            f"{path} was written by an older version, without first poses; train it again (a2v "
            "train baseline), or give it to a2v survey with --dataset and --data"
        )
    label = find_action(action, trained.actions, path)
    clips = baseline_motions(
        trained, trained.starts, trained.actions[label], count=count, seed=seed
    )
    made = retimed(stack_clips(clips) if count > 1 else clips[0], fps=fps, speed=speed)
    return made if frames is None else made.first(min(made.frames, frames))
