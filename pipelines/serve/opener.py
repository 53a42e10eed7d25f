"""The child process that opens the photos of strangers: it loads little, and has no more memory
than it needs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from a2v.errors import InputError
from a2v.io import atomic_path
from a2v.system import bound_memory
from pipelines.serve.talk import Tell, answer

SHOWN_SIDE = 1280
"""Longest side of the photo that the page shows, pixels."""
OPENER_BYTES = 3 << 30
"""Address space of the process that opens photos: one of 60 megapixels takes 1.4 GB, and libraries
reserve more than they use."""


def open_photo(task: Mapping[str, Any], tell: Tell) -> dict[str, object]:
    """Decode the photo "file" that came in and write what the page shows of it to "shown".

    Returns
    -------
    dict
        "width" and "height" of the shown photo, "digest" of the value that the store will have of
        the photo.
    """
    from PIL import Image

    from a2v.perception import decode_photo
    from pipelines.engine.forget import ref_of
    from pipelines.nodes.values import Blob

    _bound_memory()
    data = Path(task["file"]).read_bytes()
    picture = Image.fromarray(decode_photo(data, "this file")[..., :3])
    picture.thumbnail((SHOWN_SIDE, SHOWN_SIDE))
    with atomic_path(task["shown"]) as temporary:
        picture.save(temporary, "jpeg", quality=85)
    return {
        "width": picture.width,
        "height": picture.height,
        "digest": ref_of(Blob.of(data)).digest,
    }


def open_clip(task: Mapping[str, Any], tell: Tell) -> dict[str, object]:
    """Read the head and the first frame of the video "file" that came in.

    Returns
    -------
    dict
        "seconds" by the file, 0 if it does not say, and "digest" by which the store names it.

    Raises
    ------
    InputError
        It is no video that can be read, or too large, too small or too long.
    """
    from a2v.footage.reading import open_reel
    from a2v.footage.settings import LONGEST
    from pipelines.engine.store import File

    _bound_memory()
    try:
        with open_reel(task["file"]) as reel:
            seconds = reel.seconds
    except InputError as error:  # the decoder's own words name our file
        said = re.sub(r" \(\[Errno.*?\)", "", str(error))
        raise InputError(said.replace(str(task["file"]), "this file")) from None
    if seconds > LONGEST:
        raise InputError(
            f"this video is {seconds:.0f} s long; expected at most {LONGEST:.0f} s, cut it first"
        )
    return {"seconds": round(seconds, 2), "digest": File.of(task["file"]).digest}


def _bound_memory() -> None:
    """Let this process have so much and no more: what a photo of strangers may need to be
    decoded."""
    bound_memory(OPENER_BYTES)


def main() -> None:
    """Open photos and videos until standard input ends."""
    answer(lambda task, tell: (open_clip if task["task"] == "clip" else open_photo)(task, tell))
