"""Loading libraries beside a block."""

from __future__ import annotations

import threading

import pytest

from a2v.beside import loading_beside


def test_loaders_run_in_order_beside_the_block() -> None:
    called, both = [], threading.Event()

    def last() -> None:
        called.append((2, threading.current_thread() is threading.main_thread()))
        both.set()

    with loading_beside(lambda: called.append((1, False)), last):
        assert both.wait(10)
    assert called == [(1, False), (2, False)]


def test_an_error_of_the_block_waits_for_the_current_loader_only() -> None:
    started, go_on, called = threading.Event(), threading.Event(), []

    def first() -> None:
        started.set()
        assert go_on.wait(10)
        called.append(1)

    def block() -> None:
        with loading_beside(first, lambda: called.append(2)):
            assert started.wait(10)
            threading.Timer(0.05, go_on.set).start()
            raise ValueError("of the block")

    with pytest.raises(ValueError, match="of the block"):
        block()
    assert called == [1]


def test_a_loader_that_fails_does_not_keep_the_next_from_loading() -> None:
    called = threading.Event()

    def fail() -> None:
        raise ImportError("missing")

    with loading_beside(fail, called.set):
        assert called.wait(10)
