"""The child process that decodes untrusted files, with few imports and limited memory."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from a2v.errors import A2VError, InputError, printable
from a2v.io import atomic_path
from a2v.system import bound_memory
from pipelines.serve.talk import Tell, answer

SHOWN_SIDE = 1280
"""Longest side of the photo that the page shows, in pixels."""
OPENER_BYTES = 3 << 30
"""Address space of the process that opens photos, in bytes.

A photo of 60 megapixels takes 1.4 GB, and libraries reserve more than they use.
"""


MOTION_NAME = "the motion"
"""What a motion is called until people give it a title."""


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


def open_motion(task: Mapping[str, Any], tell: Tell) -> dict[str, object]:
    """Read the motion of the uploaded "file", named with "suffix", and write it to "made".

    Returns
    -------
    dict
        "seconds", "notes" about what was chosen or assumed, and "digest" of what was written.

    Raises
    ------
    InputError
        The file has no motion of a person that can be read.
    """
    from a2v.formats import read_motion
    from pipelines.engine.refs import File

    _bound_memory()
    file = Path(task["file"]).with_name(f"{MOTION_NAME}{task['suffix']}")
    Path(task["file"]).rename(file)
    try:
        motion = read_motion(file, action=MOTION_NAME)
    except A2VError as error:
        told = re.sub(rf"{re.escape(str(file))}:(\d+)", r"line \1", str(error))
        told = re.sub(r" \(\w*Error: [^()]*\)", "", told.replace(str(file), "this file"))
        raise InputError(_spaced(told)) from None
    finally:
        file.unlink(missing_ok=True)
    notes = list(motion.provenance.get("notes", ()))
    if motion.batch:
        notes.append("the file has several motions; the first is taken")
        motion = motion[(0,) * len(motion.batch)]
    motion = dataclasses.replace(motion, provenance={"notes": notes})
    motion.save(task["made"])
    return {
        "seconds": round(motion.frames / motion.fps, 2),
        "notes": [_spaced(printable(text)) for text in notes],
        "digest": File.of(task["made"]).digest,
    }


def _spaced(text: str) -> str:
    """Return a message with the names of bones in words, or the page takes them for a program's."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text.replace("_", " "))


def _bound_memory() -> None:
    """Limit the memory of this process to what decoding an uploaded file may need."""
    bound_memory(OPENER_BYTES)


def main() -> None:
    """Open photos, videos and motions until standard input ends."""
    open_it = {"open": open_photo, "clip": open_clip, "motion": open_motion}
    answer(lambda task, tell: open_it[task["task"]](task, tell))
