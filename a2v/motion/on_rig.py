"""Retarget edited motions: contacts are found in the travelling motion, and edits in place are
applied afterwards."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from a2v.animation import RetargetSettings, put_rig_in_place, retarget
from a2v.animation.root_motion import ground_trajectory_of
from a2v.motion.edit import Edit, repeat_loop
from a2v.types import Body, FloatArray, Motion

_PLAIN = RetargetSettings()


def retarget_edited(
    motion: Motion, body: Body, edit: Edit, *, settings: RetargetSettings = _PLAIN
) -> FloatArray:
    """Retarget a motion after all edits except the removal of travel.

    In a motion in place the feet slide. Contacts are therefore found and cleaned in the travelling
    motion, and the travel is removed after that. A cycle is retargeted as the middle one of three
    rounds, so that it closes on the rig too.

    Parameters
    ----------
    motion : Motion
        One clip; with ``edit.loop`` a cycle of `a2v.motion.edit.make_loop`.
    body : Body
    edit : Edit
        Only `loop` and `in_place` count.
    settings : RetargetSettings

    Returns
    -------
    (T, B, 4, 4) float32
        World from bone, meters, y up; the ground is y = 0.

    Raises
    ------
    InputError
        See `a2v.animation.retarget`.
    """
    frames = motion.frames
    if edit.loop:  # breath and sway close with the cycle
        settings = replace(settings, life=replace(settings.life, cycle=frames / motion.fps))
    moves = retarget(repeat_loop(motion, 3) if edit.loop else motion, body, settings=settings)
    if edit.in_place:
        moves = put_rig_in_place(moves, body, motion.fps)
    if not edit.loop:
        return moves
    if not edit.in_place and settings.align:
        first, middle = ground_trajectory_of(moves[[0, frames]], body).transforms()
        moves = (first @ np.linalg.inv(middle)) @ moves
    cycle: FloatArray = moves[frames : 2 * frames].astype(np.float32)
    return cycle
