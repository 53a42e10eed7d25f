"""The interface of samplers: the request for clips, the noise, and the contract that both kinds
keep."""

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
"""Gives standard normal numbers (float32) of a shape, for the part of the clips that begins with a
frame."""

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
        Frames that are given, meters; they are the first of the T.
    fresh : bool
        Where the action changes, a window model begins the next one by itself and fades into it,
        instead of continuing the last frames.
    skip_rest : bool
        A window model leaves out the time that people stand still before they begin.
    steerer : Steerer or None
        What steers the windows; one clip.
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
    """Clips that are distributed as the data's windows.

    Attributes
    ----------
    labels : (N,) int
    lengths : (N, J) float32
        Bone lengths, native units.
    frames : int
        At most one window.
    active : (N,) float or None
        Share of the window that each clip moves; None draws it from the data's shares of its
        action.
    headings : (N,) float or None
        First heading of each clip, radians about +y from +z, where headings were not learned; None
        draws it in the same way.
    """

    labels: IntArray
    lengths: FloatArray
    frames: int
    active: FloatArray | None = None
    headings: FloatArray | None = None


class Sampler(Protocol):
    """Makes clips from an exported graph. Joints are meters; both results are (N, T, J,
    3) float32."""

    @property
    def path(self) -> Path:
        """The exported graph."""
        ...

    def generate(self, request: ClipRequest) -> tuple[FloatArray, FloatArray]:
        """Joints and rotations; see `MotionModel.generate`.

        Raises
        ------
        InputError
            The graph gives other shapes, or the model cannot be directed and there is a steerer.
        """
        ...

    def generate_like_data(
        self, request: WindowRequest, generator: np.random.Generator
    ) -> FloatArray:
        """Joints; see `MotionModel.generate_like_data`.

        Raises
        ------
        InputError
            More frames than a window.
        """
        ...


def checked_results(
    path: Path, made: Sequence[np.ndarray], shape: tuple[int, ...]
) -> tuple[FloatArray, FloatArray]:
    """Joints and rotations, if both have a shape."""
    joints, rotations = made
    if joints.shape != shape or rotations.shape != shape:
        raise InputError(
            f"{path} made joints of shape {joints.shape}; expected {shape}: export the model again "
            "with a2v"
        )
    return joints, rotations


def normal_noise(generator: np.random.Generator) -> Noise:
    """The noise that a generator draws, call after call."""

    def draw(shape: tuple[int, ...], at: int) -> FloatArray:
        return generator.standard_normal(shape, dtype=np.float32)

    return draw


def join_start(
    start: FloatArray, joints: FloatArray, rotations: FloatArray, skeleton: Skeleton
) -> tuple[FloatArray, FloatArray]:
    """Given frames (N, P, J, 3) followed by generated ones: joints and rotations (N, P + T, J, 3)
    float32."""
    before = inverse_kinematics(np.asarray(start, dtype=np.float32), skeleton)
    return np.concatenate([start, joints], axis=1).astype(np.float32), np.concatenate(
        [before, rotations], axis=1
    ).astype(np.float32)
