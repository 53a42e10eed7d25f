"""The protocol between the page and its child processes: one JSON object per line.

Each input line is a task. Output lines are ``{"progress": ...}`` and, last, ``{"done": ...}`` or
``{"problem": ...}``.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import IO, Any

from a2v.errors import A2VError, printable

ORIGINAL = "original"
"""File name of the uploaded photo, in the folder of a photo."""

CORRECTIONS = "me.yaml"
"""File name of the user's corrections, in the same folder."""

CLIP = "clip"
"""File name, without suffix, of the video whose motion the person copies, in the same folder."""

EXPORTS = "exports"
"""Folder of files for other tools, in the same folder."""

Tell = Callable[[Mapping[str, object]], None]
Work = Callable[[Mapping[str, Any], Tell], "dict[str, object] | None"]
"""Runs a task and returns its answer, None for a task without an answer."""


def answer(work: Work) -> None:
    """Run tasks from standard input until it ends; an error becomes the answer of its task."""
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # output of libraries must not mix with answers
    lock = threading.Lock()

    def tell(message: Mapping[str, object]) -> None:
        with lock, contextlib.suppress(BrokenPipeError):
            out.write(json.dumps(message) + "\n")
            out.flush()

    for line in _lines(sys.stdin):
        task = json.loads(line)
        own = (
            str(task.get("photo", "")),
            str(Path(task.get("folder", "")) / ORIGINAL),
            str(task.get("folder", "")),
        )
        try:
            if (done := work(task, tell)) is not None:
                tell({"done": done})
        except A2VError as error:
            tell({"problem": _without_paths(str(error), own)})
        except MemoryError:
            tell({"problem": "the computation ran out of memory; use a smaller picture"})
        except Exception as error:
            traceback.print_exc()
            tell(
                {
                    "problem": _without_paths(
                        f"a defect of a2v: {type(error).__name__}: {error}"[:500], own
                    )
                }
            )


def _without_paths(text: str, paths: tuple[str, ...]) -> str:
    """Return a message for the page without internal file names."""
    for path in paths:
        if path:
            text = text.replace(f"{path}: ", "").replace(path, "the photo")
    return printable(" ".join(text.split()))


def _lines(stream: IO[str]) -> Iterator[str]:
    """Yield the lines of standard input.

    A thread reads them and ends the process when the parent is gone, also within a task.
    """
    waiting: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read() -> None:
        for line in stream:
            waiting.put(line)
        os._exit(1)

    threading.Thread(target=read, daemon=True).start()
    while True:
        yield waiting.get()
