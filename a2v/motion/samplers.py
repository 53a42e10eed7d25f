"""Two ways in which an exported graph makes clips: frame by frame, and window by window."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import Skeleton, bone_vectors, inverse_kinematics
from a2v.kinematics.ground import face_forward, heading
from a2v.motion.beginnings import rests, shifted
from a2v.motion.card import STATE_NAMES, StepCard, WindowCard
from a2v.motion.steer import CodeReader, Guide, Steering
from a2v.sessions import open_session, run_rows
from a2v.types import FloatArray, IntArray

Noise = Callable[[tuple[int, ...], int], FloatArray]
"""Gives standard normal numbers (float32) of a shape, for what begins with a frame of the clips."""

CHANGE_SECONDS = 0.25
"""Over which one action fades into another."""

SHORT_SHARE = 0.3
"""Share of a window under which the middle clip of an action is short: somebody who runs through the laboratory, in three seconds at most."""

ENDING_FRAMES = 2
"""Frames at the end of a window's motion in which it comes to rest; a window that is gone on from does without them."""

RESULTS = ("joints", "rotations")
"""Outputs of every graph: metres, and rotation vectors, (N, T, J, 3) each."""


@dataclass(frozen=True)
class StepSampler:
    """One frame follows the other; states go from each to the next."""

    path: Path
    card: StepCard

    def initial_states(self, count: int) -> dict[str, FloatArray]:
        """Zero states (see `STATE_NAMES`) for the first frame of `count` clips."""
        shapes = dict.fromkeys(STATE_NAMES, (count, self.card.hidden_size)) | {"previous": (count, len(self.card.joint_names), 3)}
        return {name: np.zeros(shape, dtype=np.float32) for name, shape in shapes.items()}

    def run(self, labels: IntArray, *, noise: FloatArray, lengths: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joints (metres, the first root near the origin) and rotations (N, T, J, 3) float32.

        Parameters
        ----------
        labels : (N, T) int
        noise : (N, T, Z) float
        lengths : (N, J) float
            Native units.
        """
        feed = self.initial_states(len(labels)) | _frames_feed(labels, noise) | {"bone_lengths": np.asarray(lengths, dtype=np.float32)}
        joints, rotations = run_rows(open_session(self.path), RESULTS, feed)
        return joints, rotations

    def generate(
        self,
        labels: IntArray,
        lengths: FloatArray,
        noise: Noise,
        start: FloatArray | None,
        *,
        anew: bool = False,
        at_once: bool = False,
        guide: Guide | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """See `MotionModel.generate`; `noise` is asked once, and `anew` and `at_once` say nothing: states go on. It cannot be guided."""
        if guide is not None:
            raise InputError(f"{self.path.name} cannot be directed; choose a model that can, such as cmu-fine")
        drawn = noise((*labels.shape, self.card.latent_size), 0)
        return (
            self.run(labels, noise=drawn, lengths=lengths)
            if start is None
            else self._continue(labels, noise=drawn, lengths=lengths, start=start)
        )

    def generate_like_data(
        self,
        labels: IntArray,
        lengths: FloatArray,
        frames: int,
        generator: np.random.Generator,
        *,
        active: FloatArray | None = None,
        headings: FloatArray | None = None,
    ) -> FloatArray:
        """See `MotionModel.generate_like_data`: how the data's clips end and head was learned, and cannot be asked for."""
        return self.generate(np.repeat(labels[:, None], frames, axis=1), lengths, normal_noise(generator), None)[0]

    def _continue(self, labels: IntArray, *, noise: FloatArray, lengths: FloatArray, start: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As `run`, but the first frames are those of `start` (N, P, J, 3): the states follow them, as under teacher forcing."""
        native = ((start - start[:, :1, :1]) / np.float32(self.card.metres_per_unit)).astype(np.float32)
        states = self.initial_states(len(labels))
        session, names = open_session(self.path), [f"last_{name}" for name in STATE_NAMES]
        feed, body = _frames_feed(labels, noise), {"bone_lengths": np.asarray(lengths, np.float32)}
        given = start.shape[1]
        for t in range(given):
            new = session.run(names, {name: array[:, t : t + 1] for name, array in feed.items()} | states | body)
            states = dict(zip(STATE_NAMES, new, strict=True)) | {"previous": native[:, t]}
        joints, rotations = session.run(RESULTS, {name: array[:, given:] for name, array in feed.items()} | states | body)
        return _join(start, joints + start[:, :1, :1], rotations, self.card.skeleton)


@dataclass(frozen=True)
class WindowSampler:
    """Whole windows, each of which goes on from the last frames of the one before."""

    path: Path
    card: WindowCard

    def active_shares(self, label: int) -> FloatArray:
        """How much of a window (n,) the data's clips of an action move.

        Raises
        ------
        InputError
            The data has none.
        """
        shares = self.card.active[label]
        if not len(shares):
            raise InputError(f"{self.path.name} has seen no clip of '{self.card.actions[label]}'; choose another action")
        return shares

    def active_share(self, label: int) -> float:
        """Share of a window that clips of an action move: the 90 % quantile of `active_shares`, the median of short ones.

        The few long ones among short clips are others: people who slow down and stop (docs/results/motion_direction.md).
        """
        shares = self.active_shares(label)
        middle = float(shares[(len(shares) - 1) // 2])
        return middle if middle < SHORT_SHARE else float(shares[int(0.9 * (len(shares) - 1))])

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
        """One window: joints (metres, first root at the origin) and rotations (N, W, J, 3) float32.

        Parameters
        ----------
        labels : (N,) int
        active : (N,) float
            Share of the window that is in motion.
        noise : (N, Z) float
        lengths : (N, J) float
            Native units.
        context : (N, P, J, 3) float or None
            Frames that the window repeats at its start and goes on from, metres.
        steering : Steering or None
            Wishes for all of the windows.
        """
        count = len(labels)
        given = np.zeros((count, self.card.context_frames, lengths.shape[1], 3), np.float32) if context is None else context
        feed: dict[str, np.ndarray] = {
            "noise": np.asarray(noise, dtype=np.float32),
            "actions": np.asarray(labels, dtype=np.int64),
            "active": np.asarray(active, dtype=np.float32),
            "context": np.asarray(given, dtype=np.float32),
            "has_context": np.full(count, context is not None, dtype=np.float32),
            "bone_lengths": np.asarray(lengths, dtype=np.float32),
        }
        joints, rotations = run_rows(open_session(self.path), RESULTS, feed, None if steering is None else steering.feed())
        return joints, rotations

    def reader(self, lengths: FloatArray) -> CodeReader:
        """What the codes of this model say of the joints of a body with bones of `lengths` (J,), native units.

        Raises
        ------
        InputError
            The model takes no wishes.
        """
        card = self.card
        if not card.steerable:
            raise InputError(f"{self.path.name} cannot be directed; choose a model that can, such as cmu-fine")
        shapes = {"context": (1, card.context_frames, len(lengths), 3), "noise": (1, card.latent_size), "bone_lengths": (1, len(lengths))}
        feed: dict[str, np.ndarray] = {name: np.zeros(shape, np.float32) for name, shape in shapes.items()}
        feed |= {"active": np.ones(1, np.float32), "has_context": np.zeros(1, np.float32), "actions": np.zeros(1, np.int64)}
        basis, mean = open_session(self.path).run(["basis", "mean"], feed)
        return CodeReader(
            basis=basis.astype(np.float64),
            mean=mean.astype(np.float64),
            skeleton=card.skeleton,
            lengths=np.asarray(lengths, np.float64) * card.metres_per_unit,
            metres_per_unit=card.metres_per_unit,
            frames=card.window_frames,
        )

    def generate(
        self,
        labels: IntArray,
        lengths: FloatArray,
        noise: Noise,
        start: FloatArray | None,
        *,
        anew: bool = False,
        at_once: bool = False,
        guide: Guide | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """See `MotionModel.generate`: windows until all frames are there, `noise` asked for each.

        A window goes on from the last frames of the one before, which speak for the action that they are of: where it changes, the second
        one can begin `anew`, and the first fades into it (`crossfade`).
        """
        count, frames = labels.shape
        changes = np.flatnonzero((labels[:, 1:] != labels[:, :-1]).any(axis=0)) + 1
        joints: FloatArray = np.zeros((count, 0, lengths.shape[1], 3), np.float32)
        rotations: FloatArray = joints
        if start is not None:
            joints, rotations = _join(start, joints, rotations, self.card.skeleton)
        given, fade = self.card.context_frames, max(2, round(CHANGE_SECONDS * self.card.fps))
        ahead = joints
        for end in [*changes, frames]:
            label = labels[:, end - 1]
            share = np.array([self.active_share(int(k)) for k in label], dtype=np.float32)
            usable = max(round(float(share.min()) * self.card.window_frames), given + 4)
            while joints.shape[1] < end:
                begun = joints.shape[1]
                changing = anew and begun in changes and ahead.shape[1] > 0
                context = joints[:, np.maximum(np.arange(-given, 0) + begun, 0)] if begun and not changing else None
                known, left = given if context is not None else 0, end - begun
                run = functools.partial(
                    self._window, label, active=share, noise=noise((count, self.card.latent_size), begun), lengths=lengths,
                    context=context, before=(joints, ahead) if changing else None, usable=usable if at_once and guide is None else 0, floor=[],
                )  # fmt: skip
                if guide is None:
                    new, rotated = run()
                    here = usable - (self.card.window_frames - new.shape[1])
                else:
                    here = usable
                take = left if left <= here - known else max(here - ENDING_FRAMES, given + 4) - known
                if guide is not None:
                    take = guide.until(begun, begun + take) - begun
                    new, rotated = _guided(run, guide, joints, known=known, take=take, skeleton=self.card.skeleton)
                ahead = new[:, np.minimum(np.arange(known + take, known + take + fade), new.shape[1] - 1)]
                joints = np.concatenate([joints, new[:, known : known + take]], axis=1)
                rotations = np.concatenate([rotations, rotated[:, known : known + take]], axis=1)
        return joints, rotations

    def _window(
        self,
        label: IntArray,
        steering: Steering | None = None,
        *,
        context: FloatArray | None,
        before: tuple[FloatArray, FloatArray] | None,
        usable: int,
        floor: list[FloatArray],
        **given: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """A whole window where it belongs: at its `context`, or after what was `before` and what would have come (see `crossfade`).

        One that nothing leads to, and of which `usable` frames move, is without what people stand still at first, and as much shorter; 0 keeps that.
        `floor` is how much the first such window was lifted: those that are made again are lifted alike, or wishes for heights would be taken back.
        """
        new, rotated = self.run(label, context=context, steering=steering, **given)
        if context is not None:
            return new + context[:, :1, :1], rotated
        skip = np.zeros(len(new), dtype=np.int64)
        if usable:
            skip = np.minimum(rests(new, self.card.fps, usable), max(usable - self.card.context_frames - 4, 0))
            new, rotated = shifted(new, skip), shifted(rotated, skip)
            new = new - new[:, :1, :1]
        if before is not None:
            floor[:] = floor or [lowest(before[0][:, -new.shape[1] :]) - lowest(new)]
            new = crossfade(*before, new, self.card.skeleton, floor[0])
            rotated = inverse_kinematics(new, self.card.skeleton).astype(np.float32)
        whole = new.shape[1] - int(skip.max(initial=0))
        return new[:, :whole], rotated[:, :whole]

    def generate_like_data(
        self,
        labels: IntArray,
        lengths: FloatArray,
        frames: int,
        generator: np.random.Generator,
        *,
        active: FloatArray | None = None,
        headings: FloatArray | None = None,
    ) -> FloatArray:
        """See `MotionModel.generate_like_data`: how long each clip moves is drawn from the data's distribution for its action.

        Raises
        ------
        InputError
            `frames` are more than a window.
        """
        if frames > self.card.window_frames:
            raise InputError(f"{self.path.name} makes windows of {self.card.window_frames} frames; {frames} were asked for")
        if active is None:
            active = np.array([generator.choice(self.active_shares(int(label))) for label in labels])
        noise = normal_noise(generator)((len(labels), self.card.latent_size), 0)
        joints = self.run(labels, active=active, noise=noise, lengths=lengths)[0][:, :frames]
        if not self.card.headings:
            return joints
        if headings is None:
            headings = np.array([generator.choice(self.card.headings[int(label)]) for label in labels])
        turned: FloatArray = face_forward(joints, np.stack([np.cos(headings), -np.sin(headings)], axis=-1)).astype(np.float32)
        return turned


def _guided(
    run: Callable[..., tuple[FloatArray, FloatArray]], guide: Guide, joints: FloatArray, *, known: int, take: int, skeleton: Skeleton
) -> tuple[FloatArray, FloatArray]:
    """A window after `joints` (1, T, J, 3) as `guide` wants it, of which the first `known` frames are the last of these."""
    first = joints.shape[1] - known
    place, yaw = guide.start
    if joints.shape[1]:
        at = min(first, joints.shape[1] - 1)
        place, yaw = joints[0, at, 0].astype(np.float64), float(heading(joints[0, at], skeleton))
    asking = guide.window(first, (known, known + take), place, yaw)
    steering = next(asking)
    while True:
        new, _ = run(steering)
        new = new if joints.shape[1] else guide.begin(new)
        try:
            steering = asking.send(new[0].astype(np.float64))
        except StopIteration:
            return new, inverse_kinematics(new, skeleton).astype(np.float32)


def lowest(joints: FloatArray) -> FloatArray:
    """Height (N,) of the lowest joint of clips (N, T, J, 3)."""
    found: FloatArray = joints[..., 1].min(axis=(1, 2)).astype(np.float64)
    return found


def crossfade(before: FloatArray, ahead: FloatArray, after: FloatArray, skeleton: Skeleton, lift: FloatArray) -> FloatArray:
    """Clips `after` (N, T, J, 3) float32 that go on from `before` (N, S, J, 3): there, that way round, and from its poses into their own.

    Directions of bones and steps of the root are mixed while the clips before would go on as `ahead` (N, F, J, 3); bones keep the
    lengths of `after`, whose heights are theirs and `lift` (N,): what brings the lowest joint of both to the same height.
    """
    fade, last = ahead.shape[1], before[:, -1].astype(np.float64)
    yaw = heading(last, skeleton) - heading(after[:, 0].astype(np.float64), skeleton)
    new = face_forward(after.astype(np.float64), np.stack([np.cos(yaw), -np.sin(yaw)], axis=-1))
    weight = (np.arange(1, fade + 1) / (fade + 1))[:, None]
    weight = weight * weight * (3 - 2 * weight)
    old_steps = np.diff(np.concatenate([last[:, None, 0], ahead[:, :, 0]], axis=1), axis=1)
    steps = np.diff(new[:, :, 0], axis=1, prepend=2 * new[:, :1, 0] - new[:, 1:2, 0])
    steps[:, :fade] = (1 - weight) * old_steps + weight * steps[:, :fade]
    root = last[:, None, 0] + np.cumsum(steps, axis=1)
    root[..., 1] = new[:, :, 0, 1] + lift[:, None]
    root[:, :fade, 1] = (1 - weight[:, 0]) * ahead[:, :, 0, 1] + weight[:, 0] * root[:, :fade, 1]
    vectors, old = bone_vectors(new, skeleton), bone_vectors(ahead.astype(np.float64), skeleton)
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    mixed = (1 - weight[..., None]) * old + weight[..., None] * vectors[:, :fade]
    vectors[:, :fade] = mixed * lengths[:, :fade] / np.maximum(np.linalg.norm(mixed, axis=-1, keepdims=True), 1e-9)
    joints = np.einsum("jb,ntbx->ntjx", skeleton.path_matrix, vectors) + root[:, :, None]
    return np.asarray(joints, np.float32)


def normal_noise(generator: np.random.Generator) -> Noise:
    """The noise that a generator draws, call after call."""

    def draw(shape: tuple[int, ...], at: int) -> FloatArray:
        return generator.standard_normal(shape, dtype=np.float32)

    return draw


def _frames_feed(labels: IntArray, noise: FloatArray) -> dict[str, np.ndarray]:
    """Inputs of a step graph with a column a frame: labels (N, T), noise (N, T, Z) and the time counter (N, T) in (0, 1]."""
    count, frames = labels.shape
    time = np.tile((np.arange(frames, dtype=np.float32) + 1) / np.float32(frames), (count, 1))
    return {"noise": np.asarray(noise, dtype=np.float32), "actions": np.asarray(labels, dtype=np.int64), "time": time}


def _join(start: FloatArray, joints: FloatArray, rotations: FloatArray, skeleton: Skeleton) -> tuple[FloatArray, FloatArray]:
    """Given frames (N, P, J, 3) followed by generated ones: joints and rotations (N, P + T, J, 3) float32."""
    before = inverse_kinematics(np.asarray(start, dtype=np.float32), skeleton)
    return np.concatenate([start, joints], axis=1).astype(np.float32), np.concatenate([before, rotations], axis=1).astype(np.float32)
