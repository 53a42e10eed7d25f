"""Write the files of a run; each appears when it is complete."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from a2v.io import atomic_path, read_npz
from a2v.motion.edit import Edit, put_in_place
from a2v.props import Props
from a2v.types import Character, Motion
from pipelines.engine.refs import Ref
from pipelines.engine.run import Outcome
from pipelines.nodes.values import Blob, Image, Poses
from pipelines.rigs import RigOptions, write_rigged

_OWN = RigOptions()
_NAMES = {
    "video": "video.mp4",
    "glb": "character.glb",
    "photo_clip": "photo.mp4",
    "bvh": "motion.bvh",
}


def write_results(
    outcome: Outcome,
    folder: Path,
    views: Sequence[str],
    rig: RigOptions = _OWN,
    edit: Edit = Edit(),
) -> list[Path]:
    """Write video, clips, character, motion and preview page; return the paths, the video first.

    Character and motion are those of the run if `rig` is plain, else they are made from its
    `engine_character` and `poses`. Of `edit` only "in place" matters here.
    """
    from a2v.rendering import write_page

    written = [write_blob(outcome, outcome.values["video"], folder / "video.mp4")]
    if "photo_clip" in outcome.values:
        written.append(
            write_blob(outcome, outcome.values["photo_clip"], folder / _NAMES["photo_clip"])
        )
    written += [
        write_blob(outcome, ref, folder / f"{view}.mp4")
        for view, ref in zip(views, outcome.values["clip"], strict=True)
    ]
    motion = made_motion(outcome, edit)
    if rig.plain:
        written += [
            write_blob(outcome, outcome.values[name], folder / _NAMES[name])
            for name in ("glb", "bvh")
        ]
    else:
        written += write_rigged(
            folder,
            outcome.get("engine_character", Character),
            outcome.get("poses", Poses),
            rig,
            name=motion.action or "motion",
            props=outcome.get("props", Props),
        )
    motion.save(folder / "motion.npz")
    write_page(
        folder / "preview.html",
        folder / "character.glb",
        folder / "video.mp4",
        title=motion.action or "motion",
    )
    return [*written, folder / "motion.npz", folder / "preview.html"]


def made_motion(outcome: Outcome, edit: Edit) -> Motion:
    """Return the motion of a run for the file; --in-place removes its travel only here."""
    motion = outcome.get("motion", Motion)
    return put_in_place(motion, loop=edit.loop) if edit.in_place else motion


def write_early_page(outcome: Outcome, folder: Path) -> Path:
    """Write ``preview.html`` with the moving character of a run that has reached its `glb`."""
    from a2v.rendering import write_page

    title = outcome.get("motion", Motion).action or "motion"
    write_page(
        folder / "preview.html", bytes(outcome.store.get(outcome.values["glb"], Blob)), title=title
    )
    return folder / "preview.html"


def write_shared(
    folder: Path,
    *,
    animation: str | None,
    megabytes: float,
    sheet: bool,
    caption: Sequence[str] = (),
) -> list[Path]:
    """Write an animation and a sheet beside the ``video.mp4`` of `folder`.

    They are ``video.gif`` or ``video.webp`` of at most `megabytes`, and ``sheet.png``: twelve
    frames with the lines of `caption` below them.
    """
    from a2v.rendering import contact_sheet, probe_video, read_video, with_caption, write_within

    source, written = folder / "video.mp4", []
    if animation is not None:
        written.append(folder / f"video.{animation}")
        write_within(written[-1], read_video(source), probe_video(source).fps, megabytes=megabytes)
    if sheet:
        from PIL import Image as Pillow

        info = probe_video(source)
        wanted = np.unique(np.linspace(0, info.frames - 1, 12).round().astype(int))
        frames = {
            index: frame
            for index, frame in enumerate(read_video(source))
            if index in set(wanted.tolist())
        }
        labels = [f"{index / info.fps:.2f} s" for index in frames]
        columns = 3 if info.width < 2 * info.height else 1 if info.width > 3 * info.height else 2
        written.append(folder / "sheet.png")
        picture = contact_sheet(list(frames.values()), cols=columns, labels=labels)
        with atomic_path(written[-1]) as temporary:
            Pillow.fromarray(with_caption(picture, caption)).save(temporary)
    return written


def write_node(outcome: Outcome, name: str, folder: Path, views: Sequence[str]) -> list[Path]:
    """Write the value of one output: files unchanged, frames as PNG, other values as .npz.

    What was read in the photo is drawn as well.

    There is one file per frame and view if the output has these axes.
    """
    value = outcome.values[name]
    if isinstance(value, Ref):
        written = [_write(outcome, name, value, folder / _NAMES.get(name, f"{name}.npz"))]
        return [*written, _draw_reading(outcome, value, folder)] if name == "reading" else written
    refs = np.asarray(value, dtype=object) if not isinstance(value, np.ndarray) else value
    written = []
    for index in np.ndindex(refs.shape):
        per_view = name == "clip" or refs.ndim == 2
        stem = [views[index[-1]]] if per_view else []
        stem += [f"{index[0]:04d}"] if name != "clip" else []
        suffix = {"clip": ".mp4", "frame": ".png", "photo_frame": ".png"}.get(name, ".npz")
        target = (
            folder / name / ("_".join(stem) + suffix)
            if name != "clip"
            else folder / ("".join(stem) + suffix)
        )
        written.append(_write(outcome, name, refs[index], target))
    return written


def _draw_reading(outcome: Outcome, ref: Ref[Any], folder: Path) -> Path:
    """Draw what was read in the photo as reading.png."""
    from PIL import Image as Picture

    from a2v.reconstruction.reading import Reading
    from a2v.reconstruction.reading.draw import draw_reading

    with atomic_path(folder / "reading.png") as temporary:
        Picture.fromarray(draw_reading(outcome.store.get(ref, Reading))).save(temporary, "png")
    return folder / "reading.png"


def _write(outcome: Outcome, name: str, ref: Ref[Any], path: Path) -> Path:
    if name in _NAMES or name == "clip":
        return write_blob(outcome, ref, path)
    if name in ("frame", "photo_frame"):
        with atomic_path(path) as temporary:
            temporary.write_bytes(outcome.store.get(ref, Image).png.tobytes())
        return path
    read_npz(outcome.store.local_path(ref))  # complete, or an error before anything is written
    with atomic_path(path) as temporary:
        temporary.write_bytes(outcome.store.path(ref).read_bytes())
    return path


def write_blob(outcome: Outcome, ref: Ref[Blob], path: str | os.PathLike[str]) -> Path:
    """Write a stored file to `path`."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(bytes(outcome.store.get(ref, Blob)))
    return Path(path)
