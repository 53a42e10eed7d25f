"""Play clips of the library as they are shown: from a stance, into a stance, alive while they
stand, with feet that stay in place.

`play_clip` plays the keyed poses alone. Here a one-shot begins in the stance of its `before` and
settles into that of its `after`; everything that stands or sits breathes, shifts its weight and
looks about (`lively`).
"""

from __future__ import annotations

import dataclasses
import zlib
from functools import cache

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from a2v.geometry.steps import smoothstep
from a2v.kinematics import Skeleton, rotvec_to_rotmat, skeleton_of
from a2v.kinematics.foot_contacts import PlantSettings
from a2v.kinematics.from_joints import with_joints
from a2v.kinematics.limbs import bend_to
from a2v.kinematics.names import canonical_joints
from a2v.kinematics.planting import plant_feet
from a2v.kinematics.skeleton import subtree
from a2v.motion.clips import Clip, clip_library, play_clip
from a2v.motion.crossfade import crossfade
from a2v.types import FloatArray, Motion

LEAD_SECONDS = (0.25, 0.6)
"""Seconds of the stance before a one-shot: of seed 0, and at most of other seeds."""
JOIN_SECONDS = 0.25
"""Seconds over which a stance goes over into a clip."""
SETTLE_SECONDS = 0.55
"""Seconds over which a clip settles into a stance."""
AFTER_SECONDS = 0.7
"""Seconds of the stance after a one-shot if no length is given."""
LEAST_SECONDS = 1.2
"""Shortest length of a clip if no length is given."""
OWN = "-"
"""Marks a clip that begins or ends in a pose of its own."""
UNMOVED = frozenset({"T-pose", "A-pose"})
"""Clips that are one pose."""
DEAD = frozenset({"Die", "Die backwards", "Die slowly"})
"""Clips that end without any life."""
QUIET = frozenset(
    [
        "Sleep", "Lie", "Lie down", "Meditate", "Pray", "Fall through the air", "Fly",
        "Fly like a superhero", "Swim", "Tread water", "Push-ups", "Press-ups", "Sit-ups", "Crawl",
        "Roll", "Kneel and fix", "Draw an arrow upwards",
    ]
)  # fmt: skip
"""Clips that breathe, but neither shift their weight nor look about."""

RUNS = 2.0
"""Speed from which a cycle runs, meters per second: its body already moves with the standing foot
(``scripts/make_clips.py``), and planting made the slide of Sprint .74 m/s instead of .14."""
CRAWLS = frozenset({"Crawl"})
"""Clips whose feet are dragged."""

BREATH_SECONDS = 3.8
BREATH = np.deg2rad(1.3)
"""Angle of the chest in a breath."""
SWAY = np.deg2rad(2.2)
"""Size of the sway of the trunk, about the person's left and the vertical."""
SHIFT = 0.016
"""Size of the shift of weight, meters."""
GLANCE_SECONDS = (1.6, 3.2)
"""Range of the seconds between glances."""
GLANCE = (np.deg2rad(26.0), np.deg2rad(38.0))
"""Range of the angle of a glance."""
TURN_SECONDS = 0.3
"""Seconds in which the head turns."""
BUSY = (0.35, 0.9)
"""Speeds of joints, meters per second, from which a clip needs no glances, and has none."""


def clip_seconds(action: str, *, count: int | None = None) -> float:
    """Return the seconds for which a clip is shown if no length is given: its own, with the stances
    before and after it."""
    library = clip_library()
    index = library.index(action)
    clip, own = library.clips[index], len(library.joints[index]) / library.clips[index].fps
    if count is None:
        shown = library.seconds(action)
    else:
        shown = own * count / max(clip.beats, 1)
    if clip.plays == "loop":
        return shown
    lead = LEAD_SECONDS[0] if clip.before not in ("", OWN) else 0.0
    return float(max(LEAST_SECONDS, shown + lead + (AFTER_SECONDS if clip.after else 0.0)))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Play:
    """How a clip is played.

    Attributes
    ----------
    frames : int
    fps : float
    speed : float
        1 as keyed, 2 twice as fast.
    seed : int
    count : int or None
        How often a one-shot or a counted cycle is done; None for as often as there is time.
    cycles : int
        If not 0, the frames are this number of whole cycles, and the last leads to the first.
    alone : bool
        Whether it begins in the stance before it; in a mix another action comes before.
    """

    frames: int
    fps: float
    speed: float = 1.0
    seed: int = 0
    count: int | None = None
    cycles: int = 0
    alone: bool = True


def staged(action: str, play: Play) -> Motion:
    """Play a clip with its stances, alive, feet planted.

    Raises
    ------
    InputError
        The clip is unknown.
    """
    library = clip_library()
    index = library.index(action)
    clip = library.clips[index]
    made = play_clip(
        action,
        frames=play.frames,
        fps=play.fps,
        speed=play.speed,
        seed=play.seed,
        cycles=play.cycles,
    )
    joints = made.joints.astype(np.float64)
    if clip.plays != "loop" or play.count is not None:
        joints = _in_stances(clip, len(library.joints[index]), joints, play)
    if action not in UNMOVED:
        joints = lively(joints, play, quiet=action in QUIET, dead=action in DEAD)
    pace = float(np.hypot(clip.pace, clip.aside))
    still = action in CRAWLS or clip.air or action in UNMOVED or play.cycles or pace > RUNS
    if not still:
        settings = PlantSettings(share=0.8 if pace else 0.4, carry=float(pace > 0))
        joints = with_feet_planted(joints, play.fps, settings)
    return with_joints(made, joints, clip_library().skeleton)


@cache
def _legs() -> tuple[Skeleton, list[int], list[int], list[int]]:
    """Return pelvis and legs of the library's skeleton as a skeleton of their own, the joints that
    these are, and the balls and tips of the feet."""
    names = clip_library().skeleton.joint_names
    own = ["pelvis", *(f"{bone}_{side}" for side in "lr" for bone in _LEG)]
    parents = [-1, 0, 1, 2, 3, 0, 5, 6, 7]
    known = ("pelvis", *(f"{side}_{name}" for side in ("left", "right") for name in _LEG_NAMES))
    skeleton = skeleton_of("custom", parents, known)
    skeleton = dataclasses.replace(skeleton, hips=(1, 5), feet=(4, 8))
    balls, tips = (
        [names.index(end.format(side)) for side in "lr"] for end in ("ball_{}", "ball_{}_end")
    )
    return skeleton, [names.index(name) for name in own], balls, tips


_LEG = ("thigh", "calf", "foot", "ball")
_LEG_NAMES = ("hip", "knee", "ankle", "foot")


def with_feet_planted(joints: FloatArray, fps: float, settings: PlantSettings) -> FloatArray:
    """Plant the feet of joints (T, J, 3) of the library's skeleton (`plant_feet`)."""
    skeleton, own, balls, tips = _legs()
    legs = plant_feet(joints[:, own], skeleton, fps, settings=settings).astype(np.float64)
    made = joints + (legs[:, :1] - joints[:, :1])
    made[:, own] = legs
    made[:, tips] = made[:, balls] + joints[:, tips] - joints[:, balls]
    return made


def _in_stances(clip: Clip, keyed: int, played: FloatArray, play: Play) -> FloatArray:
    """Put the stances before and after a one-shot around its played joints."""
    fps, frames = play.fps, play.frames
    draw = np.random.default_rng([play.seed, 11, zlib.crc32(clip.file.encode())])
    lead = LEAD_SECONDS[0] if play.seed == 0 else draw.uniform(*LEAD_SECONDS)
    alone = play.alone and clip.before not in ("", OWN)
    before = min(round(lead * fps), frames // 3) if alone else 0
    own = keyed / clip.fps / play.speed
    times = (
        play.count / max(clip.beats, 1)
        if play.count is not None
        else 1
        if clip.plays == "once"
        else max(1, round((frames / fps - (AFTER_SECONDS if clip.after else 0.0)) / own))
        if clip.after
        else frames / fps / own + 1
    )
    body = min(frames - before, round(own * times * fps))
    repeats = play.count is not None and clip.plays == "once"
    main = np.concatenate([played[: round(own * fps)]] * int(np.ceil(times))) if repeats else played
    joints = main[:body]
    if before:
        stance = _stance(clip.before, before + round(JOIN_SECONDS * fps), play)
        joints = joined(stance[:before], stance[before:], joints)
    left = frames - len(joints)
    if left <= 0:
        return joints[:frames]
    if clip.after == OWN or not clip.after:
        return np.concatenate([joints, np.repeat(joints[-1:], left, axis=0)])
    stance = _stance(clip.after, left, play)
    ahead = np.repeat(joints[-1:], min(left, round(SETTLE_SECONDS * fps)), axis=0)
    return joined(joints, ahead, stance)


def _stance(action: str, frames: int, play: Play) -> FloatArray:
    played = play_clip(action, frames=max(2, frames), fps=play.fps, seed=0)
    return played.joints.astype(np.float64)[:frames]


def joined(before: FloatArray, ahead: FloatArray, after: FloatArray) -> FloatArray:
    """Continue joints `before` (S, J, 3) by `after` (T, J, 3), blended over the frames `ahead` with
    which `before` would go on."""
    fade = min(len(ahead), len(after))
    if not fade or not len(before):
        return np.concatenate([before, after])
    mixed = crossfade(
        before[None].astype(np.float32),
        ahead[None, :fade].astype(np.float32),
        after[None].astype(np.float32),
        sided(clip_library().skeleton),
        np.zeros(1),
    )
    return np.concatenate([before, mixed[0].astype(np.float64)])


def sided(skeleton: Skeleton) -> Skeleton:
    """Return the skeleton with its hips and shoulders named, left before right."""
    found = canonical_joints(skeleton.joint_names, skeleton.parents.tolist())
    return dataclasses.replace(
        skeleton,
        hips=(found["left_hip"], found["right_hip"]),
        shoulders=(found["left_shoulder"], found["right_shoulder"]),
    )


def lively(joints: FloatArray, play: Play, *, quiet: bool, dead: bool = False) -> FloatArray:
    """Add breath, shifts of weight and glances to joints (T, J, 3) where little moves.

    A body that is `quiet` only breathes, one that is `dead` does not after it has come to rest.
    """
    skeleton, frames, fps = clip_library().skeleton, len(joints), play.fps
    names = skeleton.joint_names
    if frames < 4:
        return joints
    draw = np.random.default_rng([play.seed, 5])
    seconds = frames / fps
    times = np.arange(frames) / fps
    speed = np.linalg.norm(np.gradient(joints, axis=0), axis=-1).max(axis=1) * fps
    busy = gaussian_filter1d(
        maximum_filter1d(speed, max(1, round(0.4 * fps)), mode="nearest"),
        0.15 * fps,
        mode="nearest",
    )
    free = 1 - smoothstep(busy, *BUSY)
    if dead:
        return joints
    made = joints.copy()
    period = seconds / max(1, round(seconds / BREATH_SECONDS)) if play.cycles else BREATH_SECONDS
    phase = 2 * np.pi * (times / period + (0 if play.cycles else draw.random()))
    size = BREATH * (1.6 if quiet else 1.0) * free
    _turn(made, "spine_03", -size * (0.5 - 0.5 * np.cos(phase)), 0, skeleton)
    _turn(made, "neck_01", size * (0.5 - 0.5 * np.cos(phase)), 0, skeleton)
    if quiet:
        return made
    yaw, pitch = _glances(times, draw, closes=bool(play.cycles))
    for bone, share in (("neck_01", 0.4), ("head", 0.6)):
        _turn(made, bone, share * free * yaw, 1, skeleton)
        _turn(made, bone, share * free * pitch, 0, skeleton)
    for axis, wave in ((0, 6.3), (1, 8.7)):
        cycle = seconds / max(1, round(seconds / wave)) if play.cycles else wave
        swing = np.sin(2 * np.pi * times / cycle + draw.uniform(0, 2 * np.pi))
        _turn(made, "spine_01", SWAY * free * swing, axis, skeleton)
    feet = made[:, [names.index("ball_l"), names.index("ball_r")]]
    stands = float(
        feet[..., 1].max() < 0.08 and np.ptp(feet, axis=0).max() < 0.15 and made[0, 0, 1] > 0.7
    )
    waves = (7.1, 3.9)
    shift = np.zeros((frames, 3))
    for number, wave in enumerate(waves):
        cycle = seconds / max(1, round(seconds / wave)) if play.cycles else wave
        for axis, amount in ((0, 1.0), (2, 0.5)):
            angle = 2 * np.pi * times / cycle + draw.uniform(0, 2 * np.pi)
            shift[:, axis] += SHIFT * amount * np.sin(angle) / (1 + number)
    return _shifted(made, stands * free[:, None] * shift, skeleton) if stands else made


def _glances(
    times: FloatArray, draw: np.random.Generator, *, closes: bool
) -> tuple[FloatArray, FloatArray]:
    """Yaw and pitch (T,) of a head that looks about; of a closed cycle both ends look ahead."""
    end = times[-1] - (TURN_SECONDS if closes else 0.0)
    yaw, pitch = np.zeros_like(times), np.zeros_like(times)
    at, now = draw.uniform(0.3, 1.0), np.zeros(2)
    while at < end:
        ahead = np.linalg.norm(now) > 0 and draw.random() < 0.4
        side = -np.sign(now[0]) if now[0] else draw.choice([-1.0, 1.0])
        wanted = (
            np.zeros(2)
            if ahead
            else np.array([side * draw.uniform(*GLANCE), draw.uniform(-0.08, 0.12)])
        )
        step = smoothstep(times, at, at + TURN_SECONDS)
        yaw += step * (wanted[0] - now[0])
        pitch += step * (wanted[1] - now[1])
        now, at = wanted, at + draw.uniform(*GLANCE_SECONDS)
    if closes:
        back = smoothstep(times, end, end + TURN_SECONDS)
        yaw, pitch = yaw - back * now[0], pitch - back * now[1]
    return yaw, pitch


def _turn(joints: FloatArray, bone: str, angle: FloatArray, axis: int, skeleton: Skeleton) -> None:
    """Turn what hangs on a joint by `angle` (T,), in place: about the person's left (`axis` 0) or
    about the vertical (1)."""
    names = skeleton.joint_names
    at = names.index(bone)
    below = [joint for joint in subtree(skeleton.parents.tolist(), at) if joint != at]
    left = joints[:, names.index("upperarm_l")] - joints[:, names.index("upperarm_r")]
    left = left / np.maximum(np.linalg.norm(left, axis=-1, keepdims=True), 1e-9)
    about = left if axis == 0 else np.broadcast_to(np.array([0.0, 1.0, 0.0]), left.shape)
    turn = rotvec_to_rotmat(angle[:, None] * about)
    joints[:, below] = joints[:, [at]] + np.einsum(
        "tab,tjb->tja", turn, joints[:, below] - joints[:, [at]]
    )


def _shifted(joints: FloatArray, shift: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Move the body of joints (T, J, 3) by `shift` (T, 3) over feet that stay."""
    names = skeleton.joint_names
    made = joints + shift[:, None]
    for side in ("l", "r"):
        hip, knee, ankle = (names.index(f"{name}_{side}") for name in ("thigh", "calf", "foot"))
        made[:, knee], made[:, ankle] = bend_to(
            made[:, hip], made[:, knee], made[:, ankle], joints[:, ankle]
        )
        rest = [names.index(f"ball_{side}"), names.index(f"ball_{side}_end")]
        made[:, rest] = made[:, [ankle]] + joints[:, rest] - joints[:, [ankle]]
    return made
