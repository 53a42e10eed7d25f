"""``a2v sample``: sample one motion model as the papers do: native joints, interpolation, outpainting."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.io import say, write_npz
from a2v.kinematics.resample import frames_needed
from a2v.motion import MotionModel
from a2v.motion.applications import interpolate, matching_actions, outpaint, sample_each
from a2v.motion.direct import on_feet
from a2v.motion.edit import Edit, retimed
from a2v.motion.plan import MotionPlan, make_steps
from a2v.motion.timeline import Take
from a2v.types import Motion
from pipelines.answer import Answer
from pipelines.inputs import check_writable
from pipelines.motion_clips import MAX_CLIPS, MAX_FRAMES, SEVERAL, ClipOptions, first_frames
from pipelines.motion_file import MotionFileOptions
from pipelines.options import flag, group, option
from pipelines.requests.motion import (
    AUTO,
    DurationOptions,
    EditOptions,
    PlanOptions,
    length_of,
    open_model,
    plan_length,
    read_plan,
)

HELP = "Sample one motion model, for research: joints as its data set has them, interpolations, continuations of given poses."
EXAMPLES = (
    """examples:
  a2v sample --action Walk --start mine.bvh --start-frames 10 --count 3 --out futures.mp4   go on from given poses
  a2v sample --model humanact12 --action lift_dumbbell --interpolate 5 --seed 1 --to-seed 4 --out between.png
  a2v sample --model humanact12-fine --action 'lift_dumbbell*' --out kinds.png         one clip of each action that matches
  a2v sample --model humanact12 --action jump --count 100 --native --out jump.npz     as the papers' classifiers expect it
  a2v sample --model runs/condgru/baseline.pt --action warm_up --out warm_up.mp4       of a2v train baseline, as it is"""
    + SEVERAL
)

CHECKPOINT = ".pt"
"""Suffix of the file of ``a2v train baseline``."""
LABORATORY = "pipelines.lab.baseline_motion"
"""Module that samples checkpoints, imported by name: commands know no laboratory."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    action: str = option(
        "action; several with commas for a transition, or patterns for a clip of each match"
    )
    model: str = option(
        f"name of the model, an .onnx file, or a {CHECKPOINT} of a2v train baseline; {AUTO}: the "
        "one that has the action",
        default=AUTO,
    )
    length: DurationOptions = group(DurationOptions)
    seed: int = option("seed of the motion", default=0)
    file: MotionFileOptions = group(MotionFileOptions)
    clips: ClipOptions = group(ClipOptions)
    start: str | None = option(
        "motion file, as for --bones; its poses begin every clip", default=None, metavar="FILE"
    )
    start_frames: int | None = option(
        "number of poses taken from --start (default: all)", default=None
    )
    interpolate: int = option(
        "number of rows to interpolate between the motions of --seed and --to-seed", default=0
    )
    to_seed: int | None = option("seed of the last row (default: --seed + 1)", default=None)
    native: bool = flag(
        "write an .npz of joints in the axes, unit and frame rate of the model's data set, with the first root at the origin"
    )

    @property
    def way(self) -> str:
        """How the clips are sampled: "start", "interpolate" or "a pattern"; else "".

        Raises
        ------
        InputError
            Two of them are given, or one of them with other bones.
        """
        found = [name for name in ("start", "interpolate") if getattr(self, name)]
        found += ["a pattern"] if set("*?") & set(self.action) else []
        if len(found) > 1:
            raise InputError(f"give either {' or '.join(found)}, not both")
        if found and self.clips.changed:
            raise InputError(
                f"{self.clips.changed} cannot be given with {found[0]}; it is for plain clips and "
                "transitions"
            )
        return found[0] if found else ""


def run(options: Options) -> Answer:
    """Sample the model and write the files."""
    file, length, way = options.file, options.length, options.way
    file.check()
    if options.native:
        _check_native(file)
    if Path(options.model).suffix.lower() == CHECKPOINT:
        return file.write(_of_checkpoint(options))
    plan, model = _planned(options, way)
    rate = model.fps if options.native else length.fps
    take = Take(
        frames=plan_length(plan, frames=length.frames, seconds=length.seconds, fps=rate),
        fps=rate,
        seed=options.seed,
        count=options.clips.count,
        lengths=None if way else options.clips.lengths(model),
    )
    options.clips.check(frames_needed(take.frames, model.fps * file.edits.speed, rate))
    if options.native:
        content = native(plan, model, options, take)
        check_writable(file.path.parent)
        write_npz(file.path, content)
        return Answer(files=[file.path])
    return file.write(_sampled(plan, model, options, take), plan.merged(file.edits.edit))


def _check_native(file: MotionFileOptions) -> None:
    """Refuse other files and edits with --native."""
    if file.path.suffix.lower() != ".npz" or file.rig is not None:
        raise InputError(f"cannot write {file.path}; --native writes an .npz without a rig")
    if file.edits != EditOptions():
        raise InputError("an edit cannot be given with native, which writes what the model makes")


def _planned(options: Options, way: str) -> tuple[MotionPlan, MotionModel]:
    """Plan the actions of a single model; the interpretation of the words is printed."""
    if way == "a pattern":
        model = open_model(options.model)
        return MotionPlan((), (), model), model
    plan = read_plan(PlanOptions(action=options.action, model=options.model))
    if plan.model is None:
        what = ", ".join(step.action for step in plan.steps)
        raise InputError(
            f"sample needs a single model, and {what} use {', '.join(plan.sources)}; name one with "
            "--model, or use a2v motion"
        )
    for line in plan.lines():
        say(line)
    return plan, plan.model


def _sampled(plan: MotionPlan, model: MotionModel, options: Options, take: Take) -> Motion:
    """Sample the clips in their tempo and at the rate of `take`."""
    speed, way = options.file.edits.speed, options.way
    if not way:
        return make_steps(model, plan.steps, take, edit=Edit(speed=speed))
    frames = frames_needed(take.frames, model.fps * speed, take.fps)
    made = retimed(_application(plan, model, options, frames), fps=take.fps, speed=speed)
    made = made.first(min(made.frames, take.frames))
    return made if options.native else on_feet(made, model)


def _application(plan: MotionPlan, model: MotionModel, options: Options, frames: int) -> Motion:
    """Sample the clips of --start, --interpolate or a pattern at the model's own rate."""
    seed, names = options.seed, [step.action for step in plan.steps]
    if options.start is not None:
        start = first_frames(options.start, options.start_frames)
        return outpaint(model, start, names, frames=frames, count=options.clips.count, seed=seed)
    if options.interpolate:
        if len(names) > 1:
            raise InputError("--interpolate blends two motions of one action; give one --action")
        last = seed + 1 if options.to_seed is None else options.to_seed
        return interpolate(
            model, names[0], seeds=(seed, last), rows=options.interpolate, frames=frames
        )
    found = [
        action
        for name in options.action.split(",")[:MAX_CLIPS]
        for action in matching_actions(model, name.strip())
    ]
    if len(found) * frames > MAX_FRAMES or len(found) > MAX_CLIPS:
        raise InputError(
            f"the patterns match {len(found)} times; expected at most {min(MAX_CLIPS, MAX_FRAMES // frames)} clips"
        )
    return sample_each(model, found, frames=frames, seed=seed)


def native(plan: MotionPlan, model: MotionModel, options: Options, take: Take) -> dict[str, object]:
    """Return the arrays of --native in the native frame and unit.

    They are ``joints`` (..., T, J, 3), ``labels`` (..., T), and the meanings of the labels.
    """
    names = [model.actions[model.label(step.action)] for step in plan.steps]
    if len(names) == 1 and not options.way:
        action = names[0]
        joints = model.sample_native(
            action, frames=take.frames, count=take.count, seed=take.seed, lengths=take.lengths
        )
        joints = joints if take.count > 1 else joints[0]
        labels = np.broadcast_to(model.frame_labels(names, take.frames), joints.shape[:-2])
    else:
        made = _sampled(plan, model, options, take)
        joints, action = model.to_native(made.joints), made.action
        clips = [model.frame_labels(part.split(","), made.frames) for part in action.split("|")]
        labels = np.broadcast_to(np.stack(clips) if len(clips) > 1 else clips[0], joints.shape[:-2])
    skeleton = model.skeleton
    return {
        "joints": joints, "labels": np.ascontiguousarray(labels, dtype=np.int64), "actions": np.asarray(model.actions), "action": action,
        "dataset": model.card.dataset, "fps": model.fps, "seed": options.seed, "parents": skeleton.parents,
        "joint_names": np.asarray(skeleton.joint_names), "meters_per_unit": model.card.meters_per_unit,
        "native_signs": np.asarray(model.card.native_signs), "model_digest": model.digest,
    }  # fmt: skip


def _of_checkpoint(options: Options) -> Motion:
    """Sample one action of a file of ``a2v train baseline``.

    Raises
    ------
    InputError
        Options that a baseline cannot take, an unknown action, or the file cannot be used.
    """
    length = options.length
    if other := options.way or options.clips.changed or ("native" if options.native else ""):
        raise InputError(f"{other} cannot be given with a baseline's checkpoint; leave it out")
    cut = length.frames is not None or length.seconds is not None
    made: Motion = importlib.import_module(LABORATORY).baseline_motion(
        options.model,
        options.action,
        frames=length_of(frames=length.frames, seconds=length.seconds, fps=length.fps)
        if cut
        else None,
        fps=length.fps,
        speed=options.file.edits.speed,
        count=options.clips.count,
        seed=options.seed,
    )
    return made
