"""Run a task in a worker process, or recall its result."""

from __future__ import annotations

import contextlib
import functools
import io
import platform
import tempfile
import time
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from a2v.errors import A2VError, InputError, printable
from a2v.io import atomic_path
from a2v.sessions import WEIGHTS, file_digest
from pipelines.batch.tasks import GIVEN, TARGETS, Result, Task, steps_of
from pipelines.engine.memo import refs_within
from pipelines.engine.refs import File, Ref
from pipelines.engine.store import Store
from pipelines.graph import video_graph


def perform(task: Task, store: Store, likeness: Mapping[str, str]) -> Result:
    """Run a task in this process. Every error is part of the result.

    So an exception always means a lost worker.

    Parameters
    ----------
    likeness : `own_likeness` of the process that sent the task
    """
    from pipelines.run import run

    begun = time.perf_counter()
    try:
        if other := [
            name for name, digest in likeness.items() if own_likeness().get(name) != digest
        ]:
            text = f"worker {platform.node() or 'without a name'} runs another version than this machine: {', '.join(other[:4])}"  # noqa: E501
            return Result(
                problem=f"{text}{' and more' * (len(other) > 4)} differ; install the same version there",  # noqa: E501
                strange=True,
            )
        if (known := recall(task, store)) is not None:
            return known
        given: dict[str, Any] = {
            name: _local_file(value, task, store) if isinstance(value, File) else value
            for name, value in task.parameters.items()
        }
        with contextlib.redirect_stdout(io.StringIO()):  # The engine's text about errors.
            outcome = run(
                TARGETS[task.kind],
                graph=steps_of(task.kind, task.recorded, "other" in given),
                store=store,
                executor="serial",
                **given,
            )
        seconds = time.perf_counter() - begun
        values = {name: outcome.values[name] for name in TARGETS[task.kind]}
        if task.kind == "video":
            values["thumbnail"] = _thumbnail(np.ravel(values["clip"])[0], store)
        facts = {"seconds": seconds, "notes": list(outcome.notes)}
        store.remember(
            f"task_{task.kind}",
            task.key,
            tuple(values.values()),
            facts,
            given=refs_within(task.parameters),
        )
        return Result(
            values=values, seconds=seconds, peak_memory=outcome.peak_memory, notes=outcome.notes
        )
    except A2VError as error:
        return Result(problem=printable(str(error)), seconds=time.perf_counter() - begun)
    except MemoryError:
        return Result(
            problem="the computation ran out of memory; use a smaller --size or fewer --workers",
            seconds=time.perf_counter() - begun,
        )
    except Exception as error:
        text = f"a defect of a2v: {type(error).__name__}: {error}"
        return Result(
            problem=printable(text[:500]),
            trace=traceback.format_exc(),
            seconds=time.perf_counter() - begun,
        )


def recall(task: Task, store: Store) -> Result | None:
    """Return the stored result of a task."""
    known = store.recall(f"task_{task.kind}", task.key)
    if known is None or not isinstance(known[0], tuple) or len(known[0]) != len(GIVEN[task.kind]):
        return None
    return Result(
        values=dict(zip(GIVEN[task.kind], known[0], strict=True)),
        notes=tuple(known[1].get("notes") or ()),
    )


def _thumbnail(clip: Ref[Any], store: Store) -> Ref[Any]:
    """Return the first frame of a clip as a small JPEG."""
    from PIL import Image

    from a2v.rendering import read_video
    from pipelines.nodes.values import Blob

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "clip.mp4"
        path.write_bytes(bytes(store.get(clip, Blob)))
        picture = Image.fromarray(next(iter(read_video(path))))
    picture.thumbnail((128, 128))
    buffer = io.BytesIO()
    picture.save(buffer, "jpeg", quality=80)
    return store.put(Blob.of(buffer.getvalue()))


@functools.cache
def own_likeness() -> Mapping[str, str]:
    """Return digests of everything that determines results besides parameters.

    That is the code of the nodes, the shipped weights, and the versions of packages.
    """
    from pipelines.report import versions

    graphs = [
        video_graph(recorded=recorded, several=several)
        for recorded in (False, True)
        for several in (False, True)
    ]
    steps = {step.node.name: step.node for graph in graphs for step in graph}
    found = {f"the code of {name}": node.code() for name, node in steps.items()}
    found |= {
        f"the weights {path.name}": file_digest(path)
        for path in sorted((*WEIGHTS.glob("*.onnx"), *WEIGHTS.glob("*.npz")))
    }
    return found | {
        f"the version of {name}": version
        for name, version in versions().items()
        if name not in ("commit", "a2v")
    }


def _local_file(file: File, task: Task, store: Store) -> File:
    """Return a file on this machine: at its own path, a shipped weight, or in the store."""
    from pipelines.nodes.values import Blob

    for path in (Path(file.path), WEIGHTS / Path(file.path).name):
        # A mix of models and clips has one digest of all its files. `own_likeness` compares shipped
        # ones.
        if path.is_file() and (path.parent == WEIGHTS or File.of(path) == file):
            return File(str(path), file.digest)
    if file.digest not in task.files:
        raise InputError(f"{file.path} has changed or is gone; start the batch again")
    path = store.folder / "files" / f"{file.digest}{Path(file.path).suffix}"
    with atomic_path(path) as temporary:
        temporary.write_bytes(bytes(store.get(task.files[file.digest], Blob)))
    return File(str(path), file.digest)
