"""Act one step with its wishes, on the library's skeleton: layers, sides, ways, angles, counts."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from a2v.errors import InputError
from a2v.kinematics.foot_contacts import PlantSettings
from a2v.kinematics.from_joints import with_joints
from a2v.kinematics.ground import GroundTrajectory, ground_trajectory
from a2v.motion.clips import RELAXED, clip_library
from a2v.motion.clips import SOURCE as CLIPS
from a2v.motion.direct import MIN_PACE, make_motion, natural_speed
from a2v.motion.direction import Direction, Keyframe
from a2v.motion.edit import Edit, edited, mirror_motion, put_in_place
from a2v.motion.keeping import ONE_SHOTS
from a2v.motion.layers import layered, used_parts
from a2v.motion.model import MotionModel
from a2v.motion.on_clips import on_clips_motion
from a2v.motion.prompts import Step
from a2v.motion.staging import Play, clip_seconds, staged, with_feet_planted
from a2v.motion.timeline import Take
from a2v.motion.ways import GroundPath, Way, way_along
from a2v.motion.wishes import Wishes
from a2v.types import FloatArray, Motion

MODEL_SECONDS = 3.0
"""Seconds of a model's action in a mix if no length is given."""
LAYERED_SECONDS = 5.0
"""The same with something else for the upper body."""
ONE_SHOT_SECONDS = 1.8
"""Seconds of a model's action that is done once, in a count."""
TURN_SPEED = 75.0
"""Speed of a turn by an angle, degrees per second."""
LEAST_TURN_SECONDS = 1.2
TURNED = np.radians(30.0)
"""Angle from which an action turns to a side."""
ASIDE = 0.3
"""Way in meters from which an action goes to a side."""
USES = 0.05
"""Difference in meters of the ways of two hands, or feet, from which an action uses one of them."""


def natural_seconds(step: Step) -> float:
    """Seconds of a step without a given length."""
    own = step.wishes
    if own.distance is not None and step.source:
        return own.distance / (own.pace or _speed(step) * step.speed)
    if own.angle is not None:
        return max(LEAST_TURN_SECONDS, own.angle / TURN_SPEED)
    if step.source == CLIPS:
        return clip_seconds(step.action, count=own.count) / step.speed
    if own.count is not None:
        return own.count * ONE_SHOT_SECONDS / step.speed
    return LAYERED_SECONDS if own.layered else MODEL_SECONDS


def _speed(step: Step) -> float:
    """Natural speed of a step's action over the ground, meters per second."""
    if step.source == CLIPS:
        library = clip_library()
        clip = library.clips[library.index(step.action)]
        return float(np.hypot(clip.pace, clip.aside))
    return natural_speed(MotionModel.load(step.source), step.action)


def act(step: Step, play: Play) -> Motion:
    """Make the motion of one step, with its wishes.

    Parameters
    ----------
    step : Step
        With a source.
    play : Play
        Its `speed` multiplies that of the step.

    Returns
    -------
    Motion
        On the library's skeleton.

    Raises
    ------
    InputError
        See `make_motion` and `play_clip`.
    """
    own = step.wishes
    play = dataclasses.replace(
        play,
        speed=play.speed * step.speed,
        seed=play.seed if step.seed is None else step.seed,
        count=own.count,
    )
    made = _clip(step, play) if step.source == CLIPS else _modeled(step, play)
    side = own.side
    if side and not own.over and side != _side_of(made):
        made = mirror_motion(made)
    if own.mirror:
        made = mirror_motion(made)
    if own.layered:
        made = _layers(made, own, play)
    return put_in_place(made) if own.in_place else made


def _clip(step: Step, play: Play) -> Motion:
    """Play a clip; a cycle at a wished pace is played faster or slower."""
    own = step.wishes
    if own.pace is not None:
        play = dataclasses.replace(play, speed=own.pace / _speed(step))
    return staged(step.action, play)


def _modeled(step: Step, play: Play) -> Motion:
    """Make the action of a model: along a straight way, turned by an angle, or repeated."""
    own, model = step.wishes, MotionModel.load(step.source)
    plain = dataclasses.replace(
        step, source="", wishes=Wishes(), seconds=None, frames=play.frames, speed=1.0
    )
    take = Take(frames=play.frames, fps=play.fps, seed=play.seed)
    edit, direction, turn = Edit(speed=play.speed), None, 0.0
    if own.distance is not None or own.pace is not None:
        pace = own.pace or _speed(step) * play.speed
        length = own.distance or pace * play.frames / play.fps
        path = GroundPath(np.array([[0.0, 0.0], [0.0, max(length, 0.1)]]))
        direction, edit = Direction(path=path, pace=pace), Edit()
    elif own.angle is not None:
        seconds = (play.frames - 1) / play.fps
        turn = float(np.radians(own.angle)) * (-1 if own.side == "right" else 1)
        keys = tuple(
            Keyframe(time=seconds * share, at=(0.0, 0.0), heading=turn * eased)
            for share, eased in ((0.0, 0.0), (0.5, 0.5), (1.0, 1.0))
        )
        direction, edit = Direction(keyframes=keys), Edit()
    steps = [plain]
    if own.count is not None and step.action in ONE_SHOTS:
        each = np.diff(np.round(np.linspace(0, play.frames, own.count + 1)).astype(int))
        steps = [
            dataclasses.replace(plain, frames=max(1, int(count)), seed=play.seed + number)
            for number, count in enumerate(each)
        ]
    made = make_motion(model, steps, take, edit=edit, direction=direction)
    made = on_clips_motion(_lasting(made, play.frames))
    return made if own.angle is None else _turned(made, turn)


def _turned(motion: Motion, angle: float) -> Motion:
    """Bend the turn of a motion in place so that it is exactly `angle`, radians."""
    path = ground_trajectory(motion).smooth(motion.fps)
    off = angle - (path.heading[-1] - path.heading[0])
    share = np.linspace(0.0, 1.0, motion.frames)
    local = np.linalg.inv(path.transforms())
    world = GroundTrajectory(path.position, path.heading + share * off).transforms() @ local
    return _moved(motion, world)


def _lasting(motion: Motion, frames: int) -> Motion:
    """Return the first `frames` of a clip; the last pose of a shorter one is held."""
    at = np.minimum(np.arange(frames), motion.frames - 1)
    return dataclasses.replace(
        motion,
        joints=motion.joints[at],
        rotations=motion.rotations[at],
        root=motion.root[at],
        action_starts=None,
    )


def _layers(base: Motion, own: Wishes, play: Play) -> Motion:
    """Lay the wished action of the upper body, or still limbs, over a motion."""
    library = clip_library()
    joints = base.joints.astype(np.float64)
    if own.still:
        idle = library.joints[library.index(RELAXED)]
        parts = [part for limb in own.still for part in _LIMB_PARTS[limb]]
        joints = layered(joints, np.repeat(idle[:1], len(joints), axis=0), parts, base.fps)
    if own.over:
        over = _upper(own, dataclasses.replace(play, frames=len(joints), count=None, speed=1.0))
        parts = used_parts(over.joints.astype(np.float64), library.skeleton)
        joints = layered(joints, over.joints.astype(np.float64), parts, base.fps)
    return dataclasses.replace(base, joints=joints.astype(np.float32))


_LIMB_PARTS = {"arms": ("left", "right"), "head": ("head",)}


def _upper(own: Wishes, play: Play) -> Motion:
    """Make the action of the upper body for all frames: one-shots that come to rest are held there,
    others are repeated."""
    if own.over_source != CLIPS:
        made = _modeled(Step(action=own.over, source=own.over_source), play)
    else:
        library = clip_library()
        index = library.index(own.over)
        clip, keyed = library.clips[index], library.joints[index]
        at = np.arange(play.frames) / play.fps * clip.fps
        if clip.plays == "once":
            at = _held(keyed, clip.fps, at)
        count = len(keyed)
        low, share = np.floor(at).astype(int), (at % 1)[:, None, None]
        joints = keyed[low % count] + share * (keyed[(low + 1) % count] - keyed[low % count])
        made = dataclasses.replace(
            staged(own.over, dataclasses.replace(play, frames=4)),
            joints=joints.astype(np.float32),
            rotations=np.zeros_like(joints, np.float32),
            root=joints[:, 0].astype(np.float32),
        )
    return mirror_motion(made) if own.side and own.side != _side_of(made) else made


HOLD_SHARE = 0.85
"""Share of the largest distance from the first pose from which a pose is held."""
HOLD_SPEED = 0.25
"""Speed of joints below which a pose is held, meters per second."""
HOLD_SECONDS = 0.4
"""Shortest rest that is held."""


def _held(keyed: FloatArray, fps: float, at: FloatArray) -> FloatArray:
    """Change the frames `at` of a one-shot (K, J, 3) that are longer than it: its rest is held if
    it has one, otherwise it is repeated."""
    away = np.linalg.norm(keyed - keyed[:1], axis=-1).max(axis=1)
    speed = np.linalg.norm(np.gradient(keyed, axis=0), axis=-1).max(axis=1) * fps
    rests = np.flatnonzero((away > HOLD_SHARE * away.max()) & (speed < HOLD_SPEED))
    if at[-1] < len(keyed) or len(rests) < HOLD_SECONDS * fps:
        return at
    return np.minimum(at, rests[len(rests) // 2])


def _side_of(motion: Motion) -> str:
    """Return the side to which a motion turns or goes, or of the hand or foot that it uses; "" if
    both are used alike."""
    path = ground_trajectory(motion)
    turned = path.heading[-1] - path.heading[0]
    if abs(turned) > TURNED:
        return "left" if turned > 0 else "right"
    way = path.position[-1] - path.position[0]
    left = np.array([np.cos(path.heading[0]), -np.sin(path.heading[0])])
    ahead = np.array([np.sin(path.heading[0]), np.cos(path.heading[0])])
    if abs(way @ left) > max(ASIDE, abs(way @ ahead)):
        return "left" if way @ left > 0 else "right"
    names = motion.joint_names
    more = []
    for end, top in (("hand", "upperarm"), ("foot", "thigh")):
        ways = []
        for side in ("l", "r"):
            off = (
                motion.joints[:, names.index(f"{end}_{side}")]
                - motion.joints[:, names.index(f"{top}_{side}")]
            )
            ways.append(float(np.linalg.norm(off - np.median(off, axis=0), axis=-1).max()))
        more.append(ways[0] - ways[1])
    most = max(more, key=abs)
    if abs(most) < USES:
        return ""
    return "left" if most > 0 else "right"


def make_directed(
    steps: Sequence[Step], *, frames: int, fps: float, direction: Direction, seed: int, edit: Edit
) -> Motion:
    """Play a travelling clip along a path, or any clip with a heading.

    Raises
    ------
    InputError
        There are several steps, the clip does not travel, or the direction has keyframes or holds.
    """
    if len(steps) != 1 or steps[0].source != CLIPS or direction.keyframes or direction.holds:
        raise InputError(
            f"{', '.join(step.action for step in steps)}: a clip takes a path, a pace and a "
            "heading; leave poses and holds out, and give one action"
        )
    step, path = steps[0], direction.path
    natural = _speed(step) * step.speed * edit.speed
    if path is None:
        made = act(step, Play(frames=frames, fps=fps, speed=edit.speed, seed=seed))
        return edited(_placed(made, None, direction.heading), dataclasses.replace(edit, speed=1.0))
    if natural < MIN_PACE:
        raise InputError(
            f"'{step.action}' travels at {natural:.2f} m/s; a path needs an action that travels"
        )
    way = way_along(path, pace=direction.pace or natural, fps=fps)
    tempo = (direction.pace or natural) / natural * edit.speed
    made = act(step, Play(frames=len(way.points), fps=fps, speed=tempo, seed=seed))
    made = _placed(made, way, direction.heading)
    planted = with_feet_planted(
        made.joints.astype(np.float64), fps, PlantSettings(carry=0.0, share=0.5)
    ).astype(np.float32)
    made = dataclasses.replace(
        made,
        joints=planted,
        root=planted[:, 0],
        provenance={
            **made.provenance,
            "path": np.asarray(path.points).round(4).tolist(),
            "pace": direction.pace or natural,
        },
    )
    return edited(made, dataclasses.replace(edit, speed=1.0))


def _placed(motion: Motion, way: Way | None, facing: float | None) -> Motion:
    """Move a clip that goes straight onto a way, heading along it or at `facing`, radians."""
    own = ground_trajectory(motion).smooth(motion.fps)
    local = np.linalg.inv(own.transforms())
    heading = own.heading if way is None else way.heading
    heading = heading if facing is None else np.full(len(heading), facing)
    points = own.position if way is None else way.points
    world = GroundTrajectory(points, heading).transforms() @ local
    return _moved(motion, world)


def _moved(motion: Motion, world: FloatArray) -> Motion:
    """Move every frame of a motion by a transform (T, 4, 4)."""
    joints = motion.joints.astype(np.float64) @ world[:, :3, :3].transpose(0, 2, 1)
    joints = joints + world[:, None, :3, 3]
    return with_joints(motion, joints, clip_library().skeleton)
