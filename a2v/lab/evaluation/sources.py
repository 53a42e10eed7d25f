"""Sources of motions for the evaluation: models, and recordings."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from a2v.errors import InputError
from a2v.kinematics.ground import first_heading
from a2v.lab.datasets import ActionDataset, ClipSampler
from a2v.motion import MotionModel
from a2v.types import FloatArray, IntArray

PART = 250
"""Number of clips that are sampled at a time."""

Generate = Callable[[IntArray, FloatArray, np.random.Generator], FloatArray]
"""``(labels (N,), bone lengths (N, J) native, generator) -> native joints (N, T, J, 3)``."""


def generator_of(model: MotionModel, frames: int, *, noise_scale: float = 1.0) -> Generate:
    """Return an exported model as a source for the protocol; see
    `MotionModel.generate_like_data`."""

    def generate(
        labels: IntArray, lengths: FloatArray, generator: np.random.Generator
    ) -> FloatArray:
        joints = []
        for start in range(0, len(labels), PART):
            part = slice(start, start + PART)
            joints.append(
                model.generate_like_data(
                    labels[part], lengths[part], frames, generator, noise_scale=noise_scale
                )
            )
        return model.to_native(np.concatenate(joints))

    return generate


def generator_of_families(
    model: MotionModel, fine: ActionDataset, coarse: ActionDataset, frames: int
) -> Generate:
    """Return a model of fine actions as a source of coarse ones.

    Each sample is like a random clip of the family: of its action, of its length, with its heading.

    Action, length and heading of recordings are correlated, and classifiers that see headings use
    that (docs/research/motion-flow.md). If they are drawn independently, real clips lose as much
    accuracy.

    Parameters
    ----------
    model : MotionModel
        A model of the actions of `fine`.
    fine : ActionDataset
    coarse : ActionDataset
        The same recordings with the coarse labels. A recording of which `fine` has several parts
        counts once per part.

    Raises
    ------
    InputError
        A family has no clip in `fine`.
    """
    label_of = dict(zip(coarse.clip_names, coarse.labels.tolist(), strict=True))
    family = np.array([label_of.get(name.split("/")[0], -1) for name in fine.clip_names])
    members = [np.flatnonzero(family == label) for label in range(len(coarse.actions))]
    if empty := [name for name, own in zip(coarse.actions, members, strict=True) if not len(own)]:
        raise InputError(f"{fine.name} has no clips of '{empty[0]}'")
    sampler = ClipSampler(fine, fine.length)
    shares = np.minimum(np.array([len(clip) for clip in fine.joints]) / fine.length, 1)

    def generate(
        labels: IntArray, lengths: FloatArray, generator: np.random.Generator
    ) -> FloatArray:
        clips = np.array([generator.choice(members[label]) for label in labels.tolist()])
        ahead = first_heading(sampler.windows(clips, generator), fine.skeleton)
        headings = np.arctan2(ahead[:, 1], ahead[:, 0])
        joints = [
            model.generate_like_data(
                fine.labels[clips[part]],
                lengths[part],
                frames,
                generator,
                active=shares[clips[part]],
                headings=headings[part],
            )
            for part in (slice(start, start + PART) for start in range(0, len(clips), PART))
        ]
        return model.to_native(np.concatenate(joints))

    return generate


def recorded(dataset: ActionDataset) -> Generate:
    """Return random windows of recorded clips of the requested actions, with their own bone
    lengths, as a source like a model.

    Raises
    ------
    InputError
        When it is called for an action without a clip in the data.
    """
    sampler = ClipSampler(dataset, dataset.length)

    def generate(labels: IntArray, _: FloatArray, generator: np.random.Generator) -> FloatArray:
        clips = np.zeros(len(labels), dtype=np.int64)
        for label in np.unique(labels):
            own = np.flatnonzero(dataset.labels == label)
            if not len(own):
                raise InputError(f"{dataset.name} has no clip of '{dataset.actions[label]}' here")
            wanted = labels == label
            clips[wanted] = generator.choice(own, int(wanted.sum()))
        return dataset.frame.flip(sampler.windows(clips, generator))

    return generate
