"""``a2v video``: a photo and an action to a video."""

from __future__ import annotations

import dataclasses
import json
import sys
from dataclasses import dataclass
from pathlib import Path

from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.rendering.looks import LOOKS
from pipelines.answer import Answer
from pipelines.graph import Parameters, check_names, outputs_of, video_graph
from pipelines.inputs import LookOptions, MovingStages, PhotoOptions, RunOptions, check_writable
from pipelines.motion_options import MotionOptions, WayOptions
from pipelines.options import flag, group, option
from pipelines.outputs import write_node, write_results, write_shared
from pipelines.report import make_report
from pipelines.rigs import RigOptions
from pipelines.run import Outcome
from pipelines.store import Store

HELP = "Make a video of the person in a photo doing an action, seen from several sides, with a rigged character and its motion."
EXAMPLES = """examples:
  a2v video --photo me.jpg --action Walk --out out/walk
  a2v video --photo me.jpg --action "sneak for 3 s, then run away" --out out/escape       in words
  a2v video --photo me.jpg --motion dance.bvh --fps 24 --views front --size 720 --out out/dance
  a2v video --photo me.jpg --action Jump --views front,turntable --look night --aspect 16:9 --out out/jump
  a2v video --photo me.jpg --action Walk --background photo --from-photo --out out/stroll                  out of the picture
  a2v video --photo me.jpg --action Run --out out/run --only frame      only up to the frames, as PNG

The folder gets video.mp4 (the views side by side), one MP4 a view, character.glb, motion.bvh, motion.npz, preview.html
(a double click shows the character, turnable, beside the video) and report.json.
Run again after an interruption: finished frames are remembered. Another action for the same photo re-uses the character."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """What the command takes."""

    photo: PhotoOptions = group(PhotoOptions)
    out: str = option("folder for the results")
    motion: MotionOptions = group(MotionOptions)
    look: LookOptions = group(LookOptions)
    animation: str | None = option("video.gif or video.webp too", default=None, choices=("gif", "webp"), rare=True)
    max_mb: float = option("most that it may have, MB: it gets smaller and slower as needed", default=8.0, metavar="MB", rare=True)
    sheet: bool = flag("sheet.png too: twelve frames in one picture", rare=True)
    from_photo: bool = flag("begin in the photo's own pose and go over into the action")
    raw: bool = flag("leave the feet as the motion has them: no contact clean-up", rare=True)
    no_blink: bool = flag("the eyes stay open; by default the person blinks now and then", rare=True)
    start: str | None = option("compute NODE and all that follows anew", default=None, names=("--from",), metavar="NODE")
    only: str | None = option("stop at NODE and write its result", default=None, metavar="NODE")
    rigging: RigOptions = group(RigOptions)
    stages: MovingStages = group(MovingStages)
    running: RunOptions = group(RunOptions)


def run(options: Options) -> Answer:
    """Make the video."""
    graph = video_graph(recorded=options.motion.motion is not None)
    check_names(graph, [name for name in (options.start, options.only) if name], outputs_of(graph), "node")
    if options.only and (options.animation or options.sheet):
        raise InputError("--only writes one stage's result; leave --animation and --sheet out")
    if not options.max_mb > 0:
        raise InputError(f"max-mb is {options.max_mb}; expected megabytes above 0")
    store, stages = Store(options.running.cache), options.stages
    moving = stages.retarget
    moving = dataclasses.replace(moving, raw=options.raw or moving.raw, from_photo=options.from_photo or moving.from_photo)
    stages = dataclasses.replace(stages, retarget=moving)
    if options.no_blink:
        stages = dataclasses.replace(stages, blink=dataclasses.replace(stages.blink, rate=0))
    parameters = options.look.parameters(store) | options.motion.parameters() | options.photo.parameters(store, stages)
    out = check_writable(options.out)
    understood = options.motion.explained()
    for line in understood:
        print(line, file=sys.stderr)
    rigged = not options.rigging.plain
    if rigged and options.only:
        raise InputError("--only writes one stage's result, on the body's own rig; leave --rig and --root-motion out")
    exports = ["character", "poses"] if rigged else ["glb", "bvh"]
    targets = [options.only] if options.only else ["video", "clip", *exports, "motion", "subject"]
    targets += ["photo_clip"] if options.look.in_photo and not options.only else []
    transparent = parameters["render"].background == "transparent" and not options.only  # an MP4 has no alpha channel
    outcome = options.running.run([*targets, *(["frame"] if transparent else [])], parameters, graph=graph, start=options.start)
    views = parameters["render"].views
    written = (
        write_node(outcome, options.only, out, views)
        if options.only
        else write_results(outcome, out, views, options.rigging, parameters["edit"])
    )
    written += write_node(outcome, "frame", out, views) if transparent else []
    written += write_shared(out, animation=options.animation, megabytes=options.max_mb, sheet=options.sheet) if not options.only else []
    report = _write_report(options, parameters, outcome, written)
    options.running.tell_times(outcome)
    if not written:
        raise InputError(f"{options.only} gave nothing to write")
    return Answer(
        files=[*written, report],
        text=str(written[0]),
        notes=outcome.notes,
        facts={"seconds": round(outcome.seconds, 3), "understood": understood},
    )


def _write_report(options: Options, parameters: Parameters, outcome: Outcome, written: list[Path]) -> Path:
    """Write ``report.json``: what was set (the values in force, files by name), read and written."""
    motion, running = options.motion, options.running
    files = {
        "photo": options.photo.photo, "mask": options.photo.mask, "keypoints": options.photo.keypoints, "motion": motion.motion,
        "camera": options.look.camera, "timeline": motion.timeline, "keyframes": motion.keyframes,
        "look": options.look.look if options.look.look not in LOOKS else None,
    }  # fmt: skip
    inputs = {name: path for name, path in files.items() if path is not None}
    if motion.motion is None:
        inputs["model"] = parameters["model"].path
    set_ = {name: getattr(motion, name) for name in ("action", "timeline", "model", "motion", "fps", "seed")}
    set_ |= {item.name: getattr(motion, item.name) for item in dataclasses.fields(WayOptions)}
    set_ |= {"frames": parameters["frames"], "edit": parameters["edit"]}
    set_ |= {"executor": running.executor, "workers": running.workers, "start": options.start, "only": options.only}
    set_ |= {name: getattr(options.rigging, name) for name in ("rig", "root_motion")}
    names = {"render", "cameras", "scene", *(item.name for item in dataclasses.fields(options.stages))}
    stages = {name: value for name, value in parameters.items() if name in names}
    described = {**set_, "photo": Path(options.photo.photo).name, **stages}
    report = make_report(outcome, command="video", parameters=described, inputs=inputs, outputs=written)
    path = Path(options.out) / "report.json"
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(report, indent=2) + "\n")
    return path
