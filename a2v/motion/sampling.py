"""The interface of samplers: requests for clips, the noise, and the contract of both kinds of
samplers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import Skeleton, inverse_kinematics
from a2v.motion.steer import Steerer
from a2v.types import FloatArray, IntArray

Noise = Callable[[tuple[int, ...], int], FloatArray]
"""Function of a shape and a first frame that returns standard normal numbers (float32) for the part
of the clips from this frame on."""

RESULTS = ("joints", "rotations")
"""Outputs of every graph: meters, and rotation vectors, (N, T, J, 3) each."""


@dataclass(frozen=True, eq=False)
class ClipRequest:
    """A request for clips.

    Attributes
    ----------
    labels : (N, T) int
        The action of every frame.
    lengths : (N, J) float32
        Bone lengths, native units.
    noise : Noise
    start : (N, P, J, 3) float32 or None
        Given frames, meters; they are the first of the T.
    fresh : bool
        At a change of the action, a window model starts the next action independently and fades
        into it, instead of continuing the last frames.
    skip_rest : bool
        A window model leaves out the time in which the person stands still at the beginning.
    steerer : Steerer or None
        Steers the windows; only for one clip.
    """

    labels: IntArray
    lengths: FloatArray
    noise: Noise
    start: FloatArray | None = None
    fresh: bool = False
    skip_rest: bool = False
    steerer: Steerer | None = None


@dataclass(frozen=True, eq=False)
class WindowRequest:
    """A request for clips with the distribution of the data's windows.

    Attributes
    ----------
    labels : (N,) int
    lengths : (N, J) float32
        Bone lengths, native units.
    frames : int
        At most one window.
    active : (N,) float or None
        Fraction of the window in which each clip moves; None draws it from the data of its action.
    headings : (N,) float or None
        First heading of each clip, radians about +y from +z, if headings were not learned; None
        draws it in the same way.
    noise_scale : float
        Factor on the noise.
    """

    labels: IntArray
    lengths: FloatArray
    frames: int
    active: FloatArray | None = None
    headings: FloatArray | None = None
    noise_scale: float = 1.0


class Sampler(Protocol):
    """Makes clips from an exported graph. Joints are meters; both results are (N, T, J,
    3) float32."""

    @property
    def path(self) -> Path:
        """The exported graph."""
        ...

    def generate(self, request: ClipRequest) -> tuple[FloatArray, FloatArray]:
        """Generate joints and rotations; see `MotionModel.generate`.

        Raises
        ------
        InputError
            The graph gives other shapes, or a steerer is given for a model that cannot be directed.
        """
        ...

    def generate_like_data(
        self, request: WindowRequest, generator: np.random.Generator
    ) -> FloatArray:
        """Generate joints; see `MotionModel.generate_like_data`.

        Raises
        ------
        InputError
            More frames than a window.
        """
        ...


def checked_results(
    path: Path, made: Sequence[np.ndarray], shape: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    """Return joints and rotations after a check of their shape."""
    joints, rotations = made
    if joints.shape != shape or rotations.shape != shape:
        raise InputError(
            f"{path} made joints of shape {joints.shape}; expected {shape}: export the model again "
            "with a2v"
        )
    return joints, rotations


def normal_noise(generator: np.random.Generator, scale: float = 1.0) -> Noise:
    """Return a `Noise` that draws from a generator, call after call."""

    def draw(shape: tuple[int, ...], at: int) -> FloatArray:
        return generator.standard_normal(shape, dtype=np.float32) * np.float32(scale)

    return draw


def join_start(
    start: FloatArray, joints: FloatArray, rotations: FloatArray, skeleton: Skeleton
) -> tuple[FloatArray, FloatArray]:
    """Prepend given frames (N, P, J, 3) to generated ones: joints and rotations (N, P + T, J, 3)
    float32."""
    before = inverse_kinematics(np.asarray(start, dtype=np.float32), skeleton)
    return np.concatenate([start, joints], axis=1).astype(np.float32), np.concatenate(
        [before, rotations], axis=1
    ).astype(np.float32)
