"""Make clips window by window: each window continues the last frames of the previous one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import inverse_kinematics
from a2v.kinematics.ground import face_forward, heading
from a2v.motion.beginnings import rests, shifted
from a2v.motion.card import WindowCard
from a2v.motion.crossfade import crossfade, lowest
from a2v.motion.growing import GrowingClips
from a2v.motion.sampling import (
    RESULTS,
    ClipRequest,
    WindowRequest,
    checked_results,
    join_start,
    normal_noise,
)
from a2v.motion.steer import CodeReader, Steerer, Steering
from a2v.sessions import run_file
from a2v.types import FloatArray, IntArray

CHANGE_SECONDS = 0.25
"""Seconds over which one action fades into the next."""

SHORT_SHARE = 0.3
"""Share of a window below which the median clip of an action is short, such as a person who runs
through the laboratory in at most three seconds."""

ENDING_FRAMES = 2
"""Number of frames at the end of a window in which the motion comes to rest. They are dropped if
another window continues it."""

BROKEN = 20
"""The shortest 1/20 of an action's clips are never drawn: among longer clips they are mostly
recordings that broke off (a walk of HumanAct12 jumps at 36 m/s, and the model repeats it if that
length is requested). `export/sample.py` and the page do the same."""

LOGISTIC = 1.702
"""The logistic function of a normal number times this is uniform over [0, 1], to within 0.01.
`export/sample.py` and the page can compute it, too."""


@dataclass(frozen=True)
class WindowSampler:
    """Makes whole windows, each of which continues the last frames of the previous one."""

    path: Path
    card: WindowCard

    def active_shares(self, label: int) -> FloatArray:
        """Return the fractions (n,) of a window in which the data's clips of an action move.

        Raises
        ------
        InputError
            The data has no clip of the action.
        """
        shares = self.card.active[label]
        if not len(shares):
            raise InputError(
                f"{self.path.name} was not trained on clips of '{self.card.actions[label]}'; "
                "choose another action"
            )
        return shares

    def active_share(self, label: int) -> float:
        """Return the default fraction of a window in which an action moves: the 90 % quantile of
        `active_shares`, or their median for short clips.

        Long clips among mostly short ones show something else: people who slow down and stop
        (docs/results/motion_direction.md).
        """
        shares = self.active_shares(label)
        middle = float(shares[(len(shares) - 1) // 2])
        return middle if middle < SHORT_SHARE else float(shares[int(0.9 * (len(shares) - 1))])

    def drawn_shares(self, label: IntArray, noise: FloatArray, *, following: bool) -> FloatArray:
        """Draw the fractions of a window (N,) float32 in which clips of actions (N,) move, from
        `active_shares`.

        The last number of their `noise` (N, Z) selects them: it is the noise of the code's least
        coefficient, so that nothing else depends on it. A window that continues another gets one of
        the longer half, so that a clip continues instead of starting repeatedly.
        """
        u = 1 / (1 + np.exp(-LOGISTIC * noise[:, -1].astype(np.float64)))
        drawn = np.zeros(len(label), np.float32)
        for action in np.unique(label):
            shares, own = self.active_shares(int(action)), label == action
            first = len(shares) // (2 if following else BROKEN)
            drawn[own] = shares[first + (u[own] * (len(shares) - first)).astype(np.int64)]
        return drawn

    def run(
        self,
        labels: IntArray,
        *,
        active: FloatArray,
        noise: FloatArray,
        lengths: FloatArray,
        context: FloatArray | None = None,
        steering: Steering | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Generate one window: joints (meters, first root at the origin) and rotations (N, W, J, 3)
        float32.

        Parameters
        ----------
        labels : (N,) int
        active : (N,) float
            Fraction of the window that is in motion.
        noise : (N, Z) float
        lengths : (N, J) float
            Native units.
        context : (N, P, J, 3) float or None
            Frames that the window repeats at its start and continues, meters.
        steering : Steering or None
            Constraints for all of the windows.
        """
        count = len(labels)
        given = (
            np.zeros((count, self.card.context_frames, lengths.shape[1], 3), np.float32)
            if context is None
            else context
        )
        feed: dict[str, np.ndarray] = {
            "noise": np.asarray(noise, dtype=np.float32),
            "actions": np.asarray(labels, dtype=np.int64),
            "active": np.asarray(active, dtype=np.float32),
            "context": np.asarray(given, dtype=np.float32),
            "has_context": np.full(count, context is not None, dtype=np.float32),
            "bone_lengths": np.asarray(lengths, dtype=np.float32),
        }
        made = run_file(self.path, RESULTS, feed, None if steering is None else steering.feed())
        return checked_results(
            self.path, made, (count, self.card.window_frames, lengths.shape[1], 3)
        )

    def reader(self, lengths: FloatArray) -> CodeReader:
        """Return the linear map from the codes of this model to the joints of a body with bones of
        `lengths` (J,), native units.

        Raises
        ------
        InputError
            The model takes no constraints.
        """
        card = self.card
        if not card.steerable:
            raise InputError(
                f"{self.path.name} cannot be directed; choose a model that can, such as cmu-fine"
            )
        shapes = {
            "context": (1, card.context_frames, len(lengths), 3),
            "noise": (1, card.latent_size),
            "bone_lengths": (1, len(lengths)),
        }
        feed: dict[str, np.ndarray] = {
            name: np.zeros(shape, np.float32) for name, shape in shapes.items()
        }
        feed |= {
            "active": np.ones(1, np.float32),
            "has_context": np.zeros(1, np.float32),
            "actions": np.zeros(1, np.int64),
        }
        basis, mean = run_file(self.path, ["basis", "mean"], feed)
        return CodeReader(
            basis=basis.astype(np.float64),
            mean=mean.astype(np.float64),
            skeleton=card.skeleton,
            lengths=np.asarray(lengths, np.float64) * card.meters_per_unit,
            meters_per_unit=card.meters_per_unit,
            frames=card.window_frames,
        )

    def generate(self, request: ClipRequest) -> tuple[FloatArray, FloatArray]:
        """See `Sampler`. Windows are generated until all frames exist, each with new noise.

        The moving time of each window of each clip is drawn (`drawn_shares`), so that the clips of
        a batch continue independently; with a steerer it is `active_share`. A window continues the
        last frames of the previous one. At a change of the action, the next window can start
        `fresh`, and the previous one fades into it (`crossfade`).
        """
        labels, steerer = request.labels, request.steerer
        count, frames = labels.shape
        changes = np.flatnonzero((labels[:, 1:] != labels[:, :-1]).any(axis=0)) + 1
        done = GrowingClips.empty(
            count, frames, len(self.card.joint_names), max(2, round(CHANGE_SECONDS * self.card.fps))
        )
        if request.start is not None:
            begun = join_start(
                request.start, request.start[:, :0], request.start[:, :0], self.card.skeleton
            )
            done.add(np.arange(count), *begun, np.full(count, request.start.shape[1]))
        for end in [*changes, frames]:
            begins = request.fresh and int(done.at.min()) in changes
            while (rows := np.flatnonzero(done.at < end)).size:
                window = self._next_window(request, done, rows, end, begins=begins)
                known, left = window.known, end - done.at[rows]
                if steerer is None:
                    new, rotated, usable = window.make()
                    usable = usable if request.skip_rest else window.usable
                else:
                    usable = window.usable
                take = np.where(
                    left <= usable - known,
                    left,
                    np.maximum(usable - ENDING_FRAMES, self.card.context_frames + 4) - known,
                )
                if steerer is not None:
                    begun_at = int(done.at[rows].min())
                    take = np.array([steerer.until(begun_at, begun_at + int(take[0])) - begun_at])
                    new, rotated = _guided(
                        window, steerer, done.joints[:, :begun_at], take=int(take[0])
                    )
                done.add(rows, new[:, known:], rotated[:, known:], take)
                begins = False
        return done.joints, done.rotations

    def _next_window(
        self, request: ClipRequest, done: GrowingClips, rows: IntArray, end: int, *, begins: bool
    ) -> _Window:
        """Return the next window of the clips `rows`, up to frame `end`; one that `begins` fades in
        from the discarded frames."""
        given, begun = self.card.context_frames, int(done.at[rows].min())
        follows = begun > 0 and not begins
        noise = request.noise((len(request.labels), self.card.latent_size), begun)[rows]
        label = request.labels[rows, end - 1]
        if request.steerer is None:
            share = self.drawn_shares(label, noise, following=follows)
        else:
            share = np.array([self.active_share(int(action)) for action in label], np.float32)
        return _Window(
            sampler=self,
            label=label,
            share=share,
            noise=noise,
            lengths=request.lengths[rows],
            usable=np.maximum(
                np.round(share * self.card.window_frames).astype(np.int64), given + 4
            ),
            skip_rest=request.skip_rest and request.steerer is None,
            context=done.last(rows, given) if follows else None,
            before=(done.joints[:, :begun], done.ahead) if begins else None,
        )

    def generate_like_data(
        self, request: WindowRequest, generator: np.random.Generator
    ) -> FloatArray:
        """See `Sampler`. The moving time of each clip is drawn from the data's distribution for its
        action."""
        if request.frames > self.card.window_frames:
            raise InputError(
                f"{self.path.name} makes windows of {self.card.window_frames} frames; "
                f"{request.frames} were requested"
            )
        active, headings = request.active, request.headings
        if active is None:
            active = np.array(
                [generator.choice(self.active_shares(int(label))) for label in request.labels]
            )
        noise = normal_noise(generator, request.noise_scale)(
            (len(request.labels), self.card.latent_size), 0
        )
        joints = self.run(request.labels, active=active, noise=noise, lengths=request.lengths)[0][
            :, : request.frames
        ]
        if not self.card.headings:
            return joints
        if headings is None:
            headings = np.array(
                [generator.choice(self.card.headings[int(label)]) for label in request.labels]
            )
        turned: FloatArray = face_forward(
            joints, np.stack([np.cos(headings), -np.sin(headings)], axis=-1)
        ).astype(np.float32)
        return turned


@dataclass
class _Window:
    """A window that can be generated several times, with different constraints.

    Attributes
    ----------
    label, share, usable : (n,)
        Action, fraction of the window in motion, and the number of these frames.
    noise : (n, Z) float32, lengths : (n, J) float32
    skip_rest : bool
        Leave out the rest at the beginning, if no frames come before.
    context : (n, P, J, 3) or None
        Frames that the window continues.
    before : two arrays (n, S, J, 3), (n, F, J, 3), or None
        The previous frames and the discarded ones after them, if the window fades in (see
        `crossfade`).
    lift : (n,) or None
        Shift of the first generation to the height of the previous frames. Later generations get
        the same shift, or constraints on heights would be undone.
    """

    sampler: WindowSampler
    label: IntArray
    share: FloatArray
    noise: FloatArray
    lengths: FloatArray
    usable: IntArray
    skip_rest: bool
    context: FloatArray | None
    before: tuple[FloatArray, FloatArray] | None
    lift: FloatArray | None = None

    @property
    def known(self) -> int:
        """Number of first frames that repeat the context."""
        return 0 if self.context is None else self.sampler.card.context_frames

    def make(self, steering: Steering | None = None) -> tuple[FloatArray, FloatArray, IntArray]:
        """Generate joints and rotations (n, W, J, 3) at their positions, and the number of frames
        (n,) that move."""
        card = self.sampler.card
        new, rotated = self.sampler.run(
            self.label,
            active=self.share,
            noise=self.noise,
            lengths=self.lengths,
            context=self.context,
            steering=steering,
        )
        moving = self.usable if self.skip_rest else np.full(len(new), card.window_frames)
        if self.context is not None:
            return new + self.context[:, :1, :1], rotated, moving
        if self.skip_rest:
            skip = np.minimum(
                rests(new, card.fps, self.usable),
                np.maximum(self.usable - card.context_frames - 4, 0),
            )
            new, rotated = shifted(new, skip), shifted(rotated, skip)
            new, moving = new - new[:, :1, :1], self.usable - skip
        if self.before is not None:
            if self.lift is None:
                self.lift = lowest(self.before[0][:, -new.shape[1] :]) - lowest(new)
            new = crossfade(*self.before, new, card.skeleton, self.lift)
            rotated = inverse_kinematics(new, card.skeleton).astype(np.float32)
        return new, rotated, moving


def _guided(
    window: _Window, steerer: Steerer, joints: FloatArray, *, take: int
) -> tuple[FloatArray, FloatArray]:
    """Generate the `window` after `joints` (1, T, J, 3) with the constraints of `steerer`; its
    known frames are the last of `joints`."""
    known, skeleton = window.known, window.sampler.card.skeleton
    first = joints.shape[1] - known
    place, yaw = steerer.start
    if joints.shape[1]:
        at = min(first, joints.shape[1] - 1)
        place, yaw = joints[0, at, 0].astype(np.float64), float(heading(joints[0, at], skeleton))
    asking = steerer.window(first, (known, known + take), place, yaw)
    steering = next(asking)
    while True:
        new, *_ = window.make(steering)
        new = new if joints.shape[1] else steerer.begin(new)
        try:
            steering = asking.send(new[0].astype(np.float64))
        except StopIteration:
            return new, inverse_kinematics(new, skeleton).astype(np.float32)
