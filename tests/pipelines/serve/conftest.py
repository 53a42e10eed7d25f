"""Fixtures of the page's tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from pipelines.serve.library import Library
from tests.support.page import Server, ready


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with one photo whose person is ready; nothing was computed."""
    folder = tmp_path_factory.mktemp("page")
    ready(Library(folder))
    running = Server(folder)
    yield running
    running.end()
