"""Clips frame by frame: the networks' states are passed from each frame to the next."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.geometry.steps import smoothstep
from a2v.kinematics import Skeleton, bone_vectors, inverse_kinematics
from a2v.motion.card import STATE_NAMES, StepCard
from a2v.motion.sampling import (
    RESULTS,
    ClipRequest,
    WindowRequest,
    checked_results,
    join_start,
    normal_noise,
)
from a2v.sessions import run_file
from a2v.types import FloatArray, IntArray

FADE_SECONDS = 0.5
"""Time after given frames in which the network's error in the last of them fades out."""


@dataclass(frozen=True)
class StepSampler:
    """Makes clips frame by frame; states are passed from each frame to the next."""

    path: Path
    card: StepCard

    def initial_states(self, count: int) -> dict[str, FloatArray]:
        """Return zero states (see `STATE_NAMES`) for the first frame of `count` clips."""
        shapes = dict.fromkeys(STATE_NAMES, (count, self.card.hidden_size)) | {
            "previous": (count, len(self.card.joint_names), 3)
        }
        return {name: np.zeros(shape, dtype=np.float32) for name, shape in shapes.items()}

    def run(
        self, labels: IntArray, *, noise: FloatArray, lengths: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Generate joints (meters, the first root near the origin) and rotations (N, T, J, 3)
        float32.

        Parameters
        ----------
        labels : (N, T) int
        noise : (N, T, Z) float
        lengths : (N, J) float
            Native units.
        """
        feed = (
            self.initial_states(len(labels))
            | _frames_feed(labels, noise)
            | {"bone_lengths": np.asarray(lengths, dtype=np.float32)}
        )
        made = run_file(self.path, RESULTS, feed)
        return checked_results(self.path, made, (*labels.shape, *np.shape(lengths)[1:], 3))

    def generate(self, request: ClipRequest) -> tuple[FloatArray, FloatArray]:
        """See `Sampler`. The noise is drawn once. `fresh` and `skip_rest` have no effect, because
        states continue over a change of the action."""
        if request.steerer is not None:
            raise InputError(
                f"{self.path.name} cannot be directed; choose a model that can, such as cmu-fine"
            )
        labels, lengths = request.labels, request.lengths
        noise = request.noise((*labels.shape, self.card.latent_size), 0)
        if request.start is None:
            return self.run(labels, noise=noise, lengths=lengths)
        return self._continue(labels, noise=noise, lengths=lengths, start=request.start)

    def generate_like_data(
        self, request: WindowRequest, generator: np.random.Generator
    ) -> FloatArray:
        """See `Sampler`. Ends and headings of the data's clips were learned, and cannot be set."""
        labels = np.repeat(request.labels[:, None], request.frames, axis=1)
        noise = normal_noise(generator, request.noise_scale)
        return self.generate(ClipRequest(labels, request.lengths, noise))[0]

    def _continue(
        self, labels: IntArray, *, noise: FloatArray, lengths: FloatArray, start: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Run with the first frames replaced by `start` (N, P, J, 3): the states follow them, as in
        teacher forcing.

        The networks reproduce given poses with an error of centimeters. What they make after the
        last one follows their own pose of it, so that error is added, and fades out.
        """
        native = ((start - start[:, :1, :1]) / np.float32(self.card.meters_per_unit)).astype(
            np.float32
        )
        states = self.initial_states(len(labels))
        names = [f"last_{name}" for name in STATE_NAMES]
        feed, body = _frames_feed(labels, noise), {"bone_lengths": np.asarray(lengths, np.float32)}
        given, own = start.shape[1], native[:, 0]
        for t in range(given):
            new = run_file(
                self.path,
                names,
                {name: array[:, t : t + 1] for name, array in feed.items()} | states | body,
            )
            own = new[0]
            states = dict(zip(STATE_NAMES, new, strict=True)) | {"previous": native[:, t]}
        made = run_file(
            self.path,
            RESULTS,
            {name: array[:, given:] for name, array in feed.items()} | states | body,
        )
        joints, _ = checked_results(
            self.path, made, (len(labels), labels.shape[1] - given, *np.shape(lengths)[1:], 3)
        )
        skeleton = self.card.skeleton
        error = (native[:, -1] - own) * np.float32(self.card.meters_per_unit)
        if self.card.decoder.startswith("glmi"):  # its root goes on from the given one
            error = error - error[:, :1]
        joints = _faded(joints, error, skeleton, FADE_SECONDS * self.card.fps)
        rotations = inverse_kinematics(joints, skeleton).astype(np.float32)
        return join_start(start, joints + start[:, :1, :1], rotations, skeleton)


def _faded(joints: FloatArray, error: FloatArray, skeleton: Skeleton, frames: float) -> FloatArray:
    """Add `error` (N, J, 3) to clips (N, T, J, 3) with a weight that falls to 0 in `frames` frames;
    bones keep their lengths."""
    weight = 1 - smoothstep(np.arange(1.0, joints.shape[1] + 1), 0, frames + 1)[:, None, None]
    vectors = bone_vectors(joints.astype(np.float64), skeleton)
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    vectors = vectors + weight * bone_vectors(error, skeleton)[:, None]
    vectors *= lengths / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)
    root = joints[:, :, :1] + weight * error[:, None, :1]
    return np.asarray(
        np.einsum("jb,ntbx->ntjx", skeleton.path_matrix, vectors) + root, dtype=np.float32
    )


def _frames_feed(labels: IntArray, noise: FloatArray) -> dict[str, np.ndarray]:
    """Return the inputs of a step graph, one column per frame: labels (N, T), noise (N, T, Z) and
    the time counter (N, T) in (0, 1]."""
    count, frames = labels.shape
    time = np.tile((np.arange(frames, dtype=np.float32) + 1) / np.float32(frames), (count, 1))
    return {
        "noise": np.asarray(noise, dtype=np.float32),
        "actions": np.asarray(labels, dtype=np.int64),
        "time": time,
    }
