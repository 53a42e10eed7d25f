"""Where fanned-out nodes run: here, in local processes, on Dask or on Ray; all are
`concurrent.futures.Executor`.

Local workers are started by a fork server, never by fork (mitsuba, torch and onnxruntime hold
threads), with one BLAS, OpenMP and Dr.Jit thread each, and they end with the process that started
them, even when that is killed.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any, Literal

from a2v.errors import A2VError, InputError, MissingDependencyError
from a2v.io import discard_unfinished, shorten
from a2v.processes import safe_children, start_fork_server
from a2v.system import core_count, start_method
from pipelines.engine.closure import top_folder

ExecutorName = Literal["serial", "local", "dask", "ray"]
EXECUTORS: tuple[ExecutorName, ...] = ("local", "dask", "ray", "serial")

_ONE_THREAD = dict.fromkeys(
    (
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "NUMEXPR_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
    ),
    "1",
)


class SerialExecutor(Executor):
    """Runs every call at once in the calling thread."""

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Run now; the future is finished."""
        future: Future[Any] = Future()
        try:
            future.set_result(function(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


class RayExecutor(Executor):
    """Runs calls as Ray tasks; Ray retries those whose worker dies."""

    def __init__(self, address: str | None = None, workers: int | None = None) -> None:
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # it reports by itself, to its makers
        os.environ.setdefault(
            "RAY_enable_metrics_collection", "0"
        )  # or its workers complain that nobody takes their figures
        try:
            import ray
        except ImportError as error:
            raise MissingDependencyError(
                "the ray executor needs Ray: pip install 'a2v[ray]'"
            ) from error
        self._ray = ray
        self._started = not ray.is_initialized()
        if self._started:
            local = (
                {} if address else {"num_cpus": workers or cpu_count(), "include_dashboard": False}
            )
            with safe_children(), _elsewhere():  # workers import from the folder in which it starts
                ray.init(address=address, log_to_driver=False, **local)
        self._call = ray.remote(num_cpus=1, max_retries=2)(_in_one_thread)

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Start a Ray task."""
        future: Future[Any] = self._call.remote(function, args, kwargs, str(Path.cwd())).future()
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Stop Ray, if this executor started it."""
        if self._started:
            self._ray.shutdown()


@contextlib.contextmanager
def _elsewhere() -> Iterator[None]:
    """Be in the folder of this program, whose modules are found anyway."""
    before = Path.cwd()
    os.chdir(top_folder())
    try:
        yield
    finally:
        os.chdir(before)


def _in_one_thread(
    function: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any], folder: str
) -> Any:
    _limit_threads()
    with contextlib.suppress(OSError):  # another machine
        os.chdir(folder)
    return function(*args, **kwargs)


def _limit_threads() -> None:
    os.environ.update(_ONE_THREAD)
    with contextlib.suppress(ImportError):
        import threadpoolctl

        threadpoolctl.threadpool_limits(1)


_HANDED_DOWN = ("DRJIT_LIBLLVM_PATH", "A2V_CACHE", "TMPDIR")
"""What a worker takes over from the environment of the moment at which it starts, not of the fork
server's start."""


class LocalExecutor(Executor):
    """Processes of this machine, started at the first call; nothing is started for a run that fans
    nothing out."""

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._pool: ProcessPoolExecutor | None = None

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Hand the call to a worker."""
        if self._pool is None:
            self._pool = _start_pool(self._workers)
        return self._pool.submit(function, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers; with `cancel_futures` at once, in the middle of what they do."""
        if self._pool is None:
            return
        processes = (
            list((getattr(self._pool, "_processes", None) or {}).values()) if cancel_futures else []
        )
        manager: threading.Thread | None = getattr(self._pool, "_executor_manager_thread", None)
        self._pool.shutdown(wait=wait and not cancel_futures, cancel_futures=cancel_futures)
        for process in processes:
            process.terminate()
        for process in processes:
            process.join(5)
        if processes and manager is not None:
            manager.join(
                5
            )  # it closes the pipe to which the interpreter writes at its end: a Bad file descriptor, now and then  # noqa: E501


def _start_pool(workers: int) -> ProcessPoolExecutor:
    import multiprocessing

    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(_ONE_THREAD)  # the fork server hands its environment to every worker
    try:
        start_fork_server()
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name)
            else:
                os.environ[name] = value
    given = {name: os.environ[name] for name in _HANDED_DOWN if name in os.environ}
    return ProcessPoolExecutor(
        workers,
        mp_context=multiprocessing.get_context(start_method()),
        initializer=_start_worker,
        initargs=(given,),
    )


def _start_worker(environment: dict[str, str]) -> None:
    """In a new local worker: one thread, Ctrl-C left to the parent, and an end with the parent."""
    import multiprocessing

    def leave(*_: object) -> None:
        discard_unfinished()
        os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, leave)
    os.environ.update(environment)
    _limit_threads()
    parent = multiprocessing.parent_process()
    if parent is not None:

        def follow() -> None:
            parent.join()
            leave()

        threading.Thread(target=follow, daemon=True).start()


def cpu_count() -> int:
    """Processor cores that this process may use."""
    return core_count()


@contextlib.contextmanager
def open_executor(
    name: ExecutorName | Executor = "local",
    *,
    workers: int | None = None,
    address: str | None = None,
) -> Iterator[Executor]:
    """Yield an executor; on an error nothing that waits is started any more.

    Parameters
    ----------
    name : one of EXECUTORS, or an executor of your own (left open)
    workers : int or None
        Processes; None for one a core.
    address : str or None
        Address of a Dask scheduler or a Ray cluster; None starts one here.

    Raises
    ------
    InputError
        Unknown name, or workers below 1.
    MissingDependencyError
        The executor's package is not installed.
    """
    if workers is not None and workers < 1:
        raise InputError(f"workers is {workers}; expected 1 or more")
    if isinstance(name, Executor):
        yield name
    elif name == "serial":
        yield SerialExecutor()
    elif name == "local":
        pool = LocalExecutor(workers or cpu_count())
        try:
            yield pool
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
        pool.shutdown()
    elif name == "dask":
        with _dask_executor(workers or cpu_count(), address) as executor:
            yield executor
    elif name == "ray":
        ray = RayExecutor(address, workers)
        try:
            yield ray
        finally:
            ray.shutdown(cancel_futures=True)
    else:
        raise InputError(f"unknown executor '{name}'; choose from {', '.join(EXECUTORS)}")


@contextlib.contextmanager
def _dask_executor(workers: int, address: str | None) -> Iterator[Executor]:
    try:
        import distributed
    except ImportError as error:
        raise MissingDependencyError(
            "the dask executor needs Dask: pip install 'a2v[dask]'"
        ) from error
    with contextlib.ExitStack() as stack:
        stack.enter_context(
            _silent(logging.getLogger("distributed"), logging.getLogger("distributed.client"))
        )
        if address is None:
            with safe_children():
                cluster = distributed.LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=None,
                    silence_logs=40,
                )
            stack.enter_context(cluster)
            client = stack.enter_context(distributed.Client(cluster))
        else:
            client = stack.enter_context(_connect(distributed, address))
        client.run(_limit_threads)
        try:
            yield client.get_executor(retries=2)
        except A2VError:
            raise
        except (
            distributed.KilledWorker,
            distributed.comm.CommClosedError,
            asyncio.CancelledError,
            CancelledError,
            OSError,
        ) as error:
            raise A2VError(
                _dask_failure(error, address, alive=client.status == "running")
            ) from error


@contextlib.contextmanager
def _silent(*loggers: logging.Logger) -> Iterator[None]:
    """Keep pages of what went wrong from standard error: the one sentence that is raised says
    it."""
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


CONNECT_SECONDS = 10.0


def _connect(distributed: Any, address: str) -> Any:
    """A client of the scheduler at `address`."""
    try:
        return distributed.Client(address, timeout=CONNECT_SECONDS)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"no Dask scheduler answers at '{address}' ({shorten(error, 80)}); start one (dask "
            "scheduler) or give another --address"
        ) from None


def _dask_failure(error: BaseException, address: str | None, *, alive: bool) -> str:
    """What happened to a run on Dask, in one line with its remedy."""
    if "KilledWorker" in type(error).__name__:
        return "Dask's workers were killed while they computed, most likely because they ran out of memory; run again with fewer or larger workers"  # noqa: E501
    where = f"at {address} " if address else ""
    lost = "a worker or the network failed" if alive else "it ended or cannot be reached any more"
    return f"the Dask scheduler {where}stopped answering: {lost}; what was finished is remembered: start it again and repeat the command"  # noqa: E501
