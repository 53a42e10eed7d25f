"""Jobs as tasks for workers: people and motions, which several jobs share, and videos.

A task is a part of the graph for one process. What it gave is remembered as a whole, so that a
finished video is recalled by one record and not by those of its frames.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import io
import platform
import re
import tempfile
import time
import traceback
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import joblib
import numpy as np

from a2v.errors import A2VError, InputError
from a2v.io import atomic_path, printable
from a2v.sessions import WEIGHTS, file_digest
from pipelines.batch.rows import Row
from pipelines.engine.graph import Graph, Parameters, inputs_of, needed_for
from pipelines.engine.memo import plain, refs_within
from pipelines.engine.store import File, Ref, Store, digest_of
from pipelines.graph import video_graph
from pipelines.inputs import put_file
from pipelines.requests.film import FilmRequest
from pipelines.requests.motion import MotionRequest, ResolvedMotion
from pipelines.requests.person import PersonRequest

Kind = Literal["person", "motion", "video"]
TARGETS: Mapping[Kind, tuple[str, ...]] = {
    "person": ("character", "body"),
    "motion": ("motion",),
    "video": ("video", "clip", "glb", "bvh", "motion"),
}
"""What each kind of task takes from the graph."""
GIVEN: Mapping[Kind, tuple[str, ...]] = {**TARGETS, "video": (*TARGETS["video"], "thumbnail")}
"""What each kind of task gives."""


@dataclass(frozen=True)
class Task:
    """A part of the graph for one worker.

    Attributes
    ----------
    kind : str
    key : str
        Names its result: code and parameters.
    parameters : dict
        The inputs of that part of the graph.
    recorded : bool
        Whether the motion is a file's.
    after : tuple of str
        Keys of the tasks that have to be done before.
    files : dict
        Stored contents of the files among `parameters`, by digest, for workers that do not see
        these files.
    """

    kind: Kind
    key: str
    parameters: Parameters
    recorded: bool
    after: tuple[str, ...] = ()
    files: Mapping[str, Ref[Any]] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Result:
    """What became of a task: values, or why there are none.

    Attributes
    ----------
    values : dict of refs, empty where it failed
    problem : str
        One sentence.
    trace : str
        Where a defect of ours happened.
    strange : bool
        The worker runs other code, weights or packages; the task did not begin.
    seconds : float
        Spent on it; 0 where it was recalled.
    peak_memory : int
        Bytes.
    notes : tuple of str
    """

    values: Mapping[str, Any] = field(default_factory=dict)
    problem: str = ""
    trace: str = ""
    strange: bool = False
    seconds: float = 0.0
    peak_memory: int = 0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Job:
    """A row with the tasks that it consists of.

    Attributes
    ----------
    row : Row
    name : str
        Its folder: words of the row and digits of all that was asked for, never more than a plain
        name.
    tasks : tuple of Task
        Person, motion, video; empty where the row has a problem.
    notes : tuple of str
        What the words of its action were taken for.
    """

    row: Row
    name: str
    tasks: tuple[Task, ...]
    notes: tuple[str, ...] = ()


class Planner:
    """Makes jobs of rows; what rows share is read and checked once."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._person = functools.lru_cache(maxsize=None)(self._read_person)
        self._motion = functools.lru_cache(maxsize=None)(MotionRequest.resolve)
        self._film = functools.lru_cache(maxsize=None)(self._read_film)
        self._files: dict[str, Ref[Any]] = {}
        self._digests: dict[int, _Digest] = {}
        self._first_of: dict[tuple[str, str], str] = {}

    def job(self, row: Row) -> Job:
        """The job of a row; its problem, if it has one, takes the place of tasks."""
        if row.problem:
            return Job(row, folder_name(row, None), ())
        try:
            asked = row.request
            moving = self._moving(asked.motion)
            parameters = self._person(asked.person) | moving.parameters | self._film(asked.film)
        except InputError as error:
            return Job(dataclasses.replace(row, problem=str(error)), folder_name(row, None), ())
        recorded = asked.motion.motion is not None
        digests = {name: self._digest(value) for name, value in parameters.items()}
        person, motion, video = (
            self._make(kind, parameters, digests, recorded)
            for kind in ("person", "motion", "video")
        )
        first = self._first_of.setdefault(
            (person.key, motion.key), video.key
        )  # its poses and cameras serve the others
        after = (person.key, motion.key, *([first] if first != video.key else []))
        return Job(
            row,
            folder_name(row, digests),
            (person, motion, dataclasses.replace(video, after=after)),
            moving.understood,
        )

    def _read_person(self, person: PersonRequest) -> Parameters:
        return person.resolve(self._store)

    def _moving(self, motion: MotionRequest) -> ResolvedMotion:
        """A motion's parameters; the model is opened and the action looked up once for all
        seeds."""
        known = self._motion(dataclasses.replace(motion, seed=0))
        if "seed" not in known.parameters:
            return known
        return dataclasses.replace(known, parameters={**known.parameters, "seed": motion.seed})

    def _read_film(self, film: FilmRequest) -> Parameters:
        return film.resolve(self._store)

    def _digest(self, value: Any) -> _Digest:
        """Rows share most of their parameters, which are digested once."""
        known = self._digests.get(id(value))
        if known is None:
            known = self._digests[id(value)] = _Digest.of(value)
        return known

    def _make(
        self, kind: Kind, parameters: Parameters, digests: Mapping[str, _Digest], recorded: bool
    ) -> Task:
        several = "other" in parameters
        own = {name: parameters[name] for name in _inputs(kind, recorded, several)}
        files = {
            value.digest: self._stored(value)
            for value in own.values()
            if isinstance(value, File) and self._store.remote
        }
        return Task(
            kind,
            make_key(kind, {name: digests[name] for name in own}, recorded, several),
            own,
            recorded,
            files=files,
        )

    def _stored(self, file: File) -> Ref[Any]:
        if file.digest not in self._files:
            ref = put_file(self._store, file.path)
            assert ref is not None
            self._files[file.digest] = ref
        return self._files[file.digest]


@functools.cache
def steps_of(kind: Kind, recorded: bool, several: bool = False) -> Graph:
    """The steps of a kind of task."""
    return needed_for(video_graph(recorded=recorded, several=several), TARGETS[kind])


@functools.cache
def _codes(kind: Kind, recorded: bool, several: bool) -> tuple[str, ...]:
    return tuple(step.node.code() for step in steps_of(kind, recorded, several))


@functools.cache
def _inputs(kind: Kind, recorded: bool, several: bool) -> tuple[str, ...]:
    return inputs_of(steps_of(kind, recorded, several))


@dataclass(frozen=True)
class _Digest:
    """A parameter's part of keys and names.

    Attributes
    ----------
    value : the parameter itself, so that its `id` stays its own
    hash : str
    text : str
    """

    value: Any
    hash: str
    text: str

    @classmethod
    def of(cls, value: Any) -> _Digest:
        known = plain(value)
        return cls(value, str(joblib.hash(known)), repr(known))


def make_key(
    kind: Kind, parameters: Mapping[str, _Digest], recorded: bool, several: bool = False
) -> str:
    """What names a task's result: its nodes' code and its parameters."""
    named = sorted((name, digest.hash) for name, digest in parameters.items())
    return digest_of(repr([kind, _codes(kind, recorded, several), named]).encode())


def folder_name(row: Row, parameters: Mapping[str, _Digest] | None) -> str:
    """A plain name for a job's folder: words for people, and digits that only equal jobs share."""
    asked = row.request
    words = (
        [row.name]
        if row.name
        else [
            Path(asked.person.photo).stem,
            asked.motion.action or Path(asked.motion.motion or "").stem,
        ]
    )
    text = re.sub(r"[^A-Za-z0-9]+", "-", "-".join(words)).strip("-")[:60] or "job"
    if parameters is None:
        what = repr(plain(dataclasses.replace(row, number=0, problem="")))
    else:
        what = f"{{{', '.join(f'{name!r}: {digest.text}' for name, digest in parameters.items())}}}"
    return f"{text}-{digest_of(what.encode())[:10]}"


# --- in the worker


def perform(task: Task, store: Store, likeness: Mapping[str, str]) -> Result:
    """Do a task in this process; whatever goes wrong is told in the result, so that an exception
    always means a lost worker.

    Parameters
    ----------
    likeness : of the process that asks (`own_likeness`)
    """
    from pipelines.run import run

    begun = time.perf_counter()
    try:
        if other := [
            name for name, digest in likeness.items() if own_likeness().get(name) != digest
        ]:
            text = f"worker {platform.node() or 'without a name'} does not run what this machine runs: {', '.join(other[:4])}"  # noqa: E501
            return Result(
                problem=f"{text}{' and more' * (len(other) > 4)} differ; install the same version there",  # noqa: E501
                strange=True,
            )
        if (known := recall(task, store)) is not None:
            return known
        given: dict[str, Any] = {
            name: _here(value, task, store) if isinstance(value, File) else value
            for name, value in task.parameters.items()
        }
        with contextlib.redirect_stdout(io.StringIO()):  # the engine's words about errors
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
            problem="the memory was used up; take a smaller --size or fewer --workers",
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
    """The remembered result of a task."""
    known = store.recall(f"task_{task.kind}", task.key)
    if known is None or not isinstance(known[0], tuple) or len(known[0]) != len(GIVEN[task.kind]):
        return None
    return Result(
        values=dict(zip(GIVEN[task.kind], known[0], strict=True)),
        notes=tuple(known[1].get("notes") or ()),
    )


def _thumbnail(clip: Ref[Any], store: Store) -> Ref[Any]:
    """The first frame of a clip, small, as a JPEG."""
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
    """What decides results besides parameters: code of the nodes, shipped weights, versions of
    packages; digests by what they are of."""
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


def _here(file: File, task: Task, store: Store) -> File:
    """A file as this machine has it: where it was, among the shipped weights, or out of the
    store."""
    from pipelines.nodes.values import Blob

    for path in (Path(file.path), WEIGHTS / Path(file.path).name):
        # of a mix of models and clips the digest is that of all their files; `own_likeness` has
        # compared the shipped ones
        if path.is_file() and (path.parent == WEIGHTS or File.of(path) == file):
            return File(str(path), file.digest)
    if file.digest not in task.files:
        raise InputError(f"{file.path} has changed or is gone; start the batch again")
    path = store.folder / "files" / f"{file.digest}{Path(file.path).suffix}"
    with atomic_path(path) as temporary:
        temporary.write_bytes(bytes(store.get(task.files[file.digest], Blob)))
    return File(str(path), file.digest)
