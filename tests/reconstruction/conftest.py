"""A body that is photographed wider than it is."""

from __future__ import annotations

import pytest

from a2v.types import Body, OrthographicCamera, Subject
from tests.support.photographs import dressed_scene


@pytest.fixture(scope="session")
def scene() -> tuple[Subject, Body, OrthographicCamera]:
    return dressed_scene()
