"""What the commands take in: photos, models, motions and settings, checked before anything long runs."""

from __future__ import annotations

import contextlib
import dataclasses
import errno
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2v.errors import InputError
from a2v.io import read_bytes
from pipelines.store import File, Ref, Store

if TYPE_CHECKING:
    from a2v.rendering import CameraPath
    from a2v.types import RenderSettings
    from pipelines.nodes.values import Blob

MAX_PHOTO_BYTES = 256 << 20


SHAPE_OPTIONS = {"pifu": "implicit", "body-prior": "shape"}
"""What the options of a backend begin with."""


def check_writable(folder: str | os.PathLike[str]) -> Path:
    """Make `folder` and check that files can be made in it, before minutes are spent.

    Raises
    ------
    InputError
        They cannot.
    """
    path = Path(folder)
    if path.exists() and not path.is_dir():
        raise InputError(f"cannot write to {path}: it is a file; give a folder as --out")
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path) as probe:
            probe.write(b"\0" * 4096)
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
    return dataclasses.replace(store.put(Blob.of(read_bytes(path, limit=MAX_PHOTO_BYTES))), source=os.fspath(path))


def motion_inputs(*, action: str, model: str, motion: str | None, frames: int, seed: int, fps: float | None) -> dict[str, Any]:
    """The graph's parameters for a generated (`model`) or a recorded (`motion`, a file) motion.

    Raises
    ------
    InputError
        Unknown model, action (the nearest are named) or file.
    """
    if not 1 <= frames <= 10_000:
        raise InputError(f"frames is {frames}; expected 1 to 10000")
    if fps is not None and not 0.5 <= fps <= 240:
        raise InputError(f"fps is {fps}; expected 0.5 to 240")
    if motion is not None:
        return {"motion_file": File.of(motion), "action": action, "frames": frames, "fps": fps}
    if not action:
        raise InputError("no action given; name one with --action (a2v actions lists them), or give --motion FILE.bvh")
    from a2v.motion import MotionModel

    opened = MotionModel.load(model)
    for name in action.split(","):
        opened.label(name.strip())
    return {"model": File.of(opened.path), "action": action, "frames": frames, "seed": seed, "fps": fps}


def add_model_argument(parser: Any, *, several: bool = False) -> None:
    """The option that names a motion model, or `several`."""
    from a2v.motion import BUNDLED

    text = f"motion model: {', '.join(BUNDLED)}, or an .onnx file"
    if several:
        parser.add_argument("--model", action="append", default=[], help=f"{text}; may be repeated")
    else:
        parser.add_argument("--model", default="cmu", help=text)


def add_render_arguments(parser: Any) -> None:
    """Options of how frames look."""
    from a2v.types import VIEWS, RenderSettings

    look = RenderSettings()
    parser.add_argument(
        "--views",
        type=str | None,
        default=None,
        help=f"of {', '.join(VIEWS)}, turntable and the cameras of --camera; by default the four, or all of --camera",
    )
    parser.add_argument("--camera", type=str | None, default=None, help="YAML file of cameras of your own (docs/rendering.md)")
    parser.add_argument(
        "--background", default=look.background, help="stage, transparent (adds PNG frames), a colour (#30506f, navy) or an image file"
    )
    parser.add_argument("--size", type=int, default=look.size, help="pixels a side")
    parser.add_argument("--spp", type=int, default=look.spp, help="samples a pixel")
    parser.add_argument("--denoise", type=bool, default=look.denoise, help="Open Image Denoise on every frame")
    parser.add_argument("--variant", default=look.variant, help="Mitsuba variant: auto, llvm_ad_rgb or scalar_rgb")
    parser.add_argument("--render_seed", type=int, default=look.seed, help="seed of the renderer")


def render_parameters(store: Store, settings: Any) -> dict[str, Any]:
    """The graph's parameters `render`, `cameras` and `backdrop` out of the options of `add_render_arguments`.

    Raises
    ------
    InputError
        An unknown view or background, or an unreadable file.
    """
    from a2v.rendering import check_views, read_cameras
    from a2v.types import VIEWS, RenderSettings

    cameras = () if settings.camera is None else read_cameras(settings.camera)
    named = settings.views.split(",") if settings.views is not None else [one.name for one in cameras] or VIEWS
    views = tuple(view.strip() for view in named)
    background, backdrop = _background(store, settings.background)
    render = RenderSettings(
        views=views,
        background=background,
        size=settings.size,
        spp=settings.spp,
        denoise=settings.denoise,
        variant=settings.variant,
        seed=settings.render_seed,
    )
    check_views(views, cameras)
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


def add_run_arguments(parser: Any) -> None:
    """Options of where and how a graph runs."""
    from pipelines.executors import EXECUTORS

    parser.add_argument("--executor", default="local", choices=EXECUTORS, help="where frames are computed")
    parser.add_argument("--workers", type=int | None, default=None, help="processes; one a core by default")
    parser.add_argument(
        "--address", type=str | None, default=None, help="of a Dask scheduler or a Ray cluster; without it one is started here"
    )
    parser.add_argument(
        "--cache", type=str | None, default=None, help="folder of remembered results (default: $A2V_CACHE, else ~/.cache/a2v)"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress bars")


def stage_settings() -> dict[str, Any]:
    """The settings of every stage at their defaults, by the name that the graph, the command line and YAML use."""
    from a2v.animation import BindSettings, DeformSettings, RetargetSettings
    from a2v.body import FitSettings
    from a2v.perception import PerceptionSettings
    from a2v.reconstruction import ColorSettings
    from a2v.reconstruction.backends import DEFAULT_BACKEND, SETTINGS

    return {
        "perception": PerceptionSettings(),
        "fit": FitSettings(),
        "shape": _shape_settings(SETTINGS[DEFAULT_BACKEND]),
        "color": ColorSettings(),
        "bind": BindSettings(),
        "retarget": RetargetSettings(),
        "deform": DeformSettings(),
    }


def add_photo_arguments(parser: Any) -> None:
    """Options of the photo."""
    parser.add_argument("--photo", required=True, help="the person, seen whole: JPEG, PNG...")
    parser.add_argument(
        "--mask", type=str | None, default=None, help="image of the photo's size, white where the person is; replaces the detector's"
    )
    parser.add_argument("--keypoints", type=str | None, default=None, help="OpenPose JSON; replaces the detector's")


def add_stage_arguments(parser: Any, names: Sequence[str]) -> None:
    """Options of the named stages, such as ``--fit.iterations``; with "shape" those of every backend, and which one."""
    from a2v.reconstruction.backends import DEFAULT_BACKEND, SETTINGS

    for name, settings in stage_settings().items():
        if name in names and name != "shape":
            parser.add_class_arguments(type(settings), name)
    if "shape" in names:
        parser.add_argument("--backend", choices=tuple(SETTINGS), default=DEFAULT_BACKEND, help="how the person is reconstructed")
        for backend, settings in SETTINGS.items():
            parser.add_class_arguments(type(settings), SHAPE_OPTIONS[backend])


def stages_of(settings: Any) -> dict[str, Any]:
    """The stages' settings out of parsed options."""
    found = {name: getattr(settings, name) for name in stage_settings() if hasattr(settings, name)}
    if hasattr(settings, "backend"):
        found["shape"] = _shape_settings(getattr(settings, SHAPE_OPTIONS[settings.backend]))
    return found


def _shape_settings(settings: Any) -> Any:
    """A backend's settings with the digest of its weights, which remembered results go by."""
    from a2v.reconstruction import ImplicitSettings
    from a2v.reconstruction.implicit import ImplicitModel

    if isinstance(settings, ImplicitSettings):
        return dataclasses.replace(settings, digest=ImplicitModel.load(settings.weights or None).digest)
    return settings


def photo_parameters(
    store: Store,
    photo: str | os.PathLike[str],
    *,
    mask: str | os.PathLike[str] | None = None,
    keypoints: str | os.PathLike[str] | None = None,
    **stages: Any,
) -> dict[str, Any]:
    """The graph's parameters from a photo to a character; `stages` replace the defaults of `stage_settings`.

    Raises
    ------
    InputError
        A file cannot be read.
    TypeError
        `stages` has an unknown name.
    """
    settings = stage_settings()
    if unknown := set(stages) - set(settings):
        raise TypeError(f"no stage {', '.join(sorted(unknown))}; the stages are {', '.join(settings)}")
    files = {"photo": photo, "mask": mask, "keypoints": keypoints}
    return {name: put_file(store, path) for name, path in files.items()} | settings | stages


def video_parameters(
    store: Store,
    photo: str | os.PathLike[str],
    action: str = "",
    *,
    model: str = "cmu",
    motion: str | None = None,
    frames: int = 60,
    seed: int = 0,
    fps: float | None = None,
    render: RenderSettings | None = None,
    cameras: Sequence[CameraPath] = (),
    backdrop: str | os.PathLike[str] | None = None,
    **photo_options: Any,
) -> dict[str, Any]:
    """All the graph's parameters, the defaults filled in; use with ``video_graph(recorded=motion is not None)``.

    Raises
    ------
    InputError
        An unknown model or action (the nearest are named), a number out of range, or an unreadable file.
    """
    from a2v.types import RenderSettings

    moving = motion_inputs(action=action, model=model, motion=motion, frames=frames, seed=seed, fps=fps)
    look = {"render": render or RenderSettings(), "cameras": tuple(cameras), "backdrop": put_file(store, backdrop)}
    return {**moving, **look, **photo_parameters(store, photo, **photo_options)}
