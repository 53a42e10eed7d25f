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
"""Name of `first_frame_and_zeros` among the models."""


def generator_of_baseline(trained: TrainedBaseline, dataset: ActionDataset) -> Generate:
    """Return a baseline as a source for the protocol. First poses are those of recorded clips of
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
    """Return `count` clips of an action by a baseline, as long as the data set's windows. Bone
    lengths are those that it generates."""
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
    """Read a baseline from a file and check that it fits this data set.

    Raises
    ------
    InputError
        The file is not a baseline, or has other actions, joints or lengths.
    """
    trained = load_baseline(path)
    sizes = trained.model.sizes
    if trained.actions != dataset.actions or (sizes.pose, sizes.frames) != (
        3 * dataset.skeleton.n_joints,
        dataset.length,
    ):
        raise InputError(
            f"baseline '{path}' was trained with other actions, joints or lengths than "
            f"{dataset.name}; evaluate it on {trained.dataset}"
        )
    return trained


def first_frame_and_zeros(dataset: ActionDataset) -> Generate:
    """Return a source of a real first pose, followed by joints that all lie in the origin.

    This is the result of a generation whose loop over frames never runs. Under the authors'
    classifier it scores about what the papers report for CondGRU (docs/results/baselines.md).
    """
    recordings = recorded(dataset)

    def generate(
        labels: IntArray, lengths: FloatArray, generator: np.random.Generator
    ) -> FloatArray:
        joints = recordings(labels, lengths, generator)
        joints[:, 1:] = 0
        return joints

    return generate
