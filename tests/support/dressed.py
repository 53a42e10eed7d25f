"""A body that is photographed wider than it is, for the tests of every backend."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from a2v.types import Body, OrthographicCamera, Subject


@pytest.fixture(scope="session")
def scene() -> tuple[Subject, Body, OrthographicCamera]:
    from tests.support.photographs import dressed_scene

    return dressed_scene()
