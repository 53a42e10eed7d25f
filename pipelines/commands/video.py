"""``a2v video``: make a video from a photo and an action."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from a2v.errors import InputError
from a2v.io import atomic_path, claim, say
from pipelines.answer import Answer
from pipelines.bone_maps import written_map
from pipelines.engine.graph import check_names, outputs_of
from pipelines.engine.run import Outcome
from pipelines.engine.store import Store
from pipelines.inputs import RunOptions, check_writable
from pipelines.options import flag, group, option
from pipelines.outputs import write_early_page, write_node, write_results, write_shared
from pipelines.report import make_report
from pipelines.requests.film import FilmRequest
from pipelines.requests.motion import MotionRequest
from pipelines.requests.papers import PAPERS, parts_used, with_checkpoints
from pipelines.requests.person import PersonRequest
from pipelines.requests.video import Resolved, VideoRequest
from pipelines.rigs import RigOptions
from pipelines.sprites import seen_around, write_sprites

HELP = "Make a video of the person in a photo doing an action, seen from several sides, and write the rigged character and its motion."
EXAMPLES = """examples:
  a2v video --photo me.jpg --action Walk --out out/walk                   with --papers: as the two papers do it
  a2v video --photo me.jpg --action "sneak for 3 s, then run away" --out out/escape       in words
  a2v video --photo me.jpg --motion dance.bvh --fps 24 --views front --size 720 --out out/dance
  a2v video --photo me.jpg --action Jump --views front,turntable --look night --aspect 16:9 --out out/jump
  a2v video --photo me.jpg --action Walk --background photo --from-photo --out out/stroll                  out of the picture
  a2v video --photo me.jpg --action Run --out out/run --only frame      only up to the frames, as PNG

The folder gets video.mp4 (the views side by side), one MP4 per view, character.glb, motion.bvh, motion.npz, preview.html
(a double click shows the character, turnable, beside the video) and report.json.
Run again after an interruption: finished frames are remembered. Another action for the same photo reuses the character."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    papers: bool = flag(
        "the papers' way: their VAE's motion, a fused character, colors by their equation alone, "
        "four still cameras; other options replace its parts (docs/papers.md)",
        rare=True,
        sets=PAPERS,
    )
    person: PersonRequest = group(PersonRequest, "the person")
    out: str = option("folder to write to")
    motion: MotionRequest = group(MotionRequest, "the motion")
    film: FilmRequest = group(FilmRequest, "the film")
    animation: str | None = option(
        "also write video.gif or video.webp", default=None, choices=("gif", "webp"), rare=True
    )
    max_mb: float = option(
        "maximum size of that file, MB; its pictures and frame rate are reduced to fit",
        default=8.0,
        metavar="MB",
        rare=True,
    )
    sprites: int = option(
        "also write sprites.png and sprites.json: every frame from 8 (1, 2, 4, 16) directions, on "
        "nothing; 0: none",
        default=0,
        metavar="NUMBER",
        rare=True,
    )
    sheet: bool = flag("also write sheet.png: twelve frames in one picture", rare=True)
    start: str | None = option(
        "compute NODE and everything after it again",
        default=None,
        names=("--from",),
        metavar="NODE",
    )
    only: str | None = option("stop after NODE and write its result", default=None, metavar="NODE")
    rigging: RigOptions = group(RigOptions, "exported files")
    running: RunOptions = group(RunOptions, "execution")

    @property
    def request(self) -> VideoRequest:
        """The requested video."""
        made = VideoRequest(person=self.person, motion=self.motion, film=self.film)
        made = with_checkpoints(made) if self.papers else made
        return seen_around(made, self.sprites) if self.sprites else made


def run(options: Options) -> Answer:
    """Make the video; first print the interpretation of the words of the action."""
    return make(options, tell=say)


def make(options: Options, *, tell: Callable[[str], object]) -> Answer:
    """Make the video.

    Before a long computation starts, `tell` is called with the interpretation of the words of the
    action.
    """
    if (answer := written_map(options.motion.motion_bone_map, options.motion.motion)) is not None:
        return answer
    resolved = options.request.resolve(Store(options.running.cache))
    graph = resolved.graph
    check_names(
        graph, [name for name in (options.start, options.only) if name], outputs_of(graph), "node"
    )
    if options.only and (options.animation or options.sheet or options.sprites):
        raise InputError(
            "--only writes the result of one node; leave --animation, --sheet and --sprites out"
        )
    if not options.max_mb > 0:
        raise InputError(f"max-mb is {options.max_mb}; expected more than 0")
    out = check_writable(options.out)
    for line in resolved.understood:
        tell(line)
    for line in parts_used(options.request, resolved) if options.papers else ():
        tell(line)
    with claim(out):
        return _make(options, resolved, out)


def _make(options: Options, resolved: Resolved, out: Path) -> Answer:
    """Compute the requested results and write them to `out`."""
    graph, parameters = resolved.graph, resolved.parameters
    rigged = not options.rigging.plain
    if rigged and options.only:
        raise InputError(
            "--only writes the result of one node on the body's own rig; leave --rig and "
            "--root-motion out"
        )
    exports = ["engine_character", "poses", "props"] if rigged else ["glb", "bvh"]
    targets = [options.only] if options.only else ["video", "clip", *exports, "motion", "subject"]
    targets += ["photo_clip"] if options.film.in_photo and not options.only else []
    transparent = (
        parameters["render"].background == "transparent" and not options.only
    )  # An MP4 has no alpha channel.
    early = (
        {} if options.only else {"glb": functools.partial(_show_early, out, options.running.quiet)}
    )
    outcome = options.running.run(
        [*targets, *(["frame"] if transparent else [])],
        parameters,
        graph=graph,
        start=options.start,
        early=early,
    )
    views = parameters["render"].views
    written = (
        write_node(outcome, options.only, out, views)
        if options.only
        else write_results(outcome, out, views, options.rigging, parameters["edit"])
    )
    if options.sprites:
        written += write_sprites(out, outcome, views, options.motion.fps)
    elif transparent:
        written += write_node(outcome, "frame", out, views)
    written += (
        write_shared(
            out,
            animation=options.animation,
            megabytes=options.max_mb,
            sheet=options.sheet,
            caption=caption_of(outcome),
        )
        if not options.only
        else []
    )
    report = _write_report(options, resolved, outcome, written)
    options.running.tell_times(outcome)
    if not written:
        raise InputError(f"the node {options.only} has no result to write")
    options.running.tell_made([*written, report], outcome.seconds)
    return Answer(
        files=[*written, report],
        text=str(written[0]),
        notes=outcome.notes,
        facts={"seconds": round(outcome.seconds, 3), "understood": list(resolved.understood)},
    )


def caption_of(outcome: Outcome) -> list[str]:
    """Return lines about the fit to the photo for the contact sheet; none without a photo."""
    from a2v.body import summary

    names = [name for name in ("joint_fit", "photo_body") if name in outcome.nodes]
    return summary(outcome.nodes[names[0]].measures) if names else []


def _show_early(out: Path, quiet: bool, outcome: Outcome) -> None:
    """Write the page with the moving character before the frames are rendered; print its path."""
    write_early_page(outcome, out)
    if not quiet:
        say(
            f"the moving character can be seen in {out / 'preview.html'} after {outcome.seconds:.0f} s; the "
            "video follows"
        )


def _write_report(
    options: Options, resolved: Resolved, outcome: Outcome, written: list[Path]
) -> Path:
    """Write ``report.json``: the request, the values used, and the files read and written."""
    request, running, parameters = options.request, options.running, resolved.parameters
    inputs = request.files() | ({} if resolved.recorded else {"model": parameters["model"].path})
    given = {
        "executor": running.executor,
        "workers": running.workers,
        "start": options.start,
        "only": options.only,
    }
    given |= {name: getattr(options.rigging, name) for name in ("rig", "root_motion", "visemes")}
    report = make_report(
        outcome,
        command="video",
        parameters={**request.described(), **resolved.in_force, **given},
        inputs=inputs,
        outputs=written,
    )
    path = Path(options.out) / "report.json"
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(report, indent=2) + "\n", encoding="utf-8")
    return path
