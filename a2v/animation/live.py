"""Drive a rig by a tracked person's joints while they arrive."""

from __future__ import annotations

from collections import deque

import numpy as np

from a2v.animation.life import LifeSettings
from a2v.animation.retarget import RetargetSettings, retarget
from a2v.animation.rig import SIDES, rig_of, sole_points
from a2v.kinematics.from_joints import motion_of_joints
from a2v.kinematics.skeleton import Skeleton
from a2v.types import Body, FloatArray

KEPT = 6
"""Number of past frames over which the limbs' twist is smoothed."""
GROUND_FRAMES = 100
"""Number of past frames from which the height of the ground is estimated."""
STANDS = 0.03
"""Height in meters of the lower foot above the ground up to which it stands."""
_LOW = 0.1
_SETTINGS = RetargetSettings(
    raw=True,
    align=False,
    level="never",
    steps="never",
    smoothing=0.0,
    life=LifeSettings(hands="relaxed", gaze=0.0, breath=0.0, sway=0.0),
)


class LiveRig:
    """A rig that follows joints frame by frame.

    Parameters
    ----------
    body : Body
        Its rest pose stands upright and faces +z.
    skeleton : Skeleton
        Of the joints. It needs feet.
    fps : float
        Usual number of frames per second.
    """

    def __init__(self, body: Body, skeleton: Skeleton, fps: float = 10.0) -> None:
        self.body, self.skeleton, self.fps = body, skeleton, fps
        self._rig = rig_of(body)
        self._joints: deque[FloatArray] = deque(maxlen=KEPT)
        self._lowest: deque[float] = deque(maxlen=GROUND_FRAMES)
        self._start: FloatArray | None = None

    def add(self, joints: FloatArray) -> FloatArray:
        """Return the bones (B, 4, 4) of the next frame, world from bone, meters, ground y = 0.

        Parameters
        ----------
        joints : (J, 3)
            Meters, y up.
        """
        self._joints.append(joints)
        clip = np.stack(self._joints)
        motion = motion_of_joints(clip, self.skeleton, self.fps, action="live")
        transforms = retarget(motion, self.body, settings=_SETTINGS)[-1:].astype(np.float64)
        if self._start is None:
            self._start = transforms[0, 0, :3, 3] * np.array([1.0, 0.0, 1.0])
        transforms[..., :3, 3] -= self._start
        sole = min(sole_points(transforms, self._rig, side)[..., 1].min() for side in SIDES)
        transforms[..., 1, 3] += self._lift(joints) - sole
        return np.asarray(transforms[0])

    def _lift(self, joints: FloatArray) -> float:
        """Return the height of the lower foot above the ground, meters."""
        lowest = float(joints[list(self.skeleton.feet), 1].min())
        self._lowest.append(lowest)
        return max(0.0, lowest - float(np.quantile(self._lowest, _LOW)) - STANDS)
