"""FID and accuracy of a model in training, quicker and coarser than the papers' protocol."""

from __future__ import annotations

import numpy as np
import torch

from a2v.lab.datasets import ActionDataset, ClipSampler
from a2v.lab.evaluation.classifier import Evaluator
from a2v.lab.evaluation.metrics import accuracy, fid
from a2v.lab.evaluation.sources import Generate
from a2v.lab.motion.vae import MotionVAE
from a2v.types import FloatArray, IntArray

EVERY = 10
"""Lines of the log from one evaluation to the next."""


def generator_of_vae(model: MotionVAE, dataset: ActionDataset) -> Generate:
    """Return a function that samples motions from a VAE during training.

    The motions are in the data set's own frame; the root starts at the origin.
    """
    device, size = next(model.parameters()).device, model.settings.latent_size

    def generate(
        labels: IntArray, lengths: FloatArray, generator: np.random.Generator
    ) -> FloatArray:
        noise = generator.standard_normal((len(labels), dataset.length, size), dtype=np.float32)
        actions = torch.eye(model.n_actions)[torch.from_numpy(labels)][:, None]
        inputs = actions.expand(-1, dataset.length, -1), torch.from_numpy(lengths)
        joints = model.sample(*(x.to(device) for x in (*inputs, torch.from_numpy(noise)))).joints
        made = joints.cpu().numpy()
        flipped: FloatArray = dataset.frame.flip(made - made[:, :1, :1])
        return flipped

    return generate


def quick_scores(
    generate: Generate,
    dataset: ActionDataset,
    evaluator: Evaluator,
    *,
    clips: int = 600,
    seed: int = 1,
) -> dict[str, float]:
    """FID and accuracy of `clips` samples against 3,000 real windows. The classifier starts from a
    zero state, and actions are as frequent as in the data.

    Returns
    -------
    dict
        "fid", "accuracy" and "motion": the mean joint speed divided by that of real clips (above 1
        is jitter).
    """
    generator = np.random.default_rng(seed)
    chosen = generator.integers(0, len(dataset), clips)
    labels = dataset.labels[chosen]
    joints = generate(labels, dataset.clip_bone_lengths[chosen], generator)
    windows, _, _ = ClipSampler(dataset, dataset.length).batch(3000, generator)
    real = dataset.frame.flip(windows)
    features, predicted = evaluator(joints)
    reference, _ = evaluator(real)
    speed = np.abs(np.diff(joints, axis=1)).mean() / np.abs(np.diff(real, axis=1)).mean()
    return {
        "fid": fid(reference, features),
        "accuracy": accuracy(predicted, labels),
        "motion": float(speed),
    }
