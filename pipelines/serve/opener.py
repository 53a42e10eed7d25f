"""The child process that decodes untrusted photos, with few imports and limited memory."""

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
"""Longest side of the photo that the page shows, in pixels."""
OPENER_BYTES = 3 << 30
"""Address space of the process that opens photos, in bytes.

A photo of 60 megapixels takes 1.4 GB, and libraries reserve more than they use.
"""


def open_photo(task: Mapping[str, Any], tell: Tell) -> dict[str, object]:
    """Decode the uploaded photo "file" and write the version for the page to "shown".

    Returns
    -------
    dict
        "width" and "height" of the shown photo, "digest" of the photo in the store.
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
    """Read the header and the first frame of the uploaded video "file".

    Returns
    -------
    dict
        "seconds" from the header, 0 if missing, and "digest" of the file in the store.

    Raises
    ------
    InputError
        The video cannot be read, or is too large, too small or too long.
    """
    from a2v.footage.reading import open_reel
    from a2v.footage.settings import LONGEST
    from pipelines.engine.refs import File

    _bound_memory()
    try:
        with open_reel(task["file"]) as reel:
            seconds = reel.seconds
    except InputError as error:  # the decoder's message contains the internal file name
        said = re.sub(r" \(\[Errno.*?\)", "", str(error))
        raise InputError(said.replace(str(task["file"]), "this file")) from None
    if seconds > LONGEST:
        raise InputError(
            f"this video is {seconds:.0f} s long; expected at most {LONGEST:.0f} s, cut it first"
        )
    return {"seconds": round(seconds, 2), "digest": File.of(task["file"]).digest}


def _bound_memory() -> None:
    """Limit the memory of this process to what decoding an uploaded photo may need."""
    bound_memory(OPENER_BYTES)


def main() -> None:
    """Open photos and videos until standard input ends."""
    answer(lambda task, tell: (open_clip if task["task"] == "clip" else open_photo)(task, tell))
