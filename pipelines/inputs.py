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

from a2v.animation import BindSettings, BlinkSettings, DeformSettings, RetargetSettings
from a2v.body import FitSettings
from a2v.errors import InputError
from a2v.io import clear_leftovers, read_bytes
from a2v.kinematics.resample import SHOWN_FPS
from a2v.motion.edit import Edit
from a2v.perception import PerceptionSettings
from a2v.reconstruction import ColorSettings, FaceSettings, HandSettings, ImplicitSettings, PapersSettings, SurfaceSettings
from a2v.reconstruction.backends import DEFAULT_BACKEND, SETTINGS, BackendSettings
from a2v.rendering.looks import LOOKS
from a2v.rendering.scene import SceneSettings
from a2v.types import VIEWS, RenderSettings
from pipelines.executors import EXECUTORS, ExecutorName
from pipelines.graph import Parameters
from pipelines.motion_options import AUTO, motion_inputs
from pipelines.options import flag, option, settings
from pipelines.store import Ref, Store

if TYPE_CHECKING:
    from a2v.rendering import CameraPath
    from pipelines.graph import Graph
    from pipelines.nodes.values import Blob
    from pipelines.run import Outcome

MAX_PHOTO_BYTES = 256 << 20

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


PHOTO = "photo"
"""The background that is the photo's own place, and the name of its view."""


# --- options that commands share; each gives the graph's parameters that it stands for


@dataclass(frozen=True, kw_only=True)
class LookOptions:
    """How frames look."""

    views: str | None = option(
        f"of {', '.join(VIEWS)}, turntable and those of --camera; by default the four, or all of those", default=None
    )
    camera: str | None = option("YAML file of cameras of your own (docs/rendering.md)", default=None, metavar="FILE")
    background: str = option(
        "stage, transparent, a colour (navy, #30506f), an image file, or photo (adds photo.mp4)", default=_LOOK.background, metavar="WHAT"
    )
    look: str = option(f"light: {', '.join(LOOKS)}, or a YAML file", default=LOOKS[0])
    size: int = option("pixels of the longer side", default=_LOOK.size)
    aspect: str = option("shape of each view: 1:1, 9:16, 16:9 or another width:height", default=_LOOK.aspect, metavar="W:H")
    titles: bool = flag("the views' names above the pictures of video.mp4", rare=True)
    spp: int = option("samples a pixel", default=_LOOK.spp)
    denoise: bool = option("Open Image Denoise on every frame", default=_LOOK.denoise, rare=True)
    variant: str = option("Mitsuba variant: auto, llvm_ad_rgb or scalar_rgb", default=_LOOK.variant, rare=True)
    render_seed: int = option("seed of the renderer", default=_LOOK.seed, rare=True)

    @property
    def in_photo(self) -> bool:
        """Whether the photo's own place is wanted beside the views."""
        return self.background == PHOTO

    def parameters(self, store: Store) -> Parameters:
        """`render`, `cameras`, `backdrop` and `scene`.

        Raises
        ------
        InputError
            An unknown view, background or look, or an unreadable file.
        """
        from a2v.rendering import check_views, read_cameras, read_look

        cameras = () if self.camera is None else read_cameras(self.camera)
        named = self.views.split(",") if self.views is not None else [one.name for one in cameras] or VIEWS
        background, backdrop = _background(store, _LOOK.background if self.in_photo else self.background)
        render = RenderSettings(
            views=tuple(view.strip() for view in named),
            background=background,
            size=self.size,
            aspect=self.aspect,
            titles=self.titles,
            spp=self.spp,
            denoise=self.denoise,
            variant=self.variant,
            seed=self.render_seed,
        )
        check_views(render.views, cameras)
        return {"render": render, "cameras": cameras, "backdrop": backdrop, "scene": read_look(self.look)}


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
        raise InputError(f"background '{asked}' is no file; expected stage, photo, transparent, a colour such as #30506f, or an image")
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
    pifuhd: str = option("PIFuHD's checkpoint, your own file, for the backend papers", default="", metavar="FILE", rare=True)
    pifu_geometry: str = option(
        "PIFu's net_G, likewise: the shape without --pifuhd, and what --pifu-color needs", default="", metavar="FILE", rare=True
    )
    pifu_color: str = option("PIFu's net_C, likewise: colours of what the photo does not show", default="", metavar="FILE", rare=True)
    pamir_geometry: str = option("PaMIR's checkpoint instead, your own file; needs SMPL's in --fit.model", default="", metavar="FILE", rare=True)
    pamir_texture: str = option("PaMIR's checkpoint for colours, likewise", default="", metavar="FILE", rare=True)
    perception: PerceptionSettings = settings(PerceptionSettings)
    fit: FitSettings = settings(FitSettings)
    implicit: ImplicitSettings = settings(ImplicitSettings)
    shape: SurfaceSettings = settings(SurfaceSettings)
    hands: HandSettings = settings(HandSettings)
    face: FaceSettings = settings(FaceSettings)
    color: ColorSettings = settings(ColorSettings)
    bind: BindSettings = settings(BindSettings)

    @property
    def papers(self) -> PapersSettings:
        """The settings of the backend papers."""
        return PapersSettings(
            pifuhd=self.pifuhd, pifu_geometry=self.pifu_geometry, pifu_color=self.pifu_color,
            pamir_geometry=self.pamir_geometry, pamir_texture=self.pamir_texture,
            smpl=self.fit.model if self.pamir_geometry and self.fit.model.endswith(".npz") else "",
        )  # fmt: skip

    def parameters(self) -> Parameters:
        """Each stage's settings by the name that the graph has for them."""
        shapes: dict[str, BackendSettings] = {"pifu": self.implicit, "body-prior": self.shape, "papers": self.papers}
        known = {"perception": self.perception, "fit": self.fit, "shape": _with_digest(shapes[self.backend])}
        return {**known, "hands": self.hands, "face": self.face, "color": self.color, "bind": self.bind}


@dataclass(frozen=True, kw_only=True)
class MovingStages(CharacterStages):
    """Those and the settings of the stages from a motion to a moving character."""

    retarget: RetargetSettings = settings(RetargetSettings)
    blink: BlinkSettings = settings(BlinkSettings)
    deform: DeformSettings = settings(DeformSettings)

    def parameters(self) -> Parameters:
        """Each stage's settings by the name that the graph has for them."""
        return {**super().parameters(), "retarget": self.retarget, "blink": self.blink, "deform": self.deform}


def _with_digest(shape: BackendSettings) -> BackendSettings:
    """A backend's settings with the digest of its weights, which remembered results go by."""
    from a2v.reconstruction.implicit import ImplicitModel

    if isinstance(shape, ImplicitSettings):
        return dataclasses.replace(shape, digest=ImplicitModel.load(shape.weights or None).digest)
    if isinstance(shape, PapersSettings):
        return dataclasses.replace(shape, digest=shape.files_digest())
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
        self,
        targets: str | Sequence[str],
        parameters: Mapping[str, object],
        *,
        graph: Graph | None = None,
        start: str | None = None,
        overrides: Mapping[str, Any] | None = None,
    ) -> Outcome:
        """Compute `targets` with bars, as `pipelines.run.run` does."""
        from pipelines.progress import Bars
        from pipelines.run import run

        bars, given = Bars(quiet=self.quiet), Parameters(parameters)
        try:
            return run(
                targets, graph=graph, executor=self.executor, workers=self.workers, address=self.address, store=Store(self.cache),
                start=start, overrides=overrides, progress=bars, **given,
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
    model: str = AUTO,
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
    scene: SceneSettings = SceneSettings(),
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
    look = {"render": render or RenderSettings(), "cameras": tuple(cameras), "backdrop": put_file(store, backdrop), "scene": scene}
    return {**moving, **look, **photo_parameters(store, photo, **photo_options)}
