"""Nodes: plain typed functions whose results are stored under a key of their code and arguments.

The key has the digest of the code that the node reaches and of the data files that this code reads
(`pipelines.engine.closure`), and the digest of the arguments (`joblib.hash`: dtype- and shape-aware
for arrays; refs and files count by their content). If any of them changes, the node runs again;
otherwise the stored result is returned. While a node runs it may report progress and notes. They go
to the event file of the run, which the process with the progress bars reads.
"""

from __future__ import annotations

import contextlib
import contextvars
import dataclasses
import functools
import importlib
import inspect
import json
import os
import platform
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Generic, ParamSpec, TypeVar, cast

import joblib
import numpy as np

from a2v.digest import Digest
from a2v.errors import A2VError
from a2v.system import peak_memory
from a2v.types import Progress
from pipelines.engine import store as storage
from pipelines.engine.closure import code_digest
from pipelines.engine.refs import File, Ref, refs_in
from pipelines.engine.store import Store

P = ParamSpec("P")
R = TypeVar("R", covariant=True)


class Node(Generic[P, R]):
    """A memoized function; a call looks into the current store first."""

    def __init__(self, function: Callable[P, R], remember: bool = True) -> None:
        functools.update_wrapper(self, function)
        self.function = function
        self.remember = remember
        self.name = function.__name__

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Return the stored result for these arguments, or compute it."""
        return cast(R, self.call(storage.current(), self.code(), args, kwargs))

    def __reduce__(self) -> tuple[Any, ...]:
        return _find, (self.function.__module__, self.function.__qualname__)

    @functools.cached_property
    def signature(self) -> inspect.Signature:
        """The signature of the function; a run asks for it hundreds of times."""
        return inspect.signature(self.function)

    def code(self) -> str:
        """Return the digest of the code and data files that the result depends on."""
        module = self.function.__module__
        source = inspect.getsourcefile(sys.modules[module])
        if source is None:
            raise TypeError(f"module {module} has no source file; nodes live in modules")
        return code_digest(source, self.function.__qualname__.partition(".")[0])

    def key(self, code: str, args: tuple[Any, ...], kwargs: Mapping[str, Any]) -> str:
        """Return the key of a call: node, code and arguments."""
        bound = self.signature.bind(*args, **kwargs)
        bound.apply_defaults()
        return str(joblib.hash([self.name, code, plain(bound.arguments)]))

    def call(
        self,
        store: Store,
        code: str,
        args: tuple[Any, ...],
        kwargs: Mapping[str, Any],
        *,
        fresh: bool = False,
    ) -> Any:
        """Return the result with store and folders given; `fresh` ignores a stored result."""
        key = self.key(code, args, kwargs)
        started = time.time()
        if self.remember and not fresh and (known := store.recall(self.name, key)) is not None:
            result, facts = known
            told = {name: facts.get(name) for name in ("notes", "measures")}
            emit(
                node=self.name,
                done=True,
                hit=True,
                start=started,
                seconds=time.time() - started,
                size=size_of(result),
                **told,
            )
            return result
        emit(node=self.name, start=started)
        with peak_memory() as peak, _running(self.name) as running, storage.using(store):
            clock, work = time.perf_counter(), time.process_time()
            result = self.function(*args, **dict(kwargs))
            spent = {"seconds": time.perf_counter() - clock, "cpu": time.process_time() - work}
            facts = {**spent, "peak": peak(), "notes": running.notes, "measures": running.measures}
        if self.remember:
            store.remember(
                self.name,
                key,
                result,
                {**facts, "start": started},
                given=refs_within([args, kwargs]),
            )
        else:
            store.share(refs_in(result))
        emit(node=self.name, done=True, hit=False, start=started, size=size_of(result), **facts)
        return result


def memo(*, remember: bool = True) -> Callable[[Callable[P, R]], Node[P, R]]:
    """Make a function a `Node`.

    Parameters
    ----------
    remember : False for a cheap node that also depends on the machine: it runs every time
    """

    def wrap(function: Callable[P, R]) -> Node[P, R]:
        return Node(function, remember)

    return wrap


class Bound:
    """A node together with the store, the event folder and the digest of its code, which it needs
    in any process."""

    def __init__(
        self, node: Node[Any, Any], store: Store, events: str, code: str, fresh: bool = False
    ) -> None:
        self._state = (node, store, events, code, fresh)

    def __reduce__(self) -> tuple[Any, ...]:
        return Bound, self._state

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Return the result of the node; its events go to the run.

        Raises
        ------
        A2VError
            This process has other code than the one that built the graph.
        """
        node, store, events, code, fresh = self._state
        if node.code() != code:
            raise A2VError(
                f"worker {platform.node()} has other code for '{node.name}' than this machine; "
                "install the same version there"
            )
        with events_in(events):
            return node.call(store, code, args, kwargs, fresh=fresh)

    def as_function(self) -> Callable[..., Any]:
        """Return a function with the node's name, signature and annotations for pipefunc."""
        bound = self

        @functools.wraps(bound._state[0].function)
        def call(*args: Any, **kwargs: Any) -> Any:
            return bound(*args, **kwargs)

        return call


def _find(module: str, name: str) -> Any:
    return functools.reduce(getattr, name.split("."), cast(Any, importlib.import_module(module)))


def plain(value: Any) -> Any:
    """Return `value` as new lists, dictionaries and arrays.

    So equal values have equal digests, whatever objects they share.
    """
    if isinstance(value, Ref | File):
        return [type(value).__name__, str(value.digest)]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = {
            item.name: plain(getattr(value, item.name))
            for item in dataclasses.fields(value)
            if item.compare
        }
        return [type(value).__qualname__, fields]
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray) and value.dtype == object:
        return ["array", list(value.shape), [plain(item) for item in value.ravel().tolist()]]
    if isinstance(value, np.ma.MaskedArray):  # pipefunc passes a fully computed axis as one
        return plain(np.asarray(value))
    if isinstance(value, np.ndarray):
        return np.ascontiguousarray(value)
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    if isinstance(value, Digest):
        return str(value)
    if value is None or isinstance(value, str | bytes | bool | int | float):
        return value
    if isinstance(value, os.PathLike):
        raise TypeError(f"the path {os.fspath(value)} cannot be part of a key; pass File.of(path)")
    raise TypeError(
        f"{type(value).__name__} cannot be part of a key; pass refs, files, arrays, numbers, text "
        "or dataclasses of them"
    )


def refs_within(value: Any) -> Iterator[Ref[Any]]:
    """Yield every ref in a value that `plain` takes apart; for a file, the ref of its content."""
    if isinstance(value, Ref):
        yield value
    elif isinstance(value, File):
        yield Ref(value.digest)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        for item in dataclasses.fields(value):
            yield from refs_within(getattr(value, item.name))
    elif isinstance(value, Mapping):
        for item in value.values():
            yield from refs_within(item)
    elif isinstance(value, list | tuple):
        for item in value:
            yield from refs_within(item)
    elif isinstance(value, np.ndarray) and value.dtype == object:
        yield from refs_within(value.ravel().tolist())


def size_of(result: Any) -> list[int]:
    """Return the shape of a list or array of refs; empty for a single result."""
    if isinstance(result, list):
        return [len(result)]
    return list(result.shape) if isinstance(result, np.ndarray) else []


# --- what a running node reports

_events: contextvars.ContextVar[str] = contextvars.ContextVar("events", default="")
_check: contextvars.ContextVar[Callable[[], None]] = contextvars.ContextVar(
    "check", default=lambda: None
)
_node: contextvars.ContextVar[_Running | None] = contextvars.ContextVar("node", default=None)


@dataclasses.dataclass
class _Running:
    name: str
    notes: list[str] = dataclasses.field(default_factory=list)
    measures: dict[str, Any] = dataclasses.field(default_factory=dict)


@contextlib.contextmanager
def _running(name: str) -> Iterator[_Running]:
    running = _Running(name)
    token = _node.set(running)
    try:
        yield running
    finally:
        _node.reset(token)


@contextlib.contextmanager
def events_in(folder: str) -> Iterator[None]:
    """Send the reports of nodes inside the block to files in `folder`."""
    token = _events.set(folder)
    try:
        yield
    finally:
        _events.reset(token)


@contextlib.contextmanager
def stopped_by(check: Callable[[], None]) -> Iterator[None]:
    """Call `check` at every report of a node of this thread; it raises to stop the run."""
    token = _check.set(check)
    try:
        yield
    finally:
        _check.reset(token)


def emit(**event: Any) -> None:
    """Append one line to this process's event file of the run; without a run do nothing."""
    _check.get()()
    if folder := _events.get():
        path = os.path.join(folder, f"{os.getpid()}.jsonl")  # noqa: PTH118
        with contextlib.suppress(OSError), open(path, "a", encoding="utf-8") as stream:
            stream.write(json.dumps(event) + "\n")


def note(text: str) -> None:
    """Add a note for the user to the result. It is stored, so a remembered result has it too."""
    running = _node.get()
    if running is not None and text not in running.notes:
        running.notes.append(text)


def measure(values: Mapping[str, Any]) -> None:
    """Record numbers about the result for the report, such as residuals.

    They are stored with it.
    """
    running = _node.get()
    if running is not None:
        running.measures.update(_json(values))


def _json(value: Any) -> Any:
    """Return `value` as JSON can hold it; numbers have six significant digits."""
    if isinstance(value, Mapping):
        return {str(key): _json(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [_json(item) for item in value]
    if isinstance(value, float | np.floating):
        return float(f"{value:.6g}")
    return value.item() if isinstance(value, np.generic) else value


def progress() -> Progress:
    """Return a `Progress` for the long work of the running node, which the run draws as a bar."""
    running = _node.get()
    name, last = (running.name if running else ""), [0.0]

    def report(done: int, total: int) -> None:
        now = time.monotonic()
        if now - last[0] > 0.2 or done >= total:
            last[0] = now
            emit(node=name, progress=[int(done), int(total)])

    return report
