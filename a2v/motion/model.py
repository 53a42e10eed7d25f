"""Exported motion models, ready to sample with onnxruntime: no torch in the process."""

from __future__ import annotations

import functools
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from a2v.digest import Digest
from a2v.errors import InputError
from a2v.kinematics import Skeleton, inverse_kinematics
from a2v.motion.card import MAX_FRAMES, ModelCard, StepCard, WindowCard, read_card
from a2v.motion.names import BUNDLED, find_action
from a2v.motion.placement import (
    leg_length,
    level_floor,
    place_on_ground,
    scale_bones,
    scale_path,
    to_native,
)
from a2v.motion.sampling import ClipRequest, Noise, WindowRequest, normal_noise
from a2v.motion.steer import Steerer
from a2v.motion.step_sampler import StepSampler
from a2v.motion.window_sampler import WindowSampler
from a2v.sessions import WEIGHTS, file_digest
from a2v.types import FloatArray, IntArray, Motion


@dataclass(frozen=True)
class MotionModel:
    """An exported motion model.

    Attributes
    ----------
    path : Path
    card : ModelCard
    """

    path: Path
    card: ModelCard

    @classmethod
    def load(cls, model: str | os.PathLike[str]) -> MotionModel:
        """Open a shipped model by name (`BUNDLED`: "cmu", "humanact12"...) or an ``.onnx`` file.

        Raises
        ------
        InputError
            No such model, or the file is no motion model of a2v, or its description is invalid.
        """
        name = os.fspath(model)
        path = WEIGHTS / BUNDLED[name] if name in BUNDLED else Path(name)
        if not path.is_file():
            raise InputError(
                f"motion model '{name}' not found; give {', '.join(BUNDLED)} or an .onnx file exported by a2v"
            )
        if path.suffix == ".pt":
            raise InputError(
                f"{path} is a checkpoint of a training, not a motion model (.onnx); a2v sample, a2v evaluate and a2v survey take the baseline.pt of a2v train baseline"
            )
        return cls(path, read_card(path))

    @property
    def actions(self) -> tuple[str, ...]:
        """Names of the actions in label order."""
        return self.card.actions

    @property
    def fps(self) -> float:
        """Frames per second of what it generates."""
        return self.card.fps

    @property
    def bone_lengths(self) -> FloatArray:
        """Default bone lengths (J,) float32, native units."""
        return self.card.bone_lengths.copy()

    @property
    def skeleton(self) -> Skeleton:
        """The tree of its joints."""
        return self.card.skeleton

    @property
    def digest(self) -> Digest:
        """Digest of the file."""
        return file_digest(self.path)

    @functools.cached_property
    def sampler(self) -> StepSampler | WindowSampler:
        """Object that runs the file's graph."""
        if isinstance(self.card, WindowCard):
            return WindowSampler(self.path, self.card)
        assert isinstance(self.card, StepCard)
        return StepSampler(self.path, self.card)

    @property
    def makes_windows(self) -> bool:
        """Whether the model makes whole windows from noise (a flow); otherwise clips are made frame
        by frame (a VAE)."""
        return isinstance(self.card, WindowCard)

    def label(self, action: str) -> int:
        """Return the index of an action; case, spaces, hyphens and underscores don't matter.

        Raises
        ------
        InputError
            Unknown action; the message names the nearest ones.
        """
        return find_action(action, self.actions, self.path.stem)

    def generate(
        self,
        labels: IntArray,
        lengths: FloatArray,
        generator: np.random.Generator | Noise,
        start: FloatArray | None = None,
        *,
        fresh: bool = False,
        skip_rest: bool = False,
        steerer: Steerer | None = None,
    ) -> tuple[FloatArray, FloatArray]:
        """Generate clips with explicit actions and bodies. `sample`, the applications and the
        evaluation use it.

        Parameters
        ----------
        labels : (N, T) int
            Action of every frame. For window models all clips must change their action at the same
            frames.
        lengths : (N, J) float32
            Bone lengths, native units.
        generator : numpy Generator or Noise
            Generator of the noise, or a function that returns it for a shape and a first frame. It
            is called once for a step model, and once per window for a window model.
        start : (N, P, J, 3) float or None
            First frames of the clips, meters, y up: they are kept unchanged, and the generated
            frames continue them.

        fresh, skip_rest : bool
            See `a2v.motion.sampling.ClipRequest`. `export/sample.py` has neither.
        steerer : Steerer or None
            Steers the windows of one clip, and sets its start (`a2v.motion.direct`).

        Returns
        -------
        joints : (N, T, J, 3) float32
            Meters, y up, the first root near the origin, or at that of `start`.
        rotations : (N, T, J, 3) float32
            Rotation vectors of the chain convention, radians.

        Raises
        ------
        InputError
            `start` is not shorter than the clips.
        """
        if start is not None and not 1 <= start.shape[1] < labels.shape[1]:
            raise InputError(
                f"{start.shape[1]} of {labels.shape[1]} frames are given, so none are left to generate; increase the number of frames"
            )
        noise = normal_noise(generator) if isinstance(generator, np.random.Generator) else generator
        joints, rotations = self.sampler.generate(
            ClipRequest(labels, lengths, noise, start, fresh, skip_rest, steerer)
        )
        if not self.card.rests_as_named:
            rotations = inverse_kinematics(joints, self.skeleton).astype(np.float32)
        return joints, rotations

    def generate_like_data(
        self,
        labels: IntArray,
        lengths: FloatArray,
        frames: int,
        generator: np.random.Generator,
        *,
        active: FloatArray | None = None,
        headings: FloatArray | None = None,
        noise_scale: float = 1.0,
    ) -> FloatArray:
        """Generate joints (N, T, J, 3) float32, meters, with the distribution of the data's
        windows.

        This includes clips that end and hold their last pose. A step model learned such endings. A
        window model gets the moving time of each clip as input, drawn from the data's distribution
        for its action.

        Parameters
        ----------
        labels : (N,) int
        lengths : (N, J) float32
            Native units.
        frames : int
            At most one window.
        generator : numpy Generator
        active, headings : (N,) float or None
            For window models: the fraction of a window in which each clip moves, and its first
            heading (radians about +y from +z) if headings were not learned. Default: drawn for each
            action.
        noise_scale : float
            Factor on the noise; 1 / temperature samples a VAE from its prior.

        Raises
        ------
        InputError
            `frames` is larger than a window.
        """
        request = WindowRequest(labels, lengths, frames, active, headings, noise_scale)
        return self.sampler.generate_like_data(request, generator)

    def to_native(self, joints: FloatArray) -> FloatArray:
        """Convert world joints (..., T, J, 3), meters, to the data set's own frame and unit, first
        root at the origin.

        The papers' classifiers expect this form.
        """
        return to_native(
            joints, meters_per_unit=self.card.meters_per_unit, signs=self.card.native_signs
        )

    def sample_native(
        self,
        action: str,
        *,
        frames: int = 60,
        count: int = 1,
        seed: int = 0,
        lengths: FloatArray | None = None,
    ) -> FloatArray:
        """Sample clips of one action in the form that the papers' classifiers expect: (N, T, J, 3)
        float32, native frame and unit, first root at the origin.

        Clips of up to one window move for as long as the data's clips and then hold their last
        pose, as in the evaluation and in the classifiers' training. Longer ones are those of
        `sample`.

        Parameters
        ----------
        action : str
        frames, count, seed : int
        lengths : (J,) float or None
            Bone lengths, native units; default: the model's.

        Raises
        ------
        InputError
            Unknown action, or a number out of range.
        """
        names = self.check_request(action, frames=frames, count=count)
        bodies = np.tile(
            self.bone_lengths if lengths is None else np.asarray(lengths, dtype=np.float32),
            (count, 1),
        )
        labels, generator = (
            np.tile(self.frame_labels(names, frames), (count, 1)),
            np.random.default_rng(seed),
        )
        if frames <= self.card.frames:
            return self.to_native(self.generate_like_data(labels[:, 0], bodies, frames, generator))
        return self.to_native(
            level_floor(self.generate(labels, bodies, generator)[0], self.card.frames)
        )

    def scaled_bones(self, bone_scale: float | Mapping[str, float] = 1.0) -> FloatArray:
        """Scale the default bone lengths: (J,) float32, native units, by one factor, or by joint or
        part of the body.

        Raises
        ------
        InputError
            See `a2v.motion.placement.scale_bones`.
        """
        return scale_bones(self.bone_lengths, self.skeleton, bone_scale)

    def sample(
        self,
        action: str | Sequence[str],
        *,
        frames: int = 60,
        count: int = 1,
        seed: int = 0,
        bone_scale: float | Mapping[str, float] = 1.0,
        lengths: FloatArray | None = None,
    ) -> Motion:
        """Generate `count` clips.

        Parameters
        ----------
        action : str or sequence of str
            One action, or several that follow each other in equal parts (a transition).
        frames : int
            Frames per clip, at `fps`.
        count : int
            Number of clips; with 1 the result has no leading dimension.
        seed : int
            Seed of the noise.
        bone_scale : float or mapping
            Factor on bone lengths; see `scaled_bones`.
        lengths : (J,) float or None
            Custom bone lengths, native units, instead of the scaled defaults.

        Returns
        -------
        Motion
            Meters, y up, above the origin at the first frame, lowest joint of each clip on the
            ground.

        Raises
        ------
        InputError
            Unknown action, or a number out of range.
        """
        names = self.check_request(action, frames=frames, count=count)
        body = (
            self.scaled_bones(bone_scale)
            if lengths is None
            else np.asarray(lengths, dtype=np.float32)
        )
        joints, rotations = self.generate(
            np.tile(self.frame_labels(names, frames), (count, 1)),
            np.tile(body, (count, 1)),
            np.random.default_rng(seed),
        )
        scales = dict(bone_scale) if isinstance(bone_scale, Mapping) else bone_scale
        motion = self.to_motion(
            joints, rotations, lengths=body, names=names, seed=seed, bone_scale=scales
        )
        return motion if count > 1 else motion[0]

    def check_request(self, action: str | Sequence[str], *, frames: int, count: int) -> list[str]:
        """Check the names and numbers of a request; returns the actions as a list.

        Raises
        ------
        InputError
            Unknown or no action, `frames` or `count` out of range.
        """
        if not 1 <= frames <= MAX_FRAMES:
            raise InputError(f"frames is {frames}; expected 1 to {MAX_FRAMES}")
        if count < 1:
            raise InputError(f"count is {count}; expected at least 1")
        names = [action] if isinstance(action, str) else list(action)
        if not names:
            raise InputError("no action given")
        return [self.actions[self.label(name)] for name in names]

    def frame_labels(self, names: Sequence[str], frames: int) -> IntArray:
        """Return the label of every frame (T,) if `names` follow each other in equal parts."""
        labels: IntArray = np.repeat(
            [self.label(name) for name in names], -(-frames // len(names))
        )[:frames]
        return labels

    def to_motion(
        self,
        joints: FloatArray,
        rotations: FloatArray,
        *,
        lengths: FloatArray,
        names: Sequence[str],
        seed: int,
        place: bool = True,
        **provenance: Any,
    ) -> Motion:
        """Convert the result of `generate` to a batch of clips that stand on the ground.

        Parameters
        ----------
        joints, rotations : (N, T, J, 3) float32
        lengths : (J,) or (N, J) float32
            Bone lengths of the clips, native units. Longer legs take longer steps, so the root's
            path is scaled by the ratio of the legs' length to the model's.
        names : sequence of str
        seed : int
        place : bool
            Level the floor, scale the path, and start above the origin with the lowest joint on the
            ground; otherwise the joints are kept where they are.
        **provenance
            Further facts on the clips; must be JSON.
        """
        if place:
            step = leg_length(lengths, self.skeleton) / leg_length(self.bone_lengths, self.skeleton)
            joints = place_on_ground(scale_path(joints, step), self.card.frames)
        return Motion(
            joints=joints,
            rotations=rotations,
            root=joints[..., 0, :],
            fps=self.fps,
            parents=self.skeleton.parents,
            joint_names=self.card.joint_names,
            skeleton=self.skeleton.name,
            action=",".join(names),
            seed=seed,
            provenance={"model": self.path.name, "model_digest": self.digest, "seed": seed, "frames": joints.shape[1], **provenance},
        )  # fmt: skip
