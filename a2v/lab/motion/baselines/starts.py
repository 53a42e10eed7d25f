"""First poses that a baseline's file keeps, with its skeleton: so it needs no data to generate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch

from a2v.kinematics import skeleton_of
from a2v.lab.datasets import ActionDataset, NativeFrame

EACH = 4
"""Number of recorded first poses of each action that are kept."""


def kept_starts(dataset: ActionDataset) -> dict[str, Any]:
    """Return `EACH` first poses of each action, roots at the origin, and what a motion of them
    needs, as tensors and plain values."""
    chosen = [
        index
        for label in range(len(dataset.actions))
        for index in np.flatnonzero(dataset.labels == label)[:EACH].tolist()
    ]
    poses = np.stack([dataset.joints[index][0] - dataset.joints[index][0, :1] for index in chosen])
    return {
        "poses": torch.from_numpy(poses.astype(np.float32)),
        "labels": torch.from_numpy(dataset.labels[chosen].astype(np.int64)),
        "skeleton": dataset.skeleton.name,
        "parents": dataset.skeleton.parents.tolist(),
        "joint_names": list(dataset.skeleton.joint_names),
        "fps": float(dataset.fps),
        "frames": int(dataset.length),
        "meters_per_unit": float(dataset.frame.meters_per_unit),
        "signs": [float(sign) for sign in dataset.frame.signs],
    }


def read_starts(kept: Mapping[str, Any], actions: tuple[str, ...], name: str) -> ActionDataset:
    """Return the result of `kept_starts` as a data set of clips of one frame.

    Raises
    ------
    KeyError, TypeError, ValueError, RuntimeError, AttributeError
        It is damaged.
    """
    poses, labels = kept["poses"].numpy(), kept["labels"].numpy()
    parents, names = [int(parent) for parent in kept["parents"]], kept["joint_names"]
    signs = tuple(float(sign) for sign in kept["signs"])
    fps, frames, unit = float(kept["fps"]), int(kept["frames"]), float(kept["meters_per_unit"])
    if (
        poses.shape[1:] != (len(parents), 3)
        or poses.dtype != np.float32
        or not np.isfinite(poses).all()
        or not 0 < len(poses) == len(labels) <= EACH * len(actions)
        or not ((labels >= 0) & (labels < len(actions))).all()
        or len(names) != len(parents)
        or len(signs) != 3
        or not (1 <= fps <= 240 and 2 <= frames <= 10_000 and 0 < unit <= 1000)
    ):
        raise ValueError("its first poses do not fit each other")
    return ActionDataset(
        name=name,
        skeleton=skeleton_of(str(kept["skeleton"]), parents, tuple(map(str, names))),
        actions=actions,
        joints=tuple(pose[None] for pose in poses),
        labels=labels.astype(np.int64),
        clip_names=tuple(f"first pose {index}" for index in range(len(poses))),
        subjects=("",) * len(poses),
        fps=fps,
        length=frames,
        frame=NativeFrame(meters_per_unit=unit, signs=(signs[0], signs[1], signs[2])),
    )
