"""The ready person in a store, and the files that prompts name."""

from __future__ import annotations

from pathlib import Path

import pytest

import a2v
from a2v.samples.ready import PHOTO
from a2v.types import Character
from pipelines.engine.refs import Ref
from pipelines.engine.store import Store
from tests.support.doors import reduced, write_files
from tests.support.ready_store import ready_folder


@pytest.fixture(scope="session")
def store() -> Store:
    return Store(ready_folder())


@pytest.fixture(scope="session")
def small(store: Store) -> a2v.Person:
    """The ready person with few triangles, so that files are written quickly."""
    return a2v.make_character(PHOTO, cache=store.folder, triangles=2000, texture=512, normal_map=0)


@pytest.fixture(scope="session")
def few(small: a2v.Person, store: Store) -> Ref[Character]:
    """The same with few vertices in its videos too."""
    return reduced(small, store)


@pytest.fixture
def here(
    store: Store, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> Path:
    """A working folder with the files that prompts name."""
    folder = store.folder.parent / "asked"
    if not (folder / "own.bvh").exists():
        folder.mkdir(exist_ok=True)
        write_files(folder)
    monkeypatch.chdir(folder)
    return folder
