"""Perform several actions in turn, each with its own length and tempo."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from a2v.errors import InputError
from a2v.io import brief, read_bytes
from a2v.kinematics.resample import resample_at
from a2v.motion.card import MAX_FRAMES
from a2v.motion.edit import check_speed
from a2v.motion.model import MotionModel
from a2v.motion.prompts import MAX_PROMPT, Match, Step, Vocabulary
from a2v.motion.sampling import Noise
from a2v.motion.steer import Steerer
from a2v.motion.stride import lengthened, strides
from a2v.motion.wishes import Wishes
from a2v.plain_yaml import parse_yaml
from a2v.types import FloatArray, Motion

_WISHES: dict[str, type | tuple[type, ...]] = {
    "count": int,
    "distance": (int, float),
    "pace": (int, float),
    "angle": (int, float),
    "side": str,
    "in_place": bool,
    "mirror": bool,
    "over": str,
    "still": str,
    "look": str,
    "hands": str,
}
"""Entries of a timeline that are fields of `Wishes`, and their kinds."""

#: Seconds over which tempo changes from one step to the next.
EASE_SECONDS = 0.5

MAX_TIMELINE_BYTES = 1 << 16
MAX_STEPS = 200
"""Largest number of steps of a timeline. They are matched, told and checked one by one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Take:
    """Length, rate, seed, number and bone lengths of clips.

    Attributes
    ----------
    frames : int
        Number of frames of the result, shared equally by steps without a given length.
    fps : float
        Frames per second of the result.
    seed, count : int
        Seed of all clips, and their number.
    lengths : (J,) float or None
        Bone lengths, native units; None for the model's own.
    """

    frames: int
    fps: float
    seed: int = 0
    count: int = 1
    lengths: FloatArray | None = None


@dataclass(frozen=True)
class Moments:
    """Times of the frames of a result.

    Attributes
    ----------
    at : (T,) float
        In generated frames.
    fps : float
        Of the result.
    """

    at: FloatArray
    fps: float

    @property
    def seconds(self) -> float:
        """The last frame's time."""
        return (len(self.at) - 1) / self.fps

    def frame_of(self, time: float) -> float:
        """The generated frame for a time of the result in seconds; the last frame for later
        times."""
        return float(np.interp(time * self.fps, np.arange(len(self.at)), self.at))


def read_timeline(
    source: str | os.PathLike[str], vocabulary: Vocabulary
) -> tuple[list[Step], list[Match]]:
    """Read the steps of a YAML file and the match of each.

    It is a list of ``{action: ..., style: ..., seconds: ..., frames: ..., seed: ..., speed: ...}``:
    action and style are words as in a prompt, the other entries those of `Step` and of its
    `Wishes`, such as ``over: wave``, the action of the upper body.

    Raises
    ------
    InputError
        The file cannot be read, or an entry is unknown or of the wrong kind.
    """
    data = read_bytes(source, limit=MAX_TIMELINE_BYTES)
    expected = "a YAML list of steps, such as {action: walk, seconds: 2}"
    content = parse_yaml(data, source, "timeline", expected)
    if not isinstance(content, list) or not content:
        raise InputError(f"{source} is not a timeline (no list of steps); expected {expected}")
    if len(content) > MAX_STEPS:
        raise InputError(
            f"{source} has {len(content)} steps; expected at most {MAX_STEPS}; divide it"
        )
    found = [
        _timed_step(number, entry, source, vocabulary) for number, entry in enumerate(content, 1)
    ]
    return [step for step, _ in found], [match for _, match in found]


def _timed_step(
    number: int, entry: object, source: object, vocabulary: Vocabulary
) -> tuple[Step, Match]:
    where = f"step {number} of {source}"
    if not isinstance(entry, dict) or not isinstance(entry.get("action"), str):
        raise InputError(
            f"{where} is {brief(entry)}; expected names and values, such as action: walk"
        )
    kinds: dict[str, type | tuple[type, ...]] = {
        "action": str,
        "style": str,
        "seconds": (int, float),
        "speed": (int, float),
        "frames": int,
        "seed": int,
        **_WISHES,
    }
    for name, value in entry.items():
        if name not in kinds:
            raise InputError(
                f"{where} has the unknown entry {brief(name)}; expected {', '.join(kinds)}"
            )
        flag = kinds[name] is bool
        fits = isinstance(value, kinds[name]) and isinstance(value, bool) == flag
        if not fits or (name == "seed" and not 0 <= int(value) < 2**32):
            kind = "text" if kinds[name] is str else "true or false" if flag else "a number"
            raise InputError(f"{where} has {name}: {brief(value)}; expected {kind}")
    words = f"{entry['action']} {entry.get('style', '')}".strip()
    if len(words) > MAX_PROMPT:
        raise InputError(
            f"{where} has an action of {len(words)} letters; expected at most {MAX_PROMPT}"
        )
    match = vocabulary.match(words)
    numbers = {name: entry[name] for name in ("seconds", "frames", "seed") if name in entry}
    wished = {name: entry[name] for name in _WISHES if name in entry}
    if "over" in wished:
        wished["over"] = vocabulary.match(wished["over"][:MAX_PROMPT]).action
    if "still" in wished:
        wished["still"] = tuple(part.strip() for part in wished["still"].split(","))
    speed = match.speed * entry.get("speed", 1.0)
    return Step(action=match.action, speed=speed, wishes=Wishes(**wished), **numbers), match


def step_frames(steps: Sequence[Step], *, frames: int, fps: float) -> list[int]:
    """Return the number of frames of each step at `fps`: its own length, else an equal share of
    `frames`.

    Raises
    ------
    InputError
        There is no step, or they are longer than a model makes.
    """
    if not steps:
        raise InputError("no action given")
    share = -(-frames // len(steps))
    counts = [
        step.frames or (round(step.seconds * fps) if step.seconds else share) for step in steps
    ]
    if not any(step.frames or step.seconds for step in steps):
        counts[-1] = max(1, frames - share * (len(steps) - 1))  # like a transition without lengths
    counts = [max(1, count) for count in counts]
    if sum(counts) > MAX_FRAMES:
        raise InputError(f"the steps take {sum(counts)} frames; expected at most {MAX_FRAMES}")
    return counts


def perform(
    model: MotionModel,
    steps: Sequence[Step],
    take: Take,
    *,
    speed: float = 1.0,
    skip_rest: bool = False,
    steerer: Callable[[Moments], Steerer] | None = None,
) -> Motion:
    """Make clips of `steps` in turn, each of its own length.

    Parameters
    ----------
    model : MotionModel
    steps : sequence of Step
    take : Take
        With one clip the result has no leading dimension.
    speed : float
        Tempo of the whole motion, multiplied with that of each step.
    skip_rest : bool
        Actions begin at the first movement, see `MotionModel.generate`.
    steerer : callable or None
        Makes the steerer of the one clip from its `Moments` (`a2v.motion.direct`). The clip keeps
        its steered place.

    Raises
    ------
    InputError
        An unknown action, or a number out of range.
    """
    rate, count = take.fps, take.count
    check_speed(speed)
    lasting = step_frames(steps, frames=take.frames, fps=rate)
    at, starts, longer = _moments(
        steps,
        lasting,
        ease=EASE_SECONDS * rate,
        speed=speed,
        made_for_one=model.fps / rate,
        travels=steerer is None,
    )
    made = int(np.ceil(at[-1] - 1e-6)) + 1
    names = model.check_request([step.action for step in steps], frames=made, count=count)
    labels = np.array([model.label(name) for name in names])[
        np.searchsorted(starts, np.arange(made) + 1e-6, side="right") - 1
    ]
    body = (
        model.bone_lengths if take.lengths is None else np.asarray(take.lengths, dtype=np.float32)
    )
    noise = _noise_of(steps, starts, take.seed)
    joints, rotations = model.generate(
        np.tile(labels, (count, 1)),
        np.tile(body, (count, 1)),
        noise,
        fresh=True,
        skip_rest=skip_rest,
        steerer=None if steerer is None else steerer(Moments(at, rate)),
    )
    motion = model.to_motion(
        joints, rotations, lengths=body, names=names, seed=take.seed, place=steerer is None
    )
    if len(at) != made or not np.allclose(at, np.arange(made), atol=1e-6):
        motion = dataclasses.replace(resample_at(motion, np.minimum(at, made - 1)), fps=float(rate))
    motion = lengthened(motion, longer)
    if len(steps) > 1:
        motion = dataclasses.replace(motion, action_starts=np.cumsum([0, *lasting[:-1]]) / rate)
    return motion if count > 1 else motion[0]


def stack_clips(clips: Sequence[Motion]) -> Motion:
    """Clips of the same length and skeleton as one motion with a leading axis (N, T, ...); the
    other facts are the first clip's."""
    stacked = {
        name: np.stack([getattr(clip, name) for clip in clips])
        for name in ("joints", "rotations", "root")
    }
    return dataclasses.replace(clips[0], **stacked)


def _noise_of(steps: Sequence[Step], starts: FloatArray, seed: int) -> Noise:
    """Noise of steps that begin with the frames `starts` (S,), from their own seeds if given, else
    from `seed`."""
    common = np.random.default_rng(seed)
    own = [common if step.seed is None else np.random.default_rng(step.seed) for step in steps]

    def draw(shape: tuple[int, ...], at: int) -> FloatArray:
        if len(shape) < 3:  # a window
            return own[int(np.searchsorted(starts, at + 1e-6, side="right")) - 1].standard_normal(
                shape, dtype=np.float32
            )
        drawn = common.standard_normal(shape, dtype=np.float32)
        for generator, start, end in zip(
            own,
            np.ceil(starts).astype(int),
            [*np.ceil(starts[1:]).astype(int), shape[1]],
            strict=True,
        ):
            if generator is not common:
                drawn[:, start:end] = generator.standard_normal(
                    (shape[0], end - start, *shape[2:]), dtype=np.float32
                )
        return drawn

    return draw


def _moments(
    steps: Sequence[Step],
    lasting: Sequence[int],
    *,
    ease: float,
    speed: float,
    made_for_one: float,
    travels: bool,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times of the result's frames (T,) in generated frames, beginnings of its steps (S,), and
    factors on the length of strides (T,).

    `lasting`: frames of each step; `ease`: frames over which the tempo changes; `speed`: the tempo
    of all; `made_for_one`: generated frames for one frame of a step at the recorded tempo. A faster
    motion takes longer steps (`strides`) where it `travels` freely, so its tempo rises less.
    """
    speeds = np.repeat([step.speed * speed for step in steps], lasting)
    if np.ptp(speeds) > 0:
        speeds = uniform_filter1d(speeds, max(1, round(ease)), mode="nearest")
    longer = strides(speeds) if travels else np.ones(len(speeds))
    at = np.concatenate([[0.0], np.cumsum(speeds / longer * made_for_one)])
    return at[:-1], at[np.cumsum([0, *lasting[:-1]])], longer
