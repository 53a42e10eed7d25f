"""Join actions of several sources in one clip, on the library's skeleton, with blends between
them."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from a2v.animation.detail import FRONT
from a2v.animation.posture import table_of
from a2v.animation.source import source_joints, source_leg_length, upright_rotmat
from a2v.errors import InputError
from a2v.geometry.vectors import unit
from a2v.kinematics import Skeleton, rotvec_to_rotmat, swing_between
from a2v.kinematics.names import canonical_joints
from a2v.kinematics.transforms import inverse_kinematics, on_lengths
from a2v.motion.applications import on_skeleton
from a2v.motion.clips import SOURCE as CLIPS
from a2v.motion.clips import RELAXED, clip_library, play_clip
from a2v.motion.crossfade import crossfade
from a2v.motion.direct import make_motion
from a2v.motion.edit import Edit, edited
from a2v.motion.model import MotionModel
from a2v.motion.prompts import Step
from a2v.motion.settling import rises
from a2v.motion.timeline import Take, stack_clips
from a2v.types import FloatArray, Motion

MODEL_SECONDS = 3.0
"""Seconds of a model's action in a mix if no length is given."""
SHORTEST_SECONDS = 0.8
"""Least length of a step without a given length, seconds."""
FADE_SECONDS = (0.35, 1.1)
"""Seconds of a blend between similar poses, and between poses that are `FAR` apart."""
FAR = 1.2
"""Distance in meters of a joint between two poses from which the longest blend is used."""
LEAD = 0.6
"""Share of a blend for which a clip waits before it begins, since its first frames are hardly
visible."""
SOLE = 0.012
"""Height in meters of a standing person's lowest joint above the ground, on the library's
skeleton."""
LEVELLED = frozenset({"humanact12", "ntu_vibe"})
"""Skeletons of data whose vertical leans with the camera (`a2v.animation.retarget`)."""


def natural_seconds(step: Step) -> float:
    """Seconds of a step without a given length: a clip its own length, an action of a model
    `MODEL_SECONDS`."""
    if step.source == CLIPS:
        return clip_library().seconds(step.action) / step.speed
    return MODEL_SECONDS


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
    if len(sources) == 1 and CLIPS not in sources:
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
    library, speed = clip_library(), steps[0].speed * edit.speed
    index = library.index(steps[0].action)
    if (
        edit.loop and library.clips[index].plays == "loop"
    ):  # a whole number of its own cycles already closes
        cycle = len(library.joints[index]) / library.clips[index].fps / speed
        whole = max(1, round(frames / fps / cycle)) * cycle
        played = play_clip(
            steps[0].action,
            frames=max(2, round(whole * fps)),
            fps=fps,
            speed=speed,
            seed=seed,
            cycles=round(whole / cycle),
        )
        return edited(played, dataclasses.replace(after, loop=False, in_place=edit.in_place))
    count = steps[0].frames or (round(steps[0].seconds * fps) if steps[0].seconds else frames)
    return edited(
        play_clip(steps[0].action, frames=max(1, count), fps=fps, speed=speed, seed=seed), after
    )


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


@dataclass(frozen=True)
class _Segment:
    """Steps of one source, and their frames."""

    steps: tuple[Step, ...]
    counts: tuple[int, ...]

    @property
    def frames(self) -> int:
        return sum(self.counts)


def _joined(steps: Sequence[Step], frames: int, fps: float, seed: int, speed: float) -> Motion:
    counts = shared_frames(steps, frames=frames, fps=fps)
    segments = []
    for (source, _), run in groupby(
        enumerate(steps),
        key=lambda item: (item[1].source, item[0] if item[1].source == CLIPS else -1),
    ):
        own = list(run)
        assert source
        segments.append(
            _Segment(tuple(step for _, step in own), tuple(counts[at] for at, _ in own))
        )
    library = clip_library()
    skeleton = _sided(library.skeleton)
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
    starts = np.cumsum([0, *counts[:-1]]) / fps
    clips = [step.source == CLIPS for step in steps]
    in_air = [
        own and library.clips[library.index(step.action)].air
        for own, step in zip(clips, steps, strict=True)
    ]
    rising = [
        not own and rises(MotionModel.load(step.source).card, step.action)
        for own, step in zip(clips, steps, strict=True)
    ]
    return Motion(
        joints=joints.astype(np.float32),
        rotations=inverse_kinematics(joints, library.skeleton).astype(np.float32),
        root=joints[:, 0].astype(np.float32),
        fps=float(fps),
        parents=library.skeleton.parents,
        joint_names=library.skeleton.joint_names,
        action=",".join(step.action for step in steps),
        seed=seed,
        rest_offsets=library.rest_offsets,
        action_starts=starts,
        provenance={
            "sources": [step.source for step in steps],
            "seed": seed,
            "told": clips,
            "air": in_air,
            "rises": rising,
        },
    )


def _played(
    segment: _Segment, fps: float, seed: int, speed: float, *, ahead: int, lead: int
) -> FloatArray:
    """Return the joints (T + ahead, J, 3) of a segment and its continuation on the clips' skeleton.
    A clip of the library holds its first pose for `lead` frames."""
    frames, first = segment.frames + ahead, segment.steps[0]
    if first.source == CLIPS:
        played = play_clip(
            first.action,
            frames=max(1, frames - lead),
            fps=fps,
            speed=first.speed * speed,
            seed=seed,
        )
        joints = played.joints.astype(np.float64)
        return np.concatenate([np.repeat(joints[:1], frames - len(joints), axis=0), joints])
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


def _sided(skeleton: Skeleton) -> Skeleton:
    """The skeleton with its hips and shoulders named, left before right."""
    found = canonical_joints(skeleton.joint_names, skeleton.parents.tolist())
    return dataclasses.replace(
        skeleton,
        hips=(found["left_hip"], found["right_hip"]),
        shoulders=(found["left_shoulder"], found["right_shoulder"]),
    )


def on_clips_skeleton(motion: Motion) -> FloatArray:
    """Convert a clip of any skeleton to the library's: joints (T, J, 3), meters.

    It has the library's bones, standing feet and neck, and relaxed hands.
    """
    library = clip_library()
    skeleton, lengths = library.skeleton, library.lengths
    source = source_joints(motion)
    if motion.skeleton in LEVELLED:
        rotmat = upright_rotmat(source, motion.fps)
        motion = dataclasses.replace(
            motion, joints=(motion.joints.astype(np.float64) @ rotmat.T).astype(np.float32)
        )
        source = source_joints(motion)
    idle = library.joints[library.index(RELAXED)]
    scale = source_leg_length(
        {
            name: idle[:, at]
            for name, at in canonical_joints(
                skeleton.joint_names, skeleton.parents.tolist()
            ).items()
        }
    ) / source_leg_length(source)
    joints = on_skeleton(
        dataclasses.replace(motion, joints=motion.joints * np.float32(scale)), skeleton, lengths
    ).astype(np.float64)
    joints = on_lengths(_standing(joints, skeleton, motion.skeleton), skeleton, lengths)
    joints = _with_details(joints, idle[0], skeleton)
    joints[..., 1] += SOLE - joints[..., 1].min()
    return joints


def _standing(joints: FloatArray, skeleton: Skeleton, data: str) -> FloatArray:
    """Turn feet and neck of joints (T, J, 3) by the difference between the standing poses of the
    skeleton of `data` and of the library."""
    table = table_of(data)
    found = canonical_joints(skeleton.joint_names, skeleton.parents.tolist())
    rest = _rest(skeleton)
    left = unit(
        (joints[:, found["left_hip"]] - joints[:, found["right_hip"]]) * np.array([1.0, 0.0, 1.0])
    )
    out = joints.copy()
    for bone, key in (("left_ankle", "dip"), ("right_ankle", "dip"), ("neck", "neck")):
        if key not in table:
            continue
        child = {"left_ankle": "left_foot", "right_ankle": "right_foot", "neck": "head"}[bone]
        own = rest[found[child]] - rest[found[bone]]
        angle = np.degrees(
            np.arctan2(own[1], np.hypot(own[0], own[2]))
            if key == "dip"
            else np.arctan2(own[2], own[1])
        )
        turn = rotvec_to_rotmat(
            np.deg2rad(table[key] - angle if key == "dip" else angle - table[key]) * left
        )
        moved = [at for at in range(skeleton.n_joints) if _hangs_on(at, found[bone], skeleton)]
        out[:, moved] = joints[:, found[bone], None] + np.einsum(
            "tab,tkb->tka", turn, joints[:, moved] - joints[:, found[bone], None]
        )
    return out


def _hangs_on(joint: int, on: int, skeleton: Skeleton) -> bool:
    """Return whether a joint is a descendant of another one."""
    at = int(skeleton.parents[joint])
    while at >= 0:
        if at == on:
            return True
        at = int(skeleton.parents[at])
    return False


def _rest(skeleton: Skeleton) -> FloatArray:
    offsets = clip_library().rest_offsets
    points = np.zeros_like(offsets)
    for joint in range(1, len(points)):
        points[joint] = points[skeleton.parents[joint]] + offsets[joint]
    return points


def _with_details(joints: FloatArray, relaxed: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Joints (T, J, 3) with fingers and face as in the pose `relaxed` (J, 3), turned with the
    forearms and the person."""
    names = skeleton.joint_names
    out = joints.copy()
    for side in ("l", "r"):
        elbow, wrist = names.index(f"lowerarm_{side}"), names.index(f"hand_{side}")
        fingers = [at for at in range(len(names)) if _hangs_on(at, wrist, skeleton)]
        turn = rotvec_to_rotmat(
            swing_between(
                np.broadcast_to(relaxed[wrist] - relaxed[elbow], joints[:, 0].shape),
                joints[:, wrist] - joints[:, elbow],
            )
        )
        out[:, fingers] = joints[:, wrist, None] + np.einsum(
            "tab,kb->tka", turn, relaxed[fingers] - relaxed[wrist]
        )
    head, front = names.index("head"), names.index(FRONT)
    found = canonical_joints(names, skeleton.parents.tolist())
    across = joints[:, found["left_hip"]] - joints[:, found["right_hip"]]
    yaw = -np.arctan2(across[:, 2], across[:, 0])
    out[:, front] = joints[:, head] + np.einsum(
        "tab,b->ta",
        rotvec_to_rotmat(yaw[:, None] * np.array([0.0, 1.0, 0.0])),
        relaxed[front] - relaxed[head],
    )
    return out
