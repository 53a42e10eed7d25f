"""Motion that goes where it is sent: along a path over the ground, and through given poses (`a2v.motion.steer`).

Each window is steered by what lies within it, in its own axes: its first root is the origin, its first frame faces +z.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from a2v.errors import InputError
from a2v.io import brief, read_bytes
from a2v.kinematics import inverse_kinematics
from a2v.kinematics.ground import heading, yaw_to_rotmat
from a2v.motion.edit import Edit, edited, retimed
from a2v.motion.model import MotionModel
from a2v.motion.placement import ground_offset
from a2v.motion.prompts import Step
from a2v.motion.samplers import WindowSampler
from a2v.motion.steer import CodeReader, Steering, Wish, steer
from a2v.motion.timeline import perform
from a2v.types import FloatArray, IntArray, Motion

#: How near, metres, the root shall be to the path and the hips' line to its side, and every how many seconds that is asked for
#: (chosen on walks over three paths: harder wishes are nearer, and feet slide more; docs/research/motion-flow.md).
PATH_SIGMA, SIDE_SIGMA, ASK_SECONDS = 0.15, 0.1, 0.66
#: How near a given pose shall be: directions of bones (unit vectors) and the root, metres.
POSE_SIGMA, ROOT_SIGMA = 0.02, 0.005
#: Clips by which the natural speed of an action is measured.
SPEED_CLIPS = 16
MAX_POINTS = 10_000


#: What a window shall have: of its first frame's number, place (2,), heading, and the frames (K,) that may be asked for.
Wishes = Callable[[int, FloatArray, float, IntArray], list[Wish]]


@dataclass(frozen=True)
class Path:
    """A way over the ground.

    Attributes
    ----------
    points : (N, 2) float
        x and z, metres; at least two, each different from the one before.
    """

    points: FloatArray

    def __post_init__(self) -> None:
        points = np.asarray(self.points, np.float64)
        if points.ndim != 2 or points.shape[1:] != (2,) or not 2 <= len(points) <= MAX_POINTS or not np.isfinite(points).all():
            raise InputError(f"a path has shape {points.shape}; expected 2 to {MAX_POINTS} points of x and z, metres")
        if (np.linalg.norm(np.diff(points, axis=0), axis=1) < 1e-6).any():
            raise InputError("two points of the path that follow each other are the same; leave one out")

    @property
    def lengths(self) -> FloatArray:
        """Way from the first point to each (N,), metres."""
        return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self.points, axis=0), axis=1))])

    def at(self, way: FloatArray) -> FloatArray:
        """Points (..., 2) after a `way` (...), metres; beyond the end straight on."""
        lengths, points = self.lengths, np.asarray(self.points, np.float64)
        inside = np.stack([np.interp(way, lengths, points[:, axis]) for axis in (0, 1)], axis=-1)
        ahead = (points[-1] - points[-2]) / np.linalg.norm(points[-1] - points[-2])
        placed: FloatArray = inside + np.maximum(np.asarray(way) - lengths[-1], 0)[..., None] * ahead
        return placed

    def heading(self, way: FloatArray, *, over: float = 0.4) -> FloatArray:
        """Angle (...) about +y that turns +z to where the path leads, `over` metres before and behind, radians."""
        step = self.at(np.asarray(way) + over) - self.at(np.maximum(np.asarray(way) - over, 0))
        return np.arctan2(step[..., 0], step[..., 1])


def read_path(text: str) -> Path:
    """A path out of points "x,z x,z ...", metres, or out of a ``.csv`` of two columns (a line of names may come first).

    Raises
    ------
    InputError
        Neither, unreadable, or no path.
    """
    rows = text.split()
    if text.lower().endswith(".csv"):
        lines = read_bytes(text, limit=MAX_POINTS * 100).decode("utf-8-sig", errors="replace").splitlines()
        rows = [line.strip() for line in lines if line.strip()]
        rows = rows[1:] if rows and not _numbers(rows[0]) else rows
    points = [_numbers(row) for row in rows]
    if odd := [row for row, point in zip(rows, points, strict=True) if len(point) != 2]:
        raise InputError(
            f"'{brief(odd[0])}' is no point of a path; expected x,z in metres, such as \"0,0 0,3 3,3\", or a .csv file of two columns"
        )
    return Path(np.array(points, np.float64).reshape(-1, 2))


def _numbers(row: str) -> list[float]:
    try:
        return [float(part) for part in row.replace(";", ",").split(",")]
    except ValueError:
        return []


@dataclass(frozen=True, kw_only=True)
class Direction:
    """Where a motion shall go.

    Attributes
    ----------
    path : Path or None
    pace : float or None
        Metres a second along the path; None: as fast as the action goes by itself.
    """

    path: Path
    pace: float | None = None


def make_motion(
    model: MotionModel,
    steps: Sequence[Step],
    *,
    frames: int,
    fps: float,
    seed: int = 0,
    edit: Edit = Edit(),
    direction: Direction | None = None,
) -> Motion:
    """One clip as the commands ask for it: `perform`, or `follow_path` where there is one, then `edited`.

    Parameters
    ----------
    model : MotionModel
    steps : sequence of Step
        One of them along a path.
    frames : int
        Of the result, for steps that name no length; a path has its own.
    fps : float
    seed : int
    edit : Edit
    direction : Direction or None

    Raises
    ------
    InputError
        See these functions; or several steps along a path.
    """
    if direction is None:
        made = perform(model, steps, frames=frames, fps=fps, speed=edit.speed, seed=seed)
    else:
        check_directed(model, steps)
        made = follow_path(model, steps[0].action, direction.path, speed=direction.pace, seed=seed)
        made = retimed(made, fps=fps, speed=edit.speed)
    return edited(made, replace(edit, speed=1.0))


def natural_speed(model: MotionModel, action: str) -> float:
    """Metres a second that the model's own clips of an action travel."""
    sampler = model.sampler
    share = sampler.active_share(model.label(action)) if isinstance(sampler, WindowSampler) else 1.0
    frames = max(4, round(0.8 * share * model.card.frames))  # before clips end and stand
    made = model.sample(action, frames=frames, count=SPEED_CLIPS, seed=0)
    # over half a second, so that sway does not count, and nothing is lost where a clip turns
    apart = max(1, min(round(0.5 * model.fps), frames - 1))
    steps = np.linalg.norm((made.root[:, apart:] - made.root[:, :-apart])[..., [0, 2]], axis=-1)
    return float(np.median(steps) / apart * model.fps)


def follow_path(model: MotionModel, action: str, path: Path, *, speed: float | None = None, seed: int = 0) -> Motion:
    """A person who does `action` along `path`, facing where it leads.

    Parameters
    ----------
    model : MotionModel
        One that can be directed ("cmu-fine").
    action : str
    path : Path
        Its first point becomes the origin's place; the motion ends at its last.
    speed : float or None
        Metres a second; None: as fast as the action goes by itself.
    seed : int

    Raises
    ------
    InputError
        The model cannot be directed, the action does not travel, or the way takes too many frames.
    """
    sampler = _directed(model)
    label = model.label(action)
    pace = natural_speed(model, action) if speed is None else speed
    if pace < 0.05:
        raise InputError(f"'{action}' goes {pace:.2f} m a second; a path needs an action that travels, or a speed")
    frames = int(path.lengths[-1] / pace * model.fps) + 1
    reader = sampler.reader(model.bone_lengths)
    width = float(reader.lengths[list(model.skeleton.hips or ())].sum()) or 0.2

    def wishes(first: int, place: FloatArray, yaw: float, asked: IntArray) -> list[Wish]:
        way = (first + asked) / model.fps * pace
        turn = yaw_to_rotmat(np.array(-yaw))
        points, ahead = path.at(way), path.heading(way)
        target = np.stack([points[:, 0] - place[0], np.zeros(len(way)), points[:, 1] - place[1]], axis=-1) @ turn.T
        side = np.stack([np.cos(ahead), np.zeros(len(way)), -np.sin(ahead)], axis=-1) @ turn.T * width
        rows, offset = reader.root(asked)
        hips = _between_hips(reader, asked)
        flat = [0, 2]
        return [
            Wish.of(rows[:, flat], offset[:, flat], target[:, flat], PATH_SIGMA),
            Wish.of(hips[0][:, flat], hips[1][:, flat], side[:, flat], SIDE_SIGMA),
        ]

    start = path.at(np.array(0.0))
    joints = _windows(model, sampler, label, frames, seed, wishes, start=start, yaw=float(path.heading(np.array(0.0))))
    return _as_motion(model, joints, action, seed, path=np.asarray(path.points).round(4).tolist(), speed=pace)


def reach_poses(model: MotionModel, action: str, poses: Mapping[int, FloatArray], *, frames: int, seed: int = 0) -> Motion:
    """A person who does `action` and has given poses at given frames, within one window.

    Parameters
    ----------
    model : MotionModel
        One that can be directed ("cmu-fine").
    action : str
    poses : mapping of int to (J, 3) float
        Joints, metres, y up, of the model's skeleton, at frames 0 to `frames` - 1; roots are where the person shall be. The first
        pose's heading is where the window starts from.
    frames : int
    seed : int

    Raises
    ------
    InputError
        The model cannot be directed, or a frame or a pose is out of range.
    """
    sampler = _directed(model)
    window, joints_count = sampler.card.window_frames, model.skeleton.n_joints
    if not 2 <= frames <= window:
        raise InputError(f"frames is {frames}; poses are reached within one window, 2 to {window} frames")
    if not poses or min(poses) < 0 or max(poses) >= frames:
        raise InputError(f"poses are given at frames {sorted(poses)}; expected at least one from 0 to {frames - 1}")
    if odd := [frame for frame, pose in poses.items() if np.shape(pose) != (joints_count, 3) or not np.isfinite(pose).all()]:
        raise InputError(f"the pose at frame {odd[0]} has shape {np.shape(poses[odd[0]])}; expected ({joints_count}, 3) finite numbers")
    reader = sampler.reader(model.bone_lengths)
    at = np.array(sorted(poses))
    given = np.stack([np.asarray(poses[int(frame)], np.float64) for frame in at])
    yaw = float(heading(given[0], model.skeleton))
    start = given[0, 0] if at[0] == 0 else np.zeros(3)
    local = (given - start) @ yaw_to_rotmat(np.array(-yaw)).T
    vectors = local[:, 1:] - local[:, model.skeleton.parents[1:]]
    unit = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)

    def wishes(first: int, place: FloatArray, turned: float, asked: IntArray) -> list[Wish]:
        rows, offset = reader.root(at)
        bones, plain = reader.directions(at)
        return [Wish.of(rows, offset, local[:, 0], ROOT_SIGMA), Wish.of(bones, plain, unit, POSE_SIGMA)]

    joints = _windows(model, sampler, model.label(action), frames, seed, wishes, start=start[[0, 2]], yaw=yaw)
    joints[:, :, 1] += start[1] - joints[0, 0, 1] if at[0] == 0 else 0
    return _as_motion(model, joints, action, seed, place=False, poses=at.tolist())


def check_directed(model: MotionModel, steps: Sequence[Step]) -> None:
    """Refuse a path for what cannot go along one, before anything long runs.

    Raises
    ------
    InputError
        The model cannot be directed, or there are several steps.
    """
    _directed(model)
    if len(steps) != 1:
        raise InputError("a path is walked by one action; give one --action")


def _directed(model: MotionModel) -> WindowSampler:
    sampler = model.sampler
    if not isinstance(sampler, WindowSampler) or not sampler.card.steerable:
        raise InputError(f"{model.path.name} cannot be directed; choose a model that can, such as cmu-fine")
    return sampler


def _windows(
    model: MotionModel, sampler: WindowSampler, label: int, frames: int, seed: int, wishes: Wishes, *, start: FloatArray, yaw: float
) -> FloatArray:
    """Joints (T, J, 3), metres, of windows that go on from one another, each steered by `wishes` of what lies within it."""
    card, generator = sampler.card, np.random.default_rng(seed)
    given, lengths = card.context_frames, model.bone_lengths[None]
    every = max(1, round(ASK_SECONDS * card.fps))
    share = np.array([sampler.active_share(label)])
    joints = np.zeros((0, model.skeleton.n_joints, 3))
    while len(joints) < frames:
        context = None if not len(joints) else joints[None, -given:]
        first = max(len(joints) - given, 0)
        place = start if context is None else context[0, 0, 0, [0, 2]]
        turned = yaw if context is None else float(heading(context[0, 0], model.skeleton))
        asked = np.arange(0 if context is None else given + every, card.window_frames, every)
        steering: Steering = steer(wishes(first, place, turned, asked))
        noise = generator.standard_normal((1, card.latent_size), dtype=np.float32)
        made, _ = sampler.run(np.array([label]), active=share, noise=noise, lengths=lengths, context=context, steering=steering)
        new = made[0].astype(np.float64)
        if context is None:
            new = new @ yaw_to_rotmat(np.array(yaw)).T + [place[0], 0, place[1]]
            joints = new[: max(given + 4, round(float(share[0]) * card.window_frames))]
        else:
            usable = max(round(float(share[0]) * card.window_frames), given + 4)
            joints = np.concatenate([joints, (new + context[0, 0, 0])[given:usable]])
    return joints[:frames]


def _between_hips(reader: CodeReader, frames: IntArray) -> tuple[FloatArray, FloatArray]:
    """From the right hip to the left: rows (F, 3, D) and offsets (F, 3), metres."""
    if reader.skeleton.hips is None:
        raise InputError(f"skeleton '{reader.skeleton.name}' does not say which joints are hips")
    rows, offset = reader.joints(frames, reader.skeleton.hips)
    return rows[:, 0] - rows[:, 1], offset[:, 0] - offset[:, 1]


def _as_motion(model: MotionModel, joints: FloatArray, action: str, seed: int, *, place: bool = True, **facts: object) -> Motion:
    if place:
        joints = joints - ground_offset(joints[None])[0] * (0, 1, 0)
    made = joints[None].astype(np.float32)
    rotations = inverse_kinematics(made, model.skeleton).astype(np.float32)
    name = model.actions[model.label(action)]
    return model.to_motion(made, rotations, lengths=model.bone_lengths, names=[name], seed=seed, place=False, **facts)[0]
