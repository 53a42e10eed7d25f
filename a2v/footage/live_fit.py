"""Fit a body to the frames of a camera while they arrive, each from the past frames only."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from a2v.body.fit import one_thread
from a2v.footage.figure import Figure
from a2v.footage.fit import FilmFit
from a2v.footage.live_terms import Costs, LiveFigure, Pose, Recent
from a2v.footage.modes import steady_depths
from a2v.footage.settings import FollowSettings
from a2v.footage.starts import starts
from a2v.footage.track import Track, track_of
from a2v.footage.tracking import Sighting
from a2v.types import FloatArray

WARMING = 8
"""Number of frames from which the shape and the tilt of the camera are estimated."""
REMEMBERED = 16
"""Number of past frames that choose the signs of depths and the person's height."""
STEPS = 4
"""Steps of Gauss and Newton per frame."""
FIRST_STEPS = 20
"""The same without an earlier frame."""
LOST = 1.0
"""Time in seconds without the person after which the pose is found again."""
RETRIED = 5
"""Number of frames after which the most similar recorded pose is tried as a start."""
_DAMPING = 1e-5
_WORST_DAMPING = 1e4


@dataclass(frozen=True, kw_only=True)
class LivePose:
    """A body in one frame, in the world: y up, the camera at the origin, looking along -z.

    Attributes
    ----------
    time : float
        Seconds.
    joints : (J, 3)
        `a2v.footage.figure.JOINTS`, meters.
    """

    time: float
    joints: FloatArray


class LiveFit:
    """Fits a body to one sighting after another.

    The first `WARMING` sightings give the shape and the tilt of the camera as in `FilmFit`. Then
    the pose of each frame minimizes the terms of `FilmFit` in which the two poses before it are
    fixed, by the method of Levenberg and Marquardt with analytic derivatives.

    Parameters
    ----------
    size : pair of int
        Width and height of the frames, pixels.
    settings : FollowSettings, optional
        `height`, `lens` and `acceleration` are used.
    """

    def __init__(self, size: tuple[int, int], settings: FollowSettings | None = None) -> None:
        self.size = size
        self.settings = replace(settings or FollowSettings(), camera="still")
        self.film = FilmFit(self.settings)
        self._past: deque[Sighting] = deque(maxlen=REMEMBERED)
        self._figure: LiveFigure | None = None
        self._plain: Figure | None = None
        self._tilt = 0.0
        self._poses: list[Pose] = []
        self._recent = Recent()
        self._count, self._unseen = 0, False

    @property
    def ready(self) -> bool:
        """Whether the shape and the tilt are known."""
        return self._figure is not None

    @one_thread()
    def add(self, sighting: Sighting) -> LivePose | None:
        """Return the pose of the next frame; None until `ready` and if nobody is seen."""
        if sighting.keypoints is None:
            self._unseen = True
            return None
        if self._unseen and self._past and sighting.time - self._past[-1].time > LOST:
            self._past.clear()
            self._poses.clear()
            self._recent.clear()
        self._unseen = False
        self._past.append(sighting)
        track = track_of(list(self._past), self.size, self.settings)
        points = steady_depths(
            track.points, track.pixels, track.heights, track.times, track.weights
        )
        if self._figure is None:
            if len(self._past) < WARMING:
                return None
            self._calibrate(track, points)
        return self._fit(track.part(slice(-1, None)), points[-1:])

    def _calibrate(self, track: Track, points: FloatArray) -> None:
        import torch

        bank = starts(track, points, self.film.model)
        shape, self._tilt = self.film._calibrated(track, points, bank)
        self._plain = Figure(self.film.model, torch.from_numpy(shape))
        self._figure = LiveFigure(self._plain)

    def _fit(self, track: Track, points: FloatArray) -> LivePose:
        figure = self._figure
        assert figure is not None
        time = float(track.times[-1])
        costs = Costs(figure, track, points, tilt=self._tilt, film=self.film, recent=self._recent)
        if self._poses:
            best = descend(costs, self._poses[-1], STEPS)
            if self._count % RETRIED == 0:
                other = descend(costs, self._similar(track, points), STEPS)
                best = min(best, other, key=lambda one: one[1])
        else:
            best = descend(costs, self._similar(track, points), FIRST_STEPS)
        self._count += 1
        pose = best[0]
        joints = figure.joints(pose)
        self._poses = [pose]
        self._recent.add(time, joints)
        return LivePose(time=time, joints=joints)

    def _similar(self, track: Track, points: FloatArray) -> Pose:
        """Return the most similar recorded pose at the person's place."""
        assert self._plain is not None
        root, angles = starts(track, points, self.film.model)
        place = self.film._places(track, root, angles, self._plain, self._tilt)
        return Pose(root[0], angles[0], place[0])


def descend(costs: Costs, pose: Pose, steps: int) -> tuple[Pose, float]:
    """Return a pose of lower cost, and the cost (Levenberg 1944, Marquardt 1963)."""
    damping = _DAMPING
    cost, gradient, curvature = costs.at(pose)
    for _ in range(steps):
        while damping < _WORST_DAMPING:
            scaled = curvature + damping * np.diag(np.diagonal(curvature) + 1.0)
            moved = pose.moved(-np.linalg.solve(scaled, gradient))
            lower = costs.at(moved)
            if lower[0] < cost:
                pose, (cost, gradient, curvature) = moved, lower
                damping = max(damping / 10, 1e-6)
                break
            damping *= 10
        else:
            break
    return pose, cost
