"""Parallel work by several processes, each on one core."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TypeVar

from a2v.errors import InputError
from a2v.lab.studio.variation import SPLITS
from a2v.processes import worker_context

T = TypeVar("T")


def check_counts(counts: Mapping[str, int], workers: int) -> None:
    """Check the requested numbers of views and processes.

    Raises
    ------
    InputError
        A split is unknown, a number of views is negative, or there is no process.
    """
    if unknown := [split for split in counts if split not in SPLITS]:
        raise InputError(f"unknown split '{unknown[0]}'; choose from {', '.join(SPLITS)}")
    if workers < 1 or min(counts.values(), default=0) < 0:
        raise InputError("workers must be at least 1, and numbers of views at least 0")


def work_through(
    work: Callable[[T], object], items: Sequence[T], workers: int, *, together: int = 1
) -> Iterator[None]:
    """Call `work` with each item, and yield after each, in their order.

    Parameters
    ----------
    work : callable
        It must be picklable: a function of a module, or a `functools.partial` of one. It has to
        cache what it opens itself.
    workers : int
        Number of processes; with 1 the work is done in this process.
    together : int
        Number of successive items that go to the same process.
    """
    if workers == 1:
        for item in items:
            work(item)
            yield
        return
    from concurrent.futures import ProcessPoolExecutor

    # the fork server, because open3d starts threads
    with ProcessPoolExecutor(
        workers, mp_context=worker_context(), initializer=_use_one_thread
    ) as pool:
        try:
            for _ in pool.map(work, items, chunksize=together):
                yield
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _use_one_thread() -> None:
    import cv2

    cv2.setNumThreads(1)
