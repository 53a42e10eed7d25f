"""Read the motions that models of the SMPL family and text-to-motion models write: rotations or
joints in arrays.

Known are AMASS, SMPL, SMPL-H and SMPL-X parameters (npz, pickles, joblib), GVHMR, WHAM, AIST++,
HY-Motion, Motion-X, MDM's ``results.npy``, and HumanML3D's joints and 263 features. Joints of
rotations come from our own forward kinematics on the published average skeleton; no file of SMPL is
needed. Body shapes, fingers and faces are not read.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.formats.conventions import choose_scale, clip_number, y_up_rotmat
from a2v.formats.recording import motion_of
from a2v.formats.smpl.skeleton import NAMES, OFFSETS, PARENTS, posed, upward_axis
from a2v.formats.smpl.stored import load_arrays
from a2v.io import reading, shorten
from a2v.kinematics import rotvec_to_rotmat, skeleton_of
from a2v.kinematics.from_joints import motion_of_joints
from a2v.kinematics.names import canonical_joints
from a2v.kinematics.resample import MAX_JOINT_FRAMES
from a2v.types import FloatArray, Motion

MAX_VALUE = 1e5

_JOINT_SETS = (22, 24, 52, 55, 127, 144)
"""Numbers of joints in arrays of joints whose first 22 are SMPL's."""
_RATES = ("mocap_framerate", "mocap_frame_rate", "fps", "frame_rate", "framerate", "mocap_fps")
_PATHS = ("trans", "transl", "smpl_trans", "trans_world", "root_trans", "translation", "Th")
_WHOLE = ("poses", "fullpose", "smpl_poses", "pose_world", "poses_world", "pose", "rot6d")
_ROOTS = ("global_orient", "root_orient", "Rh", "orient")
_BODIES = ("body_pose", "pose_body")
_JOINTS = ("joints", "joints3d", "keypoints3d", "positions", "motion", "arr_0")
_KEPT = (*_RATES, *_PATHS, *_WHOLE, *_ROOTS, *_BODIES, *_JOINTS, "smpl_scaling", "num_frames",
         "lengths", "text", "rest_joints")  # fmt: skip
"""Arrays that are read of an archive; others may be pickled or large."""
_FEATURES = 263
"""Numbers a frame of HumanML3D."""
_MOTION_X = 322
"""Numbers a frame of Motion-X."""


@dataclass(frozen=True)
class _Kind:
    """What is known of the tool that wrote a file: its name, its usual rate and upward axis."""

    title: str
    fps: float
    up: str = "y"


_AMASS = _Kind("SMPL parameters", 30.0)
_HUMANML3D = _Kind("HumanML3D's joints", 20.0)


def read_smpl_motion(path: str | os.PathLike[str], *, action: str = "", clip: str = "") -> Motion:
    """Read a motion of the kinds that this module names.

    Parameters
    ----------
    path : path
        ``.npz``, ``.npy``, ``.pkl`` (also joblib's) or ``.pt``; the content decides.
    action : str
        Stored in the motion.
    clip : str
        Number of the motion, or name of the person, in a file with several; "" takes the first
        motion, and the person with most frames.

    Returns
    -------
    Motion
        Meters, y up: the upward axis is that of the tool, unless the person stands along another
        axis with the lowest joints at one height. ``provenance["notes"]`` has what was assumed.

    Raises
    ------
    InputError
        The file is broken or too large, or its arrays are of no known kind; the message lists
        them.
    """
    source = Path(path)
    with reading(source, "motion that can be read", "arrays of a motion of SMPL's joints"):
        return _read(str(source), load_arrays(source, _KEPT), action, clip)


def _read(source: str, content: Any, action: str, clip: str) -> Motion:
    notes: list[str] = []
    kind = _AMASS
    if isinstance(content, Mapping):
        content, kind, clip = _part(source, content, clip, notes)
    if isinstance(content, np.ndarray):
        content = {"arr_0": content}
    if not isinstance(content, Mapping):
        raise InputError(f"{source} holds no arrays; expected a motion of SMPL's joints")
    arrays = {
        str(name): np.asarray(value)
        for name, value in content.items()
        if name in _KEPT and isinstance(value, np.ndarray | np.generic | float | int)
    }
    scale = arrays.get("smpl_scaling")
    found = _joints_in(arrays, content, (source, clip), notes)
    if found is None:
        clip_number(source, clip, 1)
    else:
        joints, kind = found
        return _of_joints(source, joints, _fps(arrays, kind, notes), (kind, action, notes))
    turns = _rotations_in(arrays)
    if turns is None:
        listed = ", ".join(
            f"{shorten(str(name), 40)} "
            + ("x".join(map(str, value.shape)) if isinstance(value, np.ndarray) else "")
            for name, value in [*content.items()][:8]
        )
        raise InputError(
            f"{source}: unknown arrays ({shorten(listed)}); expected AMASS's or SMPL's poses and "
            f"trans, joints (T, 22, 3), or HumanML3D's features (T, {_FEATURES})"
        )
    frames = len(turns)
    path = _path_in(arrays, frames)
    if path is None:
        path = np.zeros((frames, 3))
        notes.append("the file has no path: the person stays in place")
    elif scale is not None and scale.size == 1 and float(scale.ravel()[0]) > 0:
        path = path / float(scale.ravel()[0])
        kind = _Kind("AIST++", 60.0)
    if kind is _AMASS and set(arrays) & {"mocap_framerate", "mocap_frame_rate"}:
        kind = _Kind("AMASS", 60.0, "y" if "num_frames" in arrays or "Rh" in arrays else "z")
    _demand_numbers(source, turns, path)
    rest = arrays.get("rest_joints")
    if rest is not None:  # of SMPL-H, as we write it: the middle fingers begin at the knuckles
        known = rest.shape == (52, 3) and rest.dtype.kind == "f" and np.isfinite(rest).all()
        rest = rest[[*range(22), 25, 40]].astype(np.float64) if known else None
    recording = posed(turns, path, rest)
    up = upward_axis(recording.world, kind.up)
    if up != kind.up:
        notes.append(f"the person stands along {up}, not along the usual {kind.up}")
    fps = _fps(arrays, kind, notes)
    facts = {"format": kind.title}
    recording = replace(recording, source=source, fps=fps, up=up, notes=tuple(notes), facts=facts)
    return motion_of(recording, units="meters", action=action)


def _part(
    source: str, content: Mapping[Any, Any], clip: str, notes: list[str]
) -> tuple[Mapping[Any, Any], _Kind, str]:
    """Return the dict that holds the motion: of GVHMR's the one in the world, of several people's
    the one called `clip` or with most frames; and what is left of `clip`."""
    if isinstance(inner := content.get("smpl_params_global"), Mapping):
        return inner, _Kind("GVHMR", 30.0), clip
    people = {str(key): value for key, value in content.items() if isinstance(value, Mapping)}
    if not people or set(map(str, content)) & {*_WHOLE, *_BODIES, *_JOINTS}:
        return content, _AMASS, clip
    if clip:
        if clip not in people:
            listed = ", ".join(f"'{shorten(key, 40)}'" for key in [*people][:12])
            raise InputError(f"{source} has no person '{shorten(clip)}'; choose one of {listed}")
        return people[clip], _AMASS, ""

    def frames(person: Mapping[Any, Any]) -> int:
        return max(
            (
                len(value)
                for value in person.values()
                if isinstance(value, np.ndarray) and value.ndim
            ),
            default=0,
        )

    best = max(people, key=lambda key: frames(people[key]))
    if len(people) > 1:
        notes.append(f"of {len(people)} people '{shorten(best, 40)}', with most frames, is read")
    return people[best], _AMASS, ""


def _joints_in(
    arrays: Mapping[str, np.ndarray],
    content: Mapping[Any, Any],
    wanted: tuple[str, str],
    notes: list[str],
) -> tuple[FloatArray, _Kind] | None:
    """Return joints (T, 22 or 24, 3) if the arrays have such, and their kind; `wanted` is the name
    of the file and the number of the motion in it."""
    for name in _JOINTS:
        array = arrays.get(name)
        if array is None or array.dtype.kind not in "fiu":
            continue
        several = array.ndim == 4 and len(array) > 0
        number = clip_number(*wanted, len(array) if several else 1)
        if several and len(array) > 1 and not wanted[1]:
            notes.append(f"of {len(array)} motions the first is read")
        if several and array.shape[1] in _JOINT_SETS and array.shape[2] == 3:  # MDM
            length = _number(content.get("lengths"), number)
            joints = np.moveaxis(array[number], -1, 0)
            return joints[: length or None].astype(np.float64), _Kind("MDM", 20.0)
        if several and array.shape[2] in _JOINT_SETS:
            array = array[number]
        if array.ndim == 3 and array.shape[2] == 3 and array.shape[1] in _JOINT_SETS:
            joints = array[:, : 24 if array.shape[1] == 24 else 22].astype(np.float64)
            path = _path_in(arrays, len(joints))
            if path is not None and np.ptp(joints[:, 0], axis=0).max(initial=0) < 1e-6:
                joints = joints + path[:, None]
            title = _Kind("HY-Motion", 30.0) if name == "keypoints3d" else _HUMANML3D
            return joints, title
        if array.ndim == 2 and array.shape[1] == _FEATURES:
            return _from_features(array.astype(np.float64)), _Kind("HumanML3D's features", 20.0)
    return None


def _number(values: object, place: int) -> int:
    """Return a number of an array or a list of them; 0 if there is none."""
    found = values[place] if isinstance(values, list | np.ndarray) and place < len(values) else 0
    return int(found) if isinstance(found, int | np.integer) and found > 0 else 0


def _from_features(features: FloatArray) -> FloatArray:
    """Return joints (T, 22, 3) of HumanML3D's features (T, 263): the root's turn and speed a frame,
    its height, and the other joints in the root's frame (Guo et al., CVPR 2022)."""
    half = np.concatenate([[0.0], np.cumsum(features[:-1, 0])])
    back = rotvec_to_rotmat(np.stack([0 * half, -2 * half, 0 * half], axis=1))
    speed = np.zeros((len(features), 3))
    speed[1:, [0, 2]] = features[:-1, 1:3]
    root = np.cumsum(np.einsum("tab,tb->ta", back, speed), axis=0)
    root[:, 1] = features[:, 3]
    others = np.einsum("tab,tjb->tja", back, features[:, 4:67].reshape(-1, 21, 3))
    others += root[:, None] * (1, 0, 1)
    shin = np.linalg.norm(others[:, 6] - others[:, 3], axis=-1)
    high = float(np.median(features[:, 3])) if len(features) else 1.0
    if not 0.05 < high < 3 or shin.max(initial=0) - shin.min(initial=np.inf) > 0.2 * shin.max(
        initial=1e-9
    ):
        raise InputError(
            "the features are normalized, for shins change their length; multiply them by the data "
            "set's Std.npy and add its Mean.npy first"
        )
    return np.concatenate([root[:, None], others], axis=1)


def _rotations_in(arrays: Mapping[str, np.ndarray]) -> FloatArray | None:
    """Return rotations (T, 22 or more, 3, 3) in the parents; None if the arrays have none."""
    flat = arrays.get("arr_0", arrays.get("motion"))
    if flat is not None and flat.ndim == 2 and flat.shape[1] == _MOTION_X:
        return _rotmats(flat[:, :66])
    for name in _WHOLE:
        if name in arrays and (made := _rotmats(arrays[name])) is not None and made.shape[1] >= 22:
            wide = arrays[name].size // max(len(made), 1)
            return made if wide in (72, 144, 216) else made[:, :22]  # fingers are no hands
    body = next((_rotmats(arrays[name]) for name in _BODIES if name in arrays), None)
    if body is None or body.shape[1] < 21:
        return None
    root = next((_rotmats(arrays[name]) for name in _ROOTS if name in arrays), None)
    if root is None or len(root) != len(body):
        root = np.tile(np.eye(3), (len(body), 1, 1, 1))
    both: FloatArray = np.concatenate([root[:, :1], body], axis=1)
    return both


def _rotmats(given: np.ndarray) -> FloatArray | None:
    """Return rotations (T, K, 3, 3) of an array of rotation vectors, matrices, or their first two
    columns; None if it is none."""
    if given.dtype.kind not in "fiu" or given.ndim < 2:
        return None
    if given.ndim > 2 and len(given) == 1:  # a batch of one
        given = given[0]
    if given.ndim == 2 and given.shape[1] % 3 == 0:
        given = given.reshape(len(given), -1, 3)
    if given.ndim < 3 or len(given) > MAX_JOINT_FRAMES // len(NAMES):
        return None
    array: FloatArray = given[:, : len(NAMES)].astype(np.float64)
    if not np.isfinite(array).all() or np.abs(array).max(initial=0) > MAX_VALUE:
        return None
    if array.ndim == 4 and array.shape[2:] == (3, 3):
        return array
    if array.ndim == 3 and array.shape[2] == 6:
        pair = array.reshape(*array.shape[:2], 3, 2)
        first = _unit(pair[..., 0])
        second = pair[..., 1]
        second = _unit(second - (first * second).sum(-1, keepdims=True) * first)
        turns: FloatArray = np.stack([first, second, np.cross(first, second)], axis=-1)
        return turns
    if array.ndim != 3 or array.shape[2] != 3:
        return None
    made: FloatArray = rotvec_to_rotmat(array)
    return made


def _unit(vectors: FloatArray) -> FloatArray:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(lengths, 1e-9))


def _path_in(arrays: Mapping[str, np.ndarray], frames: int) -> FloatArray | None:
    """Return the translations (frames, 3); None if there are none."""
    flat = arrays.get("arr_0", arrays.get("motion"))
    if flat is not None and flat.ndim == 2 and flat.shape == (frames, _MOTION_X):
        return flat[:, 309:312].astype(np.float64)
    for name in _PATHS:
        if name in arrays and arrays[name].size == 3 * frames and arrays[name].dtype.kind in "fiu":
            return arrays[name].reshape(frames, 3).astype(np.float64)
    return None


def _fps(arrays: Mapping[str, np.ndarray], kind: _Kind, notes: list[str]) -> float:
    """Return the frames per second: the file's, else those of the tool, with a note."""
    for name in _RATES:
        value = arrays.get(name)
        if value is not None and value.size == 1 and value.dtype.kind in "fiu":
            fps = float(value.ravel()[0])
            if np.isfinite(fps) and 0.1 <= fps <= 1000:
                return fps
    notes.append(f"the file has no frame rate: {kind.fps:g} frames per second, as {kind.title} has")
    return kind.fps


def _demand_numbers(source: str, *arrays: FloatArray) -> None:
    frames = len(arrays[0])
    if not frames or frames * len(NAMES) > MAX_JOINT_FRAMES:
        raise InputError(
            f"{source} has {frames} frames; expected 1 to {MAX_JOINT_FRAMES // len(NAMES)}: cut it"
        )
    for array in arrays:
        if not np.isfinite(array).all() or np.abs(array).max() > MAX_VALUE:
            raise InputError(f"{source} holds NaN, infinite or absurd numbers")


def _of_joints(
    source: str, joints: FloatArray, fps: float, about: tuple[_Kind, str, list[str]]
) -> Motion:
    """Make a motion of joints (T, 22 or 24, 3) alone; their bones turn by the shortest way."""
    kind, action, notes = about
    _demand_numbers(source, joints)
    parents, names = PARENTS[: joints.shape[1]], NAMES[: joints.shape[1]]
    up = upward_axis(joints, kind.up)
    if up != kind.up:
        notes.append(f"the person stands along {up}, not along the usual {kind.up}")
    joints = joints @ y_up_rotmat(up).T
    vectors = joints - joints[:, np.maximum(parents, 0)]
    offsets = _unit(OFFSETS[: len(parents)]) * np.median(
        np.linalg.norm(vectors, axis=-1), axis=0
    ).reshape(-1, 1)
    scale, unit = choose_scale(
        source, offsets, parents, canonical_joints(names, parents), None, True
    )
    joints = joints * scale
    skeleton = skeleton_of("custom", parents, names)
    return motion_of_joints(
        joints,
        skeleton,
        fps,
        action=action,
        provenance={
            "source": source, "units": unit, "scale": scale, "up": up, "notes": notes,
            "format": kind.title,
        },
    )  # fmt: skip
