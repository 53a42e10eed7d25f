"""Small motions and data sets of motions, made by formula."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.kinematics import CMU, Skeleton, forward_kinematics, inverse_kinematics
from a2v.lab.datasets import ActionDataset
from a2v.types import Motion


def clip(joints: np.ndarray, skeleton: Skeleton, fps: float, action: str = "") -> Motion:
    """A motion of a data set's skeleton from its joints (T, J, 3)."""
    return Motion(
        joints=joints.astype(np.float32),
        rotations=inverse_kinematics(joints, skeleton).astype(np.float32),
        root=joints[:, 0].astype(np.float32),
        fps=fps,
        parents=skeleton.parents,
        joint_names=skeleton.joint_names,
        skeleton=skeleton.name,
        action=action,
    )


def person(skeleton=CMU, frames=6, step=0.1, height=0.0):
    """A T-pose that walks along +z, its feet on the ground."""
    rotations = np.zeros((frames, skeleton.n_joints, 3), np.float32)
    root = np.zeros((frames, 3), np.float32)
    root[:, 2] = np.arange(frames) * step
    joints = forward_kinematics(
        rotations, root, np.full(skeleton.n_joints, 0.25, np.float32), skeleton
    ).astype(np.float32)
    joints[..., 1] += height - joints[..., 1].min()
    return Motion(
        joints=joints,
        rotations=rotations,
        root=joints[:, 0],
        fps=10,
        parents=skeleton.parents,
        joint_names=skeleton.joint_names,
        skeleton=skeleton.name,
    )


def waving(trajectory=True, clips=6, frames=30):
    """Clips of one arm that waves at two speeds while the root walks on."""
    rng = np.random.default_rng(0)
    lengths = np.full(20, 0.3)
    joints, labels = [], []
    for i in range(clips):
        t = np.arange(frames)[:, None] * (0.1 + 0.3 * (i % 2)) + rng.uniform(0, 6)
        rotations = np.zeros((frames, 20, 3))
        rotations[:, 4:6, 2] = np.sin(t)
        root = np.zeros((frames, 3))
        if trajectory:
            root[:, 2] = np.arange(frames) * 0.05
        joints.append(forward_kinematics(rotations, root, lengths, CMU).astype(np.float32))
        labels.append(i % 2)
    names = tuple(map(str, range(clips)))
    return ActionDataset(
        name="waving",
        skeleton=CMU,
        actions=("slow", "fast"),
        joints=tuple(joints),
        labels=np.array(labels),
        clip_names=names,
        subjects=names,
        fps=20.0,
        length=20,
    )


def mirrored(clips=20):
    """Clips whose second action is done with the other arm, on the other side."""
    dataset = waving(clips=clips)
    sides = [np.float32([1 - 2 * label, 1, 1]) for label in dataset.labels]
    return dataclasses.replace(
        dataset,
        joints=tuple(joints * side for joints, side in zip(dataset.joints, sides, strict=True)),
    )


def random_clip(skeleton: Skeleton, frames: int = 12, *, stretch: float = 0.0) -> Motion:
    """A clip that turns every joint and wanders; `stretch` changes bone lengths."""
    random = np.random.default_rng(3)
    count = skeleton.n_joints
    rotations = np.cumsum(random.normal(0, 0.15, (frames, count, 3)), axis=0)
    rotations[:, 0] = 0
    root = np.cumsum(random.normal(0, 0.03, (frames, 3)), axis=0) + np.array([0, 0.95, 0])
    lengths = np.tile(random.uniform(0.15, 0.35, count), (frames, 1)) * (
        1 + stretch * random.normal(0, 1, (frames, count))
    )
    joints = forward_kinematics(rotations, root, lengths, skeleton)
    return Motion(
        joints=joints.astype(np.float32),
        rotations=rotations.astype(np.float32),
        root=root.astype(np.float32),
        fps=20.0,
        parents=skeleton.parents,
        joint_names=skeleton.joint_names,
        skeleton=skeleton.name,
    )
