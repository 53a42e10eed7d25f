"""The wheel: everything that is needed is inside, and it works from any folder."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("a2v", "pipelines", "export")


@pytest.fixture(scope="module")
def tracked() -> list[str]:
    """The repository's files that belong into the wheel."""
    listed = subprocess.run(["git", "ls-files", *PACKAGES], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("this is no git checkout: it cannot be told which files are the project's")
    return [name for name in listed.stdout.splitlines() if (ROOT / name).is_file()]


@pytest.fixture(scope="module")
def wheel(tracked: list[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of a copy of the repository: no leftovers of builds, no network."""
    folder = tmp_path_factory.mktemp("source")
    for name in [*tracked, "pyproject.toml", "README.md", "LICENSE"]:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, folder / name)
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "-q",
        "--no-deps",
        "--no-build-isolation",
        "--no-index",
        "-w",
        str(folder / "dist"),
        str(folder),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr[-2000:]
    (made,) = (folder / "dist").glob("a2v-*.whl")
    return made


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What pip puts into site-packages, without the dependencies."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-index", "--no-compile", "--target", str(folder), str(wheel)]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    return folder


@pytest.mark.slow
def test_every_file_of_the_packages_is_in_the_wheel(wheel: Path, tracked: list[str]) -> None:
    with zipfile.ZipFile(wheel) as archive:
        inside = {name for name in archive.namelist() if ".dist-info/" not in name}
        points = next(archive.read(name).decode() for name in archive.namelist() if name.endswith("entry_points.txt"))
    assert not set(tracked) - inside, "name them in [tool.setuptools.package-data] of pyproject.toml"
    assert not inside - set(tracked)
    assert "a2v = pipelines.cli:main" in points
    assert wheel.stat().st_size < 100 << 20  # PyPI's limit for a file


@pytest.mark.slow
def test_it_works_from_any_folder(installed: Path, tmp_path: Path) -> None:
    code = f"""
import sys; sys.path.insert(0, {str(installed)!r})
import a2v, pipelines, export
assert all(module.__file__.startswith({str(installed)!r}) for module in (a2v, pipelines, export))
from pipelines.cli import main
sys.exit(main(["motion", "--action", "Walk", "--frames", "4", "--rig", "mixamo", "--out", "walk.bvh", "--json"]))
"""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert json.loads(done.stdout)["files"] == ["walk.bvh"]
    assert "mixamorig:Hips" in (tmp_path / "walk.bvh").read_text()
