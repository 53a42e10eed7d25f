"""``a2v video``: a photo and an action to a video."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from a2v.errors import InputError
from a2v.io import atomic_path

HELP = "Make a video of the person in a photo doing an action, seen from several sides, with a rigged character and its motion."
EXAMPLES = """examples:
  a2v video --photo me.jpg --action Walk --out out/walk
  a2v video --photo me.jpg --action Walk,Jump --model cmu --frames 90 --out out/walk-jump
  a2v video --photo me.jpg --motion dance.bvh --fps 24 --views front --size 720 --out out/dance
  a2v video --photo me.jpg --action Jump --views front,turntable --background "#30506f" --out out/jump
  a2v video --photo me.jpg --action Jump --camera cameras.yaml --background transparent --out out/cut
  a2v video --photo me.jpg --action Run --out out/run --only frame      only up to the frames, as PNG
  a2v video --photo me.jpg --action Run --out out/run --from colored    colours and all after them anew

The folder gets video.mp4 (the views side by side), one MP4 a view, character.glb, motion.bvh, motion.npz, preview.html
(a double click shows the character, turnable, beside the video) and report.json.
Run it again after an interruption: finished frames are remembered. Another action for the same photo re-uses the character."""


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    from a2v.formats.registry import readable_motions
    from pipelines.inputs import add_model_argument, add_photo_arguments, add_render_arguments, add_run_arguments, add_stage_arguments

    parser.add_argument("--out", required=True, help="folder for the results")
    parser.add_argument("--action", default="", help="what to do; several with commas follow each other (a2v actions lists them)")
    add_model_argument(parser)
    parser.add_argument("--motion", type=str | None, default=None, help=f"recorded motion instead of a model: {readable_motions()}")
    parser.add_argument("--frames", type=int, default=60, help="frames of motion")
    parser.add_argument("--fps", type=float | None, default=None, help="resample the motion to this many frames a second (same duration)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the motion: another seed, another performance")
    add_render_arguments(parser)
    parser.add_argument("--raw", action="store_true", help="leave the feet as the motion has them: no contact clean-up")
    parser.add_argument(
        "--from", dest="start", type=str | None, default=None, metavar="NODE", help="compute NODE and all that follows anew"
    )
    parser.add_argument("--only", type=str | None, default=None, metavar="NODE", help="stop at NODE and write its result")
    add_photo_arguments(parser)
    add_stage_arguments(parser, ["perception", "fit", "shape", "color", "bind", "retarget", "deform"])
    add_run_arguments(parser)


def run(settings: Any) -> int:
    """Make the video; print its path last."""
    import dataclasses

    from pipelines.graph import check_names, outputs_of, video_graph
    from pipelines.inputs import check_writable, motion_inputs, photo_parameters, render_parameters, stages_of
    from pipelines.outputs import write_node, write_results
    from pipelines.progress import Bars
    from pipelines.report import make_report, table
    from pipelines.run import run as run_graph
    from pipelines.store import Store

    graph = video_graph(recorded=settings.motion is not None)
    check_names(graph, [name for name in (settings.start, settings.only) if name], outputs_of(graph), "node")
    store = Store(settings.cache)
    stages = stages_of(settings)
    if settings.raw:
        stages["retarget"] = dataclasses.replace(stages["retarget"], raw=True)
    params = render_parameters(store, settings) | motion_inputs(
        **{name: getattr(settings, name) for name in ("action", "model", "motion", "frames", "seed", "fps")}
    )
    params |= photo_parameters(store, settings.photo, mask=settings.mask, keypoints=settings.keypoints, **stages)
    out = check_writable(settings.out)
    targets = [settings.only] if settings.only else ["video", "clip", "glb", "bvh", "motion", "subject"]
    transparent = params["render"].background == "transparent"
    if transparent and not settings.only:
        targets.append("frame")
    bars = Bars(quiet=settings.quiet)
    try:
        outcome = run_graph(
            targets,
            graph=graph,
            executor=settings.executor,
            workers=settings.workers,
            address=settings.address,
            store=store,
            start=settings.start,
            progress=bars,
            **params,
        )
    finally:
        bars.close()
    if settings.only:
        written = write_node(outcome, settings.only, out, params["render"].views)
    else:
        written = write_results(outcome, out, params["render"].views)
        if transparent:  # an MP4 has no alpha channel
            written += write_node(outcome, "frame", out, params["render"].views)
    inputs = {name: value for name in ("photo", "mask", "keypoints", "motion", "camera") if (value := getattr(settings, name)) is not None}
    if settings.motion is None:
        inputs["model"] = params["model"].path
    report = make_report(outcome, command="video", parameters=described(settings, params), inputs=inputs, outputs=written)
    with atomic_path(out / "report.json") as temporary:
        temporary.write_text(json.dumps(report, indent=2) + "\n")
    import sys

    if not settings.quiet:
        print(table(outcome), file=sys.stderr)
    for text in outcome.notes:
        print(f"note: {text}", file=sys.stderr)
    if not written:
        raise InputError(f"{settings.only} gave nothing to write")
    print(written[0])
    return 0


def described(settings: Any, params: dict[str, Any]) -> dict[str, Any]:
    """What was set, for the report: the values in force, files by name."""
    names = ("action", "model", "motion", "frames", "fps", "seed", "executor", "workers", "start", "only")
    flat = {name: getattr(settings, name) for name in names}
    stages = {
        name: value
        for name, value in params.items()
        if name in ("perception", "fit", "shape", "color", "bind", "retarget", "deform", "render", "cameras")
    }
    return {**flat, "photo": Path(settings.photo).name, **stages}
