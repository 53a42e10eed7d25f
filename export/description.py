"""The metadata of exported motion models."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from a2v.lab.datasets import ActionDataset
from a2v.lab.motion.vae import MotionVAE
from a2v.motion.card import STEP_FORMAT


def describe_data(dataset: ActionDataset, *, license: str) -> dict[str, Any]:
    """Metadata that every exported motion model has: actions, rates, skeleton, units, license."""
    skeleton = dataset.skeleton
    return {
        "dataset": dataset.name,
        "dataset_digest": dataset.sha256,
        "actions": list(dataset.actions),
        "fps": dataset.fps,
        "frames": dataset.length,
        "skeleton": {
            "name": skeleton.name,
            "joint_names": list(skeleton.joint_names),
            "parents": skeleton.parents.tolist(),
            "chains": [list(chain) for chain in skeleton.chains],
            "rest_directions": np.round(skeleton.rest_directions, 9).tolist(),
        },
        "bone_lengths": np.round(
            np.median(dataset.clip_bone_lengths, axis=0).astype(float), 6
        ).tolist(),
        "metres_per_unit": dataset.frame.meters_per_unit,
        "native_signs": list(dataset.frame.signs),
        "licence": license,
        **{
            name: [list(texts) for texts in getattr(dataset, name)]
            for name in ("traits", "descriptions")
            if getattr(dataset, name)
        },
    }


def describe(
    model: MotionVAE,
    dataset: ActionDataset,
    *,
    license: str,
    extra: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The metadata that makes the file usable on its own."""
    return describe_data(dataset, license=license) | {
        "format": STEP_FORMAT,
        "decoder": model.settings.decoder,
        **({"roots": "relative"} if model.settings.relative else {}),
        **({"root_rotation": True} if model.settings.root_rotation else {}),
        "latent_size": model.settings.latent_size,
        "hidden_size": model.settings.hidden_size,
        **(extra or {}),
    }
