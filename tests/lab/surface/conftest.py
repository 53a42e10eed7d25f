"""An ellipsoid's photographs, as the studio writes them."""

from __future__ import annotations

from pathlib import Path

import pytest

from a2v.io import write_npz
from a2v.lab.studio.view import View, view_path
from tests.support.ellipsoid import ellipsoid, make_view


@pytest.fixture(scope="session")
def view() -> View:
    return make_view(0)


@pytest.fixture(scope="session")
def studio(tmp_path_factory: pytest.TempPathFactory, view: View) -> Path:
    """A folder of two views, as the studio writes it."""
    folder = tmp_path_factory.mktemp("studio")
    for index, one in enumerate((view, make_view(1))):
        write_npz(view_path(folder, "training", index), one.to_arrays())
    write_npz(folder / "guide.npz", {"faces": ellipsoid().faces})
    return folder
