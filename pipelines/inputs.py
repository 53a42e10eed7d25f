"""What the commands take in: photos, models, motions and settings, checked before anything long runs."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from a2v.errors import InputError
from pipelines.store import File, Ref, Store, read_bytes

if TYPE_CHECKING:
    from a2v.types import RenderSettings, View
    from pipelines.nodes.values import Blob

MAX_PHOTO_BYTES = 256 << 20


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

    return None if path is None else store.put(Blob.of(read_bytes(path, limit=MAX_PHOTO_BYTES)))


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


def render_settings(settings: Any) -> RenderSettings:
    """`RenderSettings` out of the flat options --views --size --spp --denoise --variant --render-seed."""
    from a2v.types import RenderSettings

    views = tuple(view.strip() for view in settings.views.split(",")) if isinstance(settings.views, str) else tuple(settings.views)
    if doubles := [view for view in views if views.count(view) > 1]:
        raise InputError(f"view '{doubles[0]}' is given twice")
    return RenderSettings(
        views=cast("tuple[View, ...]", views),
        size=settings.size,
        spp=settings.spp,
        denoise=settings.denoise,
        variant=settings.variant,
        seed=settings.render_seed,
    )


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
    from a2v.animation import BindSettings, RetargetSettings
    from a2v.body import FitSettings
    from a2v.perception import PerceptionSettings
    from a2v.reconstruction import ColorSettings, SurfaceSettings

    return {
        "perception": PerceptionSettings(),
        "fit": FitSettings(),
        "shape": SurfaceSettings(),
        "color": ColorSettings(),
        "bind": BindSettings(),
        "retarget": RetargetSettings(),
    }


def add_photo_arguments(parser: Any) -> None:
    """Options of the photo."""
    parser.add_argument("--photo", required=True, help="the person, seen whole: JPEG, PNG...")
    parser.add_argument(
        "--mask", type=str | None, default=None, help="image of the photo's size, white where the person is; replaces the detector's"
    )
    parser.add_argument("--keypoints", type=str | None, default=None, help="OpenPose JSON; replaces the detector's")


def add_stage_arguments(parser: Any, names: Sequence[str]) -> None:
    """Options of the named stages, such as ``--fit.iterations``."""
    for name, settings in stage_settings().items():
        if name in names:
            parser.add_class_arguments(type(settings), name)


def stages_of(settings: Any) -> dict[str, Any]:
    """The stages' settings out of parsed options."""
    return {name: getattr(settings, name) for name in stage_settings() if hasattr(settings, name)}


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
    return {**moving, "render": render or RenderSettings(), **photo_parameters(store, photo, **photo_options)}
