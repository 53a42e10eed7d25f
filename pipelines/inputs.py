"""What the commands take in: photos, models, motions and settings, checked before anything long runs."""

from __future__ import annotations

import dataclasses
import errno
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2v.errors import InputError
from pipelines.store import File, Ref, Store, read_bytes

if TYPE_CHECKING:
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


def render_settings(settings: Mapping[str, Any] | Any) -> Any:
    """`RenderSettings` out of the flat options --views --size --spp --denoise --variant --render-seed."""
    from a2v.types import RenderSettings

    views = tuple(view.strip() for view in settings.views.split(",")) if isinstance(settings.views, str) else tuple(settings.views)
    if doubles := [view for view in views if views.count(view) > 1]:
        raise InputError(f"view '{doubles[0]}' is given twice")
    return RenderSettings(
        views=views, size=settings.size, spp=settings.spp, denoise=settings.denoise, variant=settings.variant, seed=settings.render_seed
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


def add_photo_arguments(parser: Any) -> None:
    """Options of the photo and of the stages from it to a character."""
    from a2v.animation import BindSettings
    from a2v.body import FitSettings
    from a2v.perception import PerceptionSettings
    from a2v.reconstruction import ColorSettings, SurfaceSettings

    parser.add_argument("--photo", required=True, help="the person, seen whole: JPEG, PNG...")
    parser.add_argument(
        "--mask", type=str | None, default=None, help="image of the photo's size, white where the person is; replaces the detector's"
    )
    parser.add_argument("--keypoints", type=str | None, default=None, help="OpenPose JSON; replaces the detector's")
    for name, kind in STAGES.items():
        settings = {
            "perception": PerceptionSettings,
            "fit": FitSettings,
            "shape": SurfaceSettings,
            "color": ColorSettings,
            "bind": BindSettings,
        }[name]
        parser.add_argument(f"--{name}", type=settings, default=settings(), help=kind)


STAGES = {
    "perception": "finding the person",
    "fit": "fitting the body",
    "shape": "the surface around the body",
    "color": "the surface's colours",
    "bind": "binding the surface to the body",
}
"""Names of the stages' settings and what they are for."""


def photo_inputs(settings: Any, store: Store) -> dict[str, Any]:
    """The graph's parameters from a photo to a character."""
    from a2v.animation import BindSettings
    from a2v.body import FitSettings
    from a2v.perception import PerceptionSettings
    from a2v.reconstruction import ColorSettings, SurfaceSettings

    kinds = {"perception": PerceptionSettings, "fit": FitSettings, "shape": SurfaceSettings, "color": ColorSettings, "bind": BindSettings}
    files = {name: put_file(store, getattr(settings, name)) for name in ("photo", "mask", "keypoints")}
    return files | {name: as_dataclass(kind, getattr(settings, name)) for name, kind in kinds.items()}


def as_dataclass(kind: Any, value: Any) -> Any:
    """A settings dataclass out of what the parser made of its options."""
    if isinstance(value, kind):
        return value
    values = value.as_dict() if hasattr(value, "as_dict") else dict(value)
    names = {item.name: item for item in dataclasses.fields(kind)}
    return kind(**{name: tuple(item) if isinstance(item, list) else item for name, item in values.items() if name in names})
