"""Add gaze, breath, sway and hands to a body: a motion's joints do not contain them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from a2v.animation.detail import FRONT, follow_face, follow_hands
from a2v.animation.hands import HAND_POSES, hands_of, pose_hands, turn_bones, turn_palms
from a2v.animation.looking import look_at, read_look
from a2v.animation.rig import SIDES, Rig
from a2v.errors import InputError
from a2v.geometry.steps import smoothstep
from a2v.geometry.vectors import unit
from a2v.kinematics import rotvec_to_rotmat
from a2v.kinematics.ground import smoothed
from a2v.kinematics.skeleton import subtree
from a2v.types import FloatArray, Motion

AHEAD_SECONDS = 0.3
"""Eyes and head turn before the body does."""
_SWAY_STREAM = 7
"""Second number of the seed of the sway, so that blinks with the same seed draw other numbers."""
_HANDS_SECONDS = 0.6
"""Seconds over which hands change from one action's pose to the next, mostly before the next action
begins."""
_BREATH_SECONDS = 4.0
_SWAY = ((7.3, 1.0), (4.1, 0.6), (2.7, 0.3))
"""Periods in seconds and relative sizes of the waves of a person's sway."""
_SHORTEST_CYCLE = 2.0
"""A loop shorter than this, seconds, neither breathes nor sways, since both would be too fast."""


@dataclass(frozen=True, kw_only=True)
class LifeSettings:
    """Hands, gaze, breath and sway that are added to a motion on a body.

    Attributes
    ----------
    hands : str
        Pose of both hands: "rest", "relaxed", "flat", "grip", "hold", "fist", "point",
        "graceful" or "spread"; "auto" chooses one that suits the action (``hands.csv``).
    palms : bool
        Turn the forearms so that the palms of hanging arms face the thighs.
    gaze : float
        How far the head turns towards the direction of travel; 0 keeps it aligned with the
        shoulders.
    look : str
        Where the head looks: "camera", "ahead", "left", "right", "up", "down", "back", or a point
        "x,y,z" in meters; empty for where the motion looks.
    breath : float
        Size of the breath; 1 is natural, 0 disables it.
    sway : float
        Size of the sway of a standing person; 1 is natural, 0 disables it.
    cycle : float
        Seconds after which the clip repeats; 0 if it does not repeat.
    seed : int
        Seed of the sway.
    """

    hands: str = "auto"
    palms: bool = True
    gaze: float = 1.0
    look: str = ""
    breath: float = 1.0
    sway: float = 1.0
    cycle: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.hands not in ("auto", *HAND_POSES):
            raise InputError(f"hands is '{self.hands}'; choose from auto, {', '.join(HAND_POSES)}")
        if not all(0 <= value <= 3 for value in (self.gaze, self.breath, self.sway)):
            raise InputError("gaze, breath and sway must be from 0 (none) to 3; 1 is natural")
        if self.look:
            read_look(self.look)
        if self.cycle < 0 or self.seed < 0:
            raise InputError("cycle and seed of the life settings cannot be negative")


HEADS = frozenset(
    [
        "Sad walk", "Drunk walk", "Angry walk", "Clumsy walk", "Lavish walk",
        "Walk with wild arms", "Crawl walk", "Sweep the floor", "Mop the floor", "Wash windows",
        "Reach up", "Pick up and carry", "Climb a ladder", "Climb steps", "Cat", "Dog",
        "Elephant", "Chicken", "Panda", "Roadrunner", "Dragon", "Genie", "Fish", "Whale",
        "Hummingbird",
    ]
)  # fmt: skip
"""Actions whose heads act, so that their bows are not levelled: in CMU's recordings the neck is
inclined by 20 degrees more than the same person's usual one, or moves by 30 within five seconds."""

STILL = LifeSettings(hands="rest", palms=False, gaze=0.0, breath=0.0, sway=0.0)
"""Settings that add nothing to the motion's joints."""


def enliven(
    transforms: FloatArray,
    rig: Rig,
    names: tuple[str, ...],
    motion: Motion,
    settings: LifeSettings,
    source: Mapping[str, FloatArray],
) -> FloatArray:
    """Add hands, palms, gaze and breath to the bones of a rig; feet, hips and elbows do not move.

    If the motion has joints of the fingers and the face (`a2v.animation.detail`), they are used.

    Parameters
    ----------
    transforms : (T, B, 4, 4) float64
        World from bone.
    rig : Rig
    names : B str
    motion : Motion
        Gives the frame rate, the actions and their beginnings.
    settings : LifeSettings
    source : mapping of joint to (T, 3)
        The motion's joints as the rig follows them, with those of `detail_joints`.

    Returns
    -------
    (T, B, 4, 4) float64
    """
    fps = motion.fps
    told = share_of(motion, "told", len(transforms), otherwise=True)
    if settings.palms:
        transforms = turn_palms(transforms, rig, names, fps)
    if settings.hands == "auto":
        transforms = pose_hands(transforms, rig, names, *_hands_in_turn(motion, len(transforms)))
        own = 1 - _wished(motion, "hands", len(transforms))
        transforms = follow_hands(transforms, rig, names, source, told * own)
    else:
        transforms = pose_hands(transforms, rig, names, [(settings.hands, settings.hands)])
    if settings.breath:
        transforms = _breathe(transforms, rig, fps, settings)
    if settings.gaze:
        free = 1 - told if FRONT in source else np.ones(len(transforms))
        level = free * (1 - _heads_that_act(motion, len(transforms)))
        transforms = _look_ahead(transforms, rig, fps, settings, (free, level))
        transforms = follow_face(transforms, rig, source, told)
    return _looking(transforms, rig, motion, settings)


def _looking(
    transforms: FloatArray, rig: Rig, motion: Motion, settings: LifeSettings
) -> FloatArray:
    """Turn the head to where the settings, or the actions of the motion, look."""
    looks = [settings.look] if settings.look else motion.provenance.get("look", [])
    if not any(looks):
        return transforms
    several = len(looks) > 1 and motion.action_starts is not None
    shares = _shares(motion, len(transforms)) if several else np.ones((len(transforms), 1))
    return look_at(transforms, rig, motion.fps, looks[: shares.shape[1]], shares)


def _wished(motion: Motion, fact: str, frames: int) -> FloatArray:
    """Return the share (T,) of each frame that belongs to actions with a text in
    ``motion.provenance[fact]``."""
    truths = np.array([bool(text) for text in motion.provenance.get(fact, [""])], np.float64)
    if len(set(truths)) == 1 or motion.action_starts is None:
        return np.full(frames, truths.max())
    return _shares(motion, frames) @ truths


def share_of(motion: Motion, fact: str, frames: int, *, otherwise: bool = False) -> FloatArray:
    """Return the share (T,) of each frame that belongs to actions with a certain property.
    ``motion.provenance[fact]`` has one truth value per action; `otherwise` is used if it is absent.

    ``told``: the joints of fingers and face are meaningful; ``air``: the action is above the
    ground.
    """
    return _share(motion, motion.provenance.get(fact, [otherwise]), frames)


def _heads_that_act(motion: Motion, frames: int) -> FloatArray:
    """Return the share (T,) of each frame that belongs to actions of `HEADS`."""
    return _share(motion, [name in HEADS for name in motion.action.split(",")], frames)


def _share(motion: Motion, owned: Sequence[bool], frames: int) -> FloatArray:
    """Return the share (T,) of each frame that belongs to the `owned` (A,) of a motion's actions; 0
    if their beginnings are unknown and not all are alike."""
    truths = np.array(owned, np.float64)
    if len(set(truths)) == 1:
        return np.full(frames, truths[0])
    if motion.action_starts is None or len(truths) != len(motion.action_starts):
        return np.zeros(frames)
    return _shares(motion, frames) @ truths


def _hands_in_turn(motion: Motion, frames: int) -> tuple[list[tuple[str, str]], FloatArray]:
    """Hand poses of a motion's actions and the weight of each per frame (T, P); "relaxed" if the
    beginnings of actions are unknown."""
    names = motion.action.split(",")
    wished = motion.provenance.get("hands", [""] * len(names))
    poses = [
        (own, own) if own else hands_of(name)
        for name, own in zip(names, [*wished, *[""] * len(names)], strict=False)
    ]
    if len(set(poses)) == 1 or motion.action_starts is None:
        return ([poses[0]] if len(set(poses)) == 1 else [("relaxed", "relaxed")]), np.ones(
            (frames, 1)
        )
    return poses, _shares(motion, frames)


def _shares(motion: Motion, frames: int) -> FloatArray:
    """Weight (T, A) of the hand pose of each action in each frame, from the beginnings of the
    actions."""
    assert motion.action_starts is not None
    times = np.arange(frames) / motion.fps
    begun = np.stack(
        [
            smoothstep(times, start - 0.6 * _HANDS_SECONDS, start + 0.4 * _HANDS_SECONDS)
            for start in motion.action_starts[1:]
        ],
        -1,
    )
    begun = np.concatenate([np.ones((frames, 1)), begun, np.zeros((frames, 1))], axis=1)
    shares: FloatArray = -np.diff(np.minimum.accumulate(begun, axis=1), axis=1)
    return shares


def swayed(
    source: Mapping[str, FloatArray], fps: float, settings: LifeSettings
) -> dict[str, FloatArray]:
    """Add sway to canonical joints (T, 3), meters at the body's size, while the person stands:
    ankles and feet do not move, the hips shift by a centimeter."""
    still = _stillness(source, fps)
    if not settings.sway or not still.any():
        return dict(source)
    random = np.random.default_rng([settings.seed, _SWAY_STREAM])
    times = np.arange(len(still))[:, None] / fps
    shift = np.zeros((len(still), 3))
    for period, size in _SWAY:
        if wave := _period(period, settings.cycle):
            shift[:, [0, 2]] += size * np.sin(
                2 * np.pi * times / wave + random.uniform(0, 2 * np.pi, 2)
            )
    across = source["left_hip"] - source["right_hip"]
    left = unit(across * np.array([1.0, 0.0, 1.0]))
    forward = np.cross(left, np.array([0.0, 1.0, 0.0]))
    shift = (
        (shift[:, :1] * left * 0.009 + shift[:, 2:] * forward * 0.006)
        * still[:, None]
        * settings.sway
    )
    share = {"knee": 0.5, "ankle": 0.0, "foot": 0.0, "toes": 0.0}
    return {
        name: points + shift * share.get(name.rpartition("_")[2], 1.0)
        for name, points in source.items()
    }


def _stillness(source: Mapping[str, FloatArray], fps: float) -> FloatArray:
    """Degree (T,) to which a person stands still, 0 to 1."""
    if len(source["pelvis"]) < 2:
        return np.zeros(len(source["pelvis"]))
    speed = np.max(
        [
            np.linalg.norm(np.gradient(smoothed(source[name], 0.1 * fps), axis=0), axis=-1) * fps
            for name in ("pelvis", "left_ankle", "right_ankle")
        ],
        axis=0,
    )
    still = 1 - smoothstep(speed, 0.06, 0.25)
    return np.clip(smoothed(still[:, None], 0.4 * fps)[:, 0], 0, 1)


def _breathe(transforms: FloatArray, rig: Rig, fps: float, settings: LifeSettings) -> FloatArray:
    """Raise and lower chest and collars; the neck compensates the chest's turn, so that the head
    stays still."""
    period, spine = _period(_BREATH_SECONDS, settings.cycle), rig.chains["spine"]
    if not period or len(spine) < 2:
        return transforms
    phase = np.arange(len(transforms)) / (fps * period) % 1
    lungs = (
        np.where(
            phase < 0.42,
            0.5 - 0.5 * np.cos(np.pi * phase / 0.42),
            0.5 + 0.5 * np.cos(np.pi * (phase - 0.42) / 0.58),
        )
        - 0.5
    )
    out = transforms.copy()
    upper = spine[-1]
    left = out[:, upper, :3, :3] @ rig.rest[upper].T @ np.array([1.0, 0.0, 0.0])
    chest = np.deg2rad(-1.1) * settings.breath * lungs
    turn_bones(out, subtree(rig.parents, upper), rotvec_to_rotmat(chest[:, None] * left))
    if rig.chains["neck"]:
        turn_bones(
            out,
            subtree(rig.parents, rig.chains["neck"][0]),
            rotvec_to_rotmat(-chest[:, None] * left),
        )
    front = out[:, upper, :3, :3] @ rig.rest[upper].T @ np.array([0.0, 0.0, 1.0])
    for side in SIDES:
        if rig.chains[f"{side}_collar"]:
            rise = np.deg2rad(1.4 if side == "left" else -1.4) * settings.breath * lungs
            bones = subtree(rig.parents, rig.chains[f"{side}_collar"][0])
            turn_bones(out, bones, rotvec_to_rotmat(rise[:, None] * front))
            arm = subtree(rig.parents, rig.bones[f"{side}_shoulder"])
            turn_bones(out, arm, rotvec_to_rotmat(-rise[:, None] * front))  # arms keep their pose
    return out


def _look_ahead(
    transforms: FloatArray,
    rig: Rig,
    fps: float,
    settings: LifeSettings,
    weights: tuple[FloatArray, FloatArray],
) -> FloatArray:
    """Turn neck and head towards the direction of travel, slightly before the body turns, and the
    gaze towards the horizon, by two `weights` (T,).

    The joint of the head gives its position, not the direction of the face. Without this, the head
    would stay rigid on the shoulders.
    """
    chain = rig.chains["neck"]
    if "head" not in rig.bones or not chain or len(transforms) < 2:
        return transforms
    head, upper, pelvis = (
        rig.bones["head"],
        (rig.chains["spine"] or [rig.bones["pelvis"]])[-1],
        rig.bones["pelvis"],
    )
    front, up = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    worn = {bone: transforms[:, bone, :3, :3] @ rig.rest[bone].T for bone in (head, upper, pelvis)}
    body = unit(
        smoothed((worn[upper] + worn[pelvis]) @ front, 0.35 * fps) * np.array([1.0, 0.0, 1.0])
    )
    path = smoothed(transforms[:, pelvis, :3, 3], 0.35 * fps)
    speed = np.gradient(path, axis=0) * fps * np.array([1.0, 0.0, 1.0])
    going = unit(speed)
    ahead = smoothstep(np.linalg.norm(speed, axis=-1), 0.3, 0.8) * smoothstep(
        (going * body).sum(-1), 0.2, 0.7
    )
    wanted = unit(body + ahead[:, None] * (going - body))
    heading = np.unwrap(np.arctan2(wanted[:, 0], wanted[:, 2]))
    times = np.arange(len(heading)) / fps
    if settings.cycle:  # the next round turns in the same direction
        heading = np.interp(
            times + AHEAD_SECONDS,
            np.r_[times, times[-1] + settings.cycle],
            np.r_[heading, heading[-1]],
        )
    else:
        heading = np.interp(times + AHEAD_SECONDS, times, heading)
    chest_yaw, face = _yaw(worn[upper] @ front), worn[head] @ front
    most = np.deg2rad(50)
    relative = (heading - chest_yaw + np.pi) % (2 * np.pi) - np.pi
    turn = chest_yaw + most * np.tanh(relative / most) - _yaw(face)
    turn = (turn + np.pi) % (2 * np.pi) - np.pi
    pitch = np.arcsin(np.clip(face[:, 1], -1, 1))
    lasting = smoothed(pitch[:, None], 0.6 * fps)[:, 0]
    nod = np.clip(lasting, np.deg2rad(-14), np.deg2rad(2)) - lasting
    upright = smoothstep((worn[upper] @ up)[:, 1], 0.6, 0.9) * settings.gaze
    turn, nod = (
        smoothed((angle * upright * weight)[:, None], 0.1 * fps)[:, 0]
        for angle, weight in zip((turn, nod), weights, strict=True)
    )
    out = transforms.copy()
    steps = [*chain, head]
    right = -np.cross(up, unit(face * np.array([1.0, 0.0, 1.0])))
    for bone in steps:
        share = 0.4 / len(chain) if bone != head else 0.6
        rotmat = rotvec_to_rotmat(share * turn[:, None] * up) @ rotvec_to_rotmat(
            share * nod[:, None] * right
        )
        turn_bones(out, subtree(rig.parents, bone), rotmat)
    return out


def _yaw(vectors: FloatArray) -> FloatArray:
    angle: FloatArray = np.unwrap(np.arctan2(vectors[:, 0], vectors[:, 2]))
    return angle


def _period(natural: float, cycle: float) -> float:
    """Return the period nearest to a natural one of which a whole number fits into `cycle` seconds;
    0 for a cycle that is too short."""
    if not cycle:
        return natural
    return 0.0 if cycle < _SHORTEST_CYCLE else cycle / max(round(cycle / natural), 1)
