"""Sampling of exported motion models with onnxruntime: no torch in the process."""

from __future__ import annotations

import difflib
import functools
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import Skeleton, inverse_kinematics, skeleton_of
from a2v.sessions import WEIGHTS, file_digest, open_session, read_metadata, run_rows
from a2v.types import FloatArray, IntArray, Motion

BUNDLED = {
    "cmu": "motion_cmu.onnx",
    "humanact12": "motion_humanact12.onnx",
    "humanact12-fine": "motion_humanact12_fine.onnx",
    "cmu-glmi-m": "motion_cmu_glmi_m.onnx",
    "cmu-glmi-r": "motion_cmu_glmi_r.onnx",
    "humanact12-glmi-m": "motion_humanact12_glmi_m.onnx",
    "humanact12-glmi-r": "motion_humanact12_glmi_r.onnx",
    "humanact12-lie": "motion_humanact12_lie.onnx",
    "humanact12-plain": "motion_humanact12_plain.onnx",
}
"""Shipped motion models by name."""

MAX_FRAMES = 10_000
"""Longest clip that is generated in one call."""

_STEP, _WINDOW = "a2v-motion/1", "a2v-flow/1"
Noise = Callable[[tuple[int, ...]], FloatArray]
"""Gives standard normal numbers (float32) of a shape."""

_STATES = ("previous", "prior", "low", "high", "trajectory")


@dataclass(frozen=True)
class MotionModel:
    """An exported motion VAE, ready to sample.

    Attributes
    ----------
    path : Path
    metadata : dict
        What the file says about itself: actions, fps, frames, skeleton, bone lengths, units, licence...
    """

    path: Path
    metadata: dict[str, Any]

    @classmethod
    def load(cls, model: str | os.PathLike[str]) -> MotionModel:
        """Open a shipped model by name ("cmu", "humanact12") or an ``.onnx`` file.

        Raises
        ------
        InputError
            No such model, or the file is no motion model of a2v.
        """
        name = os.fspath(model)
        path = WEIGHTS / BUNDLED[name] if name in BUNDLED else Path(name)
        if not path.is_file():
            raise InputError(f"motion model '{name}' not found; give {', '.join(BUNDLED)} or an .onnx file exported by a2v")
        metadata = read_metadata(path, (_STEP, _WINDOW), "motion model")
        return cls(path, metadata)

    @property
    def actions(self) -> tuple[str, ...]:
        """Names of the actions in label order."""
        return tuple(self.metadata["actions"])

    @property
    def fps(self) -> float:
        """Frames per second of what it generates."""
        return float(self.metadata["fps"])

    @property
    def bone_lengths(self) -> FloatArray:
        """Default bone lengths (J,) float32, native units."""
        return np.asarray(self.metadata["bone_lengths"], dtype=np.float32)

    @functools.cached_property
    def skeleton(self) -> Skeleton:
        """The tree of its joints."""
        skeleton = self.metadata["skeleton"]
        return skeleton_of(skeleton["name"], skeleton["parents"], skeleton["joint_names"])

    @functools.cached_property
    def _rests_as_named(self) -> bool:
        """Whether the file's rotations are those of `skeleton`; a user's own skeleton was learned with its own rest pose."""
        return bool(np.allclose(self.metadata["skeleton"]["rest_directions"], self.skeleton.rest_directions, atol=1e-6))

    @property
    def digest(self) -> str:
        """SHA-256 of the file."""
        return file_digest(self.path)

    @property
    def makes_windows(self) -> bool:
        """Whether noise becomes whole windows (a flow); otherwise one frame follows the other (a VAE)."""
        return bool(self.metadata["format"] == _WINDOW)

    def label(self, action: str) -> int:
        """Index of an action; case, spaces, hyphens and underscores don't matter.

        Raises
        ------
        InputError
            Unknown action; the message names the nearest ones.
        """
        plain = {plain_name(name): index for index, name in enumerate(self.actions)}
        wanted = plain_name(action)
        if wanted in plain:
            return plain[wanted]
        near = difflib.get_close_matches(wanted, plain, n=3, cutoff=0.5)
        hint = f"did you mean {' or '.join(self.actions[plain[name]] for name in near)}?" if near else f"it knows {', '.join(self.actions)}"
        raise InputError(f"unknown action '{action}' for model '{self.path.stem}'; {hint}")

    def generate(
        self, labels: IntArray, lengths: FloatArray, generator: np.random.Generator | Noise, start: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Generate clips of explicit actions and bodies: what `sample`, the applications and the evaluation are made of.

        Parameters
        ----------
        labels : (N, T) int
            Action of every frame; models of whole windows want the same changes in all clips.
        lengths : (N, J) float32
            Bone lengths, native units.
        generator : numpy Generator or Noise
            Draws the noise, or gives it: called with a shape as often as the model needs noise (once for a step model, once
            a window for a window model), so that applications can choose it.
        start : (N, P, J, 3) float or None
            First frames of the clips, metres, y up: they are kept as they are, and what follows goes on from them.

        Returns
        -------
        joints : (N, T, J, 3) float32
            Metres, y up, the first root near the origin, or where `start` has it.
        rotations : (N, T, J, 3) float32

        Raises
        ------
        InputError
            `start` is not shorter than the clips.
        """
        if start is not None and not 1 <= start.shape[1] < labels.shape[1]:
            raise InputError(f"{start.shape[1]} given frames leave nothing to generate of {labels.shape[1]}; ask for more frames")
        noise = generator if not isinstance(generator, np.random.Generator) else functools.partial(_normal, generator)
        if self.makes_windows:
            joints, rotations = self._continue_windows(labels, lengths, noise, start)
        else:
            drawn = noise((*labels.shape, self.metadata["latent_size"]))
            joints, rotations = (
                self.run_steps(labels, drawn, lengths) if start is None else self._continue_steps(labels, drawn, lengths, start)
            )
        if not self._rests_as_named:
            rotations = inverse_kinematics(joints, self.skeleton).astype(np.float32)
        return joints, rotations

    def generate_like_data(self, labels: IntArray, lengths: FloatArray, frames: int, generator: np.random.Generator) -> FloatArray:
        """Joints (N, T, J, 3) that are distributed as the data's windows, ended clips that hold their last pose included.

        A step model learned such endings; a window model is told how long each clip moves, drawn from the data's
        distribution for its action.

        Parameters
        ----------
        labels : (N,) int
        lengths : (N, J) float32
            Native units.
        frames : int
            At most one window.
        generator : numpy Generator
        """
        if not self.makes_windows:
            return self.generate(np.repeat(labels[:, None], frames, axis=1), lengths, generator)[0]
        if frames > self.metadata["window_frames"]:
            raise InputError(f"{self.path.name} makes windows of {self.metadata['window_frames']} frames; {frames} were asked for")
        shares = [np.asarray(values) for values in self.metadata["active"]]
        active = np.array([generator.choice(shares[label]) for label in labels])
        noise = generator.standard_normal((len(labels), self.metadata["latent_size"]), dtype=np.float32)
        return self.run_window(labels, active, noise, lengths)[0][:, :frames]

    def run_steps(self, labels: IntArray, noise: FloatArray, lengths: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joints and rotations of a step model for explicit noise (N, T, Z); see `generate`."""
        count, frames = labels.shape
        feed = initial_feed(self.metadata, count) | {
            "noise": np.asarray(noise, dtype=np.float32),
            "actions": np.asarray(labels, dtype=np.int64),
            "time": np.tile((np.arange(frames, dtype=np.float32) + 1) / np.float32(frames), (count, 1)),
            "bone_lengths": np.asarray(lengths, dtype=np.float32),
        }
        joints, rotations = run_rows(open_session(self.path), ["joints", "rotations"], feed)
        return joints, rotations

    def _continue_steps(self, labels: IntArray, noise: FloatArray, lengths: FloatArray, start: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As `run_steps`, but the first frames are those of `start`: the states follow them, as under teacher forcing."""
        count, frames = labels.shape
        given, unit = start.shape[1], np.float32(self.metadata["metres_per_unit"])
        native = ((start - start[:, :1, :1]) / unit).astype(np.float32)
        time = np.tile((np.arange(frames, dtype=np.float32) + 1) / np.float32(frames), (count, 1))
        states = initial_feed(self.metadata, count)
        session, names = open_session(self.path), [f"last_{name}" for name in _STATES]
        feed: dict[str, np.ndarray] = {"noise": np.asarray(noise, np.float32), "actions": np.asarray(labels, np.int64), "time": time}
        body = {"bone_lengths": np.asarray(lengths, np.float32)}
        for t in range(given):
            new = session.run(names, {name: array[:, t : t + 1] for name, array in feed.items()} | states | body)
            states = dict(zip(_STATES, new, strict=True)) | {"previous": native[:, t]}
        joints, rotations = session.run(["joints", "rotations"], {name: array[:, given:] for name, array in feed.items()} | states | body)
        return self._after(start, joints + start[:, :1, :1], rotations)

    def _after(self, start: FloatArray, joints: FloatArray, rotations: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Given frames followed by generated ones: joints and rotations (N, P + T, J, 3) float32."""
        turns = inverse_kinematics(np.asarray(start, dtype=np.float32), self.skeleton)
        return np.concatenate([start, joints], axis=1).astype(np.float32), np.concatenate([turns, rotations], axis=1).astype(np.float32)

    def run_window(
        self, labels: IntArray, active: FloatArray, noise: FloatArray, lengths: FloatArray, context: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """One window of a window model: joints (metres, first root at the origin) and rotations (N, W, J, 3).

        Parameters
        ----------
        labels : (N,) int
        active : (N,) float
            Share of the window that is in motion.
        noise : (N, Z) float32
        lengths : (N, J) float32
            Native units.
        context : (N, P, J, 3) float32 or None
            Frames that the window repeats at its start and goes on from, metres.
        """
        count = len(labels)
        given = np.zeros((count, self.metadata["context_frames"], lengths.shape[1], 3), np.float32) if context is None else context
        feed: dict[str, FloatArray] = {
            "noise": np.asarray(noise, dtype=np.float32),
            "actions": np.asarray(labels, dtype=np.int64),
            "active": np.asarray(active, dtype=np.float32),
            "context": np.asarray(given, dtype=np.float32),
            "has_context": np.full(count, context is not None, dtype=np.float32),
            "bone_lengths": np.asarray(lengths, dtype=np.float32),
        }
        joints, rotations = run_rows(open_session(self.path), ["joints", "rotations"], feed)
        return joints, rotations

    def active_share(self, label: int) -> float:
        """Share of a window that clips of an action typically move: the 90 % quantile of the data."""
        shares = self.metadata["active"][label]
        return float(shares[int(0.9 * (len(shares) - 1))])

    def _continue_windows(
        self, labels: IntArray, lengths: FloatArray, noise: Noise, start: FloatArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """Windows that continue one another until all frames are there; a change of the action starts a new one."""
        count, frames = labels.shape
        window, given = self.metadata["window_frames"], self.metadata["context_frames"]
        changes = np.flatnonzero((labels[:, 1:] != labels[:, :-1]).any(axis=0)) + 1
        joints: FloatArray = np.zeros((count, 0, lengths.shape[1], 3), np.float32)
        rotations: FloatArray = joints
        if start is not None:
            joints, rotations = self._after(start, joints, rotations)
        for end in [*changes, frames]:
            label = labels[:, end - 1]
            share = np.array([self.active_share(int(k)) for k in label], dtype=np.float32)
            usable = max(round(float(share.min()) * window), given + 4)
            while joints.shape[1] < end:
                context = None
                if joints.shape[1]:
                    context = joints[:, np.maximum(np.arange(-given, 0) + joints.shape[1], 0)]
                new, turns = self.run_window(label, share, noise((count, self.metadata["latent_size"])), lengths, context)
                if context is not None:
                    new = (new + context[:, :1, :1])[:, given:]
                    turns = turns[:, given:]
                take = min(usable - (given if context is not None else 0), end - joints.shape[1])
                joints = np.concatenate([joints, new[:, :take]], axis=1)
                rotations = np.concatenate([rotations, turns[:, :take]], axis=1)
        return joints, rotations

    def to_native(self, joints: FloatArray) -> FloatArray:
        """World joints (..., T, J, 3) in the data set's own frame and unit, first root at the origin.

        This is what the papers' classifiers expect.
        """
        moved = joints - joints[..., :1, :1, :]
        native: FloatArray = moved / np.float32(self.metadata["metres_per_unit"]) * np.asarray(self.metadata["native_signs"], np.float32)
        return native

    def sample_native(
        self, action: str, *, frames: int = 60, count: int = 1, seed: int = 0, lengths: FloatArray | None = None
    ) -> FloatArray:
        """Clips of one action as the papers' classifiers expect them: (N, T, J, 3) float32, native frame and unit, first root at
        the origin.

        Up to one window they move as long as the data's own clips do and then hold their last pose, as in the evaluation,
        because the classifiers know clips that way; longer ones are those of `sample`.

        Parameters
        ----------
        action : str
        frames, count, seed : int
        lengths : (J,) float or None
            Bone lengths, native units; the model's own without.

        Raises
        ------
        InputError
            Unknown action, or a number out of range.
        """
        names = self.check_request(action, frames, count)
        bodies = np.tile(self.bone_lengths if lengths is None else np.asarray(lengths, dtype=np.float32), (count, 1))
        labels, generator = np.tile(self.frame_labels(names, frames), (count, 1)), np.random.default_rng(seed)
        if frames <= int(self.metadata["frames"]):
            return self.to_native(self.generate_like_data(labels[:, 0], bodies, frames, generator))
        return self.to_native(level_floor(self.generate(labels, bodies, generator)[0], int(self.metadata["frames"])))

    def scaled_bones(self, bone_scale: float | Mapping[str, float] = 1.0) -> FloatArray:
        """Default bone lengths (J,) float32, native units, times a factor for all, or by joint or part of the body.

        Parameters
        ----------
        bone_scale : float, or mapping of names to floats
            Names are joints (the bone that ends there), "arms", "legs", "torso", "head" or "all"; later ones multiply earlier ones.

        Raises
        ------
        InputError
            A factor is not within 0.1 to 10, or a name is unknown.
        """
        lengths = self.bone_lengths.copy()
        parts = body_parts(self.skeleton)
        names = self.skeleton.joint_names
        for name, factor in {"all": bone_scale}.items() if isinstance(bone_scale, float | int) else bone_scale.items():
            if not 0.1 <= factor <= 10:
                raise InputError(f"bone_scale is {factor}; expected 0.1 to 10")
            chosen = parts.get(name) or ((names.index(name),) if name in names[1:] else ())
            if not chosen:
                raise InputError(f"no bone '{name}' to scale; choose from {', '.join(sorted(parts))}, or a joint: {', '.join(names[1:])}")
            lengths[list(chosen)] *= np.float32(factor)
        return lengths

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
            Frames a clip, at `fps`.
        count : int
            Clips; with 1 the result has no leading dimension.
        seed : int
            Seed of the noise.
        bone_scale : float or mapping
            Factor on bone lengths; see `scaled_bones`.
        lengths : (J,) float or None
            Bone lengths of one's own, native units, instead of the scaled defaults.

        Returns
        -------
        Motion
            Metres, y up, above the origin at the first frame, lowest joint of each clip on the ground.

        Raises
        ------
        InputError
            Unknown action, or a number out of range.
        """
        names = self.check_request(action, frames, count)
        body = self.scaled_bones(bone_scale) if lengths is None else np.asarray(lengths, dtype=np.float32)
        joints, rotations = self.generate(
            np.tile(self.frame_labels(names, frames), (count, 1)), np.tile(body, (count, 1)), np.random.default_rng(seed)
        )
        scales = dict(bone_scale) if isinstance(bone_scale, Mapping) else bone_scale
        motion = self.to_motion(joints, rotations, body, names, seed, bone_scale=scales)
        return motion if count > 1 else motion[0]

    def check_request(self, action: str | Sequence[str], frames: int, count: int) -> list[str]:
        """The actions' names as a list, with every name and number checked.

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
        """Label of every frame (T,) when `names` follow each other in equal parts."""
        labels: IntArray = np.repeat([self.label(name) for name in names], -(-frames // len(names)))[:frames]
        return labels

    def to_motion(
        self,
        joints: FloatArray,
        rotations: FloatArray,
        lengths: FloatArray,
        names: Sequence[str],
        seed: int,
        *,
        place: bool = True,
        **provenance: Any,
    ) -> Motion:
        """What `generate` made, as a batch of clips that stand on the ground.

        Parameters
        ----------
        joints, rotations : (N, T, J, 3) float32
        lengths : (J,) or (N, J) float32
            Bone lengths that they were made with, native units: longer legs take longer steps, so the root's path is scaled
            by how much longer the legs are than the model's own.
        names : sequence of str
        seed : int
        place : bool
            Level the floor, scale the path, and start above the origin with the lowest joint on the ground; otherwise the
            joints are kept where they are.
        **provenance
            What else made the clips; must be JSON.
        """
        if place:
            step = leg_length(lengths, self.skeleton) / leg_length(self.bone_lengths, self.skeleton)
            root = joints[:, :, :1]
            joints = joints + (np.asarray(step, np.float32).reshape(-1, 1, 1, 1) - 1) * (root - root[:, :1])
            joints = level_floor(joints, int(self.metadata["frames"]))
            joints = joints - ground_offset(joints)
        skeleton = self.metadata["skeleton"]
        return Motion(
            joints=joints,
            rotations=rotations,
            root=joints[..., 0, :],
            fps=self.fps,
            parents=np.asarray(skeleton["parents"]),
            joint_names=tuple(skeleton["joint_names"]),
            skeleton=skeleton["name"],
            action=",".join(names),
            seed=seed,
            provenance={
                "model": self.path.name, "model_digest": self.digest, "seed": seed, "frames": joints.shape[1], **provenance,
            },
        )  # fmt: skip


def _normal(generator: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    return generator.standard_normal(shape, dtype=np.float32)


def plain_name(name: str) -> str:
    """An action's name without case, spaces, hyphens and underscores: what two ways to write it share."""
    return "".join(character for character in name.lower() if character.isalnum())


def initial_feed(metadata: dict[str, Any], count: int) -> dict[str, FloatArray]:
    """Zero states for the first frame of `count` clips."""
    hidden, joints = metadata["hidden_size"], len(metadata["skeleton"]["parents"])
    shapes = dict.fromkeys(_STATES, (count, hidden)) | {"previous": (count, joints, 3)}
    return {name: np.zeros(shape, dtype=np.float32) for name, shape in shapes.items()}


def ground_offset(joints: FloatArray) -> FloatArray:
    """What to subtract from joints (N, T, J, 3) to start above the origin with the lowest joint at y = 0: (N, 1, 1, 3)."""
    offset = np.zeros((len(joints), 1, 1, 3), dtype=np.float32)
    offset[:, 0, 0] = joints[:, 0, 0]
    offset[:, 0, 0, 1] = joints[..., 1].min(axis=(1, 2))
    return offset


def level_floor(joints: FloatArray, window: int, piece: int | None = None) -> FloatArray:
    """Keep the floor of long clips (N, T, J, 3) where it is in their first `window` frames.

    Models learn the root's path from short clips, so that a small slope in every window adds up: 600 frames of Run rose by
    1.3 m. The lowest joint over `piece` frames (half a window by default) is taken for the floor's height; what it moves away
    is taken off, linearly between pieces. Clips of at most `window` frames are returned as they are.
    """
    frames, half = joints.shape[1], piece or window // 2
    if frames <= window or half < 1:
        return joints
    middles = np.arange(window + half // 2, frames, half)
    if not len(middles) or middles[-1] + half // 2 < frames - 1:
        middles = np.append(middles, max(window, frames - 1 - half // 2))
    at = np.concatenate([[window - 1], middles])
    lowest = joints[..., 1].min(axis=-1).astype(np.float64)
    floor = lowest[:, :window].min(axis=1)
    lift = np.zeros_like(lowest)
    for _ in range(3):  # the lowest joint is seen where a slope begins, so that a third of it stays after one pass
        level = np.stack([(lowest - lift)[:, max(t - half // 2, 0) : t + half // 2 + 1].min(axis=1) for t in middles], axis=1)
        away = np.concatenate([np.zeros((len(joints), 1)), level - floor[:, None]], axis=1)
        lift += np.stack([np.interp(np.arange(frames), at, row) for row in away])
    levelled = joints.copy()
    levelled[..., 1] -= lift[..., None].astype(joints.dtype)
    return levelled


def body_parts(skeleton: Skeleton) -> dict[str, tuple[int, ...]]:
    """Joints whose bones make up "arms", "legs", "head", "torso" (the others) and "all"; without those that have none."""
    from a2v.kinematics.names import canonical_joints

    found = canonical_joints(skeleton.joint_names, skeleton.parents.tolist())
    ends = {"arms": ("elbow", "wrist", "hand", "thumb"), "legs": ("knee", "ankle", "foot", "toes")}
    parts = {
        part: tuple(found[f"{side}_{end}"] for side in ("left", "right") for end in names if f"{side}_{end}" in found)
        for part, names in ends.items()
    }
    parts["head"] = tuple(found[name] for name in ("head", "head_top") if name in found)
    limbs = {joint for part in parts.values() for joint in part}
    parts["torso"] = tuple(joint for joint in range(1, skeleton.n_joints) if joint not in limbs)
    parts["all"] = tuple(range(1, skeleton.n_joints))
    return {name: joints for name, joints in parts.items() if joints}


def leg_length(lengths: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Sum of the legs' bone lengths (..., J), or of all bones where no legs are known: (...)."""
    parts = body_parts(skeleton)
    total: FloatArray = np.asarray(lengths)[..., list(parts.get("legs", parts["all"]))].sum(axis=-1)
    return total
