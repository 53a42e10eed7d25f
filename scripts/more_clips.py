"""Read the second library of clips, ``clips_more.zip``, onto the skeleton of the first one.

KayKit's toy figure (``kaykit/X``: animation X of its seven files), DeepMimic's captured clips
(``deepmimic/X``), AnimatedDrawings' (``animated/X``) and CMU's basketball (``cmu/006_0N``).
``a2v.motion.on_clips.on_clips_skeleton`` carries over the directions of the bones, so that the
proportions are the library's; pelvis and path are scaled by the length of the legs.
"""

from __future__ import annotations

import dataclasses
import json
import struct
import tempfile
import zipfile
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter1d

from a2v.formats.bvh import read_bvh
from a2v.formats.deepmimic import read_deepmimic
from a2v.kinematics import rotvec_to_rotmat, skeleton_of
from a2v.kinematics.from_joints import motion_of_joints
from a2v.kinematics.limbs import bend_to
from a2v.kinematics.resample import resample_motion
from a2v.kinematics.skeleton import subtree
from a2v.kinematics.so3 import quat_to_rotmat
from a2v.motion.clips import clip_library
from a2v.motion.layers import chest_of
from a2v.motion.on_clips import on_clips_skeleton
from a2v.types import Motion

FPS = 30.0
FRONT = np.array([0.0, 0.04, 0.12])
"""The marker in front of the face, from the head's joint at rest, meters."""
KAYKIT = {
    "pelvis": "hips", "spine": "spine", "chest": "chest", "neck": "head",
    **{
        f"{side}_{ours}": f"{theirs}.{side[0]}"
        for side in ("left", "right")
        for ours, theirs in (
            ("shoulder", "upperarm"), ("elbow", "lowerarm"), ("wrist", "wrist"), ("hand", "hand"),
            ("hip", "upperleg"), ("knee", "lowerleg"), ("ankle", "foot"), ("foot", "toes"),
        )
    },
}  # fmt: skip
"""Our joints and KayKit's bones."""
PARENTS = {
    "spine": "pelvis", "chest": "spine", "neck": "chest", "head": "neck",
    **{
        f"{side}_{child}": parent if parent in ("chest", "pelvis") else f"{side}_{parent}"
        for side in ("left", "right")
        for child, parent in (
            ("shoulder", "chest"), ("elbow", "shoulder"), ("wrist", "elbow"), ("hand", "wrist"),
            ("hip", "pelvis"), ("knee", "hip"), ("ankle", "knee"), ("foot", "ankle"),
        )
    },
}  # fmt: skip


FLIES = ("Jump", "Spawn")
"""Parts of the names of KayKit's clips that leave the ground."""
FLAT = {"kaykit": 46.0, "deepmimic": 21.0}
"""Dip of a flat foot from ankle to toes by the folder of a clip, degrees."""
THICK = {
    "pelvis": 0.11, "spine": 0.11, "neck": 0.06, "head": 0.09, "clavicle": 0.07, "upperarm": 0.05,
    "lowerarm": 0.04, "hand": 0.03, "thigh": 0.09, "calf": 0.055, "foot": 0.075, "ball": 0.012,
}  # fmt: skip
"""Distance of joints from the ground when that part of the body lies on it, meters."""
ARMS_IN = 16.0
"""Largest angle by which arms are brought to the body, degrees."""
SAT = ("Sit_Ups",)
"""Clips that sit on the ground throughout: the toy's pelvis is thicker than a person's."""
STANDS = 0.6
"""Least height of the pelvis of a clip that stands, meters."""
FLOOR_SECONDS = 0.05
"""Width over which the height of the ground under a clip is smoothed, seconds."""


def flat_feet(joints: np.ndarray, dip: float) -> np.ndarray:
    """Turn the feet of joints (T, J, 3) so that feet that dip by `dip`, radians, from ankle to ball
    when they stand flat dip like the library's."""
    library = clip_library()
    names = library.skeleton.joint_names
    idle = library.joints[library.index("Idle")][0]
    made = joints.copy()
    for side in ("l", "r"):
        at, knee = names.index(f"foot_{side}"), names.index(f"calf_{side}")
        rest = [names.index(f"ball_{side}"), names.index(f"ball_{side}_end")]
        own = idle[rest[0]] - idle[at]
        wanted = np.arctan2(-own[1], np.hypot(own[0], own[2]))
        shin, foot = made[:, at] - made[:, knee], made[:, rest[0]] - made[:, at]
        axis = np.cross(foot, shin)
        axis /= np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-9)
        toes = idle[rest[1]] - idle[rest[0]]
        flat = np.arctan2(-toes[1], np.hypot(toes[0], toes[2]))
        foot = np.einsum("tab,tb->ta", rotvec_to_rotmat((wanted - dip) * axis), foot)
        made[:, rest[0]] = made[:, at] + foot
        along = foot / np.linalg.norm(foot, axis=-1, keepdims=True) * np.linalg.norm(toes)
        made[:, rest[1]] = made[:, rest[0]] + np.einsum(
            "tab,tb->ta", rotvec_to_rotmat((flat - wanted) * axis), along
        )
    return made


def balanced(joints: np.ndarray) -> np.ndarray:
    """Move the feet of joints (T, J, 3) that stand throughout under the body: over the clip they are
    as far from the pelvis as in the idle pose. A toy with a large head stands elsewhere."""
    library = clip_library()
    names = library.skeleton.joint_names
    if joints[:, 0, 1].min() < STANDS:
        return joints
    idle = library.joints[library.index("Idle")][0]
    ankles, hips = (
        [names.index(f"{name}_{side}") for side in ("l", "r")] for name in ("foot", "thigh")
    )
    across = (joints[:, hips[0]] - joints[:, hips[1]]).mean(0)
    yaw = np.arctan2(-across[2], across[0])
    turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    own = (joints[:, ankles].mean(1) - joints[:, hips].mean(1)).mean(0)
    off = turn @ (idle[ankles].mean(0) - idle[hips].mean(0)) - own
    made = joints.copy()
    for side in ("l", "r"):
        hip, knee, ankle, *rest = (
            names.index(name.format(side))
            for name in ("thigh_{}", "calf_{}", "foot_{}", "ball_{}", "ball_{}_end")
        )
        foot = made[:, rest] - made[:, [ankle]]
        made[:, knee], made[:, ankle] = bend_to(
            made[:, hip], made[:, knee], made[:, ankle], made[:, ankle] + off * [1, 0, 1]
        )
        made[:, rest] = made[:, [ankle]] + foot
    return made


def arms_in(joints: np.ndarray) -> np.ndarray:
    """Bring hanging arms nearer to the body: those of the toy hang beside its wide trunk."""
    skeleton = clip_library().skeleton
    names, parents = skeleton.joint_names, skeleton.parents.tolist()
    made, chest = joints.copy(), chest_of(joints, skeleton)
    for side, sign in (("l", 1.0), ("r", -1.0)):
        top, elbow = names.index(f"upperarm_{side}"), names.index(f"lowerarm_{side}")
        along = np.einsum("tba,tb->ta", chest, made[:, elbow] - made[:, top])
        out = np.degrees(np.arctan2(sign * along[:, 0], np.maximum(-along[:, 1], 1e-6)))
        less = np.interp(out, [0.0, 15.0, 45.0, 80.0], [0.0, 4.0, ARMS_IN, 0.0])
        turn = rotvec_to_rotmat(np.deg2rad(-sign * less)[:, None] * chest[:, :, 2])
        below = [joint for joint in subtree(parents, top) if joint != top]
        made[:, below] = made[:, [top]] + np.einsum(
            "tab,tjb->tja", turn, made[:, below] - made[:, [top]]
        )
    return made


def sat_down(joints: np.ndarray) -> np.ndarray:
    """Put the pelvis of joints (T, J, 3) on the ground, and the feet with bent knees too."""
    names = clip_library().skeleton.joint_names
    made = joints.copy()
    made[..., 1] -= made[:, 0, 1].min() - THICK["pelvis"]
    for side in ("l", "r"):
        hip, knee, ankle, *rest = (
            names.index(name.format(side))
            for name in ("thigh_{}", "calf_{}", "foot_{}", "ball_{}", "ball_{}_end")
        )
        foot, target = made[:, rest] - made[:, [ankle]], made[:, ankle].copy()
        target[:, 1] = np.maximum(target[:, 1], 0.09)
        made[:, knee], made[:, ankle] = bend_to(made[:, hip], made[:, knee], made[:, ankle], target)
        made[:, rest] = made[:, [ankle]] + foot
    return made


def on_the_ground(joints: np.ndarray) -> np.ndarray:
    """Move every frame of joints (T, J, 3) up or down so that its lowest part touches the ground,
    and carry the body along with its standing feet: KayKit's hips keep their place."""
    names = clip_library().skeleton.joint_names
    used = [at for at, name in enumerate(names) if name.split("_")[0] in THICK]
    thick = np.array([THICK[names[at].split("_")[0]] for at in used])
    floor = (joints[:, used, 1] - thick).min(axis=1)
    made = joints.copy()
    made[..., 1] -= gaussian_filter1d(floor, FLOOR_SECONDS * FPS, mode="nearest")[:, None]
    return made


def carried(joints: np.ndarray, *, closes: bool) -> np.ndarray:
    """Move the body of joints (T, J, 3) over the ground so that its standing feet stay in place. A
    clip that `closes` ends where it began."""
    names = clip_library().skeleton.joint_names
    feet = joints[:, [names.index(name) for name in ("ball_l", "ball_r", "foot_l", "foot_r")]]
    low = feet[..., 1] - feet[..., 1].min(axis=0)
    weight = np.clip(1 - low / 0.04, 0.0, 1.0) + 1e-3
    steps = np.diff(feet[..., [0, 2]], axis=0, prepend=feet[:1][..., [0, 2]])
    slid = (weight[..., None] * steps).sum(1) / weight.sum(1)[:, None]
    made = joints.copy()
    moved = np.cumsum(slid, axis=0)
    if closes:
        moved -= np.linspace(0.0, 1.0, len(moved))[:, None] * moved[-1]
    made[..., [0, 2]] -= moved[:, None]
    return made


class _Glb:
    """The animations of one of KayKit's files."""

    def __init__(self, data: bytes) -> None:
        size = struct.unpack("<I", data[12:16])[0]
        self.json = json.loads(data[20 : 20 + size])
        self.binary = data[28 + size :]
        self.nodes = self.json["nodes"]
        self.parent = {
            child: at for at, node in enumerate(self.nodes) for child in node.get("children", ())
        }

    def array(self, at: int) -> np.ndarray:
        """Return an accessor's floats (N, width)."""
        accessor = self.json["accessors"][at]
        view = self.json["bufferViews"][accessor["bufferView"]]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        assert accessor["componentType"] == 5126
        return (
            np.frombuffer(self.binary, "<f4", accessor["count"] * width, start)
            .reshape(-1, width)
            .astype(np.float64)
        )

    def transforms(self, name: str) -> dict[str, np.ndarray]:
        """World transforms (T, 4, 4) of every node in an animation, by name; "" for the rest
        pose."""
        tracks: dict[tuple[int, str], tuple[np.ndarray, np.ndarray]] = {}
        for animation in self.json["animations"] if name else ():
            if animation["name"].split("|")[-1] != name:
                continue
            for channel in animation["channels"]:
                sampler = animation["samplers"][channel["sampler"]]
                tracks[channel["target"]["node"], channel["target"]["path"]] = (
                    self.array(sampler["input"])[:, 0],
                    self.array(sampler["output"]),
                )
        seconds = max((times[-1] for times, _ in tracks.values()), default=0.0)
        at = np.arange(round(seconds * FPS) + 1) / FPS
        local = []
        for index, node in enumerate(self.nodes):
            parts = {
                "translation": np.array(node.get("translation", (0, 0, 0)), float),
                "rotation": np.array(node.get("rotation", (0, 0, 0, 1)), float),
            }
            for path in parts:
                if (index, path) in tracks:
                    times, values = tracks[index, path]
                    if path == "rotation":
                        flips = np.cumprod(
                            np.r_[1, np.where((values[1:] * values[:-1]).sum(1) < 0, -1, 1)]
                        )
                        values = values * flips[:, None]
                    parts[path] = np.stack(
                        [np.interp(at, times, values[:, axis]) for axis in range(values.shape[1])],
                        axis=-1,
                    )
            matrix = np.zeros((len(at), 4, 4))
            quat = np.broadcast_to(parts["rotation"], (len(at), 4))
            quat = quat / np.linalg.norm(quat, axis=-1, keepdims=True)
            matrix[:, :3, :3] = quat_to_rotmat(quat[:, [3, 0, 1, 2]])
            matrix[:, :3, 3] = parts["translation"]
            matrix[:, 3, 3] = 1
            local.append(matrix)
        world: dict[int, np.ndarray] = {}

        def of(index: int) -> np.ndarray:
            if index not in world:
                up = self.parent.get(index)
                world[index] = local[index] if up is None else of(up) @ local[index]
            return world[index]

        return {node["name"]: of(index) for index, node in enumerate(self.nodes)}


class SecondLibrary:
    """The clips of the archive, on the library's skeleton at `FPS`."""

    def __init__(self, archive: zipfile.ZipFile) -> None:
        self.archive = archive

    @cached_property
    def _kaykit(self) -> dict[str, _Glb]:
        found = {}
        for name in self.archive.namelist():
            if name.startswith("kaykit/") and name.endswith(".glb"):
                file = _Glb(self.archive.read(name))
                found |= {clip["name"].split("|")[-1]: file for clip in file.json["animations"]}
        return found

    def joints(self, file: str) -> np.ndarray:
        """Return the joints (T, J, 3) of a clip such as "kaykit/Sit_Ups"; "file#2-4.5" takes a
        part, seconds."""
        name, _, part = file.partition("#")
        kind, _, clip = name.partition("/")
        if kind == "kaykit":
            motion, fronts = self._of_kaykit(clip)
        else:
            motion, fronts = self._of_file(kind, clip), None
        if part:
            start, end = (float(value) for value in part.split("-"))
            first, last = round(start * motion.fps), round(end * motion.fps)
            motion = dataclasses.replace(
                motion,
                joints=motion.joints[first:last],
                rotations=motion.rotations[first:last],
                root=motion.root[first:last],
            )
        motion = resample_motion(motion, FPS)
        dip = FLAT.get(kind)
        joints = on_clips_skeleton(motion)
        joints = joints if dip is None else flat_feet(joints, np.deg2rad(dip))
        if fronts is not None:
            names = clip_library().skeleton.joint_names
            joints[:, names.index("head_front")] = joints[:, names.index("head")] + fronts
        if kind == "kaykit" and not clip.startswith(FLIES):
            joints = on_the_ground(balanced(arms_in(joints)))
            joints = sat_down(joints) if clip in SAT else joints
            return joints - joints[:1, :1] * [1, 0, 1]
        return _facing(joints)

    def _of_kaykit(self, clip: str) -> tuple[Motion, np.ndarray]:
        file = self._kaykit[clip]
        bones, rest = file.transforms(clip), file.transforms("")
        points = {ours: bones[theirs][:, :3, 3] for ours, theirs in KAYKIT.items()}
        head = bones["head"][:, :3, :3] @ rest["head"][:, :3, :3].transpose(0, 2, 1)
        points["head"] = points["neck"] + head @ np.array([0.0, 0.3, 0.0])
        names = ("pelvis", *PARENTS)
        joints = np.stack([points[name] for name in names], axis=1)
        return _motion(joints, names, FPS), head @ FRONT

    def _of_file(self, kind: str, clip: str) -> Motion:
        folder = {"animated": "animated_drawings", "cmu": "cmu_006"}.get(kind, kind)
        suffix = ".txt" if kind == "deepmimic" else ".bvh"
        prefix = "humanoid3d_" if kind == "deepmimic" else ""
        with tempfile.TemporaryDirectory() as scratch:
            path = Path(scratch) / f"{clip}{suffix}"
            path.write_bytes(self.archive.read(f"{folder}/{prefix}{clip}{suffix}"))
            motion = read_deepmimic(path) if kind == "deepmimic" else read_bvh(path)
        return motion


def _motion(joints: np.ndarray, names: tuple[str, ...], fps: float) -> Motion:
    parents = [-1, *(names.index(PARENTS[name]) for name in names[1:])]
    skeleton = skeleton_of("custom", parents, names)
    return motion_of_joints(joints, skeleton, fps)


def _facing(joints: np.ndarray) -> np.ndarray:
    """Turn and move joints so that the first frame stands over the origin and faces +z."""
    names = clip_library().skeleton.joint_names
    across = joints[0, names.index("thigh_l")] - joints[0, names.index("thigh_r")]
    yaw = np.arctan2(across[2], across[0])
    cos, sin = np.cos(yaw), np.sin(yaw)
    turn = np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
    made = (joints - joints[:1, :1] * [1, 0, 1]) @ turn.T
    return made
