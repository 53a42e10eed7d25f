"""The child processes that find people and make videos, with the functions of the commands.

Models loaded for one task are reused for the next.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2v.errors import InputError, printable
from a2v.io import atomic_path
from pipelines.clock import STILL, Clock
from pipelines.engine.executors import LocalExecutor, cpu_count
from pipelines.engine.progress import Listener, Update
from pipelines.inputs import RunOptions
from pipelines.requests.video import VideoRequest, photo_parameters
from pipelines.serve.fitting import outline, saved
from pipelines.serve.live_child import LIVE
from pipelines.serve.records import MASK
from pipelines.serve.stages import STAGES, pictures
from pipelines.serve.talk import ORIGINAL, Tell, answer
from pipelines.serve.wishes import Wish

if TYPE_CHECKING:
    import numpy as np

    from a2v.types import Subject
    from pipelines.engine.graph import Graph
    from pipelines.engine.run import Early, Outcome

TURN = "turn.html"
"""File name of the page with the rotatable character, shown but not offered for download."""

Make = Callable[[VideoRequest, str, RunOptions], object]
"""``a2v video``: the request, the folder, and how to run."""


Write = Callable[[VideoRequest, str, Path, str, RunOptions], Sequence[Path]]
"""``a2v character``: writes files and returns their paths.

It takes the request, the clip's name, the file, the rig, and how to run.
"""


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


@dataclass(frozen=True, kw_only=True)
class Watched(RunOptions):
    """Options of the page for running a graph: own workers, progress reports, kept outcomes."""

    pool: Executor | None = None
    listener: Listener | None = None
    early: Early = field(default_factory=dict)
    outcomes: list[Outcome] = field(default_factory=list)

    def run(
        self,
        targets: str | Sequence[str],
        parameters: Mapping[str, object],
        *,
        graph: Graph | None = None,
        start: str | None = None,
        overrides: Mapping[str, Any] | None = None,
        early: Early | None = None,
    ) -> Outcome:
        """Run as `RunOptions.run` without progress bars; the page's early outputs come first."""
        from pipelines.engine.store import Store
        from pipelines.run import run

        given: dict[str, Any] = dict(parameters)
        outcome = run(
            targets,
            graph=graph,
            executor=self.pool or "serial",
            store=Store(self.cache),
            start=start,
            overrides=overrides,
            progress=self.listener,
            early=_together(self.early, early or {}),
            **given,
        )
        self.outcomes.append(outcome)
        return outcome


def _together(first: Early, then: Early) -> Early:
    """Merge two sets of early outputs; where both name a node, both are called, `first` first."""

    def both(name: str) -> Callable[[Outcome], None]:
        def tell(outcome: Outcome) -> None:
            for part in (first, then):
                if name in part:
                    part[name](outcome)

        return tell

    return {name: both(name) for name in {**first, **then}}


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
    from a2v.rendering import write_page
    from pipelines.nodes.values import Blob

    folder, wish = Path(task["folder"]), Wish.of(task["wish"])
    clock = Clock(
        frames=wish.frames,
        pictures=wish.frames * len(wish.views),
        samples=wish.size**2 * wish.spp,
        known=task["known"],
        measured=task["times"],
    )
    shown, last = list[str](), dict[str, object]()

    def hear(update: Update) -> None:
        last.update(said := clock.take(update))
        last["stage"] = str(said["stage"]).capitalize()
        tell({"progress": last | {"shown": shown}})

    def show(stage: str) -> None:
        shown.append(stage)
        tell({"progress": last | {"shown": shown}})

    def move(outcome: Outcome) -> None:
        glb = bytes(outcome.store.get(outcome.values["glb"], Blob))
        write_page(folder / TURN, glb, title=wish.action)
        show("moving")

    early = {**pictures(folder, show), "glb": move}
    running = Watched(cache=task["cache"], quiet=True, pool=pool, listener=hear, early=early)
    request = wish.request(task["photo"], task["corrections"], task["more"], task["clip"])
    make(request, str(folder), running)
    outcome = running.outcomes[-1]
    spent = {
        name: stats.span[1] - stats.span[0]
        for name, stats in outcome.nodes.items()
        if not stats.cached and stats.span[1] > stats.span[0]
    }
    files = {
        str(path.relative_to(folder)): path.stat().st_size
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
    hidden = ("job.json", TURN, LIVE, *STAGES.values())
    return {
        "files": {
            name: size
            for name, size in files.items()
            if name not in hidden and not Path(name).name.startswith(".")
        },
        "notes": list(outcome.notes),
        "times": clock.measured(spent),
        "known": set(STILL) <= set(outcome.nodes),
    }


# --- the process


def export(task: Mapping[str, Any], write: Write) -> dict[str, object]:
    """Write the character with the motion of a finished video for another tool.

    Returns
    -------
    dict
        "files" with their sizes in bytes.
    """
    folder, wish = Path(task["folder"]), Wish.of(task["wish"])
    request = wish.request(task["photo"], task["corrections"], task["more"], task["clip"])
    target = folder / "exports" / f"{task['rig']}{task['format']}"
    running = Watched(cache=task["cache"], quiet=True)
    paths = write(request, wish.action, target, str(task["rig"]), running)
    if not folder.is_dir():
        raise InputError("the video was removed")
    return {"files": {str(path.relative_to(folder)): path.stat().st_size for path in paths}}


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
    if task["task"] == "export":
        return export(task, write)
    if not pools:
        pools.append(WarmPool(task.get("workers") or cpu_count()))
    if task["task"] == "video":
        return video(task, tell, pools[0], make)
    pools[0].warm()
    load_renderer()
    return None
