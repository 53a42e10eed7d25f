"""What the commands take in: photos, models, motions and settings, checked before anything long runs."""

from __future__ import annotations

import contextlib
import dataclasses
import errno
import os
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from a2v.animation import BindSettings, DeformSettings, RetargetSettings
from a2v.body import FitSettings
from a2v.errors import InputError
from a2v.formats.registry import readable_motions
from a2v.io import clear_leftovers, read_bytes
from a2v.kinematics.resample import SHOWN_FPS
from a2v.motion import BUNDLED
from a2v.motion.edit import Edit
from a2v.perception import PerceptionSettings
from a2v.reconstruction import ColorSettings, ImplicitSettings, SurfaceSettings
from a2v.reconstruction.backends import DEFAULT_BACKEND, SETTINGS
from a2v.types import VIEWS, RenderSettings
from pipelines.executors import EXECUTORS, ExecutorName
from pipelines.graph import Parameters
from pipelines.options import flag, option, settings
from pipelines.store import File, Ref, Store

if TYPE_CHECKING:
    from a2v.motion import MotionModel
    from a2v.motion.direct import Direction
    from a2v.motion.prompts import Step
    from a2v.rendering import CameraPath
    from pipelines.graph import Graph
    from pipelines.nodes.values import Blob
    from pipelines.run import Outcome

MAX_PHOTO_BYTES = 256 << 20

MODEL = f"motion model: {', '.join(tuple(BUNDLED)[:3])}... (docs/motion.md), or an .onnx file"
"""What the options that name a motion model say."""

ACTION = "what to do, by name or in words, one after the other with commas or 'then' (see a2v actions)"
SECONDS = "length of a motion (default: 5, or as long as the model's own clips are)"
FRAMES = "length in frames, instead of --seconds"
FPS = "frames a second"
"""What the options of the same names say."""

DEFAULT_SECONDS = 5.0
MAX_FRAMES = 10_000

_LOOK = RenderSettings()


def check_writable(folder: str | os.PathLike[str]) -> Path:
    """Make `folder` and check that files can be made in it, before minutes are spent.

    Raises
    ------
    InputError
        They cannot.
    """
    path = Path(folder)
    try:
        if path.exists() and not path.is_dir():
            raise InputError(f"cannot write to {path}: it is a file; give a folder as --out")
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path) as probe:
            probe.write(b"\0" * 4096)
        clear_leftovers(path)
    except OSError as error:
        what = "the disk is full" if error.errno in (errno.ENOSPC, errno.EDQUOT) else error.strerror
        raise InputError(f"cannot write to {path}: {what}; choose another --out") from error
    return path


def put_file(store: Store, path: str | os.PathLike[str] | None) -> Ref[Blob] | None:
    """Take a user's file into the store; None stays None.

    Raises
    ------
    InputError
        It cannot be read.
    """
    from pipelines.nodes.values import Blob

    if path is None:
        return None
    ref = store.put(Blob.of(read_bytes(path, limit=MAX_PHOTO_BYTES)))
    store.share([ref])
    return dataclasses.replace(ref, source=os.fspath(path))


def length_of(*, frames: int | None, seconds: float | None, fps: float, longest: float = np.inf) -> int:
    """Frames at `fps` of a motion: as many as are asked for, or `seconds`, or `DEFAULT_SECONDS` where those are not `longest`.

    Raises
    ------
    InputError
        Both are asked for, or a number is out of range.
    """
    if frames is not None and seconds is not None:
        raise InputError(f"both frames ({frames}) and seconds ({seconds:g}) are given; give one of them")
    if not 0.5 <= fps <= 240:
        raise InputError(f"fps is {fps}; expected 0.5 to 240")
    if seconds is not None and not 0 < seconds <= MAX_FRAMES / fps:
        raise InputError(f"seconds is {seconds:g}; expected more than 0 and at most {MAX_FRAMES / fps:g} at {fps:g} frames a second")
    if frames is None:
        frames = max(1, round((min(DEFAULT_SECONDS, longest) if seconds is None else seconds) * fps))
    if not 1 <= frames <= MAX_FRAMES:
        raise InputError(f"frames is {frames}; expected 1 to {MAX_FRAMES}")
    return frames


def read_steps(model: MotionModel, action: str, timeline: str | None = None) -> tuple[list[Step], list[str]]:
    """The steps of an action in words, or of a timeline's file, and what was taken for what, a line a part that is not an action's own name.

    Raises
    ------
    InputError
        Neither or both are given, a part is empty, or nothing comes near it; the nearest are named.
    """
    from a2v.motion.prompts import Vocabulary, explain, parse_prompt
    from a2v.motion.timeline import read_timeline

    if timeline is not None and action:
        raise InputError("both action and timeline are given; give one of them")
    if timeline is None and not action:
        raise InputError("no action given; name one with --action (a2v actions lists them), or give a --timeline or a --motion")
    known = Vocabulary.of(model.card)
    steps, matches = parse_prompt(action, known) if timeline is None else read_timeline(timeline, known)
    return steps, explain([match for match in matches if match.score < 1])


def motion_inputs(
    *,
    action: str,
    model: str,
    motion: str | None = None,
    frames: int | None = None,
    seconds: float | None = None,
    fps: float = SHOWN_FPS,
    seed: int = 0,
    timeline: str | None = None,
    path: str | None = None,
    pace: float | None = None,
    edit: Edit = Edit(),
) -> Parameters:
    """The graph's parameters for a generated (`model`) or a recorded (`motion`, a file) motion; see `length_of`.

    Raises
    ------
    InputError
        An unknown model or file, an action that nothing comes near (the nearest are named), or a number out of range.
    """
    if motion is not None:
        if alone := [name for name, value in (("timeline", timeline), ("path", path)) if value is not None]:
            raise InputError(f"{alone[0]} cannot be given with motion; a recorded motion goes where it went")
        length = length_of(frames=frames, seconds=seconds, fps=fps)
        return {"motion_file": File.of(motion), "action": action, "frames": length, "fps": fps, "edit": edit}
    from a2v.motion import MotionModel

    opened = MotionModel.load(model)
    steps, _ = read_steps(opened, action, timeline)
    length = length_of(frames=frames, seconds=seconds, fps=fps, longest=opened.card.frames / opened.fps)
    direction = read_direction(opened, steps, path, pace)
    asked = {"steps": tuple(steps), "frames": length, "seed": seed, "fps": fps}
    return {"model": File.of(opened.path), **asked, "edit": edit, "direction": direction}


def read_direction(model: MotionModel, steps: Sequence[Step], path: str | None, pace: float | None) -> Direction | None:
    """Where the motion shall go; None where nothing is asked for.

    Raises
    ------
    InputError
        The path is none, or the model or the steps cannot take one.
    """
    from a2v.motion.direct import Direction, check_directed, read_path

    if path is None:
        if pace is not None:
            raise InputError(f"pace is {pace:g}, but there is no path; give one with --path, or change the tempo with --speed")
        return None
    direction = Direction(path=read_path(path), pace=pace)
    check_directed(model, steps)
    return direction


# --- options that commands share; each gives the graph's parameters that it stands for


@dataclass(frozen=True, kw_only=True)
class EditOptions:
    """What is done to a motion once it is made."""

    loop: bool = flag("a seamless cycle out of the motion")
    in_place: bool = flag("neither travel nor turning; the sway of steps stays")
    mirror: bool = flag("left and right exchanged", rare=True)
    speed: float = option("tempo: 2 is twice as fast", default=1.0, rare=True)

    @property
    def edit(self) -> Edit:
        """The same for the library."""
        return Edit(speed=self.speed, mirror=self.mirror, loop=self.loop, in_place=self.in_place)


@dataclass(frozen=True, kw_only=True)
class PlanOptions:
    """What is done, for how long, and where to."""

    action: str = option(ACTION, default="")
    timeline: str | None = option(
        "YAML file of actions with their lengths, instead of --action (docs/motion.md)", default=None, metavar="FILE"
    )
    model: str = option(MODEL, default="cmu")
    seconds: float | None = option(SECONDS, default=None)
    frames: int | None = option(FRAMES, default=None, rare=True)
    fps: float = option(FPS, default=SHOWN_FPS)
    seed: int = option("seed of the motion: another seed, another performance", default=0)
    path: str | None = option("go along this: points 'x,z x,z ...' in metres, or a .csv of two columns", default=None)
    pace: float | None = option("metres a second along --path; by default as fast as the action goes", default=None, rare=True)


@dataclass(frozen=True, kw_only=True)
class MotionOptions(EditOptions, PlanOptions):
    """A motion for one person, generated or recorded."""

    motion: str | None = option(f"recorded motion instead of a model: {readable_motions()}", default=None, metavar="FILE")

    def parameters(self) -> Parameters:
        """See `motion_inputs`."""
        edits = {item.name for item in dataclasses.fields(EditOptions)}
        given = {item.name: getattr(self, item.name) for item in dataclasses.fields(self) if item.name not in edits}
        return motion_inputs(**given, edit=self.edit)

    def explained(self) -> list[str]:
        """What the words of the action were taken for, a line a part that is not an action's own name."""
        from a2v.motion import MotionModel

        return [] if self.motion is not None else read_steps(MotionModel.load(self.model), self.action, self.timeline)[1]


@dataclass(frozen=True, kw_only=True)
class LookOptions:
    """How frames look."""

    views: str | None = option(
        f"of {', '.join(VIEWS)}, turntable and those of --camera; by default the four, or all of those", default=None
    )
    camera: str | None = option("YAML file of cameras of your own (docs/rendering.md)", default=None, metavar="FILE")
    background: str = option(
        "stage, transparent (adds PNGs), a colour (navy, #30506f) or an image file", default=_LOOK.background, metavar="WHAT"
    )
    size: int = option("pixels a side", default=_LOOK.size)
    spp: int = option("samples a pixel", default=_LOOK.spp)
    denoise: bool = option("Open Image Denoise on every frame", default=_LOOK.denoise, rare=True)
    variant: str = option("Mitsuba variant: auto, llvm_ad_rgb or scalar_rgb", default=_LOOK.variant, rare=True)
    render_seed: int = option("seed of the renderer", default=_LOOK.seed, rare=True)

    def parameters(self, store: Store) -> Parameters:
        """`render`, `cameras` and `backdrop`.

        Raises
        ------
        InputError
            An unknown view or background, or an unreadable file.
        """
        from a2v.rendering import check_views, read_cameras

        cameras = () if self.camera is None else read_cameras(self.camera)
        named = self.views.split(",") if self.views is not None else [one.name for one in cameras] or VIEWS
        background, backdrop = _background(store, self.background)
        render = RenderSettings(
            views=tuple(view.strip() for view in named),
            background=background,
            size=self.size,
            spp=self.spp,
            denoise=self.denoise,
            variant=self.variant,
            seed=self.render_seed,
        )
        check_views(render.views, cameras)
        return {"render": render, "cameras": cameras, "backdrop": backdrop}


def _background(store: Store, asked: str) -> tuple[str, Ref[Blob] | None]:
    """What `RenderSettings.background` is called, and the picture if it is one."""
    from PIL import ImageColor

    from a2v.perception.photo import decode_photo

    if asked in ("stage", "transparent"):
        return asked, None
    with contextlib.suppress(ValueError):
        red, green, blue, *_ = ImageColor.getrgb(asked)
        return f"#{red:02x}{green:02x}{blue:02x}", None
    if not Path(asked).is_file():
        raise InputError(f"background '{asked}' is no file; expected stage, transparent, a colour such as #30506f, or an image")
    data = read_bytes(asked, limit=MAX_PHOTO_BYTES)
    decode_photo(data, Path(asked).name)  # or an error before anything long runs
    return "image", put_file(store, asked)


@dataclass(frozen=True, kw_only=True)
class PhotoOptions:
    """The photo, and what replaces the detectors."""

    photo: str = option("the person, seen whole: JPEG, PNG...")
    mask: str | None = option("image of the photo's size, white where the person is; replaces the detector's", default=None, metavar="FILE")
    keypoints: str | None = option("OpenPose JSON; replaces the detector's", default=None, metavar="FILE")

    def parameters(self, store: Store, stages: CharacterStages) -> Parameters:
        """See `photo_parameters`."""
        return photo_parameters(store, self.photo, mask=self.mask, keypoints=self.keypoints, **stages.parameters())


@dataclass(frozen=True, kw_only=True)
class CharacterStages:
    """The settings of the stages from a photo to a character; the backend says whether `implicit` or `shape` counts."""

    backend: str = option(
        f"how the person is reconstructed: {' or '.join(SETTINGS)}", default=DEFAULT_BACKEND, choices=tuple(SETTINGS), metavar="NAME"
    )
    perception: PerceptionSettings = settings(PerceptionSettings)
    fit: FitSettings = settings(FitSettings)
    implicit: ImplicitSettings = settings(ImplicitSettings)
    shape: SurfaceSettings = settings(SurfaceSettings)
    color: ColorSettings = settings(ColorSettings)
    bind: BindSettings = settings(BindSettings)

    def parameters(self) -> Parameters:
        """Each stage's settings by the name that the graph has for them."""
        shapes: dict[str, SurfaceSettings | ImplicitSettings] = {"pifu": self.implicit, "body-prior": self.shape}
        known = {"perception": self.perception, "fit": self.fit, "shape": _with_digest(shapes[self.backend])}
        return {**known, "color": self.color, "bind": self.bind}


@dataclass(frozen=True, kw_only=True)
class MovingStages(CharacterStages):
    """Those and the settings of the stages from a motion to a moving character."""

    retarget: RetargetSettings = settings(RetargetSettings)
    deform: DeformSettings = settings(DeformSettings)

    def parameters(self) -> Parameters:
        """Each stage's settings by the name that the graph has for them."""
        return {**super().parameters(), "retarget": self.retarget, "deform": self.deform}


def _with_digest(shape: SurfaceSettings | ImplicitSettings) -> SurfaceSettings | ImplicitSettings:
    """A backend's settings with the digest of its weights, which remembered results go by."""
    from a2v.reconstruction.implicit import ImplicitModel

    if isinstance(shape, ImplicitSettings):
        return dataclasses.replace(shape, digest=ImplicitModel.load(shape.weights or None).digest)
    return shape


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Where and how a graph runs."""

    executor: ExecutorName = option("where frames are computed", default="local", choices=EXECUTORS, rare=True)
    workers: int | None = option("processes; one a core by default", default=None)
    address: str | None = option("of a Dask scheduler or a Ray cluster; without it one is started here", default=None, rare=True)
    cache: str | None = option("folder of remembered results (default: $A2V_CACHE, else ~/.cache/a2v)", default=None, metavar="FOLDER")
    quiet: bool = flag("no progress bars")

    def run(
        self, targets: str | Sequence[str], parameters: Mapping[str, object], *, graph: Graph | None = None, start: str | None = None
    ) -> Outcome:
        """Compute `targets` with bars, as `pipelines.run.run` does."""
        from pipelines.progress import Bars
        from pipelines.run import run

        bars, given = Bars(quiet=self.quiet), Parameters(parameters)
        try:
            return run(
                targets, graph=graph, executor=self.executor, workers=self.workers, address=self.address, store=Store(self.cache),
                start=start, progress=bars, **given,
            )  # fmt: skip
        finally:
            bars.close()

    def tell_times(self, outcome: Outcome) -> None:
        """Say on standard error how long the nodes took, unless quiet."""
        from pipelines.report import table

        if not self.quiet:
            print(table(outcome), file=sys.stderr)


# --- the same in Python


def stage_settings() -> Parameters:
    """The settings of every stage at their defaults, by the name that the graph, the command line and YAML use."""
    return MovingStages().parameters()


def photo_parameters(
    store: Store,
    photo: str | os.PathLike[str],
    *,
    mask: str | os.PathLike[str] | None = None,
    keypoints: str | os.PathLike[str] | None = None,
    **stages: object,
) -> Parameters:
    """The graph's parameters from a photo to a character; `stages` replace the defaults of `stage_settings`.

    Raises
    ------
    InputError
        A file cannot be read.
    TypeError
        `stages` has an unknown name.
    """
    known = stage_settings()
    if unknown := set(stages) - set(known):
        raise TypeError(f"no stage {', '.join(sorted(unknown))}; the stages are {', '.join(known)}")
    files = {"photo": photo, "mask": mask, "keypoints": keypoints}
    return {name: put_file(store, path) for name, path in files.items()} | known | stages


def video_parameters(
    store: Store,
    photo: str | os.PathLike[str],
    action: str = "",
    *,
    model: str = "cmu",
    motion: str | None = None,
    seconds: float | None = None,
    frames: int | None = None,
    seed: int = 0,
    fps: float = SHOWN_FPS,
    timeline: str | None = None,
    path: str | None = None,
    pace: float | None = None,
    edit: Edit = Edit(),
    render: RenderSettings | None = None,
    cameras: Sequence[CameraPath] = (),
    backdrop: str | os.PathLike[str] | None = None,
    **photo_options: Any,
) -> Parameters:
    """All the graph's parameters, the defaults filled in; use with ``video_graph(recorded=motion is not None)``.

    Raises
    ------
    InputError
        An unknown model or action (the nearest are named), a number out of range, or an unreadable file.
    """
    moving = motion_inputs(
        action=action, model=model, motion=motion, seconds=seconds, frames=frames, seed=seed, fps=fps, timeline=timeline, path=path,
        pace=pace, edit=edit,
    )  # fmt: skip
    look = {"render": render or RenderSettings(), "cameras": tuple(cameras), "backdrop": put_file(store, backdrop)}
    return {**moving, **look, **photo_parameters(store, photo, **photo_options)}
