"""A quick look at a model in training; not the papers' protocol."""

from __future__ import annotations

import numpy as np
import torch

from a2v.lab.datasets import ActionDataset, ClipSampler
from a2v.lab.evaluation.classifier import Evaluator
from a2v.lab.evaluation.metrics import accuracy, fid
from a2v.lab.motion.vae import MotionVAE


def quick_scores(
    model: MotionVAE,
    dataset: ActionDataset,
    evaluator: Evaluator,
    *,
    clips: int = 600,
    seed: int = 1,
) -> dict[str, float]:
    """FID and accuracy of `clips` samples against 3,000 real windows (classifier from a zero
    state), and their speed.

    Returns
    -------
    dict
        "fid", "accuracy" and "motion": mean joint speed relative to real clips (1 is right; more is
        jitter).
    """
    generator = np.random.default_rng(seed)
    device = next(model.parameters()).device
    chosen = generator.integers(0, len(dataset), clips)
    labels = dataset.labels[chosen]
    frames = dataset.length
    actions = torch.eye(model.n_actions)[torch.from_numpy(labels)][:, None].expand(-1, frames, -1)
    noise = torch.from_numpy(
        generator.standard_normal((clips, frames, model.settings.latent_size), dtype=np.float32)
    )
    lengths = torch.from_numpy(dataset.clip_bone_lengths[chosen])
    joints = (
        model.sample(actions.to(device), lengths.to(device), noise.to(device)).joints.cpu().numpy()
    )
    joints = joints - joints[:, :1, :1]
    real, _, _ = ClipSampler(dataset, frames).batch(3000, generator)
    features, predicted = evaluator(dataset.frame.flip(joints))
    reference, _ = evaluator(dataset.frame.flip(real))
    speed = np.abs(np.diff(joints, axis=1)).mean() / np.abs(np.diff(real, axis=1)).mean()
    return {
        "fid": fid(reference, features),
        "accuracy": accuracy(predicted, labels),
        "motion": float(speed),
    }
