"""Join actions of several sources in one clip, on the library's skeleton, with blends between
them."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import Skeleton, rotvec_to_rotmat
from a2v.kinematics.from_joints import motion_of_joints
from a2v.kinematics.transforms import on_lengths
from a2v.motion.acting import act, natural_seconds
from a2v.motion.clips import SOURCE as CLIPS
from a2v.motion.clips import clip_library
from a2v.motion.crossfade import crossfade
from a2v.motion.direct import make_motion
from a2v.motion.edit import Edit, edited
from a2v.motion.model import MotionModel
from a2v.motion.on_clips import on_clips_skeleton
from a2v.motion.prompts import Step
from a2v.motion.settling import rises
from a2v.motion.staging import Play, sided
from a2v.motion.timeline import Take, stack_clips
from a2v.types import FloatArray, Motion

SHORTEST_SECONDS = 0.8
"""Least length of a step without a given length, seconds."""
FADE_SECONDS = (0.35, 1.1)
"""Seconds of a blend between similar poses, and between poses that are `FAR` apart."""
FAR = 1.2
"""Distance in meters of a joint between two poses from which the longest blend is used."""
LEAD = 0.6
"""Share of a blend for which a clip waits before it begins, since its first frames are hardly
visible."""


def make_sourced(
    steps: Sequence[Step],
    *,
    frames: int,
    fps: float,
    seed: int = 0,
    count: int = 1,
    edit: Edit = Edit(),
) -> Motion:
    """Make clips of steps with sources (`a2v.motion.catalog.understand`).

    Steps of a single model are made by `make_motion`, a single clip of the library is played, and
    others are joined.

    Parameters
    ----------
    steps : sequence of Step
        Each has a `source`.
    frames : int
        Number of frames of the result, shared by steps without a given length in proportion to
        their natural lengths.
    fps : float
    seed, count : int
        The clips have consecutive seeds.
    edit : Edit

    Raises
    ------
    InputError
        There is no step, a step has no source, or an error of `make_motion` or `edited`.
    """
    if not steps or not all(step.source for step in steps):
        raise InputError("every step needs a source, as a2v.motion.catalog.understand gives it")
    sources = {step.source for step in steps}
    if len(sources) == 1 and CLIPS not in sources and not any(step.wishes.any for step in steps):
        return make_motion(
            MotionModel.load(steps[0].source),
            steps,
            Take(frames=frames, fps=fps, seed=seed, count=count),
            edit=edit,
        )
    made = [_one(steps, frames, fps, seed + number, edit) for number in range(count)]
    return made[0] if count == 1 else stack_clips(made)


def _one(steps: Sequence[Step], frames: int, fps: float, seed: int, edit: Edit) -> Motion:
    after = dataclasses.replace(edit, speed=1.0)
    if len(steps) > 1:
        return edited(_joined(steps, frames, fps, seed, edit.speed), after)
    step = steps[0]
    count = step.frames or (round(step.seconds * fps) if step.seconds else frames)
    play = Play(frames=max(1, count), fps=fps, speed=edit.speed, seed=seed)
    if edit.loop and step.source == CLIPS:
        library, speed = clip_library(), step.speed * edit.speed
        index = library.index(step.action)
        if library.clips[index].plays == "loop":  # whole cycles already close
            cycle = len(library.joints[index]) / library.clips[index].fps / speed
            whole = max(1, round(frames / fps / cycle))
            play = dataclasses.replace(
                play, frames=max(2, round(whole * cycle * fps)), cycles=whole
            )
            after = dataclasses.replace(after, loop=False)
    return edited(_told(act(step, play), [step], seed), after)


def shared_frames(steps: Sequence[Step], *, frames: int, fps: float) -> list[int]:
    """Return the number of frames of each step: its given length, or a share of the rest of
    `frames` in proportion to its natural length."""
    asked = [
        step.frames or (max(1, round(step.seconds * fps)) if step.seconds else 0) for step in steps
    ]
    open_ = [0.0 if own else natural_seconds(step) for step, own in zip(steps, asked, strict=True)]
    left = max(frames - sum(asked), 0)
    least = round(SHORTEST_SECONDS * fps)
    counts = [
        own or max(least, round(left * share / max(sum(open_), 1e-9)))
        for own, share in zip(asked, open_, strict=True)
    ]
    if not any(asked) and sum(counts) < frames:
        counts[-1] += frames - sum(counts)
    return counts


def _alone(step: Step) -> bool:
    """Return whether a step is made by itself: a clip, or one with wishes."""
    return step.source == CLIPS or step.wishes.any


@dataclass(frozen=True)
class _Segment:
    """Steps of one source, and their frames."""

    steps: tuple[Step, ...]
    counts: tuple[int, ...]
    opens: bool

    @property
    def frames(self) -> int:
        return sum(self.counts)


def _joined(steps: Sequence[Step], frames: int, fps: float, seed: int, speed: float) -> Motion:
    counts = shared_frames(steps, frames=frames, fps=fps)
    segments: list[_Segment] = []
    for (source, _), run in groupby(
        enumerate(steps),
        key=lambda item: (item[1].source, item[0] if _alone(item[1]) else -1),
    ):
        own = list(run)
        assert source
        segments.append(
            _Segment(
                tuple(step for _, step in own), tuple(counts[at] for at, _ in own), not segments
            )
        )
    library = clip_library()
    skeleton = sided(library.skeleton)
    longest = round(FADE_SECONDS[1] * fps)
    joints = _played(segments[0], fps, seed, speed, ahead=longest, lead=0)
    for number, segment in enumerate(segments[1:], 1):
        done = sum(part.frames for part in segments[:number])
        before, ahead = joints[None, :done], joints[None, done : done + longest]
        fade = _fade(
            before[0, -1],
            _played(segment, fps, seed + number, speed, ahead=0, lead=0)[0],
            skeleton,
            fps,
        )
        after = _played(segment, fps, seed + number, speed, ahead=longest, lead=round(LEAD * fade))[
            None
        ]
        fade = min(fade, after.shape[1])
        mixed = crossfade(
            before.astype(np.float32),
            ahead[:, :fade].astype(np.float32),
            after.astype(np.float32),
            skeleton,
            np.zeros(1),
        )
        joints = np.concatenate([joints[:done], mixed[0].astype(np.float64)])
    joints = on_lengths(joints[: sum(counts)], library.skeleton, library.lengths)
    made = motion_of_joints(
        joints,
        library.skeleton,
        float(fps),
        action=",".join(step.action for step in steps),
        seed=seed,
        rest_offsets=library.rest_offsets,
        action_starts=np.cumsum([0, *counts[:-1]]) / fps,
    )
    return _told(made, steps, seed)


def _told(motion: Motion, steps: Sequence[Step], seed: int) -> Motion:
    """Record the actions of a motion, and what a character needs to know of each."""
    library = clip_library()
    clips = [step.source == CLIPS for step in steps]
    air = [
        own and library.clips[library.index(step.action)].air
        for own, step in zip(clips, steps, strict=True)
    ]
    rising = [
        not own and rises(MotionModel.load(step.source).card, step.action)
        for own, step in zip(clips, steps, strict=True)
    ]
    facts = {
        "sources": [step.source for step in steps],
        "seed": seed,
        "told": [own or bool(step.wishes.over) for own, step in zip(clips, steps, strict=True)],
        "air": air,
        "rises": rising,
    }
    for name in ("look", "hands", "over"):
        if any(values := [getattr(step.wishes, name) for step in steps]):
            facts[name] = values
    return dataclasses.replace(
        motion,
        action=",".join(step.action for step in steps),
        seed=seed,
        provenance={**motion.provenance, **facts},
    )


def _played(
    segment: _Segment, fps: float, seed: int, speed: float, *, ahead: int, lead: int
) -> FloatArray:
    """Return the joints (T + ahead, J, 3) of a segment and its continuation on the clips' skeleton.
    A clip of the library holds its first pose for `lead` frames."""
    frames, first = segment.frames + ahead, segment.steps[0]
    if _alone(first):
        waits = lead if first.source == CLIPS else 0
        ends = first.wishes.ends  # then it is done when the step ends, and the last pose is held
        play = Play(
            frames=max(1, (segment.frames if ends else frames) - waits),
            fps=fps,
            speed=speed,
            seed=seed,
            alone=segment.opens,
        )
        joints = act(first, play).joints.astype(np.float64)
        joints = np.concatenate([np.repeat(joints[:1], waits, axis=0), joints])
        left = frames - len(joints)
        joints = np.concatenate([joints, np.repeat(joints[-1:], max(left, 0), axis=0)])
        return np.asarray(joints[:frames])
    counts = [*segment.counts[:-1], segment.counts[-1] + ahead]
    steps = [
        dataclasses.replace(step, frames=count, seconds=None)
        for step, count in zip(segment.steps, counts, strict=True)
    ]
    return on_clips_skeleton(
        make_motion(
            MotionModel.load(first.source),
            steps,
            Take(frames=frames, fps=fps, seed=seed),
            edit=Edit(speed=speed),
        )
    )


def _fade(end: FloatArray, begin: FloatArray, skeleton: Skeleton, fps: float) -> int:
    """Frames of the blend between two poses (J, 3): longer for more different poses, independent of
    their places."""
    apart = np.linalg.norm(_centered(end, skeleton) - _centered(begin, skeleton), axis=-1).max()
    return max(2, round(float(np.interp(apart, [0.15, FAR], FADE_SECONDS)) * fps))


def _centered(pose: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Return a pose (J, 3) moved over the origin, with its hips along x."""
    assert skeleton.hips is not None
    across = pose[skeleton.hips[0]] - pose[skeleton.hips[1]]
    yaw = np.arctan2(across[2], across[0])
    moved: FloatArray = (pose - pose[0] * [1, 0, 1]) @ rotvec_to_rotmat(np.array([0.0, yaw, 0.0])).T
    return moved
