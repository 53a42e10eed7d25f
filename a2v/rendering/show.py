"""Views for notebooks: characters and motions that can be turned, videos that can be played.

A view is one piece of HTML with all contents, so that JupyterLab, VS Code and exported notebooks
show the same.
"""

from __future__ import annotations

import base64
import html
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.formats.characters import Clips
from a2v.formats.gltf import write_glb, write_morph_glb
from a2v.formats.registry import MOTION_FORMATS, read_motion
from a2v.io import atomic_path, read_bytes
from a2v.kinematics.names import split_side
from a2v.rendering.lighter import lighter
from a2v.rendering.page import MAX_PAGE_BYTES, page_of
from a2v.rendering.stickfigure import StickSettings
from a2v.types import Character, FloatArray, Motion, Surface


@dataclass(frozen=True)
class View:
    """An HTML view. A notebook shows it if it is the last value of a cell.

    Attributes
    ----------
    page : str
        HTML that needs no server and no network.
    height : int
        Height in a notebook, pixels.
    """

    page: str
    height: int

    def _repr_html_(self) -> str:
        """Return the page in a frame, which separates its styles and scripts from the
        notebook's."""
        style = f"width:100%;height:{self.height}px;border:0;border-radius:8px"
        return f'<iframe srcdoc="{html.escape(self.page)}" style="{style}" title="a2v" allowfullscreen></iframe>'  # noqa: E501

    def __repr__(self) -> str:
        return (
            f"View({len(self.page) / 1e6:.1f} MB of HTML; notebooks show it, save(path) writes it)"
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the page as a standalone file."""
        with atomic_path(path) as temporary:
            temporary.write_text(self.page, encoding="utf-8")


def show(
    what: Character | Surface | Motion | bytes | str | os.PathLike[str],
    clips: Clips | None = None,
    *,
    height: int = 480,
    title: str = "",
    small: bool = False,
) -> View:
    """Return a view of a character, a motion or a video.

    Parameters
    ----------
    what : Character, Surface, Motion, bytes or path
        An object; bytes of a binary glTF or an MP4; or the path of one, of a motion (``.bvh``,
        ``.npz``...), of a page that a2v wrote, or of the output folder of `a2v video`. The clips of
        a batch of motions stand side by side.
    clips : mapping, optional
        Clips of a `Character` by name: bone transforms (T, B, 4, 4), world from bone, and frames
        per second.
    height : int
        Pixels.
    title : str
        Heading above the view.
    small : bool
        Show a copy of a `Character` with few triangles and a small texture (`lighter`), for saved
        notebooks: about 1.5 MB instead of 9.

    Raises
    ------
    InputError
        `what` cannot be shown or read, or is too large for a page.
    """
    if isinstance(what, str | os.PathLike):
        return _show_file(Path(what), height, title)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shown.glb"
        if isinstance(what, Character):
            write_glb(
                path, lighter(what) if small else what, clips, jpeg_quality=80 if small else 92
            )
        elif isinstance(what, Surface):
            write_morph_glb(path, what, what.vertices[None], 1.0)
        elif isinstance(what, Motion):
            surface, frames = stick_mesh(what)
            write_morph_glb(path, surface, frames, what.fps, clip=what.action or "motion")
            title = title or what.action
        elif isinstance(what, bytes | bytearray):
            return _show_data(bytes(what), height, title)
        else:
            raise InputError(
                f"cannot show {type(what).__name__}; expected a Character, Surface, Motion, bytes "
                "of a GLB or MP4, or a path"
            )
        return _show_data(path.read_bytes(), height, title)


def _show_file(path: Path, height: int, title: str) -> View:
    source = path / "preview.html" if path.is_dir() else path
    suffix = source.suffix.lower()
    if any(suffix in item.suffixes for item in MOTION_FORMATS):
        return show(read_motion(source), height=height, title=title)
    data = read_bytes(source, limit=MAX_PAGE_BYTES)
    if suffix == ".html":
        return View(data.decode("utf-8", "replace"), height)
    return _show_data(data, height, title or path.stem)


def _show_data(data: bytes, height: int, title: str) -> View:
    if data[4:8] != b"ftyp":
        return View(page_of(data, title=title or "a2v"), height)
    source = f"data:video/mp4;base64,{base64.b64encode(data).decode()}"
    style = "margin:0;height:100vh;background:#c9ced3"
    video = f'<video src="{source}" controls loop muted autoplay playsinline style="width:100%;height:100%;object-fit:contain"></video>'  # noqa: E501
    return View(
        f'<!DOCTYPE html><meta charset="utf-8"><title>{html.escape(title or "a2v")}</title><body '
        f'style="{style}">{video}',
        height,
    )


def stick_mesh(motion: Motion) -> tuple[Surface, FloatArray]:
    """Return a motion as a mesh with one long octahedron per bone.

    Returns
    -------
    surface : Surface
        The first frame. Left, right and middle bones have the colors of stick figures.
    frames : (T, V, 3) float32
        Vertices of every frame, meters. Clips of a batch stand 1.5 m apart.
    """
    from matplotlib.colors import to_rgb

    joints = motion.joints.reshape(-1, *motion.joints.shape[-3:]).astype(np.float64)
    joints = joints + (np.arange(len(joints)) - (len(joints) - 1) / 2)[:, None, None, None] * [
        1.5,
        0.0,
        0.0,
    ]
    children = np.flatnonzero(np.asarray(motion.parents) >= 0)
    head, tail = joints[:, :, np.asarray(motion.parents)[children]], joints[:, :, children]
    along = tail - head
    length = np.linalg.norm(along, axis=-1, keepdims=True)
    aside = np.cross(
        along, np.where(np.abs(along[..., 1:2]) > 0.9 * length, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    )
    aside *= np.clip(0.12 * length, 0.006, 0.03) / np.maximum(
        np.linalg.norm(aside, axis=-1, keepdims=True), 1e-9
    )
    other = np.cross(along / np.maximum(length, 1e-9), aside)
    waist = head + 0.2 * along
    corners = np.stack(
        [head, waist + aside, waist + other, waist - aside, waist - other, tail], axis=-2
    )  # (N, T, bones, 6, 3)
    frames = np.moveaxis(corners, 0, 1).reshape(corners.shape[1], -1, 3).astype(np.float32)
    one = np.array(
        [[0, 2, 1], [0, 3, 2], [0, 4, 3], [0, 1, 4], [5, 1, 2], [5, 2, 3], [5, 3, 4], [5, 4, 1]]
    )
    bones = len(joints) * len(children)
    faces = (np.arange(bones)[:, None, None] * 6 + one).reshape(-1, 3).astype(np.int32)
    drawn = StickSettings()
    colors = {
        side: to_rgb(name)
        for side, name in (("left", drawn.left), ("right", drawn.right), ("", drawn.middle))
    }
    sides = np.array(
        [colors[split_side(motion.joint_names[child])[0]] for child in children], np.float32
    )
    return Surface(
        vertices=frames[0],
        faces=faces,
        colors=np.tile(np.repeat(sides, 6, axis=0), (len(joints), 1)),
    ), frames
