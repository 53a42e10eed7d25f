"""Fit one body to a piece of film, window by window, with a prior on joint motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import gaussian_filter1d

from a2v.body.anny import AnnyModel
from a2v.body.fit import one_thread
from a2v.body.lbfgs import minimize
from a2v.body.pose_prior import load_pose_prior
from a2v.body.pose_space import pose_space
from a2v.body.registry import load_body_model
from a2v.body.terms import likely_pose, outside
from a2v.footage.figure import NAMES, Figure
from a2v.footage.settings import FollowSettings
from a2v.footage.starts import bridged, smooth_turns, smoother, starts
from a2v.footage.terms import Evidence, Stands, acceleration, footing, pseudo_huber
from a2v.footage.track import Track
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.kinematics.so3 import rotvec_to_rotmat
from a2v.types import FloatArray, IntArray, Progress

if TYPE_CHECKING:
    from torch import Tensor

FIXED = 6
"""Number of fixed frames before a window, so that it continues from them."""
AGAIN = 14
"""Number of last frames of a window that are fitted again in the next window."""
SAMPLED = 24
"""Number of frames from which the shape and the tilt of the camera are estimated."""
HELD = (1.35, 0.35)
"""Usual height of a camera above the ground and its standard deviation, meters."""
_POSE_WEIGHT = 0.3
_SMOOTH_WEIGHT = 0.6
_TURNS = 120.0
"""Usual acceleration of an angle, radians per square second."""
_ANGLE_WEIGHT = 0.1
_SCALES = (0.3, 0.3, 0.1)
"""Usual sizes of changes of orientation and angles, radians, and of places, meters."""
_EVEN = 2.0
"""Standard deviation in frames with which the initial values are smoothed."""


@dataclass(frozen=True, kw_only=True)
class Moves:
    """A body in every frame of a piece, in the world: y up, the first frame's camera at the origin,
    looking along -z.

    Attributes
    ----------
    joints : (T, J, 3)
        `a2v.footage.figure.JOINTS`, meters.
    landmarks : (T, 33, 3)
    wrists : (T, 2, 3, 3)
        Rotations of the left and the right wrist from the rest pose, in the world.
    shape : (S,)
        Of the body, the same in all frames.
    tilt : float
        Angle by which the camera looks down in the first frame, radians.
    """

    joints: FloatArray
    landmarks: FloatArray
    wrists: FloatArray
    shape: FloatArray
    tilt: float


@dataclass(eq=False)
class _Unknowns:
    """Rotation vectors (T, 3) from `base` (T, 3, 3), angles (T, D) and places (T, 3) of the
    body."""

    base: Tensor
    root: Tensor
    angles: Tensor
    place: Tensor

    def rotmats(self) -> Tensor:
        turned: Tensor = rotvec_to_rotmat(self.root) @ self.base
        return turned


class FilmFit:
    """Fits a body to tracks of a film."""

    def __init__(self, settings: FollowSettings):
        """Load the body model."""
        self.settings = settings
        self.model: AnnyModel = load_body_model()
        self.space = pose_space(self.model)
        self.prior = load_pose_prior()
        import torch

        self._limits = torch.from_numpy(self.space.limits.astype(np.float64))

    @one_thread()
    def fit(
        self,
        track: Track,
        points: FloatArray,
        *,
        stands: Stands | None = None,
        start: Moves | None = None,
        progress: Progress | None = None,
    ) -> Moves:
        """Fit the body in every frame.

        Parameters
        ----------
        track : Track
        points : (T, 33, 3)
            Its 3D landmarks with steady depths (`a2v.footage.modes.steady_depths`).
        stands : Stands, optional
            Contacts of the feet. Feet in contact must neither move nor leave the ground.
        start : Moves, optional
            An earlier fit whose shape and tilt are kept.
        progress : Progress, optional
            Counts frames.
        """
        import torch

        bank = starts(track, points, self.model)
        shape, tilt = (
            (start.shape, start.tilt)
            if start is not None
            else self._calibrated(track, points, bank)
        )
        figure = Figure(self.model, torch.from_numpy(shape))
        slope = torch.tensor(tilt, dtype=torch.float64)
        root, angles = (
            smooth_turns(bank[0], _EVEN),
            gaussian_filter1d(bank[1], _EVEN, axis=0, mode="nearest"),
        )
        place = gaussian_filter1d(
            self._places(track, root, angles, figure, tilt), _EVEN, axis=0, mode="nearest"
        )
        window, done = self.settings.window, 0
        joints, landmarks = np.zeros((track.frames, len(NAMES), 3)), np.zeros((track.frames, 33, 3))
        wrists = np.zeros((track.frames, 2, 3, 3))
        while done < track.frames:
            first = max(0, done - FIXED)
            end = min(track.frames, done + window)
            end = track.frames if track.frames - end < AGAIN else end
            part = slice(first, end)
            held = None if stands is None else (torch.from_numpy(stands.held[part]), stands.ground)
            unknowns = self._window(
                track.part(part),
                points[part],
                (root[part], angles[part], place[part]),
                figure,
                slope,
                done - first,
                held,
            )
            with torch.no_grad():
                turns, heads = figure.pose(unknowns.rotmats(), unknowns.angles, unknowns.place)
                joints[part], landmarks[part] = (
                    figure.joints(turns, heads).numpy(),
                    figure.landmarks(turns, heads).numpy(),
                )
                wrists[part] = turns[:, figure.wrists].numpy()
                root[part], angles[part], place[part] = (
                    turns[:, 0].numpy(),
                    unknowns.angles.numpy(),
                    unknowns.place.numpy(),
                )
            done = end if end == track.frames else end - AGAIN
            if progress is not None:
                progress(done, track.frames)
        return Moves(joints=joints, landmarks=landmarks, wrists=wrists, shape=shape, tilt=tilt)

    def _window(
        self,
        track: Track,
        points: FloatArray,
        start: tuple[FloatArray, FloatArray, FloatArray],
        figure: Figure,
        tilt: Tensor,
        kept: int,
        held: tuple[Tensor, float] | None,
    ) -> _Unknowns:
        """Minimize the cost over the unknowns of a window. The first `kept` frames do not
        change."""
        import torch

        evidence = Evidence(track, points)
        count = track.frames - kept
        easy = torch.from_numpy(smoother(count))
        base = torch.from_numpy(start[0].copy())
        begun = [
            torch.zeros((track.frames, 3), dtype=torch.float64),
            *(torch.from_numpy(values.copy()) for values in start[1:]),
        ]
        free = [torch.zeros_like(values[kept:]).requires_grad_() for values in begun]

        def unknowns() -> _Unknowns:
            changed = [
                torch.cat([before[:kept], before[kept:] + scale * (easy @ now)])
                for before, now, scale in zip(begun, free, _SCALES, strict=True)
            ]
            return _Unknowns(base, *changed)

        def loss() -> Tensor:
            now = unknowns()
            turns, heads = figure.pose(now.rotmats(), now.angles, now.place)
            joints, marks = figure.joints(turns, heads), figure.landmarks(turns, heads)
            cost = self._cost(now, evidence, marks, tilt) + self._smoothness(
                joints, now.angles, track.times
            )
            return cost if held is None else cost + footing(joints, marks, track.times, held)

        minimize(loss, free, steps=self.settings.steps, history=12, tolerance=1e-6)
        found = unknowns()
        return _Unknowns(
            found.base, *(values.detach() for values in (found.root, found.angles, found.place))
        )

    def _cost(self, now: _Unknowns, evidence: Evidence, marks: Tensor, tilt: Tensor) -> Tensor:
        cost = (
            evidence.seen(marks, tilt).sum()
            + outside(now.angles, self._limits, tolerance=0.03).sum()
        )
        return cost + 2.0 * _POSE_WEIGHT * likely_pose(now.angles, self.prior).sum()

    def _smoothness(self, joints: Tensor, angles: Tensor, times: FloatArray) -> Tensor:
        """Cost of accelerations: quadratic for usual ones and linear beyond, so that hits and kicks
        are kept."""
        cost = (
            _SMOOTH_WEIGHT
            * pseudo_huber(
                acceleration(joints, times).square().sum(-1) / self.settings.acceleration**2
            ).sum()
        )
        return (
            cost
            + _ANGLE_WEIGHT * pseudo_huber(acceleration(angles, times).square() / _TURNS**2).sum()
        )

    # --- start values

    def _calibrated(
        self, track: Track, points: FloatArray, bank: tuple[FloatArray, FloatArray]
    ) -> tuple[FloatArray, float]:
        """Estimate the body's shape (S,) and the tilt of the camera from a sample of frames."""
        import torch

        sure = np.flatnonzero(track.seen)
        order = sure[np.argsort(-track.weights[sure].sum(axis=1), kind="stable")][
            : max(SAMPLED, len(sure) // 2)
        ]
        order = np.sort(order)
        chosen: IntArray = order[
            np.unique(np.linspace(0, len(order) - 1, SAMPLED).round().astype(int))
        ]
        part, own = track.part(chosen), points[chosen]
        evidence = Evidence(part, own)
        shape = torch.from_numpy(self.model.shape_default.astype(np.float64)).requires_grad_()
        tilt = torch.tensor(
            _believed_tilt(part, self.settings.height), dtype=torch.float64
        ).requires_grad_()
        figure = Figure(self.model, shape.detach())
        root, angles = bank[0][chosen], bank[1][chosen]
        place = self._places(part, root, angles, figure, float(tilt.detach()))
        base = torch.from_numpy(root)
        free = [torch.zeros((len(chosen), 3), dtype=torch.float64).requires_grad_()]
        free += [torch.from_numpy(values).requires_grad_() for values in (angles.copy(), place)]
        bounds, mean = (
            torch.from_numpy(self.model.shape_bounds.astype(np.float64)),
            torch.from_numpy(self.model.shape_default.astype(np.float64)),
        )
        extent = self._extent()

        def loss() -> Tensor:
            now = _Unknowns(base, *free)
            body = Figure(self.model, shape)
            turns, heads = body.pose(now.rotmats(), now.angles, now.place)
            marks = body.landmarks(turns, heads)
            tall = self.model.rest(shape, extent)[0][:, 1]
            build = ((shape - mean) / 0.25).square().sum() + (
                (tall[0] - tall[1] - self.settings.height) / 0.03
            ).square()
            ground = (
                marks[:, [LANDMARK_INDEX[f"{side}_heel"] for side in ("left", "right")], 1]
                .min(dim=1)
                .values.median()
            )
            camera = ((-ground - HELD[0]) / HELD[1]).square() + (tilt / 0.3).square()
            return (
                self._cost(now, evidence, marks, tilt)
                + 4 * build
                + outside(shape, bounds, tolerance=0.02)
                + 3 * camera
            )

        minimize(loss, [*free, shape, tilt], steps=100, history=20, tolerance=1e-6)
        return shape.detach().numpy().copy(), float(tilt.detach())

    def _extent(self) -> Tensor:
        """Indices of the highest and the lowest vertex."""
        import torch

        rest = self.model.rest(torch.from_numpy(self.model.shape_default))[0]
        return torch.stack([rest[:, 1].argmax(), rest[:, 1].argmin()])

    def _places(
        self, track: Track, root: FloatArray, angles: FloatArray, figure: Figure, tilt: float
    ) -> FloatArray:
        """Return the positions (T, 3) at which the hips project to their pixels, at the distance
        that follows from the person's height."""
        import torch

        with torch.no_grad():
            turns, heads = figure.pose(
                torch.from_numpy(root),
                torch.from_numpy(angles),
                torch.zeros(track.frames, 3, dtype=torch.float64),
            )
            marks = figure.landmarks(turns, heads).numpy()
        hips = [LANDMARK_INDEX["left_hip"], LANDMARK_INDEX["right_hip"]]
        trunk = [*hips, LANDMARK_INDEX["left_shoulder"], LANDMARK_INDEX["right_shoulder"]]
        away = track.focal * self.settings.height / track.heights
        middle = track.pixels[:, trunk].mean(axis=1) / track.focal
        down = tilt + track.tilt
        right, up, ahead = middle[:, 0] * away, -middle[:, 1] * away, away
        y = up * np.cos(down) - ahead * np.sin(down)
        z = -ahead * np.cos(down) - up * np.sin(down)
        cosine, sine = np.cos(track.yaw), np.sin(track.yaw)
        world = np.stack([cosine * right + sine * z, y, -sine * right + cosine * z], axis=-1)
        world = bridged(world, track)
        placed: FloatArray = world - marks[:, trunk].mean(axis=1)
        return placed


def _believed_tilt(track: Track, height: float) -> float:
    """Return the angle in radians by which the camera looks down, if it has the usual height and
    the person stands on level ground."""
    away = float(np.median(track.focal * height / track.heights))
    heels = track.pixels[:, [LANDMARK_INDEX[f"{side}_heel"] for side in ("left", "right")], 1].max(
        axis=1
    )
    below = np.arctan2(HELD[0], away)
    return float(np.clip(np.median(below - np.arctan2(heels, track.focal) - track.tilt), -0.5, 0.5))
