#!/usr/bin/env python3
"""Sample 3D human motion from one .onnx file of a2v, with numpy and onnxruntime and nothing else.

    python sample.py motion_cmu.onnx                                  # list the actions
    python sample.py motion_cmu.onnx --action Walk --out walk.bvh     # one clip, opens in Blender
    python sample.py motion_cmu.onnx --action Jump --count 8 --seed 3 --frames 90 --out jumps.npz
    python sample.py motion_cmu.onnx --action "walk, then jump" --frames 180 --out two.bvh

Actions are given by their names; `a2v motion` understands other words too.

Copy this file next to the model: it imports nothing of the project.
"""

from __future__ import annotations

import argparse
import difflib
import itertools
import json
import os
import re
import sys
import tempfile
from pathlib import Path

import numpy as np

CLIPS_AT_ONCE = 250
"""Number of clips per run of the graph. More clips take several runs: less memory, not slower."""
MOST = 10_000
"""Largest number of frames, and of numbers in a noise vector, that a model may have."""
FORMATS = ("a2v-motion/1", "a2v-flow/1")
LOGISTIC = 1.702
"""The logistic function of a normal number times this is uniform over [0, 1], to within 0.01."""
STATES = ("previous", "prior", "low", "high", "trajectory")


class Model:
    """An exported motion model.

    `metadata` describes the file: actions, fps, frames, skeleton, bone lengths (native units),
    license.
    """

    def __init__(self, path: str | os.PathLike[str], threads: int = 1) -> None:
        os.environ.setdefault(
            "ORT_DISABLE_TELEMETRY", "1"
        )  # without it, onnxruntime looks up a host and leaves an identity on the disk
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        options.log_severity_level = 3
        try:
            self.session = onnxruntime.InferenceSession(
                os.fspath(path), options, providers=["CPUExecutionProvider"]
            )
            self.metadata = json.loads(self.session.get_modelmeta().custom_metadata_map["a2v"])
            whole = self.metadata["format"] in FORMATS and {
                "actions",
                "fps",
                "frames",
                "skeleton",
                "bone_lengths",
            } <= set(self.metadata)
            takes = {item.name: item.shape[-1] for item in self.session.get_inputs()}
            joints = len(self.metadata["skeleton"]["parents"])
            sizes = {"noise": self.metadata["latent_size"], "bone_lengths": joints}
            fits = (
                all(takes.get(name) == size for name, size in sizes.items())
                and len(self.metadata["bone_lengths"]) == joints
            )
            windows = (
                self.metadata["format"] != "a2v-flow/1"
                or 1 <= self.metadata["window_frames"] <= MOST
            )
            whole = (
                whole
                and fits
                and windows
                and sizes["noise"] <= MOST
                and 1 <= self.metadata["frames"] <= MOST
            )
        except Exception as error:  # onnxruntime and json raise many kinds for a foreign file
            raise ValueError(
                f"{path} is no motion model of a2v ({type(error).__name__}); give an .onnx file "
                "that a2v exported"
            ) from None
        if not whole:
            raise ValueError(
                f"{path} is no motion model that this script knows; expected the format "
                f"{' or '.join(FORMATS)}"
            )

    def label(self, action: str) -> int:
        """Index of an action's name (case, spaces, hyphens and underscores don't matter)."""

        def plain(name: str) -> str:
            return "".join(c for c in name.lower() if c.isalnum())

        known = {plain(name): i for i, name in enumerate(self.metadata["actions"])}
        if plain(action) not in known:
            near = difflib.get_close_matches(plain(action), known, n=3, cutoff=0.5)
            names = [self.metadata["actions"][known[name]] for name in near] or self.metadata[
                "actions"
            ]
            raise ValueError(f"unknown action '{action}'; did you mean {' or '.join(names)}?")
        return known[plain(action)]

    def sample(
        self, action: str, frames: int = 60, count: int = 1, seed: int = 0, bone_scale: float = 1.0
    ) -> dict[str, np.ndarray]:
        """Sample clips: joints (N, T, J, 3) in meters, y up, rotations (N, T, J, 3), root (N, T,
        3)."""
        names = names_of(action)
        labels = np.repeat([self.label(name) for name in names], -(-frames // len(names)))[:frames]
        lengths = np.tile(
            np.asarray(self.metadata["bone_lengths"], np.float32) * np.float32(bone_scale),
            (count, 1),
        )
        generator = np.random.default_rng(seed)
        make = self._windows if self.metadata["format"] == "a2v-flow/1" else self._steps
        joints, rotations = make(labels, lengths, generator)
        path = joints[:, :, :1] - joints[:, :1, :1]
        joints = joints + np.float32(bone_scale - 1) * path  # longer legs take longer steps
        joints = level_floor(joints, int(self.metadata["frames"]))
        offset = np.zeros(
            (count, 1, 1, 3), np.float32
        )  # start above the origin, lowest joint on the ground
        offset[:, 0, 0] = joints[:, 0, 0]
        offset[:, 0, 0, 1] = joints[..., 1].min(axis=(1, 2))
        joints = joints - offset
        return {"joints": joints, "rotations": rotations, "root": joints[:, :, 0]}

    def _steps(
        self, labels: np.ndarray, lengths: np.ndarray, generator: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Sample from a model that makes one frame after the other."""
        meta, count, frames = self.metadata, len(lengths), len(labels)
        feed: dict[str, np.ndarray] = {
            "noise": generator.standard_normal(
                (count, frames, meta["latent_size"]), dtype=np.float32
            ),
            "actions": np.tile(labels.astype(np.int64), (count, 1)),
            "time": np.tile(
                (np.arange(frames, dtype=np.float32) + 1) / np.float32(frames), (count, 1)
            ),
            "bone_lengths": lengths,
            "previous": np.zeros((*lengths.shape, 3), np.float32),
            **{name: np.zeros((count, meta["hidden_size"]), np.float32) for name in STATES[1:]},
        }
        return self._run(feed)

    def _run(self, feed: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Run the graph: joints and rotations. All inputs have one row per clip."""
        starts = range(0, len(feed["noise"]), CLIPS_AT_ONCE)
        parts = [
            {name: array[i : i + CLIPS_AT_ONCE] for name, array in feed.items()} for i in starts
        ]
        made = [self.session.run(["joints", "rotations"], part) for part in parts]
        if len(made) == 1:
            return made[0][0], made[0][1]
        return np.concatenate([joints for joints, _ in made]), np.concatenate(
            [rotations for _, rotations in made]
        )

    def _windows(
        self, labels: np.ndarray, lengths: np.ndarray, generator: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """Sample from a model that makes windows; each continues the last frames of the one
        before."""
        meta, count, frames = self.metadata, len(lengths), len(labels)
        given, window = meta["context_frames"], meta["window_frames"]
        joints = np.zeros((count, frames, lengths.shape[1], 3), np.float32)
        rotations, at = (
            joints.copy(),
            np.zeros(count, np.int64),
        )  # and how many frames each clip has
        for end in [*(np.flatnonzero(labels[1:] != labels[:-1]) + 1), frames]:
            shares = np.asarray(meta["active"][labels[end - 1]], np.float32)
            while (rows := np.flatnonzero(at < end)).size:
                following = bool(at[rows].min() > 0)
                noise = generator.standard_normal((count, meta["latent_size"]), dtype=np.float32)[
                    rows
                ]
                # the last number of the noise draws the moving share of a window; a window that is
                # continued takes one of the longer half
                first = len(shares) // (2 if following else 20)
                even = 1 / (1 + np.exp(-LOGISTIC * noise[:, -1].astype(np.float64)))
                share = shares[first + (even * (len(shares) - first)).astype(np.int64)]
                usable = np.maximum(np.round(share * window).astype(np.int64), given + 4)
                context = np.zeros((len(rows), given, lengths.shape[1], 3), np.float32)
                if following:
                    context = joints[
                        rows[:, None], np.maximum(at[rows][:, None] + np.arange(-given, 0), 0)
                    ]
                feed: dict[str, np.ndarray] = {
                    "noise": noise,
                    "actions": np.full(len(rows), labels[end - 1], np.int64),
                    "active": share,
                    "context": context,
                    "has_context": np.full(len(rows), following, np.float32),
                    "bone_lengths": lengths[rows],
                }
                new, rotated = self._run(feed)
                new = new + context[:, :1, :1]
                skip, left = given if following else 0, end - at[rows]
                # a window that is continued loses its last two frames, in which clips come
                # to rest
                take = np.where(
                    left <= usable - skip, left, np.maximum(usable - 2, given + 4) - skip
                )
                clip, frame = np.nonzero(np.arange(window) < take[:, None])
                joints[rows[clip], at[rows][clip] + frame] = new[clip, skip + frame]
                rotations[rows[clip], at[rows][clip] + frame] = rotated[clip, skip + frame]
                at[rows] += take
        return joints, rotations


def names_of(text: str) -> list[str]:
    """Names of actions in turn, with commas or "then" between them."""
    return [name for name in re.split(r"\s*(?:,|;|\bthen\b)\s*", text.strip()) if name]


def level_floor(joints: np.ndarray, window: int) -> np.ndarray:
    """Keep the floor of long clips (N, T, J, 3) at its height in their first `window` frames.

    Small slopes of the windows would add up. The lowest joint over half a window is taken as the
    floor, and its drift is subtracted.
    """
    frames, half = joints.shape[1], window // 2
    if frames <= window or half < 1:
        return joints
    middles = np.arange(window + half // 2, frames, half)
    if not len(middles) or middles[-1] + half // 2 < frames - 1:
        middles = np.append(middles, max(window, frames - 1 - half // 2))
    at = np.concatenate([[window - 1], middles])
    lowest = joints[..., 1].min(axis=-1).astype(np.float64)
    floor = lowest[:, :window].min(axis=1)
    lift = np.zeros_like(lowest)
    for _ in range(3):
        level = np.stack(
            [
                (lowest - lift)[:, max(t - half // 2, 0) : t + half // 2 + 1].min(axis=1)
                for t in middles
            ],
            axis=1,
        )
        away = np.concatenate([np.zeros((len(joints), 1)), level - floor[:, None]], axis=1)
        lift += np.stack([np.interp(np.arange(frames), at, row) for row in away])
    levelled = joints.copy()
    levelled[..., 1] -= lift[..., None].astype(joints.dtype)
    return levelled


def rotvec_to_rotmat(rotvec: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3)."""
    angle = np.linalg.norm(rotvec, axis=-1)[..., None, None]
    axis = rotvec / np.maximum(angle[..., 0], 1e-12)
    x, y, z = np.moveaxis(axis, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(*x.shape, 3, 3)
    rotmat: np.ndarray = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return rotmat


def rotmat_to_zxy_degrees(rotmat: np.ndarray) -> np.ndarray:
    """Angles (..., 3) in degrees of R = Rz Rx Ry, in the order Z, X, Y."""
    x = np.arcsin(np.clip(rotmat[..., 2, 1], -1, 1))
    z = np.arctan2(-rotmat[..., 0, 1], rotmat[..., 1, 1])
    y = np.arctan2(-rotmat[..., 2, 0], rotmat[..., 2, 2])
    angles: np.ndarray = np.degrees(np.stack([z, x, y], -1))
    return angles


def bone_rotmats(rotations: np.ndarray, chains: list[list[int]]) -> dict[int, np.ndarray]:
    """Return world rotations (T, 3, 3) of the bones; the key of a bone is the joint at its end.

    The root's is the identity.
    """
    local = rotvec_to_rotmat(rotations.astype(np.float64))
    world_rotmat = {0: np.tile(np.eye(3), (len(rotations), 1, 1))}
    for chain in chains:
        for previous, joint in itertools.pairwise(chain):
            # chains start from the identity
            world_rotmat[joint] = (
                local[:, joint]
                if previous == chain[0]
                else world_rotmat[previous] @ local[:, joint]
            )
    return world_rotmat


def bvh(joints: np.ndarray, rotations: np.ndarray, meta: dict) -> str:
    """One clip (T, J, 3) as BVH text in centimeters.

    A BVH joint rotates all bones that start at it, but the model's rotations each turn one bone.
    Where several bones start at a joint, each gets a helper joint of zero offset, ``<joint it leads
    to>_turn``.
    """
    skeleton = meta["skeleton"]
    parents, names = skeleton["parents"], skeleton["joint_names"]
    children: list[list[int]] = [
        [j for j, p in enumerate(parents) if p == parent] for parent in range(len(parents))
    ]
    lengths = 100 * np.linalg.norm(joints[0] - joints[0][np.maximum(parents, 0)], axis=-1)
    offsets = np.asarray(skeleton["rest_directions"]) * lengths[:, None]
    world_rotmat = bone_rotmats(rotations, skeleton["chains"])
    lines, columns = ["HIERARCHY"], [100 * joints[:, 0]]

    def emit(
        name: str,
        offset: np.ndarray,
        rotmat: np.ndarray,
        depth: int,
        inside: list[int],
        joint: int | None,
    ) -> None:
        """Add one node at `joint` (None: a helper that contains only the joint it leads to)."""
        pad = "\t" * depth
        columns.append(rotmat_to_zxy_degrees(rotmat))
        channels = (
            "6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
            if depth == 0
            else "3 Zrotation Xrotation Yrotation"
        )
        lines.extend(
            [
                f"{pad}{'JOINT' if depth else 'ROOT'} {name}",
                f"{pad}{{",
                f"{pad}\tOFFSET {' '.join(f'{v:.6f}' for v in offset)}",
            ]
        )
        lines.append(f"{pad}\tCHANNELS {channels}")
        for child in inside:
            relative = (
                np.swapaxes(world_rotmat[joint], -1, -2) @ world_rotmat[child]
                if joint is not None
                else None
            )
            if relative is not None and len(inside) > 1:
                emit(f"{names[child]}_turn", np.zeros(3), relative, depth + 1, [child], None)
            else:
                emit_joint(child, depth + 1)
        if not inside:
            lines.extend(
                [
                    f"{pad}\tEnd Site",
                    f"{pad}\t{{",
                    f"{pad}\t\tOFFSET 0.000000 0.000000 0.000000",
                    f"{pad}\t}}",
                ]
            )
        lines.append(f"{pad}}}")

    def emit_joint(joint: int, depth: int) -> None:
        own = children[joint]
        rotmat = (
            np.swapaxes(world_rotmat[joint], -1, -2) @ world_rotmat[own[0]]
            if len(own) == 1
            else np.eye(3)[None].repeat(len(joints), 0)
        )
        emit(names[joint], offsets[joint] if joint else np.zeros(3), rotmat, depth, own, joint)

    emit_joint(0, 0)
    lines.extend(["MOTION", f"Frames: {len(joints)}", f"Frame Time: {1 / meta['fps']:.8f}"])
    lines.extend(" ".join(f"{v:.6f}" for v in row) for row in np.concatenate(columns, axis=1))
    return "\n".join(lines) + "\n"


def write(path: Path, data: bytes) -> None:
    """Write a file under a temporary name, then rename it."""
    handle, temporary = tempfile.mkstemp(dir=path.parent or Path(), suffix=path.suffix)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        mask = os.umask(0o022)  # umask can only be read by setting it
        os.umask(mask)
        Path(temporary).chmod(0o666 & ~mask)
        Path(temporary).replace(path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def main(arguments: list[str] | None = None) -> int:
    """Run the script; return the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("model", type=Path, help="an .onnx file exported by a2v")
    parser.add_argument("--action", help="an action, or several separated by commas (a transition)")
    parser.add_argument(
        "--out", type=Path, help="F.npz (all clips) or F.bvh (with --count N: F_000.bvh, ...)"
    )
    parser.add_argument(
        "--frames", type=int, default=None, help="frames per clip (default: the model's)"
    )
    parser.add_argument("--count", type=int, default=1, help="clips to generate")
    parser.add_argument("--seed", type=int, default=0, help="seed of the noise")
    parser.add_argument("--bone-scale", type=float, default=1.0, help="factor on the bone lengths")
    options = parser.parse_args(arguments)
    try:
        if not options.model.is_file():
            raise ValueError(f"{options.model} does not exist; give an .onnx file exported by a2v")
        model = Model(options.model)
        meta = model.metadata
        if options.action is None:
            print(
                f"{options.model}: {meta['skeleton']['name']} skeleton, "
                f"{len(meta['skeleton']['parents'])} joints, {meta['fps']} fps"
            )
            print(f"license: {meta['licence']}\nactions:", *meta["actions"], sep="\n  ")
            return 0
        if options.out is None or options.out.suffix not in (".npz", ".bvh"):
            raise ValueError("give --out F.npz or --out F.bvh")
        frames = meta["frames"] if options.frames is None else options.frames
        if not 1 <= frames <= MOST or not 1 <= options.count <= min(MOST, 1_500_000 // frames):
            raise ValueError(
                f"--frames and --count must be 1 to {MOST}, and both together at most 1500000 "
                "frames"
            )
        if options.seed < 0:
            raise ValueError(f"--seed is {options.seed}; expected 0 or more")
        clips = model.sample(
            options.action, frames, options.count, options.seed, options.bone_scale
        )
        if options.out.suffix == ".bvh":
            for i in range(options.count):
                path = (
                    options.out
                    if options.count == 1
                    else options.out.with_name(f"{options.out.stem}_{i:03d}.bvh")
                )
                write(path, bvh(clips["joints"][i], clips["rotations"][i], meta).encode())
                print(path)
            return 0
        import io

        stream = io.BytesIO()
        arrays = {name: array if options.count > 1 else array[0] for name, array in clips.items()}
        skeleton = meta["skeleton"]
        labels = ",".join(meta["actions"][model.label(name)] for name in names_of(options.action))
        np.savez(
            stream,
            **arrays,
            fps=np.asarray(float(meta["fps"])),
            parents=np.asarray(skeleton["parents"]),
            joint_names=np.asarray(json.dumps(skeleton["joint_names"])),
            skeleton=np.asarray(skeleton["name"]),
            action=np.asarray(labels),
            seed=np.asarray(options.seed),
        )
        write(options.out, stream.getvalue())
        print(options.out)
        return 0
    except (ValueError, OSError) as error:
        return refused(str(error))
    except (
        Exception
    ) as error:  # a foreign graph raises many kinds of errors, and its description may lack any key
        return refused(
            f"{options.model} cannot be used ({type(error).__name__}: {error}); give an .onnx file "
            "that a2v exported"
        )


def refused(why: str) -> int:
    """Print `why` on one line; return the exit code."""
    text = " ".join(why.split())
    print(
        "sample.py:",
        "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)[:600],
        file=sys.stderr,
    )
    return 2


if __name__ == "__main__":
    sys.exit(main())
