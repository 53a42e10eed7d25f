"""``a2v motion``: generate motion files from an action."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING, dataclass, fields, replace
from pathlib import Path

import numpy as np

from a2v.animation import RIGS
from a2v.errors import InputError
from a2v.formats.registry import (
    MOTION_FORMATS,
    readable_motions,
    suffixes_of,
    write_motion,
    writer_of,
)
from a2v.io import brief, say, write_npz
from a2v.kinematics.resample import frames_needed
from a2v.motion import MotionModel
from a2v.motion.applications import (
    interpolate,
    matching_actions,
    outpaint,
    sample_each,
)
from a2v.motion.direct import on_feet
from a2v.motion.edit import Edit, check_speed, edited, retimed
from a2v.motion.plan import MotionPlan, make_steps
from a2v.motion.prompts import Step
from a2v.motion.timeline import Take
from a2v.rendering.stickfigure import DRAWN_FORMATS
from a2v.types import Motion
from pipelines.answer import Answer
from pipelines.filmed_folder import follow_folder
from pipelines.inputs import RunOptions, check_writable
from pipelines.motion_bones import bone_scale, first_frames, own_bones
from pipelines.motion_checkpoint import motion_of_checkpoint
from pipelines.motion_film import FilmedOptions, Made, follow_video
from pipelines.motion_page import PageOptions, write_page
from pipelines.options import flag, group, option
from pipelines.requests.motion import (
    EditOptions,
    PlanOptions,
    open_model,
    plan_length,
    read_plan,
)
from pipelines.requests.ways import WayOptions, read_clip_direction, read_direction
from pipelines.rigs import ROOT_MOTION, RigOptions, rig_of_motions, write_rigged_motion

HELP = "Generate motions of one or several actions and write them as .npz, .bvh, .fbx, .glb, .vrma, or pictures and videos of stick figures."
EXAMPLES = """examples:
  a2v motion --action Walk --out walk.npz
  a2v motion --action Walk,Jump --seconds 8 --out walk-jump.bvh        a transition
  a2v motion --model humanact12 --action throw --count 20 --seed 7 --out throw.npz   one file, a leading 20
  a2v motion --action Walk --count 6 --out walks.mp4                    side by side; also .gif, and .png for rows of poses
  a2v motion --action Walk --start mine.bvh --start-frames 10 --count 3 --out futures.mp4   go on from given poses
  a2v motion --model humanact12 --action lift_dumbbell --interpolate 5 --seed 1 --to-seed 4 --out between.png
  a2v motion --model runs/condgru/baseline.pt --action warm_up --out warm_up.mp4       of a2v train baseline, as it is
  a2v motion --model humanact12-fine --action 'lift_dumbbell*' --out kinds.png         one clip of each action that matches
  a2v motion --action Walk --bone-scale legs=1.3,arms=0.8 --out giant.bvh
  a2v motion --action Walk --bones mine.bvh --out my-walk.bvh           with the bone lengths of the person in a file
  a2v motion --action Walk --rig mixamo --root-motion --out walk.bvh    on another tool's bones; also .fbx and .glb
  a2v motion --action Walk --rig smpl --out walk.npz                    in AMASS's layout; walk.vrma is a VRM animation
  a2v motion --action "sneak for 3 s, then run away" --out escape.bvh         in words
  a2v motion --action Walk --path "0,0 0,3 3,3 3,6" --out way.bvh    along a path over the ground
  a2v motion --action Walk --start-pose "a.npz#30" --end-pose b.bvh --seconds 3 --out b2.bvh   also --keyframes FILE, --hold
  a2v motion --from-video clip.mp4 --out me.bvh                         the person in a video; --seconds 10, --follow.start 4
  a2v motion --from-video clips --out my_actions        clips/ACTION/*.mp4 to my_actions/ACTION/*.bvh for a2v train flow --dataset bvh
  a2v motion --action Walk --loop --in-place --out cycle.bvh                          for game engines; --mirror, --speed 1.5
  a2v motion --model humanact12 --action jump --count 100 --native --out jump.npz     as the papers' classifiers expect it
  a2v motion --page motions.html --character me.glb                     a page that makes them itself, in the browser

With several clips an .npz holds all of them with a leading dimension, .bvh become numbered files, pictures and videos show
them beside each other."""

FORMATS = (*MOTION_FORMATS, *DRAWN_FORMATS)
"""Suffixes of --out: motion files, and drawings."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    plan: PlanOptions = group(PlanOptions)
    way: WayOptions = group(WayOptions)
    out: str = option(f"file to write: {', '.join((*suffixes_of(FORMATS), '.vrma'))}", default="")
    count: int = option("number of clips", default=1)
    bone_scale: float | str = option(
        "factor for all bone lengths, or PART=FACTOR,... (arms, legs, torso, head, or a joint)",
        default=1.0,
        metavar="FACTOR",
    )
    bones: str | None = option(
        f"motion file ({readable_motions(', ')}); use its bone lengths",
        default=None,
        metavar="FILE",
    )
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
    rig: str | None = option(
        f"write a .bvh, .fbx or .glb of an adult of average build with the bones of another tool: {', '.join(RIGS)}; smpl with .npz is AMASS's layout",
        default=None,
        choices=RIGS,
        metavar="RIG",
    )
    root_motion: bool = flag(f"with --rig: {ROOT_MOTION}")
    edits: EditOptions = group(EditOptions)
    paging: PageOptions = group(PageOptions)
    filmed: FilmedOptions = group(FilmedOptions, "motion from a video")
    running: RunOptions = group(RunOptions, "execution of --from-video")
    native: bool = flag(
        "write an .npz of joints in the axes, unit and frame rate of the model's data set, with the first root at the origin"
    )

    def frames_written(self, plan: MotionPlan) -> int:
        """Number of frames of a written clip."""
        fps = self.plan.fps if plan.model is None else self.rate(plan.model)
        return plan_length(plan, frames=self.plan.frames, seconds=self.plan.seconds, fps=fps)

    def length(self, model: MotionModel) -> int:
        """Number of frames of a clip at the model's own rate."""
        return frames_needed(
            self.frames_written(MotionPlan((), (), model)),
            model.fps * self.edits.speed,
            self.rate(model),
        )

    def rate(self, model: MotionModel) -> float:
        """Frames per second of the written file."""
        return model.fps if self.native else self.plan.fps


MAX_FRAMES = 1_500_000
"""Maximum number of frames of all clips together, about a gigabyte."""
FILMED = ("plan", "way", "out", "rig", "root_motion", "edits", "filmed", "running", "paging")
"""Options that may be combined with a video."""
MAX_CLIPS = 10_000
"""Maximum number of clips, of any length: a flow makes a whole window for each."""


def run(options: Options) -> Answer:
    """Generate the motion and write its files."""
    if options.paging.page is not None:
        others = [
            item.name
            for item in fields(options)
            if item.default is not MISSING and getattr(options, item.name) != item.default
        ]
        return write_page(
            options.paging,
            options.plan,
            [
                *others,
                *_given(options.way),
                *([] if options.edits == EditOptions() else ["an edit"]),
            ],
        )
    if not options.out or options.paging.character is not None:
        raise InputError(
            "no output given; name a file with --out, or a page with --page (--character requires --page)"
        )
    path = Path(options.out)
    if options.filmed.from_video is not None and Path(options.filmed.from_video).is_dir():
        return _folder(options, path)
    rigged = rig_of_motions(path, options.rig, options.root_motion, native=options.native)
    if rigged is None:
        writer_of(path, FORMATS)
    if options.native and path.suffix.lower() != ".npz":
        raise InputError(f"cannot write {path}; --native writes an .npz")
    if options.count > MAX_CLIPS:
        raise InputError(f"count is {brief(options.count)}; expected at most {MAX_CLIPS:,} clips")
    check_speed(options.edits.speed)
    if options.filmed.from_video is not None:
        return _written(_filmed(options, options.filmed), path, rigged, options.edits.edit)
    if Path(options.plan.model).suffix.lower() == ".pt":
        speed, others = options.edits.speed, _others(options, ("count", *FILMED))
        sampled = motion_of_checkpoint(options.plan, speed, options.count, others)
        return _written(Made(sampled), path, rigged, options.edits.edit)
    asked = _planned(options)
    frames = options.frames_written(asked) if asked.model is None else options.length(asked.model)
    if options.count * frames > MAX_FRAMES:
        raise InputError(
            f"{options.count} clips of {frames} frames; expected at most {MAX_FRAMES:,} frames in all"
        )
    if options.native:
        content = native(asked, options)
        check_writable(path.parent)
        write_npz(path, content)
        return Answer(files=[path])
    edit = asked.merged(options.edits.edit)
    return _written(Made(generate(asked, options)), path, rigged, edit)


def _filmed(options: Options, filmed: FilmedOptions) -> Made:
    """Track the person in a video, and return the motion."""
    others = _others(options, FILMED)
    return follow_video(filmed, options.plan, options.edits.edit, options.running, others)


def _others(options: Options, taken: Sequence[str]) -> list[str]:
    """Return the names of the options that are given but not taken."""
    own = [
        item.name
        for item in fields(options)
        if item.name not in taken and getattr(options, item.name) != item.default
    ]
    return [*own, *_given(options.way)]


def _folder(options: Options, out: Path) -> Answer:
    """Track one person in each video of a folder, and write the motions."""
    rigged = rig_of_motions(
        out.with_suffix(".bvh"), options.rig, options.root_motion, native=options.native
    )
    return follow_folder(
        options.filmed,
        out,
        lambda filmed: _filmed(options, filmed),
        lambda made, path: _written(made, path, rigged, options.edits.edit),
        rigged=rigged is not None,
    )


def _written(made: Made, path: Path, rigged: RigOptions | None, edit: Edit) -> Answer:
    """Edit a motion that has its final tempo, and write it."""
    check_writable(path.parent)
    if rigged is None:
        motion = edited(made.motion, replace(edit, speed=1.0))
        written = write_motion(path, motion, FORMATS)
    else:
        motion = edited(made.motion, replace(edit, speed=1.0, in_place=False))
        written = write_rigged_motion(path, motion, rigged, edit)
    facts = {
        "action": motion.action,
        "frames": motion.frames,
        "fps": float(motion.fps),
        **made.facts,
    }
    return Answer(files=written, notes=made.notes, facts=facts)


def _planned(options: Options) -> MotionPlan:
    """Plan the requested actions; a pattern needs a single model.

    The interpretation of the words is printed to standard error.
    """
    if any(sign in options.plan.action for sign in "*?"):
        return MotionPlan((), (), open_model(options.plan.model))
    plan = read_plan(options.plan, directed=options.way.given)
    if plan.model is None:
        alone = [
            name for name in ("start", "interpolate", "bones", "native") if getattr(options, name)
        ]
        alone += ["bone_scale"] if options.bone_scale != 1.0 else []
        if alone:
            what = ", ".join(step.action for step in plan.steps)
            raise InputError(
                f"{alone[0]} needs a single model, and {what} use {', '.join(plan.sources)}; "
                f"leave {alone[0]} out"
            )
    for line in plan.lines():
        say(line)
    return plan


def generate(asked: MotionPlan, options: Options) -> Motion:
    """Generate the requested clips in their tempo and at their frame rate, without edits.

    Raises
    ------
    InputError
        Options that exclude each other, an unknown action, an unusable file, or a number out of
        range.
    """
    alone = [name for name in ("start", "interpolate") if getattr(options, name)]
    alone += ["a pattern"] if "*" in options.plan.action or "?" in options.plan.action else []
    if len(alone) > 1:
        raise InputError(f"give either {' or '.join(alone)}, not both")
    changed = [
        name
        for name, default in (("bone_scale", 1.0), ("bones", None))
        if getattr(options, name) != default
    ]
    if alone and changed:
        raise InputError(
            f"{changed[0]} cannot be given with {alone[0]}; it is for plain clips and transitions"
        )
    plan, speed, model = options.plan, options.edits.speed, asked.model
    if model is None:
        clip_way = None
        if options.way.given:
            clip_way = read_clip_direction(options.way, [step.action for step in asked.steps])
        take = Take(
            frames=options.frames_written(asked),
            fps=plan.fps,
            seed=plan.seed,
            count=options.count,
        )
        return make_steps(None, asked.steps, take, edit=Edit(speed=speed), direction=clip_way)
    if options.way.given or options.way.pace is not None or not alone:
        if alone:
            raise InputError(
                f"{alone[0]} cannot be given with a direction; leave {' and '.join(_given(options.way))} out"
            )
        lengths = own_bones(model, options.bones, options.bone_scale)
        lengths = model.scaled_bones(bone_scale(options.bone_scale)) if lengths is None else lengths
        direction = read_direction(
            model, asked.steps, options.way, fps=options.rate(model), count=options.count
        )
        take = Take(
            frames=options.frames_written(asked),
            fps=options.rate(model),
            seed=plan.seed,
            count=options.count,
            lengths=lengths,
        )
        return make_steps(model, asked.steps, take, edit=Edit(speed=speed), direction=direction)
    made = retimed(
        _application(model, asked.steps, options, alone[0]), fps=options.rate(model), speed=speed
    )
    made = made.first(min(made.frames, options.frames_written(asked)))
    return made if options.native else on_feet(made, model)


def _application(model: MotionModel, steps: Sequence[Step], options: Options, which: str) -> Motion:
    """Generate the clips of --start, --interpolate or a pattern at the model's own rate."""
    frames = options.length(model)
    if which == "a pattern":
        found = [
            action
            for name in options.plan.action.split(",")[:MAX_CLIPS]
            for action in matching_actions(model, name.strip())
        ]
        if len(found) * frames > MAX_FRAMES or len(found) > MAX_CLIPS:
            raise InputError(
                f"the patterns match {len(found)} times; expected at most {min(MAX_CLIPS, MAX_FRAMES // frames)} clips"
            )
        return sample_each(model, found, frames=frames, seed=options.plan.seed)
    names = [step.action for step in steps]
    if which == "start":
        assert options.start is not None
        start = first_frames(options.start, options.start_frames)
        return outpaint(
            model, start, names, frames=frames, count=options.count, seed=options.plan.seed
        )
    if len(names) > 1:
        raise InputError("--interpolate blends two motions of one action; give one --action")
    last = options.plan.seed + 1 if options.to_seed is None else options.to_seed
    return interpolate(
        model, names[0], seeds=(options.plan.seed, last), rows=options.interpolate, frames=frames
    )


def _given(way: WayOptions) -> list[str]:
    return [item.name for item in fields(way) if getattr(way, item.name) is not None]


def native(asked: MotionPlan, options: Options) -> dict[str, object]:
    """Return the arrays of --native in the native frame and unit.

    They are ``joints`` (..., T, J, 3), ``labels`` (..., T), and the meanings of the labels.
    """
    model = asked.model
    assert model is not None
    names = [model.actions[model.label(step.action)] for step in asked.steps]
    frames = options.length(model)
    plain = len(names) == 1 and not options.start and not options.interpolate
    if plain:
        own = own_bones(model, options.bones, options.bone_scale)
        lengths = model.scaled_bones(bone_scale(options.bone_scale)) if own is None else own
        joints = model.sample_native(
            names[0], frames=frames, count=options.count, seed=options.plan.seed, lengths=lengths
        )
        joints = joints if options.count > 1 else joints[0]
        labels = np.broadcast_to(model.frame_labels(names, frames), joints.shape[:-2])
        action = names[0]
    else:
        made = generate(asked, options)
        joints, action = model.to_native(made.joints), made.action
        clips = [model.frame_labels(part.split(","), made.frames) for part in action.split("|")]
        labels = np.broadcast_to(np.stack(clips) if len(clips) > 1 else clips[0], joints.shape[:-2])
    skeleton = model.skeleton
    return {
        "joints": joints, "labels": np.ascontiguousarray(labels, dtype=np.int64), "actions": np.asarray(model.actions), "action": action,
        "dataset": model.card.dataset, "fps": model.fps, "seed": options.plan.seed, "parents": skeleton.parents,
        "joint_names": np.asarray(skeleton.joint_names), "meters_per_unit": model.card.meters_per_unit,
        "native_signs": np.asarray(model.card.native_signs), "model_digest": model.digest,
    }  # fmt: skip
