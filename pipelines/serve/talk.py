"""How the page and its child processes talk: a task a line in, as JSON; lines out are
``{"progress": ...}`` and, last, ``{"done": ...}`` or ``{"problem": ...}``."""

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

from a2v.errors import A2VError
from a2v.io import printable

ORIGINAL = "original"
"""A photo as it came, in the folder of a photo."""

CORRECTIONS = "me.yaml"
"""What the user has corrected of it, beside it."""

CLIP = "clip"
"""A video whose motion the person takes over, beside it; its suffix follows."""

Tell = Callable[[Mapping[str, object]], None]
Work = Callable[[Mapping[str, Any], Tell], "dict[str, object] | None"]
"""Does a task; what it returns is its answer, and None where nobody waits for one."""


def answer(work: Work) -> None:
    """Do tasks from standard input until it ends; whatever goes wrong with one is its answer."""
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what libraries print is no answer
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
            tell({"problem": _without(str(error), own)})
        except MemoryError:
            tell({"problem": "the memory was used up; take a smaller picture"})
        except Exception as error:
            traceback.print_exc()
            tell(
                {
                    "problem": _without(
                        f"a defect of a2v: {type(error).__name__}: {error}"[:500], own
                    )
                }
            )


def _without(text: str, paths: tuple[str, ...]) -> str:
    """A sentence for the page: our own names of files are of no use to whoever reads it."""
    for path in paths:
        if path:
            text = text.replace(f"{path}: ", "").replace(path, "the photo")
    return printable(" ".join(text.split()))


def _lines(stream: IO[str]) -> Iterator[str]:
    """The lines of standard input, read by a thread that ends the process where the parent is gone,
    in the middle of a task too."""
    waiting: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read() -> None:
        for line in stream:
            waiting.put(line)
        os._exit(1)

    threading.Thread(target=read, daemon=True).start()
    while True:
        yield waiting.get()
