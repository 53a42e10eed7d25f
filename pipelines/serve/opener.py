"""The child process that opens the photos of strangers: it loads little, and has no more memory
than it needs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

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


def _bound_memory() -> None:
    """Let this process have so much and no more: what a photo of strangers may need to be
    decoded."""
    bound_memory(OPENER_BYTES)


def main() -> None:
    """Open photos until standard input ends."""
    answer(open_photo)
