"""The child processes that find people and make videos, with the functions of the commands.

Models loaded for one task are reused for the next.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2v.errors import InputError, printable
from a2v.io import atomic_path
from pipelines.clock import Clock
from pipelines.engine.executors import LocalExecutor, cpu_count
from pipelines.engine.progress import Update
from pipelines.inputs import RunOptions
from pipelines.requests.video import VideoRequest, photo_parameters
from pipelines.serve.figure import Write, export, play, still, wake
from pipelines.serve.fitting import outline, saved
from pipelines.serve.records import MASK
from pipelines.serve.talk import ORIGINAL, Tell, answer
from pipelines.serve.watched import Watched, spent
from pipelines.serve.wishes import IDLE, Wish

if TYPE_CHECKING:
    import numpy as np

    from a2v.types import Subject

SPARSE = 3
"""Every such pixel of the sample photo is looked at to load the detectors."""
CLEAR = 0.5
"""Confidence from which a landmark counts as seen."""
LEAST_CLEAR = 6
"""Number of landmarks that have to be seen."""
Make = Callable[[VideoRequest, str, RunOptions, Wish], object]
"""``a2v video``: the request, the folder, how to run, and the wish with further files."""


class WarmPool(Executor):
    """Local workers that stay for the next video. If one dies, the next call starts a new pool."""

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._pool = LocalExecutor(workers)

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Submit the call to a worker."""
        try:
            return self._pool.submit(function, *args, **kwargs)
        except BrokenProcessPool:
            self._pool = LocalExecutor(self._workers)
            return self._pool.submit(function, *args, **kwargs)

    def warm(self) -> None:
        """Start all workers and load their modules."""
        for _ in range(self._workers):
            self.submit(load_renderer)


def load_renderer() -> None:
    """Load the modules that nodes of frames import."""
    import a2v.animation.arap  # noqa: F401
    from a2v.rendering import choose_variant

    choose_variant()


# --- the tasks


def look(task: Mapping[str, Any], tell: Tell) -> dict[str, object]:
    """Find the person in a photo and write the mask that the page shows.

    Returns
    -------
    dict
        "landmarks" in pixels of the shown photo, "warnings", "digest" of the photo in the store,
        "people" in fractions of it.
    """
    import numpy as np
    from PIL import Image

    from a2v.types import Subject
    from pipelines.engine.store import Store
    from pipelines.run import run

    folder, store, size = (
        Path(task["folder"]),
        Store(task["cache"]),
        (task["width"], task["height"]),
    )
    parameters = photo_parameters(store, folder / ORIGINAL, corrections=saved(folder))
    outcome = run("subject", executor="serial", store=store, **parameters)
    subject = outcome.get("subject", Subject)
    if (clear := int((subject.keypoints[:, 2] > CLEAR).sum())) < LEAST_CLEAR:
        raise InputError(
            f"the person in this photo is not clear enough ({clear} of {len(subject.keypoints)} "
            "points of the body are seen); choose a photo that shows one person whole"
        )
    if not folder.is_dir():
        raise InputError("the photo was removed")
    with atomic_path(folder / MASK) as temporary:
        Image.fromarray(_shade(subject, size)).save(temporary, "png")
    warnings = [printable(text) for text in subject.warnings]
    people = (
        []
        if subject.people is None
        else (subject.people / np.tile(subject.photo_size, 2)).round(4).tolist()
    )
    return {
        "landmarks": _landmarks(subject, size),
        "warnings": warnings,
        "digest": parameters["photo"].digest,
        "people": people,
    }


def prepare(detectors: bool) -> dict[str, object]:
    """Load the body and, with `detectors`, what finds a person, before a photo arrives."""
    from a2v.body import load_body_model

    load_body_model()
    if detectors:
        from a2v.perception import decode_photo, find_person
        from a2v.samples.ready import PHOTO

        with contextlib.suppress(InputError):  # too small to be found, but all is loaded
            find_person(decode_photo(PHOTO.read_bytes(), PHOTO.name)[::SPARSE, ::SPARSE].copy())
    return {}


def _landmarks(subject: Subject, size: tuple[int, int]) -> list[list[float]]:
    """Return landmarks as u, v in pixels of the shown photo, and confidence."""
    left, top, right, bottom = subject.crop
    scale = size[0] / subject.photo_size[0]
    height, width = subject.mask.shape
    return [
        [
            round(float((left + u * (right - left) / width) * scale), 1),
            round(float((top + v * (bottom - top) / height) * scale), 1),
            round(float(c), 3),
        ]
        for u, v, c in subject.keypoints
    ]


def _shade(subject: Subject, size: tuple[int, int]) -> np.ndarray:
    """Return an overlay that darkens the shown photo outside the person, (H, W, 4) uint8."""
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
    """Make a video with the function of ``a2v video``.

    Returns
    -------
    dict
        "files" with their sizes in bytes, "notes", "times" of nodes for the next estimates.
    """
    folder, wish = Path(task["folder"]), Wish.of(task["wish"])
    clock = Clock(
        frames=wish.frames,
        pictures=wish.pictures,
        samples=wish.size**2 * wish.spp,
        known=True,
        measured=task["times"],
    )

    def hear(update: Update) -> None:
        said = clock.take(update)
        tell({"progress": said | {"stage": str(said["stage"]).capitalize()}})

    running = Watched(cache=task["cache"], quiet=True, pool=pool, listener=hear)
    request = wish.request(task["photo"], task["corrections"], task["more"], task["clip"])
    make(request, str(folder), running, wish)
    outcome = running.outcomes[-1]
    files = {
        str(path.relative_to(folder)): path.stat().st_size
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
    return {
        "files": {
            name: size
            for name, size in files.items()
            if name != "job.json" and not Path(name).name.startswith(".")
        },
        "notes": list(outcome.notes),
        "times": clock.measured(spent(outcome)),
    }


# --- the process


def main(make: Make, write: Write) -> None:
    """Run tasks from standard input until it ends.

    `make` makes videos, `write` exports characters for other tools.
    """
    pools: list[WarmPool] = []
    answer(lambda task, tell: serve(task, tell, pools, make, write))


def serve(
    task: Mapping[str, Any], tell: Tell, pools: list[WarmPool], make: Make, write: Write
) -> dict[str, object] | None:
    """Run a task and return its answer, None for a task without an answer."""
    if task["task"] == "look":
        return look(task, tell)
    if task["task"] == "outline":
        return outline(task)
    if task["task"] == "person":
        return wake(task, tell)
    if task["task"] == "play":
        return play(task)
    if task["task"] == "ready":  # loads the sample's body, and what motions need
        play({"folder": "", "clip": None, "wish": Wish(action=IDLE).said(), "cache": None})
        return {}
    if task["task"] == "prepare":
        return prepare(bool(task["detectors"]))
    if task["task"] == "still":
        return still(task)
    if task["task"] == "export":
        return export(task, write)
    if not pools:
        pools.append(WarmPool(task.get("workers") or cpu_count()))
    if task["task"] == "video":
        return video(task, tell, pools[0], make)
    pools[0].warm()
    load_renderer()
    return None
