"""Make clips for the commands, the pipeline and the notebooks: actions in turn, directed if
requested, on the ground, edited."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from a2v.animation.curves import near
from a2v.errors import InputError
from a2v.motion.beginnings import LATE, LATE_SECONDS, onset
from a2v.motion.direction import Direction
from a2v.motion.direction_steerer import DirectionSteerer
from a2v.motion.edit import Edit, edited
from a2v.motion.figures import NATURAL_SECONDS, STEADY, STEADY_SPREAD, natural_path
from a2v.motion.limbs import hold_limbs, planted
from a2v.motion.model import MotionModel
from a2v.motion.placement import ground_offset
from a2v.motion.prompts import Step
from a2v.motion.settling import planting, rises, settled, skeleton_of_motion
from a2v.motion.smoothing import smooth_actions
from a2v.motion.timeline import Moments, Take, perform, stack_clips
from a2v.motion.ways import MAX_METRES, MIN_METRES, GroundPath, Way, way_along
from a2v.motion.window_sampler import WindowSampler
from a2v.types import Motion

#: Clips by which the natural speed of an action is measured.
SPEED_CLIPS = 16
MIN_PACE = 0.05
"""Slowest pace along a path, m/s: below it the person stands."""
MAX_PACE = 20.0
"""Fastest pace along a path, m/s: no person runs faster."""
LEAST_RISE = {"Jump": 0.24}
"""Least rise of the pelvis, meters, of actions that are drawn again below it: half of the seeds of
Jump hopped by .15 m. The median of the recordings is .23."""
DRAWS = 6
"""Largest number of draws of such a clip."""
FURTHER = 1_000_003
"""Distance of the seeds of further draws."""
SLIDES_ALONG = 0.5
"""Share of the body's speed at which a standing foot may slide before it is held: the feet of a
person who runs around a bend slide."""
KEPT_SECONDS = 0.4
"""Seconds over which a clip changes from the ground to the height of a given pose, and back."""


def make_motion(
    model: MotionModel,
    steps: Sequence[Step],
    take: Take,
    *,
    edit: Edit = Edit(),
    direction: Direction | None = None,
) -> Motion:
    """Make clips: `perform` (with a `direction` if given), `settled` on the ground, feet `planted`,
    then `edited`.

    Clips that are not directed begin at the first movement, unlike recordings
    (`a2v.motion.beginnings`).

    Parameters
    ----------
    model : MotionModel
        One that can be directed ("cmu-fine"), with a direction.
    steps : sequence of Step
        One of them along a path.
    take : Take
        A path has its own length, and with a direction there is one clip.
    edit : Edit
    direction : Direction or None

    Raises
    ------
    InputError
        See `perform`, `edited` and `check_directed`.
    """
    after = dataclasses.replace(edit, speed=1.0)
    if direction is None and (figure := _figure(model, steps, take, speed=edit.speed)) is not None:
        return edited(figure, after)
    if direction is None:
        actions = [step.action for step in steps]
        made = _drawn(model, steps, take, edit.speed)
        made = planted(
            settled(smooth_actions(made, actions), model.card, actions),
            skeleton_of_motion(made),
            settings=planting(model.card, actions),
        )
        return edited(_rising(made, model, steps), after)
    check_directed(model, steps, direction, count=take.count)
    made = _directed(model, steps, direction, take, speed=edit.speed)
    return edited(_rising(made, model, steps), after)


def _figure(
    model: MotionModel, steps: Sequence[Step], take: Take, *, speed: float
) -> Motion | None:
    """Make clips of an action that is named after its path, or of a steady run
    (`a2v.motion.figures`), along its path; None for all other actions."""
    if (
        len(steps) != 1
        or steps[0].action not in (*NATURAL_SECONDS, *STEADY)
        or not isinstance(model.sampler, WindowSampler)
        or not model.sampler.card.steerable
    ):
        return None
    step = steps[0]
    frames = step.frames or (
        take.frames if step.seconds is None else max(1, round(step.seconds * take.fps))
    )
    seconds = frames / take.fps * speed * step.speed
    clips = []
    for number in range(take.count):
        one = dataclasses.replace(take, count=1, seed=take.seed + number)
        path, pace = _natural_way(model, step.action, seconds, one.seed)
        made = _directed(model, steps, Direction(path=path, pace=pace), one, speed=speed)
        clips.append(made.first(min(frames, made.frames)))
    return clips[0] if take.count == 1 else stack_clips(clips)


def _natural_way(
    model: MotionModel, action: str, seconds: float, seed: int
) -> tuple[GroundPath, float]:
    """Return path and pace of an action of `_figure` for a seed."""
    if action not in STEADY:
        pace = natural_speed(model, action)
        path = natural_path(action, seconds=seconds, pace=pace, fps=model.fps)
        assert path is not None
        return path, pace
    draw = np.random.default_rng([seed, len(action)])
    pace = STEADY[action] * float(np.exp(STEADY_SPREAD * draw.normal()))
    length = min(pace * (seconds + 3 / model.fps), MAX_METRES)
    return GroundPath(np.array([[0.0, 0.0], [0.0, max(length, MIN_METRES)]])), pace


def _without_wait(model: MotionModel, steps: Sequence[Step], take: Take, speed: float) -> Motion:
    """Make clips of an action whose recordings wait before it: each begins shortly before the body
    moves."""
    frames = steps[0].frames or (
        take.frames if steps[0].seconds is None else max(1, round(steps[0].seconds * take.fps))
    )
    more = frames + round(LATE_SECONDS * take.fps)
    step = dataclasses.replace(steps[0], frames=more, seconds=None)
    made = perform(
        model, [step], dataclasses.replace(take, frames=more), speed=speed, skip_rest=True
    )
    clips = [made] if take.count == 1 else [made[number] for number in range(take.count)]
    cut = []
    for clip in clips:
        begin = onset(clip.root, clip.fps)
        begin = min(begin, clip.frames - frames)
        cut.append(
            dataclasses.replace(
                clip,
                joints=clip.joints[begin : begin + frames],
                rotations=clip.rotations[begin : begin + frames],
                root=clip.root[begin : begin + frames],
            )
        )
    return cut[0] if take.count == 1 else stack_clips(cut)


def _made(model: MotionModel, steps: Sequence[Step], take: Take, speed: float) -> Motion:
    """Make clips that begin with the movement, not yet on the ground."""
    if _late(steps):
        return _without_wait(model, steps, take, speed)
    return perform(model, steps, take, speed=speed, skip_rest=True)


def _drawn(model: MotionModel, steps: Sequence[Step], take: Take, speed: float) -> Motion:
    """Make clips, and a single one of `LEAST_RISE` again until it rises so far."""
    made = _made(model, steps, take, speed)
    if take.count > 1 or len(steps) > 1 or steps[0].seed:
        return made
    least = LEAST_RISE.get(steps[0].action, -np.inf)
    for attempt in range(1, DRAWS):
        if _rise(made) >= least:
            break
        seed = take.seed + attempt * FURTHER
        made = _made(model, steps, dataclasses.replace(take, seed=seed), speed)
    return made


def _rise(motion: Motion) -> float:
    """Return how far the pelvis rises over its first height, meters."""
    height = motion.joints[:, 0, 1]
    return float(height.max() - np.median(height[:3]))


def _late(steps: Sequence[Step]) -> bool:
    """Return whether a clip of the steps begins long before its action."""
    return len(steps) == 1 and steps[0].action in LATE


def _rising(motion: Motion, model: MotionModel, steps: Sequence[Step]) -> Motion:
    """Record in the motion which of its actions go up (`a2v.animation.retarget.has_steps`)."""
    found = [rises(model.card, step.action) for step in steps]
    return (
        dataclasses.replace(motion, provenance={**motion.provenance, "rises": found})
        if any(found)
        else motion
    )


def on_feet(motion: Motion, model: MotionModel) -> Motion:
    """Plant the feet of an application's result (`a2v.motion.applications`); given poses do not
    change."""
    actions = motion.action.replace("|", ",").split(",")
    known = [name for name in actions if name in model.actions]
    return planted(
        motion,
        skeleton_of_motion(motion),
        settings=planting(model.card, known),
        kept=range(motion.given_frames or 0),
    )


def _directed(
    model: MotionModel, steps: Sequence[Step], direction: Direction, take: Take, *, speed: float
) -> Motion:
    assert isinstance(model.sampler, WindowSampler)
    way, pace, facts = None, 0.0, {}
    if direction.path is not None:
        way, pace = _way(model, steps[0].action, direction)
        frames = (
            int((len(way.points) - 1) / (model.fps * speed * steps[0].speed) * take.fps + 1e-6) + 1
        )
        steps, take = (
            [dataclasses.replace(steps[0], frames=frames, seconds=None)],
            dataclasses.replace(take, frames=frames),
        )
        facts = {"path": np.asarray(direction.path.points).round(4).tolist(), "pace": pace}
    reader = model.sampler.reader(model.bone_lengths if take.lengths is None else take.lengths)

    def steerer(moments: Moments) -> DirectionSteerer:
        return DirectionSteerer(
            direction=_timed(direction, moments.seconds),
            reader=reader,
            fps=model.fps,
            frame_of=moments.frame_of,
            way=way,
        )

    made = perform(model, steps, take, speed=speed, steerer=steerer)
    skeleton = skeleton_of_motion(made)
    timed = _timed(direction, (made.frames - 1) / take.fps)
    kept = [round(key.time * take.fps) for key in timed.keyframes if key.joints is not None]
    made = _on_ground(made, model, steps, kept=kept)
    facts |= {"keyframes": [key.time for key in timed.keyframes]} if timed.keyframes else {}
    settings = dataclasses.replace(
        planting(model.card, [step.action for step in steps]), carry=0.0, share=SLIDES_ALONG
    )
    made = hold_limbs(
        planted(made, skeleton, settings=settings, kept=kept), skeleton, direction.holds
    )
    return dataclasses.replace(made, provenance={**made.provenance, **facts})


def _on_ground(
    motion: Motion, model: MotionModel, steps: Sequence[Step], *, kept: Sequence[int]
) -> Motion:
    """Put a directed clip on the ground; given poses, at the frames `kept`, keep their height."""
    actions = [step.action for step in steps]
    if not kept:
        off = ground_offset(motion.joints[None])[0] * np.array([0, 1, 0], np.float32)
        return settled(
            dataclasses.replace(motion, joints=motion.joints - off, root=motion.root - off[0]),
            model.card,
            actions,
        )
    fixed = np.zeros(motion.frames, bool)
    fixed[list(kept)] = True
    return settled(motion, model.card, actions, kept=near(fixed, KEPT_SECONDS * motion.fps))


def _timed(direction: Direction, seconds: float) -> Direction:
    """Return the direction with its keyframes in order of time, all counted from the beginning of a
    motion of `seconds`."""
    keys = [
        dataclasses.replace(key, time=seconds - key.time, to_end=False) if key.to_end else key
        for key in direction.keyframes
    ]
    for key in keys:
        if not -1e-6 <= key.time <= seconds + 1e-6:
            raise InputError(
                f"a keyframe is at {key.time:g} s, but the motion lasts only {seconds:g} s; "
                "increase --seconds"
            )
    return dataclasses.replace(direction, keyframes=tuple(sorted(keys, key=lambda key: key.time)))


def _way(model: MotionModel, action: str, direction: Direction) -> tuple[Way, float]:
    assert direction.path is not None
    pace = natural_speed(model, action) if direction.pace is None else direction.pace
    if direction.pace is not None and not MIN_PACE <= pace <= MAX_PACE:
        raise InputError(f"pace is {pace:g} m/s; expected {MIN_PACE:g} to {MAX_PACE:g}")
    if not pace >= MIN_PACE:
        raise InputError(
            f"'{action}' travels at {pace:.2f} m/s; a path needs an action that travels, or a pace"
        )
    return way_along(direction.path, pace=pace, fps=model.fps), pace


def natural_speed(model: MotionModel, action: str) -> float:
    """Speed of the model's own clips of an action, meters per second."""
    sampler = model.sampler
    share = sampler.active_share(model.label(action)) if isinstance(sampler, WindowSampler) else 1.0
    # before clips end and the person stands
    frames = max(4, round(0.8 * share * model.card.frames))
    made = model.sample(action, frames=frames, count=SPEED_CLIPS, seed=0)
    # over half a second, so that sway does not count and turns lose nothing
    apart = max(1, min(round(0.5 * model.fps), frames - 1))
    steps = np.linalg.norm((made.root[:, apart:] - made.root[:, :-apart])[..., [0, 2]], axis=-1)
    return float(np.median(steps) / apart * model.fps)


def check_directed(
    model: MotionModel, steps: Sequence[Step], direction: Direction, *, count: int = 1
) -> None:
    """Check that the model and the steps can follow a direction, before any long computation.

    Raises
    ------
    InputError
        The model cannot be directed, it has no joint of a name, there are several steps along a
        path, or several clips are requested.
    """
    sampler = model.sampler
    if not isinstance(sampler, WindowSampler) or not sampler.card.steerable:
        raise InputError(
            f"{model.path.name} cannot be directed; choose a model that can, such as cmu-fine"
        )
    if direction.path is not None and len(steps) != 1:
        raise InputError("a path takes one action; give one --action")
    if count != 1:
        raise InputError(
            f"count is {count}, but a directed motion is one clip; give another --seed for "
            "another performance"
        )
    for hold in direction.holds:
        model.skeleton.index(hold.joint)
