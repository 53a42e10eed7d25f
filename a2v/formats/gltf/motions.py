"""Read the animations of glTF files (GLB, VRM animations) as moving bones."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.formats.conventions import Bone
from a2v.formats.gltf.armatures import bone_nodes, humanoid, parents_among
from a2v.formats.gltf.compression import plain
from a2v.formats.gltf.reading import Gltf, decomposed, node_name, read_glb
from a2v.formats.recording import Recording
from a2v.io import brief, reading, shorten
from a2v.kinematics import quat_to_rotmat
from a2v.kinematics.names import canonical_joints
from a2v.kinematics.resample import MAX_JOINT_FRAMES, SHOWN_FPS, continuous
from a2v.types import FloatArray

RATES = (5.0, 240.0)
"""Range of key rates that are taken as frames per second."""
MAX_KEYS = 10_000_000
"""Largest number of keys of all channels of an animation, and of channels times frames."""
_PATHS = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3"}


def read_moving_bones(
    path: str | os.PathLike[str], *, name: str | os.PathLike[str] | None = None, clip: str = ""
) -> Recording:
    """Read an animation of a ``.glb``, ``.gltf``, ``.vrm`` or ``.vrma``.

    Bones are the joints of skins, VRM's humanoid bones and the nodes that the animation moves.

    Parameters
    ----------
    path : path
    name : path or None
        What messages call the file.
    clip : str
        Name or number, from 0, of the animation; "" takes the one that moves most bones of a
        person, and of several such the longest.

    Raises
    ------
    InputError
        The file is broken or too large, has no such animation, or it moves no bones.
    """
    file = dataclasses.replace(plain(read_glb(path)), path=Path(name or path))
    with reading(file.path, "motion that can be read", "an animation in a glTF 2.0"):
        return _read(file, clip)


def _read(file: Gltf, clip: str) -> Recording:
    animations = [_Animation.of(file, entry) for entry in file.items("animations")]
    animations = [one for one in animations if one.tracks]
    if not animations:
        raise file.expect(
            "has no animation that moves a node", "a motion: a file with an animation"
        )
    chosen = _chosen(file, animations, clip)
    notes = []
    if len(animations) > 1 and not clip:
        notes.append(
            f"of {len(animations)} animations '{chosen.name}' is read; the others are "
            + ", ".join(f"'{one.name}'" for one in animations if one is not chosen)
        )
    nodes, names = _person(file, chosen)
    times, fps = chosen.frames(file, len(nodes))
    world, rest = _world(file, chosen, nodes, times)
    parents = parents_among(nodes, file.node_matrices()[1]).tolist()
    frames, count = len(times), len(nodes)
    turned = np.tile(np.eye(3), (frames, count, 1, 1))
    for place in range(count):
        now, _ = decomposed(world[:, place])
        turned[:, place] = now @ decomposed(rest[place][None])[0][0].T
    places = world[..., :3, 3]
    local = places.copy()
    for place, parent in enumerate(parents):
        if parent >= 0:
            away = places[:, place] - places[:, parent]
            local[:, place] = np.einsum("tba,tb->ta", turned[:, parent], away)
    return Recording(
        source=str(file.path),
        bones=[Bone(one, parent) for one, parent in zip(names, parents, strict=True)],
        local=local,
        world=places,
        rotmats=turned,
        fps=fps,
        known=False,
        notes=tuple(notes),
    )


@dataclasses.dataclass(frozen=True)
class _Track:
    """Keys of one property of a node: `times` (K,) seconds, ascending, and `values` (K, 3 or 4),
    or (3 K, ...) for CUBICSPLINE: in-tangent, value and out-tangent of each key."""

    times: FloatArray
    values: FloatArray
    kind: str

    def at(self, times: FloatArray, *, turns: bool) -> FloatArray:
        """Return the values (T, 3), or unit quaternions (T, 4), at `times` (T,)."""
        keys = self.values.reshape(len(self.times), -1, self.values.shape[1])
        smooth = self.kind == "CUBICSPLINE" and keys.shape[1] == 3
        points = keys[:, 1 if smooth else 0]
        if turns and not smooth:
            points = continuous(points)
        if len(points) == 1:
            return np.repeat(points, len(times), axis=0)
        after = np.clip(np.searchsorted(self.times, times, side="right"), 1, len(points) - 1)
        before = after - 1
        step = np.maximum(self.times[after] - self.times[before], 1e-9)
        share = np.clip((times - self.times[before]) / step, 0, 1)[:, None]
        if self.kind == "STEP":
            made = np.where(share >= 1, points[after], points[before])
        elif smooth:
            made = (
                (2 * share**3 - 3 * share**2 + 1) * points[before]
                + step[:, None] * (share**3 - 2 * share**2 + share) * keys[before, 2]
                + (3 * share**2 - 2 * share**3) * points[after]
                + step[:, None] * (share**3 - share**2) * keys[after, 0]
            )
        elif turns:
            made = _slerp(points[before], points[after], share)
        else:
            made = (1 - share) * points[before] + share * points[after]
        return np.asarray(made)


def _slerp(first: FloatArray, second: FloatArray, share: FloatArray) -> FloatArray:
    """Interpolate unit quaternions (T, 4) of continuous sign; share (T, 1)."""
    angle = np.arccos(np.clip((first * second).sum(axis=1, keepdims=True), -1, 1))
    small = np.sin(angle) < 1e-6
    sine = np.where(small, 1.0, np.sin(angle))
    one = np.where(small, 1 - share, np.sin((1 - share) * angle) / sine)
    other = np.where(small, share, np.sin(share * angle) / sine)
    return np.asarray(one * first + other * second)


@dataclasses.dataclass(frozen=True)
class _Animation:
    """An animation: its tracks by node and property."""

    name: str
    tracks: dict[tuple[int, str], _Track]

    @classmethod
    def of(cls, file: Gltf, entry: dict[str, Any]) -> _Animation:
        """Read the tracks of nodes; weights of expressions and broken channels are left out."""
        samplers, channels = entry.get("samplers"), entry.get("channels")
        tracks: dict[tuple[int, str], _Track] = {}
        if not isinstance(samplers, list) or not isinstance(channels, list):
            raise file.fail("has an animation without samplers or channels")
        for channel in channels:
            target = channel.get("target") if isinstance(channel, dict) else None
            if not isinstance(target, dict) or target.get("path") not in _PATHS:
                continue
            if "node" not in target:
                continue
            file.item("nodes", target["node"])
            number = channel.get("sampler")
            if not isinstance(number, int) or not 0 <= number < len(samplers):
                raise file.fail(f"has a channel of sampler {brief(number)}")
            sampler = samplers[number]
            if not isinstance(sampler, dict):
                raise file.fail(f"has a sampler that is {brief(sampler)}")
            times = file.accessor(sampler.get("input"), "SCALAR").astype(np.float64).ravel()
            values = file.accessor(sampler.get("output"), _PATHS[target["path"]])
            kind = str(sampler.get("interpolation", "LINEAR"))
            if (
                not len(times)
                or len(values) != len(times) * (3 if kind == "CUBICSPLINE" else 1)
                or not np.isfinite(times).all()
                or not np.isfinite(values).all()
                or (np.diff(times) < 0).any()
                or np.abs(values).max() > 1e6
                or np.abs(times).max() > 1e6
            ):
                raise file.fail(f"has keys that cannot be used, of node {target['node']}")
            tracks[target["node"], target["path"]] = _Track(times, values.astype(np.float64), kind)
        return cls(str(entry.get("name", ""))[:80], tracks)

    @property
    def seconds(self) -> float:
        """From the first to the last key."""
        times = [track.times[[0, -1]] for track in self.tracks.values()]
        return float(np.max(times) - np.min(times))

    def frames(self, file: Gltf, bones: int) -> tuple[FloatArray, float]:
        """Return the times (T,) of even frames, and frames per second: those of the keys."""
        keys = max((track.times for track in self.tracks.values()), key=len)
        steps = np.diff(keys)
        step = float(np.median(steps[steps > 1e-6])) if (steps > 1e-6).any() else 1 / SHOWN_FPS
        fps = 1 / step if RATES[0] <= 1 / step <= RATES[1] else SHOWN_FPS
        if abs(fps / round(fps) - 1) < 2e-3:
            fps = float(round(fps))
        first = min(float(track.times[0]) for track in self.tracks.values())
        count = round(self.seconds * fps) + 1
        if count * max(bones, 1) > MAX_JOINT_FRAMES:
            raise file.fail(
                f"has {count} frames of {bones} bones; more than {MAX_JOINT_FRAMES:,} positions"
            )
        return first + np.arange(count) / fps, fps


def _chosen(file: Gltf, animations: list[_Animation], clip: str) -> _Animation:
    """Return the animation that is called `clip`, or the one that moves a person most."""
    if clip:
        named = [one for one in animations if one.name == clip]
        if clip.isdecimal() and len(clip) < 6 and int(clip) < len(animations):
            named.append(animations[int(clip)])
        if not named:
            raise InputError(
                f"{file.path} has no animation '{shorten(clip)}'; choose one of "
                + ", ".join(f"{place} '{one.name}'" for place, one in enumerate(animations[:12]))
            )
        return named[0]
    human = set(humanoid(file))
    names = [node_name(node) for node in file.items("nodes")]
    human |= set(canonical_joints(names).values())
    return max(
        animations,
        key=lambda one: (len({node for node, _ in one.tracks} & human), one.seconds),
    )


def _person(file: Gltf, chosen: _Animation) -> tuple[tuple[int, ...], list[str]]:
    """Return the bones of the person, one of which carries all others, and their names."""
    human = humanoid(file)
    moved = {node for node, _ in chosen.tracks}
    above = file.node_matrices()[1]
    nodes = bone_nodes(file, above, moved | set(human))
    every = file.items("nodes")
    names = [
        human.get(node, f"other{place}" if human else node_name(every[node]))
        for place, node in enumerate(nodes)
    ]
    parents = parents_among(nodes, file.node_matrices()[1]).tolist()
    roots = [place for place, parent in enumerate(parents) if parent < 0]
    trees = {root: [root] for root in roots}
    top = list(range(len(nodes)))
    for place, parent in enumerate(parents):
        if parent >= 0:
            top[place] = top[parent]
            trees[top[place]].append(place)
    found = set(canonical_joints(names, parents).values())
    best = max(roots, key=lambda root: (len(found & set(trees[root])), len(trees[root])))
    kept = trees[best]
    return tuple(nodes[place] for place in kept), [names[place] for place in kept]


def _world(
    file: Gltf, chosen: _Animation, nodes: tuple[int, ...], times: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the matrices of `nodes` in the world at `times` (T, N, 4, 4), and at rest."""
    rest, above = file.node_matrices()
    moving = {node for node, _ in chosen.tracks}
    if len(chosen.tracks) * len(times) > MAX_KEYS:
        raise file.fail(f"has {len(chosen.tracks)} channels of {len(times)} frames")
    known: dict[int, FloatArray] = {}

    def world(node: int) -> FloatArray:
        path = []
        while node >= 0 and node not in known:
            path.append(node)
            node = above[node]
        outer = known[node] if node >= 0 else np.eye(4)[None]
        for one in reversed(path):
            local = _local(file, chosen, one, times) if one in moving else file.local_matrix(one)
            outer = known[one] = outer @ local
        return outer

    made = np.empty((len(times), len(nodes), 4, 4))
    for place, node in enumerate(nodes):
        made[:, place] = world(node)
    if not np.isfinite(made).all() or np.abs(made).max() > 1e6:
        raise file.fail("has node positions that are not finite, or too large")
    return made, rest[list(nodes)]


def _local(file: Gltf, chosen: _Animation, node: int, times: FloatArray) -> FloatArray:
    """Return the transforms (T, 4, 4) of a node in its parent."""
    still = file.items("nodes")[node]
    still = file.without_matrix(still) if "matrix" in still else still
    values = {}
    for path, default in (
        ("translation", (0.0, 0.0, 0.0)),
        ("rotation", (0.0, 0.0, 0.0, 1.0)),
        ("scale", (1.0, 1.0, 1.0)),
    ):
        track = chosen.tracks.get((node, path))
        values[path] = (
            np.broadcast_to(
                np.asarray(still.get(path, default), np.float64), (len(times), len(default))
            )
            if track is None
            else track.at(times, turns=path == "rotation")
        )
    quats = values["rotation"][:, [3, 0, 1, 2]]
    lengths = np.linalg.norm(quats, axis=1, keepdims=True)
    local = np.tile(np.eye(4), (len(times), 1, 1))
    turns = quat_to_rotmat(np.where(lengths > 1e-9, quats, [1.0, 0, 0, 0]))
    local[:, :3, :3] = turns * values["scale"][:, None, :]
    local[:, :3, 3] = values["translation"]
    return local
