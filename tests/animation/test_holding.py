"""Hands hold the rungs, rails and bars that the person climbs."""

from __future__ import annotations

import numpy as np

from a2v.animation import RetargetSettings, retarget
from a2v.animation.curves import runs, speed_of
from a2v.animation.footing import find_props
from a2v.animation.holding import LEAST_SECONDS, SLOW, axes_of, nearest_on, palm_of
from a2v.animation.rig import SIDES, rig_of
from a2v.motion import MotionModel
from a2v.motion.direct import make_motion
from a2v.motion.prompts import Step
from a2v.motion.timeline import Take
from a2v.props import Props, box, rod
from a2v.types import Body


def test_the_axis_of_a_rod_is_found_and_boxes_are_not_held() -> None:
    ends = np.array([[-0.3, 1.0, 0.2], [0.3, 1.0, 0.2]])
    props = Props.of([("rung", rod(*ends, 0.02)), ("step", box(np.zeros(3), np.ones(3)))])
    (found,) = axes_of(props)
    np.testing.assert_allclose(found[found[:, 0].argsort()], ends, atol=1e-5)
    np.testing.assert_allclose(nearest_on(found[None], np.array([0.1, 2, 0.2]))[0], [0.1, 1, 0.2])


def test_resting_hands_are_on_rungs_of_a_ladder_and_arms_keep_their_lengths(body: Body) -> None:
    motion = make_motion(
        MotionModel.load("cmu-fine"), [Step(action="Climb a ladder")], Take(frames=120, fps=30)
    )
    rig = rig_of(body)
    moves = retarget(motion, body).astype(np.float64)
    free = retarget(motion, body, settings=RetargetSettings(steps="never")).astype(np.float64)
    lines = axes_of(find_props(moves, body, motion.fps))
    assert len(lines)
    held = []
    for side in SIDES:
        palm = palm_of(moves, rig, side)
        for start, end in runs(speed_of(palm, motion.fps) < 0.5 * SLOW):
            if end - start > LEAST_SECONDS * motion.fps:
                for point in palm[start:end]:
                    held.append(np.linalg.norm(nearest_on(lines, point) - point, axis=-1).min())
        for a, b in (("shoulder", "elbow"), ("elbow", "wrist")):
            sizes = [
                np.linalg.norm(
                    m[:, rig.bones[f"{side}_{a}"], :3, 3] - m[:, rig.bones[f"{side}_{b}"], :3, 3],
                    axis=-1,
                )
                for m in (moves, free)
            ]
            np.testing.assert_allclose(sizes[0], sizes[1], atol=1e-4)
    assert len(held) > 30
    assert np.mean(np.array(held) < 0.02) > 0.6
