"""The papers' baselines as rows of a table."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.errors import InputError
from a2v.lab.datasets import ActionDataset
from a2v.lab.evaluation.sources import Generate, recorded
from a2v.lab.motion.baselines.training import TrainedBaseline, load_baseline
from a2v.types import FloatArray, IntArray, Motion

FIRST_FRAME = "first-frame"
"""The name of `first_frame_and_zeros` where models are named."""


def generator_of_baseline(trained: TrainedBaseline, dataset: ActionDataset) -> Generate:
    """Sampling of a baseline as the protocol wants it; first poses are those of recorded clips of
    the same action."""
    recordings = recorded(dataset)

    def generate(
        labels: IntArray, lengths: FloatArray, generator: np.random.Generator
    ) -> FloatArray:
        first = dataset.frame.flip(recordings(labels, lengths, generator)[:, 0])
        return dataset.frame.flip(trained.generate(labels, first, generator))

    return generate


def baseline_motions(
    trained: TrainedBaseline, dataset: ActionDataset, action: str, *, count: int, seed: int
) -> list[Motion]:
    """`count` clips of an action by a baseline, as long as the data set's windows; bones are as
    long as it makes them."""
    labels = np.full(count, dataset.actions.index(action))
    own = np.flatnonzero(dataset.labels == labels[0])
    generator = np.random.default_rng(seed)
    lengths = dataset.clip_bone_lengths[generator.choice(own, count)]
    joints = dataset.frame.flip(generator_of_baseline(trained, dataset)(labels, lengths, generator))
    names = tuple(f"{trained.name} {index}" for index in range(count))
    made = dataclasses.replace(
        dataset, joints=tuple(joints), labels=labels, clip_names=names, subjects=("",) * count
    )
    return [
        dataclasses.replace(made.motion(index), seed=seed, provenance={"model": trained.name})
        for index in range(count)
    ]


def open_baseline(path: str, dataset: ActionDataset) -> TrainedBaseline:
    """The baseline of a file, for this data set.

    Raises
    ------
    InputError
        It is none, or knows other actions, joints or lengths.
    """
    trained = load_baseline(path)
    sizes = trained.model.sizes
    if trained.actions != dataset.actions or (sizes.pose, sizes.frames) != (
        3 * dataset.skeleton.n_joints,
        dataset.length,
    ):
        raise InputError(
            f"baseline '{path}' knows other actions, joints or lengths than {dataset.name}; evaluate it on {trained.dataset}"
        )
    return trained


def first_frame_and_zeros(dataset: ActionDataset) -> Generate:
    """A real first pose, and joints that all lie in the origin from then on.

    A generation whose loop over frames never runs gives this. Under the authors' classifier it
    scores what the papers say of CondGRU (docs/results/baselines.md).
    """
    recordings = recorded(dataset)

    def generate(
        labels: IntArray, lengths: FloatArray, generator: np.random.Generator
    ) -> FloatArray:
        joints = recordings(labels, lengths, generator)
        joints[:, 1:] = 0
        return joints

    return generate
