"""Heads that turn to where a person looks."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.animation import RetargetSettings, retarget
from a2v.animation.life import LifeSettings
from a2v.animation.looking import MOST_YAW, read_look
from a2v.animation.rig import rig_of
from a2v.errors import InputError
from a2v.motion.clips import play_clip


def facing(body, look: str) -> tuple[np.ndarray, np.ndarray]:
    """Yaw and pitch of the face in an idle clip, radians."""
    idle = play_clip("Idle", frames=30, fps=30)
    life = LifeSettings(look=look, sway=0, breath=0)
    moves = retarget(idle, body, settings=RetargetSettings(life=life)).astype(np.float64)
    rig = rig_of(body)
    head = rig.bones["head"]
    face = moves[:, head, :3, :3] @ (rig.rest[head].T @ np.array([0.0, 0.0, 1.0]))
    return np.arctan2(face[:, 0], face[:, 2]), np.arcsin(face[:, 1])


def test_a_head_turns_to_the_side_the_camera_and_a_point(body) -> None:
    left, right = facing(body, "left")[0][15], facing(body, "right")[0][15]
    assert left > np.deg2rad(35)
    assert right < -np.deg2rad(35)
    assert abs(facing(body, "camera")[0]).max() < np.deg2rad(8)
    assert facing(body, "up")[1][15] > np.deg2rad(20) > facing(body, "down")[1][15]
    yaw = facing(body, "3,1.5,3")[0][15]
    assert yaw == pytest.approx(np.pi / 4, abs=np.deg2rad(8))
    assert facing(body, "back")[0][15] < MOST_YAW + np.deg2rad(12)


def test_words_turn_the_head_and_close_the_hands(body) -> None:
    from a2v.motion.plan import plan_motion
    from a2v.motion.timeline import Take

    plan = plan_motion("idle with clenched fists, looking left")
    motion = plan.make(Take(frames=40, fps=30))
    assert motion.provenance["look"] == ["left"]
    assert motion.provenance["hands"] == ["fist"]
    plain = dataclasses.replace(motion, provenance={"told": [True]})
    rig = rig_of(body)
    head = rig.bones["head"]
    turned, ahead = (
        retarget(one, body)[20, head, :3, :3] @ (rig.rest[head].T @ np.array([0.0, 0.0, 1.0]))
        for one in (motion, plain)
    )
    assert turned[0] > ahead[0] + 0.4


def test_other_looks_are_refused() -> None:
    with pytest.raises(InputError, match="look is 'sideways'; expected camera"):
        read_look("sideways")
    with pytest.raises(InputError, match="expected camera"):
        LifeSettings(look="1,2")
