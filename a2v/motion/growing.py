"""Clips that grow window by window, independently of each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.types import FloatArray, IntArray


@dataclass
class GrowingClips:
    """Clips that grow independently of each other.

    Attributes
    ----------
    joints, rotations : (N, T, J, 3) float32
    ahead : (N, F, J, 3) float32
        Discarded frames after the end of each clip.
    at : (N,) int64
        Number of frames of each clip.
    """

    joints: FloatArray
    rotations: FloatArray
    ahead: FloatArray
    at: IntArray

    @classmethod
    def empty(cls, count: int, frames: int, joints: int, ahead: int) -> GrowingClips:
        """`count` clips without frames yet, with room for `frames` and for `ahead` after them."""
        made = np.zeros((count, frames, joints, 3), np.float32)
        return cls(
            made,
            made.copy(),
            np.zeros((count, ahead, joints, 3), np.float32),
            np.zeros(count, np.int64),
        )

    def add(
        self, rows: IntArray, joints: FloatArray, rotations: FloatArray, take: IntArray
    ) -> None:
        """Extend the clips `rows` (n,) by the first `take` (n,) frames of these (n, W, J, 3); the
        following frames become `ahead`."""
        own, fade = np.arange(len(rows))[:, None], np.arange(self.ahead.shape[1])
        at, longest = self.at[rows], int(take.max())
        if (at == at[0]).all() and (take == longest).all() and len(rows) == len(self.at):
            self.joints[:, at[0] : at[0] + longest], self.rotations[:, at[0] : at[0] + longest] = (
                joints[:, :longest],
                rotations[:, :longest],
            )
        else:
            wanted = np.arange(longest) < take[:, None]
            clip, frame = np.nonzero(wanted)
            self.joints[rows[clip], at[clip] + frame] = joints[clip, frame]
            self.rotations[rows[clip], at[clip] + frame] = rotations[clip, frame]
        if joints.shape[1]:
            self.ahead[rows] = joints[own, np.minimum(take[:, None] + fade, joints.shape[1] - 1)]
        self.at[rows] = at + take

    def last(self, rows: IntArray, count: int) -> FloatArray:
        """Return the last `count` frames (n, count, J, 3) of the clips `rows`; shorter clips are
        padded with their first frame."""
        at = np.maximum(self.at[rows][:, None] + np.arange(-count, 0), 0)
        frames: FloatArray = self.joints[rows[:, None], at]
        return frames
