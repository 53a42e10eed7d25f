"""The child process that computes: reads a task a line, runs the pipeline, tells how it goes; ends with its parent.

A line in is ``{"task": "warm" | "look" | "video", ...}``; lines out are ``{"progress": ...}`` and, last, ``{"done": ...}`` or
``{"problem": ...}``. What is loaded for one task serves the next.
"""

from __future__ import annotations

import contextlib
import json
import os
import queue
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from a2v.errors import A2VError
from a2v.io import atomic_path, printable
from pipelines.executors import LocalExecutor, cpu_count
from pipelines.inputs import LookOptions, PhotoOptions, RunOptions
from pipelines.motion_options import MotionOptions
from pipelines.progress import Listener
from pipelines.serve.clock import STILL, Clock
from pipelines.serve.records import MASK, ORIGINAL, SHOWN
from pipelines.serve.wishes import Wish

if TYPE_CHECKING:
    import numpy as np

    from a2v.types import Subject
    from pipelines.graph import Graph
    from pipelines.run import Outcome

SHOWN_SIDE = 1280
"""Longest side of the photo that the page shows, pixels."""
TURN = "turn.html"
"""The character alone, turnable; for the page, not for download."""

Tell = Callable[[Mapping[str, object]], None]
Make = Callable[[PhotoOptions, str, MotionOptions, LookOptions, RunOptions], object]
"""``a2v video``: photo, folder, motion, look, and how to run."""


class WarmPool(Executor):
    """Local workers that stay for the next video; one that died takes its pool along, and the next call starts another."""

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._pool = LocalExecutor(workers)

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Hand the call to a worker."""
        try:
            return self._pool.submit(function, *args, **kwargs)
        except BrokenProcessPool:
            self._pool = LocalExecutor(self._workers)
            return self._pool.submit(function, *args, **kwargs)

    def warm(self) -> None:
        """Start all workers and load what they will need."""
        for _ in range(self._workers):
            self.submit(load_renderer)


def load_renderer() -> None:
    """Load what the nodes of frames import."""
    import a2v.animation.arap  # noqa: F401
    from a2v.rendering import choose_variant

    choose_variant()


@dataclass(frozen=True, kw_only=True)
class Watched(RunOptions):
    """How the page runs a graph: with its own workers, its progress told; the outcome is kept for a last look."""

    pool: Executor | None = None
    listener: Listener | None = None
    outcomes: list[Outcome] = field(default_factory=list)

    def run(
        self,
        targets: str | Sequence[str],
        parameters: Mapping[str, object],
        *,
        graph: Graph | None = None,
        start: str | None = None,
        overrides: Mapping[str, Any] | None = None,
    ) -> Outcome:
        """As `RunOptions.run`, without bars."""
        from pipelines.run import run
        from pipelines.store import Store

        given: dict[str, Any] = dict(parameters)
        outcome = run(
            targets, graph=graph, executor=self.pool or "serial", store=Store(self.cache), start=start, overrides=overrides,
            progress=self.listener, **given,
        )  # fmt: skip
        self.outcomes.append(outcome)
        return outcome


# --- the tasks


def look(task: Mapping[str, Any], tell: Tell) -> dict[str, object]:
    """Find the person in a photo; write what the page shows of it.

    Returns
    -------
    dict
        "width" and "height" of the shown photo, "landmarks" in its pixels, "warnings".
    """
    from PIL import Image

    from a2v.perception import decode_photo
    from a2v.types import Subject
    from pipelines.inputs import photo_parameters
    from pipelines.run import run
    from pipelines.store import Store

    folder, store = Path(task["folder"]), Store(task["cache"])
    pixels = decode_photo((folder / ORIGINAL).read_bytes(), "the photo")
    picture = Image.fromarray(pixels[..., :3])
    picture.thumbnail((SHOWN_SIDE, SHOWN_SIDE))
    with atomic_path(folder / SHOWN) as temporary:
        picture.save(temporary, "jpeg", quality=85)
    tell({"progress": {"width": picture.width, "height": picture.height}})
    outcome = run("subject", executor="serial", store=store, **photo_parameters(store, folder / ORIGINAL))
    subject = outcome.get("subject", Subject)
    with atomic_path(folder / MASK) as temporary:
        Image.fromarray(_shade(subject, picture.size)).save(temporary, "png")
    return {
        "width": picture.width, "height": picture.height, "landmarks": _landmarks(subject, picture.size),
        "warnings": [printable(text) for text in subject.warnings],
    }  # fmt: skip


def _landmarks(subject: Subject, size: tuple[int, int]) -> list[list[float]]:
    """u, v in pixels of the shown photo and confidence."""
    left, top, right, bottom = subject.crop
    scale = size[0] / subject.photo_size[0]
    height, width = subject.mask.shape
    return [
        [round(float((left + u * (right - left) / width) * scale), 1), round(float((top + v * (bottom - top) / height) * scale), 1), round(float(c), 3)]
        for u, v, c in subject.keypoints
    ]  # fmt: skip


def _shade(subject: Subject, size: tuple[int, int]) -> np.ndarray:
    """Darkness to lay over the shown photo where the person is not, (H, W, 4) uint8."""
    import cv2
    import numpy as np

    left, top, right, bottom = subject.crop
    scale_u, scale_v = size[0] / subject.photo_size[0], size[1] / subject.photo_size[1]
    height, width = subject.mask.shape
    step_u, step_v = (right - left) * scale_u / width, (bottom - top) * scale_v / height
    place = np.float32([[step_u, 0, left * scale_u], [0, step_v, top * scale_v]])  # type: ignore[arg-type]  # rows of numbers
    opacity = cv2.warpAffine(subject.mask, place, size, flags=cv2.INTER_AREA)
    shade = np.zeros((size[1], size[0], 4), np.uint8)
    shade[..., 3] = np.clip((1 - opacity) * 170 + 0.5, 0, 255).astype(np.uint8)
    return shade


def video(task: Mapping[str, Any], tell: Tell, pool: Executor, make: Make) -> dict[str, object]:
    """Make a video by the same command as in a terminal.

    Returns
    -------
    dict
        "files" with their bytes, "notes", "times" of nodes for the next estimates.
    """
    from a2v.rendering import write_page

    folder, wish = Path(task["folder"]), Wish.of(task["wish"])
    pictures, samples = wish.frames * len(wish.views), wish.size**2 * wish.spp
    clock = Clock(frames=wish.frames, pictures=pictures, samples=samples, known=task["known"], measured=task["times"])
    running = Watched(cache=task["cache"], quiet=True, pool=pool, listener=lambda update: tell({"progress": clock.take(update)}))
    make(PhotoOptions(photo=task["photo"]), str(folder), wish.motion, wish.look, running)
    write_page(folder / TURN, folder / "character.glb", title=wish.action)
    outcome = running.outcomes[-1]
    spent = {
        name: stats.span[1] - stats.span[0] for name, stats in outcome.nodes.items() if not stats.cached and stats.span[1] > stats.span[0]
    }
    files = {str(path.relative_to(folder)): path.stat().st_size for path in sorted(folder.rglob("*")) if path.is_file()}
    hidden = ("job.json", TURN)
    return {
        "files": {name: size for name, size in files.items() if name not in hidden and not Path(name).name.startswith(".")},
        "notes": list(outcome.notes), "times": clock.measured(spent), "known": set(STILL) <= set(outcome.nodes),
    }  # fmt: skip


# --- the process


def main(make: Make) -> None:
    """Serve tasks from standard input until it ends; videos are made by `make`."""
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what libraries print is no answer
    lock = threading.Lock()

    def tell(message: Mapping[str, object]) -> None:
        with lock, contextlib.suppress(BrokenPipeError):
            out.write(json.dumps(message) + "\n")
            out.flush()

    pools: list[WarmPool] = []
    for line in _lines(sys.stdin):
        serve(json.loads(line), tell, pools, make)


def serve(task: Mapping[str, Any], tell: Tell, pools: list[WarmPool], make: Make) -> None:
    """Do a task; whatever goes wrong is told."""
    if task["task"] != "look" and not pools:
        pools.append(WarmPool(task.get("workers") or cpu_count()))
    own = (str(task.get("photo", "")), str(Path(task.get("folder", "")) / ORIGINAL))
    try:
        if task["task"] == "warm":
            pools[0].warm()
            load_renderer()
        else:
            tell({"done": look(task, tell) if task["task"] == "look" else video(task, tell, pools[0], make)})
    except A2VError as error:
        tell({"problem": _without(str(error), own)})
    except MemoryError:
        tell({"problem": "the memory was used up; take a smaller picture"})
    except Exception as error:
        traceback.print_exc()
        tell({"problem": _without(f"a defect of a2v: {type(error).__name__}: {error}"[:500], own)})


def _without(text: str, paths: tuple[str, ...]) -> str:
    """A sentence for the page: our own names of files are of no use to whoever reads it."""
    for path in paths:
        if path:
            text = text.replace(f"{path}: ", "").replace(path, "the photo")
    return printable(" ".join(text.split()))


def _lines(stream: IO[str]) -> Iterator[str]:
    """The lines of standard input, read by a thread that ends the process where the parent is gone, in the middle of a task too."""
    waiting: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read() -> None:
        for line in stream:
            waiting.put(line)
        os._exit(1)

    threading.Thread(target=read, daemon=True).start()
    while True:
        yield waiting.get()
