"""The papers' baselines as rows of a table."""

from __future__ import annotations

import numpy as np

from a2v.lab.datasets import ActionDataset
from a2v.lab.evaluation.protocol import Generate, recorded
from a2v.lab.motion.baselines.training import TrainedBaseline
from a2v.types import FloatArray, IntArray

FIRST_FRAME = "first-frame"
"""The name of `first_frame_and_zeros` where models are named."""


def generator_of_baseline(trained: TrainedBaseline, dataset: ActionDataset) -> Generate:
    """Sampling of a baseline as the protocol wants it; first poses are those of recorded clips of the same action."""
    recordings = recorded(dataset)

    def generate(labels: IntArray, lengths: FloatArray, generator: np.random.Generator) -> FloatArray:
        first = dataset.frame.flip(recordings(labels, lengths, generator)[:, 0])
        return dataset.frame.flip(trained.generate(labels, first, generator))

    return generate


def first_frame_and_zeros(dataset: ActionDataset) -> Generate:
    """A real first pose, and joints that all lie in the origin from then on.

    A generation whose loop over frames never runs gives this. Under the authors' classifier it scores what the papers say of CondGRU
    (docs/results/baselines.md).
    """
    recordings = recorded(dataset)

    def generate(labels: IntArray, lengths: FloatArray, generator: np.random.Generator) -> FloatArray:
        joints = recordings(labels, lengths, generator)
        joints[:, 1:] = 0
        return joints

    return generate
