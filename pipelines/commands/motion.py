"""``a2v motion``: generate motion files from an action."""

from __future__ import annotations

from dataclasses import dataclass

from a2v.errors import InputError
from a2v.io import say
from a2v.kinematics.resample import frames_needed
from a2v.motion.edit import Edit
from a2v.motion.plan import MotionPlan, make_steps
from a2v.motion.timeline import Take
from pipelines.answer import Answer
from pipelines.motion_clips import SEVERAL, ClipOptions
from pipelines.motion_file import MotionFileOptions
from pipelines.options import group
from pipelines.requests.motion import PlanOptions, plan_length, read_plan
from pipelines.requests.ways import WayOptions, direction_of

HELP = "Generate motions of one or several actions and write them as .npz, .bvh, .fbx, .glb, .vrma, or pictures and videos of stick figures."
EXAMPLES = (
    """examples:
  a2v motion --action Walk --out walk.npz
  a2v motion --action Walk,Jump --seconds 8 --out walk-jump.bvh        a transition
  a2v motion --model humanact12 --action throw --count 20 --seed 7 --out throw.npz   one file, a leading 20
  a2v motion --action Walk --count 6 --out walks.mp4                    side by side; also .gif, and .png for rows of poses
  a2v motion --action Walk --bone-scale legs=1.3,arms=0.8 --out giant.bvh
  a2v motion --action Walk --bones mine.bvh --out my-walk.bvh           with the bone lengths of the person in a file
  a2v motion --action Walk --rig mixamo --root-motion --out walk.bvh    on another tool's bones; also .fbx and .glb
  a2v motion --action Walk --rig smpl --out walk.npz                    in AMASS's layout; walk.vrma is a VRM animation
  a2v motion --action "sneak for 3 s, then run away" --out escape.bvh         in words
  a2v motion --action Walk --path "0,0 0,3 3,3 3,6" --out way.bvh    along a path over the ground
  a2v motion --action Walk --start-pose "a.npz#30" --end-pose b.bvh --seconds 3 --out b2.bvh   also --keyframes FILE, --hold
  a2v motion --action Walk --loop --in-place --out cycle.bvh                          for game engines; --mirror, --speed 1.5

a2v follow makes motions from videos, a2v sample goes on from given poses."""
    + SEVERAL
)


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    plan: PlanOptions = group(PlanOptions)
    way: WayOptions = group(WayOptions)
    file: MotionFileOptions = group(MotionFileOptions)
    clips: ClipOptions = group(ClipOptions)


def run(options: Options) -> Answer:
    """Generate the motion and write its files."""
    asked, speed = options.plan, options.file.edits.speed
    options.file.check()
    plan = _planned(options)
    for line in plan.lines():
        say(line)
    frames = plan_length(plan, frames=asked.frames, seconds=asked.seconds, fps=asked.fps)
    model = plan.model
    options.clips.check(
        frames if model is None else frames_needed(frames, model.fps * speed, asked.fps)
    )
    take = Take(
        frames=frames,
        fps=asked.fps,
        seed=asked.seed,
        count=options.clips.count,
        lengths=None if model is None else options.clips.lengths(model),
    )
    direction = direction_of(plan, options.way, fps=take.fps, count=take.count)
    made = make_steps(model, plan.steps, take, edit=Edit(speed=speed), direction=direction)
    return options.file.write(made, plan.merged(options.file.edits.edit))


def _planned(options: Options) -> MotionPlan:
    """Plan the requested actions; other bones need a single model."""
    plan, changed = read_plan(options.plan, directed=options.way.given), options.clips.changed
    if plan.model is None and changed:
        what = ", ".join(step.action for step in plan.steps)
        raise InputError(
            f"{changed} needs a single model, and {what} use {', '.join(plan.sources)}; leave "
            f"{changed} out"
        )
    return plan
