"""Write BVH, with helper joints where the format's rotations cannot follow the bones."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field

import numpy as np

from a2v.errors import InputError
from a2v.formats.characters import check_clips
from a2v.formats.conventions import UNITS
from a2v.geometry.polar import nearest_rotations
from a2v.io import atomic_path
from a2v.kinematics import SKELETONS, rotvec_to_rotmat, skeleton_of, swing_between
from a2v.kinematics.orientations import bone_rotmats
from a2v.types import Body, FloatArray, Motion

_SAME = 2e-5
"""Largest difference between the rotations of bones that share one joint, radians."""
_STEADY = 2e-5
"""Largest displacement of a bone without position channels, meters."""


def write_bvh(
    path: str | os.PathLike[str], motion: Motion, *, units: str | float = "centimeters"
) -> None:
    """Write one clip as BVH (rotation order Z, X, Y; position channels on the root).

    BVH rotates all bones below a joint together, while the chain convention gives every bone its
    own rotation: where the children of a joint move against each other, each gets a helper joint of
    zero offset (``<child>_turn``), which `read_bvh` removes again. Joints whose bone changes length
    get position channels. Joint positions are preserved to 1e-4 m, twists about bones too.

    Parameters
    ----------
    path : path
        Written atomically.
    motion : Motion
        A single clip.
    units : name in `UNITS` or meters per unit

    Raises
    ------
    InputError
        `motion` is a batch, or the path cannot be written.
    """
    if motion.batch:
        raise InputError(
            f"write_bvh takes one clip; this Motion is a batch of shape {motion.batch}: index it "
            "first"
        )
    _write(path, _plan(motion), motion.frames, fps=motion.fps, units=units)


def write_rig_bvh(
    path: str | os.PathLike[str],
    body: Body,
    transforms: FloatArray,
    fps: float,
    *,
    units: str | float = "centimeters",
) -> None:
    """Write the motion of a rig's bones as BVH: one joint per bone, in their order, with the rest
    pose of `Body.rest_transforms`.

    Rotations are relative to the rest pose, in the world's axes (BVH has no axes of bones). The
    topmost bone and bones that move in their parent have position channels.

    Parameters
    ----------
    path : path
        Written atomically.
    body : Body
        Names, parents (one bone without), rest pose and tails.
    transforms : (T, B, 4, 4) float
        World from bone, meters.
    fps : float
    units : name in `UNITS` or meters per unit

    Raises
    ------
    InputError
        The transforms have the wrong shape or are not finite.
    """
    moves, rate = check_clips({"motion": (transforms, fps)}, len(body.bone_names))["motion"]
    _write(path, _rig_plan(body, moves), len(moves), fps=rate, units=units)


def rig_of_motion(motion: Motion) -> tuple[Body, FloatArray]:
    """Return the bones of `write_bvh`, helpers included, as a rig without skin, and its transforms
    (T, B, 4, 4) float64, world from bone."""
    plan = _plan(motion)
    parents = np.full(len(plan), -1)
    for place, joint in enumerate(plan):
        parents[joint.children] = place
    rest = np.tile(np.eye(4), (len(plan), 1, 1))
    moved = np.tile(np.eye(4), (motion.frames, len(plan), 1, 1))
    rest[0, :3, 3] = motion.joints[0, 0]
    for place, joint in enumerate(plan):
        local = joint.offset if joint.positions is None else joint.positions
        moved[:, place, :3, :3], moved[:, place, :3, 3] = joint.rotmats, local
        if parents[place] >= 0:
            rest[place, :3, 3] = rest[parents[place], :3, 3] + joint.offset
            moved[:, place] = moved[:, parents[place]] @ moved[:, place]
    heads = rest[:, :3, 3].astype(np.float32)
    body = Body(
        model=motion.skeleton,
        parameters={},
        vertices=heads,
        faces=np.zeros((0, 3), np.int32),
        bone_names=tuple(joint.name for joint in plan),
        bone_parents=parents,
        bone_transforms=rest.astype(np.float32),
        rest_transforms=rest.astype(np.float32),
        bone_tails=heads + np.array([joint.end for joint in plan], np.float32),
        weights=np.eye(len(plan), dtype=np.float32),
        parts=np.zeros(len(plan), np.int8),
    )
    return body, moved


def _write(
    path: str | os.PathLike[str], plan: list[_Joint], frames: int, *, fps: float, units: str | float
) -> None:
    scale = 1.0 / (UNITS[units] if isinstance(units, str) else units)
    header, columns = ["HIERARCHY"], []

    def emit(index: int, depth: int) -> None:
        pad, joint = "\t" * depth, plan[index]
        header.append(f"{pad}{'ROOT' if index == 0 else 'JOINT'} {_name(joint.name)}")
        header.append(pad + "{")
        header.append(f"{pad}\tOFFSET {_numbers(joint.offset * scale)}")
        order = "Zrotation Xrotation Yrotation"
        if joint.positions is not None:
            header.append(f"{pad}\tCHANNELS 6 Xposition Yposition Zposition {order}")
            columns.append(joint.positions * scale)
        else:
            header.append(f"{pad}\tCHANNELS 3 {order}")
        columns.append(_euler_zxy(joint.rotmats))
        for child in joint.children:
            emit(child, depth + 1)
        if not joint.children:
            header.extend(
                [
                    f"{pad}\tEnd Site",
                    pad + "\t{",
                    f"{pad}\t\tOFFSET {_numbers(joint.end * scale)}",
                    pad + "\t}",
                ]
            )
        header.append(pad + "}")

    emit(0, 0)
    rates = ["MOTION", f"Frames: {frames}", f"Frame Time: {1.0 / fps:.10f}"]
    table = np.concatenate(columns, axis=1)
    with (
        atomic_path(path) as temporary,
        open(temporary, "w", encoding="utf-8", newline="\n") as stream,
    ):
        stream.write("\n".join([*header, *rates]) + "\n")
        np.savetxt(stream, table, fmt="%.6f")


@dataclass
class _Joint:
    """A joint of the file: offset (3,), rotations in its parent (T, 3, 3), position channels (T, 3)
    or None, and its end (3,)."""

    name: str
    offset: FloatArray
    rotmats: FloatArray
    positions: FloatArray | None
    children: list[int] = field(default_factory=list)
    end: FloatArray = field(default_factory=lambda: np.zeros(3))


def _rig_plan(body: Body, transforms: FloatArray) -> list[_Joint]:
    """Return the joints of a rig under transforms (T, B, 4, 4)."""
    rest, parents = body.rest_transforms.astype(np.float64), body.bone_parents.tolist()
    turned = transforms[..., :3, :3] @ np.swapaxes(rest[:, :3, :3], 1, 2)
    own = np.einsum(
        "bca,bc->ba",
        body.bone_transforms[:, :3, :3],
        body.bone_tails - body.bone_transforms[:, :3, 3],
    )
    ends = np.einsum("bac,bc->ba", rest[:, :3, :3], own.astype(np.float64))
    plan: list[_Joint] = []
    for bone, parent in enumerate(parents):
        offset, place, rotmats = rest[bone, :3, 3], transforms[:, bone, :3, 3], turned[:, bone]
        if parent >= 0:
            back = np.swapaxes(turned[:, parent], 1, 2)
            offset = offset - rest[parent, :3, 3]
            place, rotmats = (
                np.einsum("tac,tc->ta", back, place - transforms[:, parent, :3, 3]),
                back @ rotmats,
            )
            plan[parent].children.append(bone)
        moves = parent < 0 or float(np.abs(place - offset).max()) > _STEADY
        plan.append(
            _Joint(body.bone_names[bone], offset, rotmats, place if moves else None, end=ends[bone])
        )
    return plan


def _plan(motion: Motion) -> list[_Joint]:
    """Return the joints of the file, including helpers, parents first."""
    count = len(motion.parents)
    joints = motion.joints.astype(np.float64)
    vectors = joints - joints[:, np.maximum(motion.parents, 0)]
    lengths = np.linalg.norm(vectors, axis=-1)
    middle = np.median(lengths, axis=0)
    directions, rotmats = _from_rest(motion, vectors, lengths)
    children: list[list[int]] = [[] for _ in range(count)]
    for joint in range(1, count):
        children[int(motion.parents[joint])].append(joint)
    plan: list[_Joint] = []
    world: list[FloatArray] = []

    def add(
        name: str, offset: FloatArray, rotmat: FloatArray, parent: int, positions: FloatArray | None
    ) -> int:
        local = rotmat if parent < 0 else np.swapaxes(world[parent], -1, -2) @ rotmat
        plan.append(_Joint(name, offset, local, positions))
        world.append(rotmat)
        if parent >= 0:
            plan[parent].children.append(len(plan) - 1)
        return len(plan) - 1

    def visit(joint: int, parent: int) -> None:
        below = children[joint]
        if not below:
            rotmat = rotmats[:, joint]
        else:
            spread = max(float(np.abs(rotmats[:, c] - rotmats[:, below[0]]).max()) for c in below)
            rotmat = (
                rotmats[:, below[0]]
                if spread < _SAME
                else _fit_rotmats(directions[below] * middle[below, None], vectors[:, below])
            )
        varies = joint > 0 and float(np.ptp(lengths[:, joint])) > 2e-5
        positions = (
            joints[:, 0]
            if joint == 0
            else directions[joint] * lengths[:, joint, None]
            if varies
            else None
        )
        offset = np.zeros(3) if joint == 0 else directions[joint] * middle[joint]
        here = add(motion.joint_names[joint], offset, rotmat, parent, positions)
        for child in below:
            helper = here
            if float(np.abs(rotmats[:, child] - rotmat).max()) >= _SAME:
                helper = add(
                    f"{motion.joint_names[child]}_turn", np.zeros(3), rotmats[:, child], here, None
                )
            visit(child, helper)

    visit(0, -1)
    return plan


def _from_rest(
    motion: Motion, vectors: FloatArray, lengths: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the directions (J, 3) of the bones in the file's rest pose, and rotations (T, J, 3, 3)
    from there to the bones `vectors` (T, J, 3)."""
    skeleton = skeleton_of(motion.skeleton, motion.parents.tolist(), motion.joint_names)
    rotmats = bone_rotmats(motion)
    middle = np.median(lengths, axis=0)
    given = motion.rest_offsets
    if given is not None and np.allclose(
        np.linalg.norm(given, axis=-1)[1:], middle[1:], rtol=0.02, atol=1e-4
    ):
        directions = given / np.maximum(np.linalg.norm(given, axis=-1, keepdims=True), 1e-12)
        rotmats[:, 1:] = rotmats[:, 1:] @ rotvec_to_rotmat(
            swing_between(directions[1:], skeleton.rest_directions[1:])
        )
    elif motion.skeleton in SKELETONS:
        directions = skeleton.rest_directions
    else:  # the first frame is the rest pose
        directions = vectors[0] / np.maximum(lengths[0][:, None], 1e-12)
        rotmats = rotmats @ np.swapaxes(rotmats[:1], -1, -2)
    # Exactly from the rest direction to the bone, but only for real differences: correcting
    # rounding errors would give siblings different rotations.
    unit = vectors / np.maximum(lengths[..., None], 1e-12)
    rotated = np.einsum("tjab,jb->tja", rotmats, directions)[:, 1:]
    off = (
        np.linalg.norm(rotated * lengths[:, 1:, None] - vectors[:, 1:], axis=-1, keepdims=True)
        > 2e-6
    )
    rotmats[:, 1:] = (
        rotvec_to_rotmat(swing_between(rotated, np.where(off, unit[:, 1:], rotated)))
        @ rotmats[:, 1:]
    )
    return directions, rotmats


def _fit_rotmats(rest: FloatArray, now: FloatArray) -> FloatArray:
    """Return the rotations (T, 3, 3) that best map vectors `rest` (C, 3) to `now` (T, C, 3)
    (Kabsch)."""
    return nearest_rotations(np.einsum("tca,cb->tab", now, rest))


def _euler_zxy(rotmats: FloatArray) -> FloatArray:
    """Return continuous angles (T, 3) in degrees of rotations (T, 3, 3) = Rz Rx Ry."""
    x = np.arcsin(np.clip(rotmats[:, 2, 1], -1, 1))
    locked = np.abs(rotmats[:, 2, 1]) > 1 - 1e-12
    z = np.where(
        locked,
        np.arctan2(rotmats[:, 1, 0], rotmats[:, 0, 0]),
        np.arctan2(-rotmats[:, 0, 1], rotmats[:, 1, 1]),
    )
    y = np.where(locked, 0.0, np.arctan2(-rotmats[:, 2, 0], rotmats[:, 2, 2]))
    angles = np.stack([z, x, y], -1)
    for t in range(
        1, len(angles)
    ):  # take the nearer one of the two equal triples, then whole revolutions
        near = angles[t] + 2 * np.pi * np.round((angles[t - 1] - angles[t]) / (2 * np.pi))
        other = np.array([angles[t, 0] + np.pi, np.pi - angles[t, 1], angles[t, 2] + np.pi])
        other += 2 * np.pi * np.round((angles[t - 1] - other) / (2 * np.pi))
        angles[t] = (
            near
            if np.abs(near - angles[t - 1]).sum() <= np.abs(other - angles[t - 1]).sum()
            else other
        )
    degrees: FloatArray = np.rad2deg(angles)
    return degrees


def _name(text: str) -> str:
    """Make a joint's name valid for the format: one line, no braces, not empty."""
    return (
        " ".join(re.sub(r"[{}\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]", "_", text).split())
        or "joint"
    )


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{value:.6f}" for value in values)
