"""``a2v compare``: one photo and motion by several methods, side by side."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.errors import InputError
from a2v.io import say
from a2v.reconstruction.backends import DEFAULT_BACKEND, NAMES
from a2v.types import (
    Body,
    ByteArray,
    OrthographicCamera,
    PhotoCamera,
    Reconstruction,
    RenderSettings,
    Subject,
)
from pipelines.answer import Answer
from pipelines.engine.graph import Parameters
from pipelines.engine.run import Outcome
from pipelines.engine.store import Store
from pipelines.inputs import RunOptions, check_writable
from pipelines.nodes.values import Image, Poses
from pipelines.options import group, option
from pipelines.requests.film import FilmRequest
from pipelines.requests.motion import MotionRequest
from pipelines.requests.person import PersonRequest
from pipelines.requests.video import VideoRequest

if TYPE_CHECKING:
    from a2v.lab.evaluation.liquid_warp import LiquidWarp

FLAT = ("warp", "liquid", "mirror")
METHODS = (*NAMES, *FLAT)

HELP = (
    "Make the same video by several methods, side by side on one page: the papers' "
    "qualitative figures for any photo and motion."
)
EXAMPLES = """examples:
  a2v compare --photo me.jpg --action Walk --methods pifu,body-prior,warp,mirror --out sheet.html
  a2v compare --photo me.jpg --motion dance.bvh --methods papers,pifu --pifuhd pifuhd.pt --pifu-geometry net_G --pifu-color net_C --out sheet.html
  a2v compare --photo me.jpg --action Jump --methods pifu,warp --size 256 --survey survey.html --out sheet.html
  a2v compare --photo me.jpg --action Walk --methods pifu,liquid --liquid-generator net_epoch_30_id_G.pth --liquid-uv mapper.txt --fit.model SMPL.npz --out sheet.html

Methods are the backends of a2v reconstruct, and three simpler ones for comparison: warp moves the
photo's pixels with the posed body, in two dimensions; liquid is Liquid Warping GAN with your own
files: its generator, the OBJ of SMPL's texture coordinates, and SMPL; mirror gives the backend's
surface the photo's colors in front and, mirrored, behind. --survey writes a page that asks people
to rank the videos; a2v survey --analyze reads the answers."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    person: PersonRequest = group(PersonRequest)
    out: str = option("file to write, .html")
    methods: str = option(
        f"some of {', '.join(METHODS)}, separated by commas",
        default=f"{DEFAULT_BACKEND},warp,mirror",
    )
    shown: int = option("number of frames of each view that are shown as pictures", default=5)
    liquid_generator: str | None = option(
        "Liquid Warping GAN's generator, for the method liquid", default=None, metavar="FILE"
    )
    liquid_uv: str | None = option(
        "OBJ with the texture coordinates of SMPL's mesh (its mapper.txt), for the method liquid",
        default=None,
        metavar="FILE",
    )
    survey: str | None = option(
        "also write a user study of the same videos, .html", default=None, metavar="FILE"
    )
    motion: MotionRequest = group(MotionRequest)
    film: FilmRequest = group(FilmRequest)
    running: RunOptions = group(RunOptions)


def run(options: Options) -> Answer:
    """Make the videos and the page."""
    from a2v.lab.evaluation.comparison import write_comparison, write_comparison_survey

    methods = list(dict.fromkeys(name.strip() for name in options.methods.split(",")))
    if unknown := [name for name in methods if name not in METHODS]:
        raise InputError(f"unknown method '{unknown[0]}'; choose from {', '.join(METHODS)}")
    for path in filter(None, (options.out, options.survey)):
        if Path(path).suffix.lower() != ".html":
            raise InputError(f"cannot write {path}; expected a name that ends in .html")
        check_writable(Path(path).parent)
    if "liquid" in methods and not (options.liquid_generator and options.liquid_uv):
        raise InputError(
            "the method liquid needs your own files: --liquid-generator FILE, --liquid-uv FILE, "
            "and SMPL's file as --fit.model"
        )
    films, fps, action = {}, 0.0, ""
    for number, method in enumerate(methods, 1):
        if not options.running.quiet:
            say(f"method {number} of {len(methods)}: {method}")
        films[method], poses = _films(options, method)
        fps, action = poses.fps, poses.action
    photo = Path(options.person.photo).name
    write_comparison(
        options.out,
        films,
        action=action,
        fps=fps,
        shown=options.shown,
        about=f"{photo}: {', '.join(methods)}",
    )
    files = [Path(options.out)]
    if options.survey:
        files += [
            Path(options.survey),
            write_comparison_survey(options.survey, films, action=action, fps=fps),
        ]
    return Answer(files=files)


def _films(options: Options, method: str) -> tuple[dict[str, list[ByteArray]], Poses]:
    """Return a method's frames by view, and the poses that they show."""
    person = (
        options.person if method in FLAT else dataclasses.replace(options.person, backend=method)
    )
    resolved = VideoRequest(person=person, motion=options.motion, film=options.film).resolve(
        Store(options.running.cache)
    )
    graph, parameters = resolved.graph, resolved.parameters
    if method in ("warp", "liquid"):
        outcome = options.running.run(
            ["subject", "body", "photo_camera", "poses", "camera"], parameters, graph=graph
        )
        frames = _warped(options, method, outcome, parameters["render"])
    else:
        overrides = _mirrored(options, parameters, graph) if method == "mirror" else {}
        outcome = options.running.run(
            ["frame", "poses"], parameters, graph=graph, overrides=overrides
        )
        frames = [
            [outcome.store.get(ref, Image).pixels[..., :3] for ref in column]
            for column in np.asarray(outcome.values["frame"]).T
        ]
    return dict(zip(parameters["render"].views, frames, strict=True)), outcome.get("poses", Poses)


def _mirrored(options: Options, parameters: Parameters, graph: Any) -> dict[str, Any]:
    """Return the backend's surface with the photo's colors, mirrored on the back."""
    from a2v.reconstruction.colorings import color_mirrored

    outcome = options.running.run(
        ["surface", "subject", "body", "photo_camera"], parameters, graph=graph
    )
    person, subject = outcome.get("surface", Reconstruction), outcome.get("subject", Subject)
    colored = color_mirrored(
        person, subject, outcome.get("body", Body), outcome.get("photo_camera", PhotoCamera)
    )
    return {"colored_surface": outcome.store.put(colored)}


def _warped(
    options: Options, method: str, outcome: Outcome, render: RenderSettings
) -> Sequence[list[ByteArray]]:
    """Return the frames of every view by `a2v.lab.evaluation.warp.Warp`, or Liquid Warping GAN."""
    from a2v.animation import deform
    from a2v.animation.bind import skin_of
    from a2v.body import flattened
    from a2v.lab.evaluation.warp import Warp
    from a2v.rendering import ViewCamera

    body, poses = outcome.get("body", Body), outcome.get("poses", Poses)
    camera = outcome.get("photo_camera", PhotoCamera)
    given = outcome.get("subject", Subject), flattened(body, camera), camera.flat
    warp = Warp(*given) if method == "warp" else _liquid(options, *given)
    skin = skin_of(body)
    posed = [deform(skin, transforms) for transforms in poses.bone_transforms]
    cameras = np.asarray(outcome.values["camera"])
    return [
        [
            warp.frame(vertices, outcome.store.get(ref, ViewCamera), render.size)[render.window]
            for vertices, ref in zip(posed, column, strict=True)
        ]
        for column in cameras.T
    ]


def _liquid(
    options: Options, subject: Subject, body: Body, camera: OrthographicCamera
) -> LiquidWarp:
    """Return Liquid Warping GAN with the user's files."""
    from a2v.lab.evaluation.liquid import Generator
    from a2v.lab.evaluation.liquid_warp import LiquidWarp, read_face_texture

    texture = read_face_texture(str(options.liquid_uv), body.faces)
    return LiquidWarp(Generator(str(options.liquid_generator)), texture, subject, body, camera)
