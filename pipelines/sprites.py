"""Sprites: the frames of a video seen from several directions on one transparent picture, and where
each is."""

from __future__ import annotations

import dataclasses
import io
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.io import atomic_path, user_cache_folder
from a2v.types import ByteArray
from pipelines.engine.run import Outcome
from pipelines.nodes.values import Image
from pipelines.requests.film import FilmRequest
from pipelines.requests.video import VideoRequest

DIRECTIONS = (1, 2, 4, 8, 16)
"""Numbers of directions."""
ELEVATION = 12.0
"""Height of the cameras over the person, degrees."""
FIELD = 10.0
"""Field of view of the cameras, degrees: small, so that sprites look alike at all places."""
MAX_SIDE = 16_384
"""Largest side of the picture, pixels."""
_ROUND = 2
"""Alpha below which a pixel is empty, of 255."""


def seen_around(request: VideoRequest, count: int) -> VideoRequest:
    """Return a request whose views are `count` directions on nothing, counted from the front to the
    person's left.

    Raises
    ------
    InputError
        Another number of directions, or views, cameras or a background are asked for too.
    """
    film, plain = request.film, FilmRequest()
    if count not in DIRECTIONS:
        raise InputError(
            f"sprites is {count}; expected one of {', '.join(map(str, DIRECTIONS))} directions"
        )
    taken = [
        name
        for name in ("views", "camera", "background")
        if getattr(film, name) != getattr(plain, name)
    ]
    if taken:
        raise InputError(f"--sprites has views of its own; leave --{' and --'.join(taken)} out")
    film = dataclasses.replace(film, camera=_cameras(count), background="transparent")
    return dataclasses.replace(request, film=film)


def _cameras(count: int) -> str:
    """Write the cameras as a file in the user's cache, and return its name."""
    path = (user_cache_folder() or Path.cwd()) / f"sprites-{count}.yaml"
    lines = [
        f"dir{number:02d}: {{azimuth: {360 * number / count:g}, elevation: {ELEVATION:g}, "
        f"fov: {FIELD:g}}}"
        for number in range(count)
    ]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def write_sprites(folder: Path, outcome: Outcome, views: Sequence[str], fps: float) -> list[Path]:
    """Write ``sprites.png``, a row a direction and a column a frame, and ``sprites.json``.

    Raises
    ------
    InputError
        The picture would be too large.
    """
    from PIL import Image as Pictures

    refs = np.asarray(outcome.values["frame"], dtype=object)
    frames = np.stack(
        [
            np.stack([_pixels(outcome.store.get(ref, Image).png.tobytes()) for ref in row])
            for row in refs
        ]
    )
    sheet, facts = sprite_sheet(frames, views, fps)
    with atomic_path(folder / "sprites.png") as temporary:
        Pictures.fromarray(sheet).save(temporary, "png")
    with atomic_path(folder / "sprites.json") as temporary:
        temporary.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
    return [folder / "sprites.png", folder / "sprites.json"]


def _pixels(png: bytes) -> ByteArray:
    from PIL import Image as Pictures

    with Pictures.open(io.BytesIO(png)) as picture:
        return np.asarray(picture.convert("RGBA"))


def sprite_sheet(
    frames: ByteArray, views: Sequence[str], fps: float
) -> tuple[ByteArray, dict[str, object]]:
    """Return the picture (H, W, 4) of frames (T, C, h, w, 4) uint8, all cut alike to what is drawn
    in any, and its description.

    The description has the form of Aseprite's and TexturePacker's JSON: ``frames`` by name
    ("dir00_0003") with ``frame`` (x, y, w, h), ``duration`` in milliseconds, and ``pivot``, the
    place of the middle of the uncut frame's lower edge as a share of the sprite.

    Raises
    ------
    InputError
        The picture would be larger than `MAX_SIDE`.
    """
    count, directions, high, wide = frames.shape[:4]
    drawn = (frames[..., 3] > _ROUND).any(axis=(0, 1))
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    top, bottom = (int(rows[0]), int(rows[-1]) + 1) if len(rows) else (0, high)
    left, right = (int(columns[0]), int(columns[-1]) + 1) if len(columns) else (0, wide)
    height, width = bottom - top, right - left
    if height * directions > MAX_SIDE or width * count > MAX_SIDE:
        raise InputError(
            f"{count} sprites of {width} x {height} pixels from {directions} directions are larger "
            f"than {MAX_SIDE} pixels; give fewer --frames or a smaller --size"
        )
    cut = frames[:, :, top:bottom, left:right]
    sheet = cut.transpose(1, 2, 0, 3, 4).reshape(directions * height, count * width, 4)
    pivot = {"x": (wide / 2 - left) / width, "y": (high - top) / height}
    named = {
        f"{view}_{frame:04d}": {
            "frame": {"x": frame * width, "y": row * height, "w": width, "h": height},
            "sourceSize": {"w": wide, "h": high},
            "spriteSourceSize": {"x": left, "y": top, "w": width, "h": height},
            "duration": round(1000 / fps, 3),
            "pivot": pivot,
        }
        for row, view in enumerate(views)
        for frame in range(count)
    }
    tags = [
        {"name": view, "from": row * count, "to": (row + 1) * count - 1, "direction": "forward"}
        for row, view in enumerate(views)
    ]
    meta = {
        "app": "a2v",
        "image": "sprites.png",
        "format": "RGBA8888",
        "size": {"w": count * width, "h": directions * height},
        "frameTags": tags,
    }
    return np.ascontiguousarray(sheet), {"frames": named, "meta": meta}
