"""Sampling of exported motion models with onnxruntime: no torch in the process."""

from __future__ import annotations

import difflib
import functools
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.io import sha256
from a2v.types import FloatArray, IntArray, Motion

WEIGHTS = Path(__file__).resolve().parent.parent / "weights"
"""Where the shipped networks are."""

BUNDLED = {"cmu": "motion_cmu.onnx", "humanact12": "motion_humanact12.onnx"}
"""Shipped motion models by name."""

MAX_FRAMES = 10_000
"""Longest clip that is generated in one call."""

_STEP, _WINDOW = "a2v-motion/1", "a2v-flow/1"
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
            raise InputError(f"motion model '{name}' not found; give {' or '.join(BUNDLED)}, or an .onnx file exported by a2v")
        try:
            meta = _session(path).get_modelmeta().custom_metadata_map.get("a2v", "")
            metadata = json.loads(meta)
        except InputError:
            raise
        except Exception as error:  # onnxruntime and json raise many kinds for a foreign file
            raise InputError(f"{path} is no motion model of a2v ({type(error).__name__})") from None
        if metadata.get("format") not in (_STEP, _WINDOW):
            raise InputError(f"{path} has the format {metadata.get('format')!r}; this version reads {_STEP} and {_WINDOW}")
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

    @property
    def digest(self) -> str:
        """SHA-256 of the file."""
        return sha256(self.path)

    def label(self, action: str) -> int:
        """Index of an action; case, spaces, hyphens and underscores don't matter.

        Raises
        ------
        InputError
            Unknown action; the message names the nearest ones.
        """
        plain = {_plain(name): index for index, name in enumerate(self.actions)}
        wanted = _plain(action)
        if wanted in plain:
            return plain[wanted]
        near = difflib.get_close_matches(wanted, plain, n=3, cutoff=0.5)
        hint = f"did you mean {' or '.join(self.actions[plain[name]] for name in near)}?" if near else f"it knows {', '.join(self.actions)}"
        raise InputError(f"unknown action '{action}' for model '{self.path.stem}'; {hint}")

    def generate(self, labels: IntArray, lengths: FloatArray, generator: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Generate clips of explicit actions and bodies: what `sample` and the evaluation are made of.

        Parameters
        ----------
        labels : (N, T) int
            Action of every frame; models of whole windows want the same changes in all clips.
        lengths : (N, J) float32
            Bone lengths, native units.
        generator : numpy Generator
            Draws the noise.

        Returns
        -------
        joints : (N, T, J, 3) float32
            Metres, y up, the first root near the origin.
        rotations : (N, T, J, 3) float32
        """
        if self.metadata["format"] == _WINDOW:
            return self._continue_windows(labels, lengths, generator)
        noise = generator.standard_normal((*labels.shape, self.metadata["latent_size"]), dtype=np.float32)
        return self.run_steps(labels, noise, lengths)

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
        if self.metadata["format"] == _STEP:
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
        joints, rotations = _session(self.path).run(["joints", "rotations"], feed)
        return joints, rotations

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
        feed = {
            "noise": np.asarray(noise, dtype=np.float32),
            "actions": np.asarray(labels, dtype=np.int64),
            "active": np.asarray(active, dtype=np.float32),
            "context": np.asarray(given, dtype=np.float32),
            "has_context": np.full(count, context is not None, dtype=np.float32),
            "bone_lengths": np.asarray(lengths, dtype=np.float32),
        }
        joints, rotations = _session(self.path).run(["joints", "rotations"], feed)
        return joints, rotations

    def active_share(self, label: int) -> float:
        """Share of a window that clips of an action typically move: the 90 % quantile of the data."""
        shares = self.metadata["active"][label]
        return float(shares[int(0.9 * (len(shares) - 1))])

    def _continue_windows(self, labels: IntArray, lengths: FloatArray, generator: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Windows that continue one another until all frames are there; a change of the action starts a new one."""
        count, frames = labels.shape
        window, given = self.metadata["window_frames"], self.metadata["context_frames"]
        changes = np.flatnonzero((labels[:, 1:] != labels[:, :-1]).any(axis=0)) + 1
        joints: FloatArray = np.zeros((count, 0, lengths.shape[1], 3), np.float32)
        rotations: FloatArray = joints
        for end in [*changes, frames]:
            label = labels[:, end - 1]
            share = np.array([self.active_share(int(k)) for k in label], dtype=np.float32)
            usable = max(round(float(share.min()) * window), given + 4)
            while joints.shape[1] < end:
                noise = generator.standard_normal((count, self.metadata["latent_size"]), dtype=np.float32)
                context = None
                if joints.shape[1]:
                    start = np.maximum(np.arange(-given, 0) + joints.shape[1], 0)
                    context = joints[:, start]
                new, turns = self.run_window(label, share, noise, lengths, context)
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

    def sample(
        self,
        action: str | Sequence[str],
        *,
        frames: int = 60,
        count: int = 1,
        seed: int = 0,
        bone_scale: float = 1.0,
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
        bone_scale : float
            Factor on all bone lengths.

        Returns
        -------
        Motion
            Metres, y up, above the origin at the first frame, lowest joint of each clip on the ground.
        """
        if not 1 <= frames <= MAX_FRAMES:
            raise InputError(f"frames is {frames}; expected 1 to {MAX_FRAMES}")
        if count < 1:
            raise InputError(f"count is {count}; expected at least 1")
        if not 0.1 <= bone_scale <= 10:
            raise InputError(f"bone_scale is {bone_scale}; expected 0.1 to 10")
        names = [action] if isinstance(action, str) else list(action)
        if not names:
            raise InputError("no action given")
        labels = np.repeat([self.label(name) for name in names], -(-frames // len(names)))[:frames]
        lengths = self.bone_lengths * np.float32(bone_scale)
        joints, rotations = self.generate(np.tile(labels, (count, 1)), np.tile(lengths, (count, 1)), np.random.default_rng(seed))
        joints = joints - ground_offset(joints)
        if count == 1:
            joints, rotations = joints[0], rotations[0]
        skeleton = self.metadata["skeleton"]
        return Motion(
            joints=joints,
            rotations=rotations,
            root=joints[..., 0, :],
            fps=self.fps,
            parents=np.asarray(skeleton["parents"]),
            joint_names=tuple(skeleton["joint_names"]),
            skeleton=skeleton["name"],
            action=",".join(self.actions[self.label(name)] for name in names),
            seed=seed,
            provenance={"model": self.path.name, "model_digest": self.digest, "seed": seed, "frames": frames, "bone_scale": bone_scale},
        )


def _plain(name: str) -> str:
    return "".join(character for character in name.lower() if character.isalnum())


@functools.lru_cache(maxsize=8)
def _cached_session(path: str, _modified: int, threads: int) -> Any:
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.log_severity_level = 3
    return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])


def _session(path: Path, threads: int = 1) -> Any:
    return _cached_session(str(path), path.stat().st_mtime_ns, threads)


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
