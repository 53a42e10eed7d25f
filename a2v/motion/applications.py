"""The papers' applications of a motion model (journal paper, Sec. 5.1.3 to 5.1.5; conference paper,
Sec. 4.2.6).

Action transition is `MotionModel.sample` with several actions, body scale its `bone_scale` and
`lengths`.
"""

from __future__ import annotations

import fnmatch
from dataclasses import replace

import numpy as np

from a2v.animation.source import source_joints
from a2v.errors import InputError
from a2v.kinematics import Skeleton, inverse_kinematics
from a2v.kinematics.ground import heading
from a2v.kinematics.names import canonical_joints, missing_joints
from a2v.kinematics.resample import resample_motion
from a2v.motion.model import MotionModel
from a2v.motion.placement import leg_length, level_floor
from a2v.types import FloatArray, Motion

CONCENTRATED = 0.7
"""Mean resultant length of headings above which a model is assumed to know only one heading."""


def interpolate(
    model: MotionModel,
    action: str,
    *,
    seeds: tuple[int, int] = (0, 1),
    rows: int = 5,
    frames: int = 60,
    linear: bool = False,
) -> Motion:
    """Interpolate between two motions of an action in their noise (journal paper, Sec. 5.1.3).

    For a step model, the first noise vector, which determines the first pose, is interpolated from
    that of ``seeds[0]`` to that of ``seeds[1]``; the noise of later frames is that of ``seeds[0]``
    in every row, so that rows differ by their first pose alone (the published code draws the later
    noise anew for each row). A window model makes each window from one vector: all of them are
    interpolated, so that the last row is the motion of ``seeds[1]``.

    Parameters
    ----------
    model : MotionModel
    action : str
    seeds : 2 ints
        The first row is exactly ``model.sample(action, seed=seeds[0])``.
    rows : int
        Number of motions, both ends included; at least 2.
    frames : int
    linear : bool
        Interpolate linearly, as in the paper. Otherwise on the great circle, which keeps the length
        of the noise as in training.

    Returns
    -------
    Motion
        A batch of `rows` clips.

    Raises
    ------
    InputError
        Unknown action, or a number out of range.
    """
    if not 2 <= rows <= 100:
        raise InputError(f"rows is {rows}; expected 2 to 100 motions, both ends included")
    names = model.check_request(action, frames=frames, count=rows)
    first, second = (np.random.default_rng(seed) for seed in seeds)
    share = np.linspace(0, 1, rows)

    def noise(shape: tuple[int, ...], at: int) -> FloatArray:
        a, b = (
            generator.standard_normal((1, *shape[1:]), dtype=np.float32)[0]
            for generator in (first, second)
        )
        if model.makes_windows:
            return between(a, b, share, linear=linear)
        mixed = np.repeat(a[None], rows, axis=0)
        mixed[:, 0] = between(a[0], b[0], share, linear=linear)
        return mixed

    body = model.bone_lengths
    joints, rotations = model.generate(
        np.tile(model.frame_labels(names, frames), (rows, 1)), np.tile(body, (rows, 1)), noise
    )
    path = "linear" if linear else "spherical"
    return model.to_motion(
        joints,
        rotations,
        lengths=body,
        names=names,
        seed=seeds[0],
        interpolated=[*seeds, rows],
        path=path,
    )


def between(
    first: FloatArray, second: FloatArray, share: FloatArray, *, linear: bool = False
) -> FloatArray:
    """Interpolate vectors (R, Z) float32 from `first` to `second` (Z,), at `share` (R,) in [0, 1].

    By default on the great circle (Shoemake 1985, in any dimension), with the length interpolated
    between both ends; parallel vectors are interpolated linearly.
    """
    share = np.asarray(share, dtype=np.float64)[:, None]
    a, b = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    norms = np.linalg.norm(a), np.linalg.norm(b)
    line = (1 - share) * a + share * b
    if linear or min(norms) == 0:
        return line.astype(np.float32)
    angle = np.arccos(np.clip(a @ b / (norms[0] * norms[1]), -1, 1))
    if np.sin(angle) < 1e-6:
        return line.astype(np.float32)
    arc = (
        np.sin((1 - share) * angle) * a / norms[0] + np.sin(share * angle) * b / norms[1]
    ) / np.sin(angle)
    result: FloatArray = (arc * ((1 - share) * norms[0] + share * norms[1])).astype(np.float32)
    return result


def outpaint(
    model: MotionModel,
    start: Motion,
    action: str | list[str],
    *,
    frames: int = 60,
    count: int = 3,
    seed: int = 0,
) -> Motion:
    """Sample several continuations of given poses (journal paper, Sec. 5.1.5).

    The continuations have the body of `start` and begin at its end; all poses of `start` are kept.
    For a model that learned only one heading (HumanAct12: facing the camera), `start` is rotated to
    that heading, and the result is rotated back.

    Parameters
    ----------
    model : MotionModel
    start : Motion
        One clip of any skeleton with a person's joints. At the model's frame rate it must be
        shorter than `frames`. Window models use its last ``context_frames`` frames, step models
        all.
    action : str or list of str
    frames : int
        Number of frames per clip, including those of `start`.
    count : int
        Number of continuations.
    seed : int

    Returns
    -------
    Motion
        A batch of `count` clips at the model's frame rate, on the model's skeleton.

    Raises
    ------
    InputError
        `start` is a batch, lacks a person's joints, or is too long; an action is unknown or a
        number out of range.
    """
    if start.batch:
        raise InputError(
            f"outpaint takes one clip; this Motion is a batch of shape {start.batch}: index it "
            "first"
        )
    names = model.check_request(action, frames=frames, count=count)
    skeleton = model.skeleton
    given = on_skeleton(
        resample_motion(start, model.fps), skeleton, model.bone_lengths * model.card.meters_per_unit
    )
    if len(given) >= frames:
        raise InputError(
            f"the start has {len(given)} frames at {model.fps:g} fps; make the result longer "
            "than that, or shorten the start"
        )
    vectors = given - given[:, np.maximum(skeleton.parents, 0)]
    lengths = np.median(np.linalg.norm(vectors, axis=-1), axis=0) / model.card.meters_per_unit
    generator = np.random.default_rng(seed)
    labels = np.tile(model.frame_labels(names, frames), (count, 1))
    bodies = np.tile(lengths.astype(np.float32), (count, 1))
    rotmat = _to_known_heading(model, given, int(labels[0, 0]), generator)
    # the model's own steps: the path was scaled for longer legs, see MotionModel.to_motion
    step = float(leg_length(lengths, skeleton) / leg_length(model.bone_lengths, skeleton))
    end = given[-1, 0]
    shown = given - end
    shown = (shown + (1 / step - 1) * shown[:, :1]) @ rotmat.T
    joints, _ = model.generate(
        labels, bodies, generator, np.tile(shown.astype(np.float32), (count, 1, 1, 1))
    )
    joints = (joints + (step - 1) * joints[:, :, :1]) @ rotmat + end
    # the given poses define the floor, unless they are too few to distinguish a step from a jump
    known = len(given) if len(given) >= 0.5 * model.fps else model.card.frames
    joints = level_floor(joints.astype(np.float32), max(known, len(given)), model.card.frames // 2)
    joints[:, : len(given)] = given
    rotations = inverse_kinematics(joints, skeleton).astype(np.float32)
    return replace(
        model.to_motion(joints, rotations, lengths=bodies, names=names, seed=seed, place=False),
        given_frames=len(given),
    )


def matching_actions(model: MotionModel, pattern: str) -> list[str]:
    """Find the model's actions that match a pattern with ``*`` and ``?``, such as
    ``lift_dumbbell*`` for its fine-grained kinds.

    Raises
    ------
    InputError
        No action matches.
    """
    found = [name for name in model.actions if fnmatch.fnmatch(name.lower(), pattern.lower())]
    if not found:
        raise InputError(
            f"no action of '{model.path.stem}' matches '{pattern}'; it knows "
            f"{', '.join(model.actions)}"
        )
    return found


def sample_each(
    model: MotionModel, actions: list[str], *, frames: int = 60, seed: int = 0
) -> Motion:
    """Sample one clip of each action as a batch (for fine-grained actions side by side; first
    paper, Table 5).

    ``action`` of the result names them in the order of the clips, with a bar between; each clip is
    ``model.sample(name, seed=seed)``.
    """
    for name in actions:
        model.check_request(name, frames=frames, count=1)
    clips = [model.sample(name, frames=frames, seed=seed) for name in actions]
    labels = [model.actions[model.label(name)] for name in actions]
    joints, rotations = (
        np.stack([clip.joints for clip in clips]),
        np.stack([clip.rotations for clip in clips]),
    )
    motion = model.to_motion(
        joints, rotations, lengths=model.bone_lengths, names=labels, seed=seed, place=False
    )
    return replace(motion, action="|".join(labels))


def on_skeleton(motion: Motion, skeleton: Skeleton, lengths: FloatArray) -> FloatArray:
    """Convert a clip to another skeleton of a person; returns joints (T, J, 3) float32.

    Joints are matched by their names in any known scheme (`canonical_joints`); joints of the spine
    without a match lie between pelvis and neck; a missing end (hand, toes, head) extends its parent
    bone with the length of `lengths` (toes: forward, level).

    Parameters
    ----------
    motion : Motion
    skeleton : Skeleton
    lengths : (J,) float
        Bone lengths for missing ends, meters.

    Raises
    ------
    InputError
        One of them lacks a person's joints.
    """
    if motion.joint_names == skeleton.joint_names:
        return motion.joints.astype(np.float32)
    wanted = canonical_joints(skeleton.joint_names, skeleton.parents.tolist())
    if missing := missing_joints(wanted):
        raise InputError(
            f"the model's skeleton '{skeleton.name}' has no {', '.join(missing[:4])}; give a start "
            "whose joints have the same names as the model's"
        )
    source = source_joints(motion)
    shoulders = (source["left_shoulder"] + source["right_shoulder"]) / 2
    neck = source.get("neck", shoulders)
    source = {"neck": neck, **source}
    forward = np.cross(source["left_hip"] - source["right_hip"], [0.0, 1.0, 0.0])
    forward /= np.maximum(np.linalg.norm(forward, axis=-1, keepdims=True), 1e-9)
    n_spine = sum(name.startswith("spine") for name in wanted)
    if n_spine != sum(name.startswith("spine") for name in source):
        for place in range(1, n_spine + 1):
            source[f"spine{place}"] = source["pelvis"] + (neck - source["pelvis"]) * (
                place / (n_spine + 1)
            )
    names = {index: name for name, index in wanted.items()}
    joints = np.zeros((motion.frames, skeleton.n_joints, 3))
    for joint, parent in enumerate(skeleton.parents.tolist()):
        name = names.get(joint, "")
        if name in source:
            joints[:, joint] = source[name]
        elif name.endswith("collar"):
            joints[:, joint] = (
                joints[:, parent]
                + (source[name.replace("collar", "shoulder")] - joints[:, parent]) * 0.4
            )
        elif parent < 0:
            joints[:, joint] = source["pelvis"]
        else:
            before = (
                joints[:, parent] - joints[:, skeleton.parents[parent]]
                if skeleton.parents[parent] >= 0
                else forward
            )
            direction = forward if name.endswith(("foot", "toes")) else before
            size = np.maximum(np.linalg.norm(direction, axis=-1, keepdims=True), 1e-9)
            joints[:, joint] = joints[:, parent] + direction / size * lengths[joint]
    return joints.astype(np.float32)


def _to_known_heading(
    model: MotionModel, given: FloatArray, label: int, generator: np.random.Generator
) -> FloatArray:
    """Return the rotation (3, 3) about +y of `given` (T, J, 3) to the heading of the model's own
    clips of an action, if they share one."""
    skeleton = model.skeleton
    if skeleton.hips is None or skeleton.shoulders is None:
        return np.eye(3)
    own, _ = model.generate(
        np.full((64, 8), label), np.tile(model.bone_lengths, (64, 1)), generator
    )
    mean = np.exp(1j * heading(own[:, 0], skeleton)).mean()
    if abs(mean) < CONCENTRATED:
        return np.eye(3)
    angle = float(np.angle(mean) - heading(given[-1], skeleton))
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, 0, sin], [0, 1, 0], [-sin, 0, cos]])
