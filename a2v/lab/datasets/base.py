"""The common form of all motion data sets: clips of joints with action labels."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import Skeleton, bone_lengths, inverse_kinematics, skeleton_of
from a2v.types import FloatArray, IntArray, Motion


@dataclass(frozen=True, kw_only=True)
class NativeFrame:
    """Axes and unit of the published files and classifiers of a data set.

    ``world = native * signs * meters_per_unit``; the papers' classifiers expect native joints.

    Attributes
    ----------
    meters_per_unit : float
        Meters of one native unit.
    signs : 3 floats of +1 or -1
        Sign of each axis: HumanAct12's camera looks along +z with y down, so (1, -1, -1).
    """

    meters_per_unit: float = 1.0
    signs: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def flip(self, joints: FloatArray) -> FloatArray:
        """Flip joints (..., 3) float32 from the files' axes to ours, or back: each sign is its own
        inverse."""
        flipped: FloatArray = joints * np.asarray(self.signs, dtype=np.float32)
        return flipped


@dataclass(frozen=True, kw_only=True)
class Clip:
    """One clip of a data set, as a loader reads it.

    Attributes
    ----------
    joints : (T, J, 3) float32
        Axes of the world, native units.
    action : int
        Index into the data set's actions.
    name, subject : str
    """

    joints: FloatArray
    action: int
    name: str
    subject: str


@dataclass(frozen=True, kw_only=True)
class ActionDataset:
    """Clips of skeletal motion with an action each.

    Joints are kept in the world's axes (y up) but in the data set's own unit, in which the papers'
    models and classifiers work; `motion` gives meters.

    Attributes
    ----------
    name : str
    skeleton : Skeleton
    actions : tuple of str
        Names in the order of the labels.
    joints : tuple of N arrays (T_i, J, 3) float32
        Axes of the world, native units, as recorded (not moved to the origin).
    labels : (N,) int64
        Index into `actions`.
    clip_names : tuple of N str
    subjects : tuple of N str
        The recorded person of each clip, for held-out splits.
    fps : float
        Frames per second.
    length : int
        Number of frames that the papers generate and evaluate.
    frame : NativeFrame
    trajectory : bool
        Whether the roots travel; False if joints are only known relative to the person's position
        (NTU-VIBE).
    notes : tuple of str
        Notes of the loader for the user: skipped files, guessed units.
    traits : tuple of tuples of str
        Traits that each action shares with others ("coarse:Walk", "style:sad"), so that rare
        actions can be learned from similar ones; empty if unknown.
    descriptions : tuple of tuples of str
        Descriptions of each action's clips by people; empty if unknown.
    """

    name: str
    skeleton: Skeleton
    actions: tuple[str, ...]
    joints: tuple[FloatArray, ...] = field(repr=False)
    labels: IntArray = field(repr=False)
    clip_names: tuple[str, ...] = field(repr=False)
    subjects: tuple[str, ...] = field(repr=False)
    fps: float
    length: int
    frame: NativeFrame = NativeFrame()
    trajectory: bool = True
    notes: tuple[str, ...] = ()
    traits: tuple[tuple[str, ...], ...] = ()
    descriptions: tuple[tuple[str, ...], ...] = ()

    @classmethod
    def from_clips(cls, clips: Sequence[Clip], **facts: Any) -> ActionDataset:
        """Make a data set of clips; `facts` are the attributes that clips do not hold."""
        return cls(
            joints=tuple(clip.joints for clip in clips),
            labels=np.asarray([clip.action for clip in clips], dtype=np.int64),
            clip_names=tuple(clip.name for clip in clips),
            subjects=tuple(clip.subject for clip in clips),
            **facts,
        )

    def __len__(self) -> int:
        return len(self.joints)

    @cached_property
    def sha256(self) -> str:
        """SHA-256 over names, labels and joints. It identifies the data of a result."""
        made = hashlib.sha256(repr((self.name, self.actions, self.clip_names, self.fps)).encode())
        made.update(np.ascontiguousarray(self.labels, dtype=np.int64).tobytes())
        for joints in self.joints:
            made.update(np.ascontiguousarray(joints, dtype=np.float32).tobytes())
        return made.hexdigest()

    @cached_property
    def clip_bone_lengths(self) -> FloatArray:
        """Median bone lengths of each clip, (N, J) float32, native units."""
        lengths: FloatArray = np.stack(
            [np.median(bone_lengths(joints, self.skeleton), axis=0) for joints in self.joints]
        ).astype(np.float32)
        return lengths

    @cached_property
    def _motion_skeleton(self) -> Skeleton:
        return skeleton_of(
            self.skeleton.name, self.skeleton.parents.tolist(), self.skeleton.joint_names
        )

    def motion(self, index: int) -> Motion:
        """Return clip `index` as a Motion: meters, starting above the origin, its lowest joint on
        the ground."""
        joints = self.joints[index] * np.float32(self.frame.meters_per_unit)
        joints = joints - np.array(
            [joints[0, 0, 0], joints[..., 1].min(), joints[0, 0, 2]], dtype=np.float32
        )
        return Motion(
            joints=joints,
            # a Motion names its skeleton, so the rotations must be those of the skeleton of that
            # name
            rotations=inverse_kinematics(joints, self._motion_skeleton).astype(np.float32),
            root=joints[:, 0],
            fps=self.fps,
            parents=self.skeleton.parents,
            joint_names=self.skeleton.joint_names,
            skeleton=self.skeleton.name,
            action=self.actions[int(self.labels[index])],
            provenance={"dataset": self.name, "clip": self.clip_names[index]},
        )

    def subset(self, keep: Sequence[int]) -> ActionDataset:
        """Return the clips of the given indices, with all actions kept in their order."""
        return dataclasses.replace(
            self,
            joints=tuple(self.joints[i] for i in keep),
            labels=self.labels[list(keep)],
            clip_names=tuple(self.clip_names[i] for i in keep),
            subjects=tuple(self.subjects[i] for i in keep),
        )

    def split(self, held_out: Sequence[str]) -> tuple[ActionDataset, ActionDataset]:
        """Split into (training, held-out) clips; the latter are of the subjects `held_out`.

        Raises
        ------
        InputError
            A subject is unknown or a side is empty.
        """
        known = set(self.subjects)
        if missing := sorted(set(held_out) - known):
            raise InputError(
                f"{self.name} has no subject '{missing[0]}'; it has {', '.join(sorted(known))}"
            )
        inside = [i for i, subject in enumerate(self.subjects) if subject in set(held_out)]
        outside = [i for i, subject in enumerate(self.subjects) if subject not in set(held_out)]
        if not inside or not outside:
            raise InputError(
                f"holding out {', '.join(held_out)} leaves one side of {self.name} empty"
            )
        return self.subset(outside), self.subset(inside)

    def split_clips(
        self, share: float = 0.2, *, seed: int = 0
    ) -> tuple[ActionDataset, ActionDataset]:
        """Split into (training, held-out) clips; the latter have `share` of every action.

        An action keeps at least one clip for training. For data with unknown subjects: clips of one
        person on both sides give better results than `split` would.

        Raises
        ------
        InputError
            No action has clips to spare.
        """
        generator = np.random.default_rng(seed)
        held: list[int] = []
        for label in np.unique(self.labels):
            own = np.flatnonzero(self.labels == label)
            held += generator.permutation(own)[
                : min(max(round(share * len(own)), 1), len(own) - 1)
            ].tolist()
        if not held:
            raise InputError(
                f"no action of {self.name} has two clips; record more, so that some can be held out"
            )
        return self.subset(np.setdiff1d(np.arange(len(self)), held).tolist()), self.subset(
            sorted(held)
        )

    def choose_subjects(self, share: float = 0.2, *, seed: int = 0) -> tuple[str, ...]:
        """Choose subjects to hold out: about `share` of the clips, with every action left on the
        training side.

        Subjects are taken in a random order as long as they fit. The choice depends only on the
        data and on `seed`.

        Raises
        ------
        InputError
            There is only one subject, or none can be spared.
        """
        subjects, actions = np.array(self.subjects), set(self.labels.tolist())
        order = [
            str(name)
            for name in np.random.default_rng(seed).permutation(sorted(set(self.subjects)))
        ]
        chosen: list[str] = []

        def spared(names: list[str]) -> bool:
            return set(self.labels[~np.isin(subjects, names)].tolist()) == actions

        for subject in order:
            held = int(np.isin(subjects, [*chosen, subject]).sum())
            if held <= share * len(self) and spared([*chosen, subject]):
                chosen.append(subject)
        if not chosen:  # every subject has more than the share: take the one with the fewest clips
            chosen = sorted((name for name in order if spared([name])), key=self.subjects.count)[:1]
        if not chosen:
            raise InputError(
                f"{self.name} has {len(order)} subjects ({', '.join(order[:5])}); none can be held "
                "out without losing an action: "
                "name each clip SUBJECT_something, or record more people"
            )
        return tuple(sorted(chosen))


class ClipSampler:
    """Random windows of a data set, all of one length, drawn without a loop over clips.

    A window starts at a random frame of its clip; a clip that is too short is padded by repeating
    its last pose; the first root is moved to the origin (the papers' protocol).

    `balance` is the fraction of a batch for which first an action is drawn uniformly, and then one
    of its clips. The others are drawn uniformly from all clips.
    """

    def __init__(self, dataset: ActionDataset, length: int, *, balance: float = 0.0) -> None:
        self.length = length
        self.labels = np.asarray(dataset.labels, dtype=np.int64)
        self.balance = balance
        self._by_action = np.argsort(self.labels, kind="stable")
        self._clips_of = np.bincount(self.labels)
        self._frames = np.concatenate(dataset.joints).astype(np.float32)
        self._counts = np.array([len(joints) for joints in dataset.joints])
        self._starts = np.concatenate([[0], np.cumsum(self._counts)[:-1]])
        self._lengths = dataset.clip_bone_lengths

    def windows(self, clips: IntArray, generator: np.random.Generator) -> FloatArray:
        """Draw one random window (B, length, J, 3) float32 of each clip index in `clips` (B,)."""
        slack = np.maximum(self._counts[clips] - self.length, 0)
        first = generator.integers(0, slack + 1)
        index = np.minimum(
            first[:, None] + np.arange(self.length), self._counts[clips][:, None] - 1
        )
        joints = self._frames[self._starts[clips][:, None] + index]
        moved: FloatArray = joints - joints[:, :1, :1]
        return moved

    def draw(self, size: int, generator: np.random.Generator) -> IntArray:
        """Draw indices (B,) of `size` clips with replacement."""
        clips: IntArray = generator.integers(0, len(self.labels), size)
        if self.balance:
            actions = generator.choice(np.flatnonzero(self._clips_of), size)
            first = np.cumsum(self._clips_of) - self._clips_of
            alike = self._by_action[
                first[actions] + (generator.random(size) * self._clips_of[actions]).astype(np.int64)
            ]
            clips = np.where(generator.random(size) < self.balance, alike, clips)
        return clips

    def batch(
        self, size: int, generator: np.random.Generator
    ) -> tuple[FloatArray, IntArray, FloatArray]:
        """Draw `size` clips with replacement: windows (B, T, J, 3), labels (B,), bone lengths (B,
        J)."""
        clips = self.draw(size, generator)
        return self.windows(clips, generator), self.labels[clips], self._lengths[clips]
