"""BVH files: read any person's skeleton to a `Motion`, write a `Motion` so that every joint position survives."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.kinematics import SKELETONS, forward_kinematics, inverse_kinematics, rotvec_to_rotmat, skeleton_of, swing_between
from a2v.kinematics.names import canonical_joints, missing_joints
from a2v.kinematics.resample import resample_motion
from a2v.kinematics.skeleton import Skeleton
from a2v.kinematics.so3 import rotmat_to_rotvec
from a2v.types import FloatArray, Motion

MAX_BYTES = 512 << 20
MAX_JOINTS = 1000
MAX_NUMBERS = 60_000_000
MAX_VALUE = 1e6

UNITS: dict[str, float] = {
    "metres": 1.0,
    "centimetres": 0.01,
    "millimetres": 0.001,
    "inches": 0.0254,
    "feet": 0.3048,
    "decimetres": 0.1,
    "CMU units": 0.0254 / 0.45,
}
"""Metres of one unit of length, by name; CMU's skeletons are in inches divided by 0.45."""

_SAME_TURN = 2e-5  # radians: bones that agree so well share one joint

_ROTATION = {"Xrotation": 0, "Yrotation": 1, "Zrotation": 2}
_POSITION = {"Xposition": 0, "Yposition": 1, "Zposition": 2}


_Fail = Callable[[int, str], InputError]


@dataclass
class _Node:
    """A joint as the file has it; `end` marks an End Site."""

    name: str
    parent: int
    line: int
    offset: list[float] | None = None
    channels: list[str] | None = None
    first: int = 0
    end: bool = False


@dataclass
class _File:
    source: str
    nodes: list[_Node] = field(default_factory=list)
    frame_time: float = 0.0
    values: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    dropped: bool = False


def read_bvh(
    path: str | os.PathLike[str] | bytes,
    *,
    fps: float | None = None,
    units: str | float | None = None,
    up: str | None = None,
    person: bool = True,
    action: str = "",
    name: str = "BVH text",
) -> Motion:
    """Read a BVH file.

    Any order of channels and rotations, position channels on any joint (they replace its OFFSET, as Blender and
    MotionBuilder do) and End Sites (they become joints ``<parent>_end``) are understood. Joints on top of their parent
    (zero offset, such as CMU's ``LHipJoint``) are merged into it.

    Parameters
    ----------
    path : path, or the text or bytes of a file
    fps : float or None
        Resample to this rate (`resample_motion`); None keeps the file's.
    units : name in `UNITS`, metres per unit, or None
        None guesses from the person's height; what was chosen is in ``motion.provenance["units"]`` and ``["scale"]``.
    up : {"x", "y", "z", "-x", "-y", "-z"} or None
        The file's upward axis; None guesses (see ``provenance["up"]``).
    person : bool
        Demand the joints of a person under a known naming scheme (`canonical_joints`); False takes any skeleton.
    action : str
        Stored in the motion.
    name : str
        What messages call text or bytes.

    Returns
    -------
    Motion
        Metres, y up. Rotations are in the chain convention and keep the file's twists about the bones.

    Raises
    ------
    InputError
        The file is missing, empty, truncated, inconsistent, not finite, of absurd size or not a person; the message names the
        file and the line.
    """
    text, source = _text(path, name)
    file = _parse(text, source)
    nodes, frames = file.nodes, len(file.values)
    local, turns = _local_transforms(file)
    world_turn = np.zeros((frames, len(nodes), 3, 3))
    world = np.zeros((frames, len(nodes), 3))
    for j, node in enumerate(nodes):
        if node.parent < 0:
            world[:, j], world_turn[:, j] = local[:, j], turns[:, j]
        else:
            before = world_turn[:, node.parent]
            world[:, j] = world[:, node.parent] + np.einsum("tij,tj->ti", before, local[:, j])
            world_turn[:, j] = before @ turns[:, j]
    keep, merged = _merge_zero(file, local)
    new = {old: i for i, old in enumerate(keep)}
    names = _unique([nodes[j].name for j in keep])
    parents = [-1 if nodes[j].parent < 0 else new[merged[nodes[j].parent]] for j in keep]
    canonical = canonical_joints(names, parents)
    if person:
        _demand_person(file, canonical, names)
        _demand_limbs(file, local, keep, canonical)
    offsets = np.median(local[:, keep], axis=0)
    offsets[0] = 0
    scale, unit = _scale(source, offsets, parents, canonical, units, person)
    joints = world[:, keep]
    axis = up or _up_axis(offsets, parents, canonical, joints, source)
    turn = _axis_turn(axis, source)
    joints = (joints * scale) @ turn.T
    # the bone that ends at j is turned by the file's parent of j (a merged helper included)
    bone_turn = np.stack([turn @ world_turn[:, max(nodes[j].parent, 0)] for j in keep], 1)
    known = _known_skeleton(names, parents)
    if known is not None:  # BVH lists joints depth first: back to the data set's order
        order = [names.index(name) for name in known.joint_names]
        keep, names, parents = [keep[i] for i in order], list(known.joint_names), known.parents.tolist()
        joints, bone_turn, offsets = joints[:, order], bone_turn[:, order], offsets[order]
    skeleton = known or skeleton_of("custom", parents, names)
    to_offset = np.tile(np.eye(3), (frames, len(keep), 1, 1))
    to_offset[:, 1:] = rotvec_to_rotmat(
        swing_between(np.broadcast_to(skeleton.rest_directions[1:], joints[:, 1:].shape), local[:, keep[1:]])
    )
    rotations = chain_rotations(bone_turn @ to_offset, skeleton)
    motion = Motion(
        joints=joints.astype(np.float32),
        rotations=rotations.astype(np.float32),
        root=joints[:, 0].astype(np.float32),
        fps=_fps(file.frame_time),
        parents=np.asarray(parents),
        joint_names=tuple(names),
        skeleton=skeleton.name,
        action=action,
        provenance={
            "source": source,
            "units": unit,
            "scale": scale,
            "up": axis,
            "dropped_rest_frame": file.dropped,
        },
        rest_offsets=np.round((offsets * scale) @ turn.T, 7),
    )
    return motion if fps is None else resample_motion(motion, fps)


def write_bvh(path: str | os.PathLike[str], motion: Motion, *, units: str | float = "centimetres") -> None:
    """Write one clip as BVH (rotation order Z, X, Y; position channels on the root).

    BVH turns all bones below a joint together, while the chain convention gives every bone its own turn: where the
    children of a joint move against each other, each gets a helper joint of zero offset (``<child>_turn``), which
    `read_bvh` merges away again. Joints whose bone changes length get position channels. So every joint position
    survives to 1e-4 m, and so do the twists about bones.

    Parameters
    ----------
    path : path
        Written atomically.
    motion : Motion
        A single clip.
    units : name in `UNITS` or metres per unit

    Raises
    ------
    InputError
        `motion` is a batch, or the path cannot be written.
    """
    if motion.batch:
        raise InputError(f"write_bvh takes one clip; this Motion is a batch of shape {motion.batch}: index it first")
    scale = 1.0 / (UNITS[units] if isinstance(units, str) else units)
    plan = _plan(motion)
    header, channels, rates = ["HIERARCHY"], [], []

    def emit(index: int, depth: int) -> None:
        pad, item = "\t" * depth, plan[index]
        header.append(f"{pad}{'ROOT' if index == 0 else 'JOINT'} {item.name}")
        header.append(pad + "{")
        header.append(f"{pad}\tOFFSET {_numbers(item.offset * scale)}")
        order = "Zrotation Xrotation Yrotation"
        if item.positions is not None:
            header.append(f"{pad}\tCHANNELS 6 Xposition Yposition Zposition {order}")
            channels.append(item.positions * scale)
        else:
            header.append(f"{pad}\tCHANNELS 3 {order}")
        channels.append(_euler_zxy(item.turns))
        for child in item.children:
            emit(child, depth + 1)
        if not item.children:
            header.extend([f"{pad}\tEnd Site", pad + "\t{", f"{pad}\t\tOFFSET 0.000000 0.000000 0.000000", pad + "\t}"])
        header.append(pad + "}")

    emit(0, 0)
    rates = ["MOTION", f"Frames: {motion.frames}", f"Frame Time: {1.0 / motion.fps:.10f}"]
    table = np.concatenate(channels, axis=1)
    with atomic_path(path) as temporary, open(temporary, "w", encoding="ascii", newline="\n") as stream:
        stream.write("\n".join([*header, *rates]) + "\n")
        np.savetxt(stream, table, fmt="%.6f")


# ---------------------------------------------------------------------------------------------------------- reading


def _text(path: str | os.PathLike[str] | bytes, name: str) -> tuple[str, str]:
    if isinstance(path, bytes):
        return path.decode("latin-1"), name
    if isinstance(path, str) and ("\n" in path or path.lstrip().startswith("HIERARCHY")):
        return path, name
    source = Path(path)
    try:
        if source.is_dir():
            raise InputError(f"{source} is a folder; expected a BVH file")
        size = source.stat().st_size
        if size > MAX_BYTES:
            raise InputError(f"{source} has {size >> 20} MiB; BVH files up to {MAX_BYTES >> 20} MiB are read: cut or subsample it")
        return source.read_bytes().decode("latin-1"), str(source)
    except FileNotFoundError:
        raise InputError(f"{source} does not exist; give the path of a BVH file") from None
    except OSError as error:
        raise InputError(f"{source} cannot be read: {error.strerror}") from error


def _parse(text: str, source: str) -> _File:
    def fail(line: int, what: str) -> InputError:
        return InputError(f"{source}:{line}: {what}")

    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if not text.strip():
        raise fail(1, "the file is empty; expected a BVH file that starts with HIERARCHY")
    file = _File(source)
    stack: list[int] = []
    expected = "HIERARCHY"
    pending: int | None = None
    count = 0
    row = -1
    for row, raw in enumerate(lines):
        number, words = row + 1, raw.split()
        if not words:
            continue
        key = words[0].upper()
        if expected == "HIERARCHY":
            if key.lstrip("\ufeffï»¿") != "HIERARCHY":
                raise fail(number, f"expected HIERARCHY, found '{raw.strip()[:40]}'; is this a BVH file?")
            expected = ""
        elif key == "MOTION":
            break
        elif key in ("ROOT", "JOINT") or (key == "END" and len(words) > 1 and words[1].upper() == "SITE"):
            if pending is not None:
                raise fail(number, f"expected '{{' after joint '{file.nodes[pending].name}', found '{words[0]}'")
            if key == "ROOT" and file.nodes:
                raise fail(number, "a second ROOT; files with several people are not read: split it")
            if key != "ROOT" and not stack:
                raise fail(number, f"{words[0]} outside of any joint")
            parent = stack[-1] if stack else -1
            name = f"{file.nodes[parent].name}_end" if key == "END" else " ".join(words[1:])
            if not name:
                raise fail(number, f"{words[0]} without a name")
            if len(file.nodes) >= MAX_JOINTS:
                raise fail(number, f"more than {MAX_JOINTS} joints")
            file.nodes.append(_Node(name, parent, number, end=key == "END"))
            pending = len(file.nodes) - 1
            if words[-1] == "{":
                file.nodes[-1].name = file.nodes[-1].name.removesuffix("{").strip()
                stack.append(pending)
                pending = None
        elif key == "{":
            if pending is None:
                raise fail(number, "'{' without a joint before it")
            stack.append(pending)
            pending = None
        elif key == "}":
            if not stack:
                raise fail(number, "'}' without a matching '{'")
            node = file.nodes[stack.pop()]
            if node.offset is None:
                raise fail(number, f"joint '{node.name}' (line {node.line}) has no OFFSET")
            if node.channels is None and not node.end:
                node.channels = []
        elif key == "OFFSET":
            if not stack:
                raise fail(number, "OFFSET outside of any joint")
            file.nodes[stack[-1]].offset = _floats(words[1:], 3, fail, number, f"OFFSET of '{file.nodes[stack[-1]].name}'")
        elif key == "CHANNELS":
            if not stack:
                raise fail(number, "CHANNELS outside of any joint")
            names = [word[:1].upper() + word[1:].lower() for word in words[2:]]
            if len(words) < 2 or not words[1].isdigit() or int(words[1]) != len(names):
                raise fail(number, f"CHANNELS says {words[1] if len(words) > 1 else 'nothing'} but lists {len(names)} channels")
            if unknown := [name for name in names if name not in _ROTATION and name not in _POSITION]:
                raise fail(number, f"unknown channel '{unknown[0]}'; expected Xposition ... Zrotation")
            if len(set(names)) < len(names):
                raise fail(number, "a channel is listed twice")
            node = file.nodes[stack[-1]]
            if node.channels is not None:
                raise fail(number, f"joint '{node.name}' has CHANNELS twice")
            node.channels, node.first = names, count
            count += len(names)
        else:
            raise fail(number, f"unexpected '{raw.strip()[:40]}' in the hierarchy")
    else:
        raise fail(row + 1, "the file ends inside the hierarchy: no MOTION section; it is truncated")
    if stack or pending is not None:
        raise fail(row + 1, f"MOTION inside of joint '{file.nodes[stack[-1] if stack else pending or 0].name}': a '}}' is missing")
    if not file.nodes:
        raise fail(row + 1, "no ROOT joint")
    if count == 0:
        raise fail(row + 1, "no joint has channels: nothing moves")
    _parse_motion(file, lines, row + 1, count, fail)
    turns = [node.first + place for node in file.nodes for place, name in enumerate(node.channels or ()) if name in _ROTATION]
    if len(file.values) > 2 and turns:  # CMU's conversions start with a T-pose: nearly all zeros, and a leap to the next frame
        steps = np.abs((np.diff(file.values[:3, turns], axis=0) + 180) % 360 - 180).max(axis=1)
        if (file.values[0, turns] == 0).mean() > 0.8 and steps[0] > max(25.0, 4 * steps[1]):
            file.values, file.dropped = file.values[1:], True
    return file


def _parse_motion(file: _File, lines: list[str], row: int, count: int, fail: _Fail) -> None:
    head: dict[str, float] = {}
    while row < len(lines) and len(head) < 2:
        raw = lines[row].strip()
        row += 1
        if not raw:
            continue
        found = re.match(r"^(Frames|Frame Time)\s*:\s*(\S*)$", raw, flags=re.IGNORECASE)
        if not found:
            raise fail(row, f"expected 'Frames:' and 'Frame Time:', found '{raw[:40]}'")
        try:
            head[found.group(1).lower()] = float(found.group(2))
        except ValueError:
            raise fail(row, f"'{found.group(2)}' is no number") from None
    if len(head) < 2:
        raise fail(len(lines), "the file ends before 'Frames:' and 'Frame Time:'; it is truncated")
    frames, file.frame_time = head["frames"], head["frame time"]
    if not (math.isfinite(frames) and frames == int(frames) and frames >= 1):
        raise fail(row, f"the file says it has {frames:g} frames; expected at least 1")
    if not (math.isfinite(file.frame_time) and 1e-4 <= file.frame_time <= 10):
        raise fail(row, f"Frame Time is {file.frame_time:g} s; expected 0.0001 to 10")
    if frames * count > MAX_NUMBERS:
        raise fail(row, f"{frames:g} frames of {count} channels are more than {MAX_NUMBERS:,} numbers: cut or subsample the file")
    numbers = [i for i in range(row, len(lines)) if lines[i].strip()]
    rows: list[FloatArray] = []
    for i in numbers:
        words = lines[i].split()
        try:
            values = np.array(words, dtype=np.float64)
        except ValueError:
            bad = next(word for word in words if not _is_number(word))
            raise fail(i + 1, f"'{bad[:20]}' is no number") from None
        if len(values) != count:
            last = i == numbers[-1] and len(values) < count
            raise fail(i + 1, f"{len(values)} numbers for {count} channels" + ("; the file is truncated" if last else ""))
        if not np.isfinite(values).all():
            raise fail(i + 1, f"NaN or infinite number in channel {int(np.argmin(np.isfinite(values))) + 1}")
        if np.abs(values).max() > MAX_VALUE:
            raise fail(i + 1, f"a value of {np.abs(values).max():.3g} is absurd for a motion")
        rows.append(values)
    if not rows:
        raise fail(len(lines), f"no frames after the header that announces {frames:g}; the file is truncated")
    if len(rows) != frames:
        more = "more" if len(rows) > frames else "fewer"
        raise fail(
            numbers[-1] + 1, f"{len(rows)} frames, {more} than the {frames:g} announced" + ("; it is truncated" if more == "fewer" else "")
        )
    file.values = np.stack(rows)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _floats(words: Sequence[str], count: int, fail: _Fail, line: int, what: str) -> list[float]:
    try:
        values = [float(word) for word in words]
    except ValueError:
        raise fail(line, f"{what}: '{' '.join(words)[:40]}' are no numbers") from None
    if len(values) != count:
        raise fail(line, f"{what} has {len(values)} numbers; expected {count}")
    if not all(math.isfinite(value) for value in values):
        raise fail(line, f"{what} holds NaN or infinite numbers")
    if max(map(abs, values)) > MAX_VALUE:
        raise fail(line, f"{what} is {max(map(abs, values)):.3g} long: absurd for a skeleton")
    return values


def _local_transforms(file: _File) -> tuple[FloatArray, FloatArray]:
    """Translations (T, N, 3) and rotations (T, N, 3, 3) of every joint in its parent."""
    frames, n = len(file.values), len(file.nodes)
    local = np.zeros((frames, n, 3))
    turns = np.tile(np.eye(3), (frames, n, 1, 1))
    for j, node in enumerate(file.nodes):
        local[:, j] = node.offset if node.offset is not None else 0.0
        for place, channel in enumerate(node.channels or ()):
            values = file.values[:, node.first + place]
            if channel in _POSITION:
                local[:, j, _POSITION[channel]] = values
            else:
                axis = np.zeros((frames, 3))
                axis[:, _ROTATION[channel]] = np.deg2rad(values)
                turns[:, j] = turns[:, j] @ rotvec_to_rotmat(axis)
    return local, turns


def _merge_zero(file: _File, local: FloatArray) -> tuple[list[int], dict[int, int]]:
    """Indices of joints to keep, and for each joint the kept joint that stands at its place."""
    length = np.abs(local).max(axis=(0, 2))
    tolerance = 1e-6 * max(float(length[1:].max()) if len(length) > 1 else 0.0, 1e-12)
    keep, merged = [0], {0: 0}
    for j, node in enumerate(file.nodes[1:], start=1):
        if length[j] > tolerance:
            keep.append(j)
            merged[j] = j
        else:
            merged[j] = merged[node.parent]
    if len(keep) < 2:
        raise InputError(f"{file.source}:{file.nodes[0].line}: every bone has zero length; there is no skeleton to move")
    return keep, merged


def _demand_person(file: _File, canonical: dict[str, int], names: Sequence[str]) -> None:
    missing = missing_joints(canonical)
    if not missing:
        return
    # a missing limb joint may be there under a known name, merged because its bone has no length
    every = canonical_joints([node.name for node in file.nodes], [node.parent for node in file.nodes])
    for name in missing:
        if name in every:
            node = file.nodes[every[name]]
            raise InputError(f"{file.source}:{node.line}: joint '{node.name}' ({name.replace('_', ' ')}) has a bone of zero length")
    listed = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    raise InputError(
        f"{file.source}:{file.nodes[0].line}: unknown joints: no {', '.join(name.replace('_', ' ') for name in missing[:4])}"
        f"{' ...' if len(missing) > 4 else ''} among {listed}; rename them to Mixamo's, CMU's or SMPL's names"
    )


def _demand_limbs(file: _File, local: FloatArray, keep: Sequence[int], canonical: dict[str, int]) -> None:
    """Bones of arms and legs must have a length, and none may be out of all proportion."""
    length = np.linalg.norm(np.median(local[:, keep], axis=0), axis=-1)
    limbs = [canonical[f"{side}_{joint}"] for side in ("left", "right") for joint in ("knee", "ankle", "elbow", "wrist")]
    middle = float(np.median(length[limbs]))
    for index in limbs:
        if length[index] < 0.02 * middle:
            node = file.nodes[keep[index]]
            raise InputError(f"{file.source}:{node.line}: joint '{node.name}' has a bone of (nearly) zero length")
    for index, joint in enumerate(keep):
        if index and length[index] > 20 * middle:
            node = file.nodes[joint]
            raise InputError(f"{file.source}:{node.line}: the bone of '{node.name}' is {length[index] / middle:.0f} times a limb's length")


def _height(offsets: FloatArray, parents: Sequence[int], canonical: dict[str, int]) -> float:
    """Rough height of the person in the file's units, from bone lengths."""
    length = np.linalg.norm(offsets, axis=-1)

    def reach(joint: int, start: int) -> float:
        total = 0.0
        while joint not in (start, -1, 0):
            total += float(length[joint])
            joint = int(parents[joint])
        return total

    legs = [reach(canonical[f"{s}_ankle"], canonical[f"{s}_hip"]) for s in ("left", "right") if f"{s}_ankle" in canonical]
    top = canonical.get("head", canonical.get("neck", canonical.get("left_shoulder", 0)))
    return (float(np.mean(legs)) + reach(top, 0)) * 1.17 if legs else float(length.sum())


def _scale(
    source: str, offsets: FloatArray, parents: Sequence[int], canonical: dict[str, int], units: str | float | None, person: bool
) -> tuple[float, str]:
    if isinstance(units, str):
        if units not in UNITS:
            raise InputError(f"unknown units '{units}'; choose from {', '.join(UNITS)}")
        return UNITS[units], units
    if units is not None:
        if not (math.isfinite(units) and units > 0):
            raise InputError(f"units is {units}; expected metres per unit, a positive number")
        return float(units), "given"
    height = _height(offsets, parents, canonical)
    if height <= 0:
        raise InputError(f"{source}: the skeleton has no size; its bones have zero length")
    if not person:
        likely = {name: abs(math.log(height * metres / 1.7)) for name, metres in UNITS.items()}
        best = min(likely, key=likely.__getitem__)
        return UNITS[best], best
    likely = {name: abs(math.log(height * metres / 1.65)) for name, metres in UNITS.items() if 0.9 <= height * metres <= 2.4}
    if not likely:
        return 1.7 / height, f"unknown: a height of {height:.4g} scaled to 1.7 m"
    best = min(likely, key=likely.__getitem__)
    return UNITS[best], best


def _up_axis(offsets: FloatArray, parents: Sequence[int], canonical: dict[str, int], joints: FloatArray, source: str) -> str:
    """The axis that points up: the one of the rest pose, unless the file's motion stands along another one."""
    top = canonical.get("head", canonical.get("neck"))
    if top is None or "left_ankle" not in canonical or "right_ankle" not in canonical:
        return "y"
    rest = np.zeros_like(offsets)
    for j in range(1, len(offsets)):
        rest[j] = rest[parents[j]] + offsets[j]
    feet = [canonical["left_ankle"], canonical["right_ankle"]]
    standing = rest[top] - rest[feet].mean(0)
    moving = np.mean(joints[:, top] - joints[:, feet].mean(1), axis=0)
    size = float(np.linalg.norm(standing)) or 1.0
    in_rest, in_motion = int(np.argmax(np.abs(standing))), int(np.argmax(np.abs(moving)))
    upright = abs(moving[in_motion]) > 0.75 * size
    # someone who lies down also points along another axis, but then the pelvis is not a leg's length above zero along it
    legs = float(np.linalg.norm(rest[feet].mean(0)))
    high = float(np.median(joints[:, 0, in_motion])) * np.sign(moving[in_motion])
    if in_rest != in_motion and upright and 0.6 * legs < high < 1.5 * legs:
        axis, sign = in_motion, np.sign(moving[in_motion])
    elif abs(standing[in_rest]) > 0.5 * size:
        axis, sign = in_rest, np.sign(standing[in_rest])
        if in_rest == in_motion and upright:
            sign = np.sign(moving[in_motion])  # a root that turns the whole rest pose over
    else:
        axis, sign = (in_motion, np.sign(moving[in_motion])) if upright else (1, 1.0)
    return ("" if sign > 0 else "-") + "xyz"[axis]


def _axis_turn(axis: str, source: str) -> FloatArray:
    """Rotation (3, 3) that turns `axis` to +y; z up turns about x, so that -y becomes +z (front in z-up systems)."""
    table: dict[str, list[list[int]]] = {
        "y": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "z": [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        "x": [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
        "-y": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
        "-z": [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        "-x": [[0, 1, 0], [-1, 0, 0], [0, 0, 1]],
    }
    if axis not in table:
        raise InputError(f"unknown up axis '{axis}'; choose from {', '.join(table)}")
    return np.asarray(table[axis], dtype=np.float64)


def _unique(names: list[str]) -> list[str]:
    seen: dict[str, int] = {}
    out = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        out.append(name if seen[name] == 1 else f"{name}_{seen[name]}")
    return out


def _known_skeleton(names: list[str], parents: list[int]) -> Skeleton | None:
    """The data set's skeleton with these joints and bones, in whatever order."""
    tree = {name: names[parent] if parent >= 0 else "" for name, parent in zip(names, parents, strict=True)}
    for skeleton in SKELETONS.values():
        pairs = zip(skeleton.joint_names, skeleton.parents.tolist(), strict=True)
        if tree == {name: skeleton.joint_names[parent] if parent >= 0 else "" for name, parent in pairs}:
            return skeleton
    return None


def _fps(frame_time: float) -> float:
    """Frames per second; the usual rates are written with few digits (.0083333 is 120)."""
    fps = 1.0 / frame_time
    return float(round(fps)) if round(fps) and abs(fps / round(fps) - 1) < 2e-4 else fps


def chain_rotations(turns: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Rotation vectors (T, J, 3) relative to the previous bone of the chain, from world turns of bones (T, J, 3, 3)."""
    rotations = np.zeros((*turns.shape[:2], 3))
    for chain in skeleton.chains:
        for place in range(1, len(chain)):
            now = turns[:, chain[place]]
            if place > 1:
                now = np.swapaxes(turns[:, chain[place - 1]], -1, -2) @ now
            rotations[:, chain[place]] = rotmat_to_rotvec(now)
    return rotations


# ---------------------------------------------------------------------------------------------------------- writing


@dataclass
class _Out:
    """A joint to be written: offset (3,), rotations in its parent (T, 3, 3), position channels (T, 3) or None."""

    name: str
    offset: FloatArray
    turns: FloatArray
    positions: FloatArray | None
    children: list[int] = field(default_factory=list)


def bone_turns(motion: Motion) -> FloatArray:
    """World rotations (T, J, 3, 3) of the bones of a clip: entry j turns the skeleton's rest direction to bone j's."""
    skeleton = skeleton_of(motion.skeleton, motion.parents.tolist(), motion.joint_names)
    joints = motion.joints.astype(np.float64)
    rotations = motion.rotations.astype(np.float64)
    lengths = np.linalg.norm(joints - joints[:, np.maximum(motion.parents, 0)], axis=-1)
    if np.abs(forward_kinematics(rotations, motion.root.astype(np.float64), lengths, skeleton) - joints).max() > 5e-5:
        rotations = inverse_kinematics(joints, skeleton)  # such as a clip of joints only
    local = rotvec_to_rotmat(rotations)
    turns = np.tile(np.eye(3), (motion.frames, len(motion.parents), 1, 1))
    for chain in skeleton.chains:
        for place in range(1, len(chain)):
            turns[:, chain[place]] = (turns[:, chain[place - 1]] if place > 1 else np.eye(3)) @ local[:, chain[place]]
    return turns


def _plan(motion: Motion) -> list[_Out]:
    skeleton = skeleton_of(motion.skeleton, motion.parents.tolist(), motion.joint_names)
    parents, n = motion.parents.tolist(), len(motion.parents)
    joints = motion.joints.astype(np.float64)
    vectors = joints - joints[:, np.maximum(motion.parents, 0)]
    lengths = np.linalg.norm(vectors, axis=-1)
    turns = bone_turns(motion)
    middle = np.median(lengths, axis=0)
    given = motion.rest_offsets
    if given is not None and np.allclose(np.linalg.norm(given, axis=-1)[1:], middle[1:], rtol=0.02, atol=1e-4):
        directions = given / np.maximum(np.linalg.norm(given, axis=-1, keepdims=True), 1e-12)
        turns[:, 1:] = turns[:, 1:] @ rotvec_to_rotmat(swing_between(directions[1:], skeleton.rest_directions[1:]))
    elif motion.skeleton in SKELETONS:
        directions = skeleton.rest_directions
    else:  # the first frame is the rest pose
        directions = vectors[0] / np.maximum(lengths[0][:, None], 1e-12)
        turns = turns @ np.swapaxes(turns[:1], -1, -2)
    children: list[list[int]] = [[] for _ in range(n)]
    for j in range(1, n):
        children[parents[j]].append(j)
    # exact turns for the joints' positions: rest direction to the bone's very direction
    unit = vectors / np.maximum(lengths[..., None], 1e-12)
    turned = np.einsum("tjab,jb->tja", turns, directions)[:, 1:]
    # (only where it matters: correcting rounding would set siblings against each other)
    off = np.linalg.norm(turned * lengths[:, 1:, None] - vectors[:, 1:], axis=-1, keepdims=True) > 2e-6
    turns[:, 1:] = rotvec_to_rotmat(swing_between(turned, np.where(off, unit[:, 1:], turned))) @ turns[:, 1:]
    out: list[_Out] = []
    world: list[FloatArray] = []

    def add(name: str, offset: FloatArray, turn: FloatArray, parent: int, positions: FloatArray | None) -> int:
        local = turn if parent < 0 else np.swapaxes(world[parent], -1, -2) @ turn
        out.append(_Out(name, offset, local, positions))
        world.append(turn)
        if parent >= 0:
            out[parent].children.append(len(out) - 1)
        return len(out) - 1

    def visit(joint: int, parent: int) -> None:
        below = children[joint]
        if not below:
            turn = turns[:, joint]
        else:
            spread = max(float(np.abs(turns[:, c] - turns[:, below[0]]).max()) for c in below)
            turn = turns[:, below[0]] if spread < _SAME_TURN else _fit_turn(directions[below] * middle[below, None], vectors[:, below])
        varies = joint > 0 and float(np.ptp(lengths[:, joint])) > 2e-5
        positions = joints[:, 0] if joint == 0 else directions[joint] * lengths[:, joint, None] if varies else None
        offset = np.zeros(3) if joint == 0 else directions[joint] * middle[joint]
        here = add(motion.joint_names[joint], offset, turn, parent, positions)
        for child in below:
            helper = here
            if float(np.abs(turns[:, child] - turn).max()) >= _SAME_TURN:
                helper = add(f"{motion.joint_names[child]}_turn", np.zeros(3), turns[:, child], here, None)
            visit(child, helper)

    visit(0, -1)
    return out


def _fit_turn(rest: FloatArray, now: FloatArray) -> FloatArray:
    """Rotations (T, 3, 3) that best turn vectors `rest` (C, 3) to `now` (T, C, 3) (Kabsch)."""
    u, _, vt = np.linalg.svd(np.einsum("tca,cb->tab", now, rest))
    sign = np.ones((*u.shape[:1], 3))
    sign[:, 2] = np.linalg.det(u @ vt)
    turn: FloatArray = (u * sign[:, None, :]) @ vt
    return turn


def _euler_zxy(turns: FloatArray) -> FloatArray:
    """Continuous angles (T, 3) in degrees of rotations (T, 3, 3) = Rz Rx Ry."""
    x = np.arcsin(np.clip(turns[:, 2, 1], -1, 1))
    locked = np.abs(turns[:, 2, 1]) > 1 - 1e-12
    z = np.where(locked, np.arctan2(turns[:, 1, 0], turns[:, 0, 0]), np.arctan2(-turns[:, 0, 1], turns[:, 1, 1]))
    y = np.where(locked, 0.0, np.arctan2(-turns[:, 2, 0], turns[:, 2, 2]))
    angles = np.stack([z, x, y], -1)
    for t in range(1, len(angles)):  # of the two equal triples take the nearer one, then whole turns
        near = angles[t] + 2 * np.pi * np.round((angles[t - 1] - angles[t]) / (2 * np.pi))
        other = np.array([angles[t, 0] + np.pi, np.pi - angles[t, 1], angles[t, 2] + np.pi])
        other += 2 * np.pi * np.round((angles[t - 1] - other) / (2 * np.pi))
        angles[t] = near if np.abs(near - angles[t - 1]).sum() <= np.abs(other - angles[t - 1]).sum() else other
    degrees: FloatArray = np.rad2deg(angles)
    return degrees


def _numbers(values: FloatArray) -> str:
    return " ".join(f"{value:.6f}" for value in values)
