"""Read the motions that models of the SMPL family and text-to-motion models write: rotations or
joints in arrays.

Known are AMASS, SMPL, SMPL-H and SMPL-X parameters (npz, pickles, joblib), GVHMR, WHAM, AIST++,
HY-Motion, Motion-X, MDM's ``results.npy``, and HumanML3D's joints and 263 features. Joints of
rotations come from our own forward kinematics on the published average skeleton; no file of SMPL is
needed. Body shapes, fingers and faces are not read.
"""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import InputError
from a2v.formats.arrays_pickle import read_arrays_pickle
from a2v.formats.conventions import Bone, choose_scale, y_up_rotmat
from a2v.formats.recording import Recording, motion_of
from a2v.io import MAX_ARCHIVE_BYTES, open_file, read_bytes, reading, shorten
from a2v.kinematics import HUMANACT12, inverse_kinematics, rotvec_to_rotmat, skeleton_of
from a2v.kinematics.names import canonical_joints
from a2v.kinematics.resample import MAX_JOINT_FRAMES
from a2v.types import FloatArray, Motion

MAX_BYTES = 512 << 20
MAX_VALUE = 1e5

NAMES = HUMANACT12.joint_names
"""The 24 joints of SMPL; SMPL-H and SMPL-X have fingers in place of the last two."""
PARENTS = HUMANACT12.parents.tolist()
PELVIS = np.array([-0.0018, -0.2233, 0.0282])
"""Pelvis of the average body, whose origin is what ``trans`` moves, meters."""
OFFSETS = np.array(
    [
        (0, 0, 0), (0.0695, -0.0914, -0.0068), (-0.0677, -0.0905, -0.0043),
        (-0.0025, 0.1090, -0.0267),
        (0.0343, -0.3752, -0.0045), (-0.0383, -0.3826, -0.0089), (0.0055, 0.1352, 0.0011),
        (-0.0136, -0.3980, -0.0437), (0.0158, -0.3984, -0.0423), (0.0015, 0.0529, 0.0254),
        (0.0264, -0.0558, 0.1193), (-0.0254, -0.0481, 0.1233), (-0.0028, 0.2139, -0.0429),
        (0.0788, 0.1217, -0.0341), (-0.0818, 0.1188, -0.0386), (0.0052, 0.0650, 0.0513),
        (0.0910, 0.0305, -0.0089), (-0.0960, 0.0326, -0.0091), (0.2596, -0.0128, -0.0275),
        (-0.2537, -0.0133, -0.0214), (0.2492, 0.0090, -0.0012), (-0.2553, 0.0078, -0.0056),
        (0.0840, -0.0082, -0.0149), (-0.0846, -0.0061, -0.0103),
    ]
)  # fmt: skip
"""Joints (24, 3) of the average SMPL body in its rest pose from their parents, meters, y up,
facing +z: as published in MuJoCo's models of SMPL."""

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


def read_smpl_motion(path: str | os.PathLike[str], *, action: str = "") -> Motion:
    """Read a motion of the kinds that this module names.

    Parameters
    ----------
    path : path
        ``.npz``, ``.npy``, ``.pkl`` (also joblib's) or ``.pt``; the content decides.
    action : str
        Stored in the motion.

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
        return _read(str(source), load_arrays(source), action)


def load_arrays(source: Path) -> Any:
    """Return the array or the dict of arrays of a file; nothing that it names is imported or
    called.

    Raises
    ------
    InputError
        It is broken, too large, or not such a file.
    """
    with open_file(source) as stream:
        head = stream.read(7)
    if head.startswith(b"PK"):
        with open_file(source) as stream, zipfile.ZipFile(stream) as archive:
            infos = archive.infolist()
            if sum(info.file_size for info in infos) > MAX_ARCHIVE_BYTES:
                raise InputError(
                    f"{source} unpacks to more than {MAX_ARCHIVE_BYTES >> 30} GiB; refusing to "
                    "read it"
                )
            if any(info.filename.endswith("/data.pkl") for info in infos):
                return _tensors(source)
        with open_file(source) as stream, np.load(stream, allow_pickle=False) as content:
            return {name: content[name] for name in content.files if name in _KEPT}
    data = read_bytes(source, limit=MAX_BYTES)
    if not head.startswith(b"\x93NUMPY"):
        return read_arrays_pickle(data, str(source))
    wide = head[6] > 1  # the format's version 2 counts its header by four bytes
    start = (12 if wide else 10) + int.from_bytes(data[8 : 12 if wide else 10], "little")
    if b"'|O'" in data[:start]:
        return read_arrays_pickle(data[start:], str(source))
    return np.load(io.BytesIO(data), allow_pickle=False)


def _tensors(source: Path) -> Any:
    """Return the arrays of a file of torch, whose unpacked size is known to be bounded."""
    import torch

    with open_file(source) as stream:
        content = torch.load(stream, map_location="cpu", weights_only=True)
    left = [MAX_ARCHIVE_BYTES // 8]

    def plain(value: Any, depth: int = 0) -> Any:
        if isinstance(value, torch.Tensor):
            left[0] -= value.numel()
            if left[0] < 0:
                raise InputError(f"{source} has more numbers than are read")
            return value.detach().numpy() if value.layout == torch.strided else None
        if isinstance(value, Mapping) and depth < 4:
            return {key: plain(inner, depth + 1) for key, inner in value.items()}
        return value

    return plain(content)


def _read(source: str, content: Any, action: str) -> Motion:
    notes: list[str] = []
    kind = _AMASS
    if isinstance(content, Mapping):
        content, kind, said = _part(content)
        notes += said
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
    found = _joints_in(arrays, content, notes)
    if found is not None:
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
    rest = rest.astype(np.float64) if rest is not None and rest.shape == (24, 3) else None
    recording = _posed(turns, path, rest)
    up = upward_axis(recording.world, kind.up)
    if up != kind.up:
        notes.append(f"the person stands along {up}, not along the usual {kind.up}")
    fps = _fps(arrays, kind, notes)
    recording = replace(recording, source=source, fps=fps, up=up, notes=tuple(notes))
    return motion_of(recording, units="meters", action=action, facts={"format": kind.title})


def _part(content: Mapping[Any, Any]) -> tuple[Mapping[Any, Any], _Kind, list[str]]:
    """Return the dict that holds the motion: of GVHMR's the one in the world, of several people's
    the one with most frames."""
    if isinstance(inner := content.get("smpl_params_global"), Mapping):
        return inner, _Kind("GVHMR", 30.0), []
    people = {key: value for key, value in content.items() if isinstance(value, Mapping)}
    if not people or set(map(str, content)) & {*_WHOLE, *_BODIES, *_JOINTS}:
        return content, _AMASS, []

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
    said = (
        [f"of {len(people)} people '{shorten(str(best), 40)}', with most frames, is read"]
        if len(people) > 1
        else []
    )
    return people[best], _AMASS, said


def _joints_in(
    arrays: Mapping[str, np.ndarray], content: Mapping[Any, Any], notes: list[str]
) -> tuple[FloatArray, _Kind] | None:
    """Return joints (T, 22 or 24, 3) if the arrays have such, and their kind."""
    for name in _JOINTS:
        array = arrays.get(name)
        if array is None or array.dtype.kind not in "fiu":
            continue
        if array.ndim == 4 and array.shape[1] in _JOINT_SETS and array.shape[2] == 3:  # MDM
            length = _first_number(content.get("lengths"))
            if len(array) > 1:
                notes.append(f"of {len(array)} motions the first is read")
            joints = np.moveaxis(array[0], -1, 0)
            return joints[: length or None].astype(np.float64), _Kind("MDM", 20.0)
        if array.ndim == 4 and len(array) and array.shape[2] in _JOINT_SETS:  # a batch
            if len(array) > 1:
                notes.append(f"of {len(array)} motions the first is read")
            array = array[0]
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


def _first_number(values: object) -> int:
    """Return the first of an array or a list of numbers; 0 if there is none."""
    first = values[0] if isinstance(values, list | np.ndarray) and len(values) else 0
    return int(first) if isinstance(first, int | np.integer) and first > 0 else 0


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


def _posed(turns: FloatArray, path: FloatArray, rest: FloatArray | None = None) -> Recording:
    """Return the joints of the average body, or of one with `rest` (24, 3), under rotations (T, K,
    3, 3) and translations (T, 3)."""
    offsets, pelvis = OFFSETS, PELVIS
    if rest is not None:
        offsets = rest - rest[np.maximum(PARENTS, 0)]
        pelvis = rest[0]
    frames, count = len(turns), len(NAMES)
    world, turned = np.zeros((frames, count, 3)), np.zeros((frames, count, 3, 3))
    for joint, parent in enumerate(PARENTS):
        own = (
            turns[:, joint]
            if joint < turns.shape[1]
            else np.broadcast_to(np.eye(3), (frames, 3, 3))
        )
        if parent < 0:
            world[:, joint], turned[:, joint] = path + pelvis, own
        else:
            world[:, joint] = world[:, parent] + turned[:, parent] @ offsets[joint]
            turned[:, joint] = turned[:, parent] @ own
    local = np.broadcast_to(offsets, world.shape).copy()
    local[:, 0] = world[:, 0]
    bones = [Bone(name, parent) for name, parent in zip(NAMES, PARENTS, strict=True)]
    return Recording(
        source="", bones=bones, local=local, world=world, rotmats=turned, fps=1.0, known=False
    )


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
    return Motion(
        joints=joints.astype(np.float32),
        rotations=inverse_kinematics(joints, skeleton).astype(np.float32),
        root=joints[:, 0].astype(np.float32),
        fps=fps,
        parents=np.asarray(parents),
        joint_names=names,
        action=action,
        provenance={
            "source": source, "units": unit, "scale": scale, "up": up, "notes": notes,
            "format": kind.title,
        },
    )  # fmt: skip


def upward_axis(joints: FloatArray, usual: str) -> str:
    """Return the upward axis, "x" to "-z", of joints (T, 22 or more, 3) in SMPL's order.

    It is the `usual` one unless the person stands along another axis, from the ankles to the head,
    and the lowest joint along that axis keeps one height better: gravity. So a handstand stays one.
    """
    along = np.mean(joints[:, 15] - 0.5 * (joints[:, 7] + joints[:, 8]), axis=0)
    size = float(np.median(np.linalg.norm(joints[:, 15] - joints[:, 7], axis=-1))) or 1.0
    axis = int(np.abs(along).argmax())
    best = ("" if along[axis] > 0 else "-") + "xyz"[axis]
    if best == usual or abs(along[axis]) < 0.6 * size:
        return usual

    def unsteady(name: str) -> float:
        heights = (joints @ y_up_rotmat(name).T)[..., 1]
        return float(np.std(heights.min(axis=1)))

    return best if unsteady(best) < 0.7 * unsteady(usual) - 1e-3 * size else usual
