"""Turn jobs into tasks for workers: people and motions, which several jobs may share, and videos.

A task is a part of the graph that runs in one process. Its result is stored as a whole, so a
finished video is recalled by one record and not by those of its frames.
"""

from __future__ import annotations

import dataclasses
import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import joblib

from a2v.digest import Digest
from a2v.errors import InputError
from pipelines.batch.rows import Row
from pipelines.engine.graph import Graph, Parameters, inputs_of, needed_for
from pipelines.engine.memo import plain
from pipelines.engine.refs import File, Ref
from pipelines.engine.store import Store
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
"""Inputs that each kind of task takes from the graph."""
GIVEN: Mapping[Kind, tuple[str, ...]] = {**TARGETS, "video": (*TARGETS["video"], "thumbnail")}
"""Results of each kind of task."""


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
    files: Mapping[Digest, Ref[Any]] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Result:
    """The result of a task: values, or the problem.

    Attributes
    ----------
    values : dict of refs; empty if the task failed
    problem : str
        One sentence.
    trace : str
        Where a defect of ours happened.
    strange : bool
        The worker runs other code, weights or packages; the task did not begin.
    seconds : float
        Time spent on it; 0 if it was recalled.
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
    """A row with its tasks.

    Attributes
    ----------
    row : Row
    name : str
        Name of its folder: words of the row, and digits of all its options. It is a plain name
        without separators.
    tasks : tuple of Task
        Person, motion, video; empty if the row has a problem.
    notes : tuple of str
        Interpretation of the words of its action.
    """

    row: Row
    name: str
    tasks: tuple[Task, ...]
    notes: tuple[str, ...] = ()


class Planner:
    """Makes jobs from rows. What rows share is read and checked once."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._person = functools.lru_cache(maxsize=None)(self._read_person)
        self._motion = functools.lru_cache(maxsize=None)(MotionRequest.resolve)
        self._film = functools.lru_cache(maxsize=None)(self._read_film)
        self._files: dict[str, Ref[Any]] = {}
        self._digests: dict[int, _Digest] = {}
        self._first_of: dict[tuple[str, str], str] = {}

    def job(self, row: Row) -> Job:
        """Return the job of a row; a row with a problem has no tasks."""
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
        )  # The poses and cameras of the first view serve the others.
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
        """Return the parameters of a motion.

        The model is opened and the action looked up once for all seeds.
        """
        known = self._motion(dataclasses.replace(motion, seed=0))
        if "seed" not in known.parameters:
            return known
        return dataclasses.replace(known, parameters={**known.parameters, "seed": motion.seed})

    def _read_film(self, film: FilmRequest) -> Parameters:
        return film.resolve(self._store)

    def _digest(self, value: Any) -> _Digest:
        """Return the part of a parameter. It is hashed once, since rows share most parameters."""
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
    """Return the steps of a kind of task."""
    return needed_for(video_graph(recorded=recorded, several=several), TARGETS[kind])


@functools.cache
def _codes(kind: Kind, recorded: bool, several: bool) -> tuple[str, ...]:
    return tuple(step.node.code() for step in steps_of(kind, recorded, several))


@functools.cache
def _inputs(kind: Kind, recorded: bool, several: bool) -> tuple[str, ...]:
    return inputs_of(steps_of(kind, recorded, several))


@dataclass(frozen=True)
class _Digest:
    """The hash and the text of a parameter, for keys and names.

    Attributes
    ----------
    value : the parameter; while it is kept, no other object gets its `id`
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
    """Return the key of a task's result, from the code of its nodes and its parameters."""
    named = sorted((name, digest.hash) for name, digest in parameters.items())
    return Digest.of(repr([kind, _codes(kind, recorded, several), named]))


def folder_name(row: Row, parameters: Mapping[str, _Digest] | None) -> str:
    """Return a plain folder name for a job: words, and digits that only equal jobs share."""
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
    return f"{text}-{Digest.of(what)[:10]}"
