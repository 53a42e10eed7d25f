"""Run nodes in this process, in local processes, on Dask or on Ray.

Each executor is a `concurrent.futures.Executor`. A fork server starts local workers, never fork,
since mitsuba, torch and onnxruntime hold threads. A worker has one BLAS, OpenMP and Dr.Jit thread
each. It ends with the process that started it, even if that is killed.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
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
from a2v.processes import safe_children, worker_context
from a2v.system import core_count
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
    """Runs every call immediately in the calling thread."""

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Run the call now; the returned future is finished."""
        future: Future[Any] = Future()
        try:
            future.set_result(function(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


class RayExecutor(Executor):
    """Runs calls as Ray tasks; Ray retries a call whose worker dies."""

    def __init__(self, address: str | None = None, workers: int | None = None) -> None:
        os.environ.setdefault(
            "RAY_USAGE_STATS_ENABLED", "0"
        )  # Ray would report usage to its developers.
        os.environ.setdefault(
            "RAY_enable_metrics_collection", "0"
        )  # Otherwise its workers complain that nobody collects their metrics.
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
            with (
                safe_children(),
                _in_program_folder(),
            ):  # Workers import from the folder in which Ray starts.
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
def _in_program_folder() -> Iterator[None]:
    """Work in the folder of this program, whose modules are found without it."""
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
"""Environment variables that a worker takes from the moment of its start.

Others are those of the start of the fork server.
"""


class LocalExecutor(Executor):
    """Processes of this machine, started at the first call.

    A run that calls no node many times starts none.
    """

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._pool: ProcessPoolExecutor | None = None
        self._stopped = False

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Give the call to a worker."""
        if self._stopped:
            raise CancelledError
        if self._pool is None:
            self._pool = _start_pool(self._workers)
        return self._pool.submit(function, *args, **kwargs)

    def stop(self) -> None:
        """End the workers immediately and refuse further calls; may be called from any thread."""
        self._stopped = True
        self.shutdown(cancel_futures=True)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers; with `cancel_futures` immediately, also those that are busy."""
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
            # The manager closes a pipe to which the interpreter writes at its end. Without this
            # wait that write sometimes fails with a bad file descriptor.
            manager.join(5)


def _start_pool(workers: int) -> ProcessPoolExecutor:
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(_ONE_THREAD)  # The fork server gives its environment to every worker.
    try:
        context = worker_context()
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name)
            else:
                os.environ[name] = value
    given = {name: os.environ[name] for name in _HANDED_DOWN if name in os.environ}
    return ProcessPoolExecutor(
        workers,
        mp_context=context,
        initializer=_start_worker,
        initargs=(given,),
    )


def _start_worker(environment: dict[str, str]) -> None:
    """Set up a new local worker: one thread, no Ctrl-C, and an end with its parent."""
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
    """Return the number of processor cores that this process may use."""
    return core_count()


@contextlib.contextmanager
def open_executor(
    name: ExecutorName | Executor = "local",
    *,
    workers: int | None = None,
    address: str | None = None,
) -> Iterator[Executor]:
    """Yield an executor; after an error no waiting call is started.

    Parameters
    ----------
    name : one of EXECUTORS, or a custom executor, which is left open
    workers : int or None
        Number of processes; None for one per core.
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
    """Suppress long logs of an error on standard error: the raised exception has one sentence."""
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
    """Return a client of the scheduler at `address`.

    Earlier clients that nobody closed are collected first: the finalizer of such a client stops its
    loop and deadlocks if Python runs it while another client starts.
    """
    gc.collect()
    try:
        return distributed.Client(address, timeout=CONNECT_SECONDS)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"no Dask scheduler answers at '{address}' ({shorten(error, 80)}); start one (dask "
            "scheduler) or give another --address"
        ) from None


def _dask_failure(error: BaseException, address: str | None, *, alive: bool) -> str:
    """Return one line about the failure of a run on Dask, with advice."""
    if "KilledWorker" in type(error).__name__:
        return "Dask's workers were killed while they computed, most likely because they ran out of memory; run again with fewer or larger workers"  # noqa: E501
    where = f"at {address} " if address else ""
    lost = "a worker or the network failed" if alive else "it ended or cannot be reached any more"
    return f"the Dask scheduler {where}stopped answering: {lost}; what was finished is remembered: start it again and repeat the command"  # noqa: E501
