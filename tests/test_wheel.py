"""The wheel contains everything needed and works from any folder."""

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
    listed = subprocess.run(
        ["git", "ls-files", *PACKAGES], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listed.returncode:
        pytest.skip("without a git checkout the project's files are unknown")
    return [name for name in listed.stdout.splitlines() if (ROOT / name).is_file()]


@pytest.fixture(scope="module")
def wheel(tracked: list[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of a copy of the repository: no leftovers of builds, no network."""
    folder = tmp_path_factory.mktemp("source")
    for name in [*tracked, "pyproject.toml", "setup.py", "README.md", "LICENSE"]:
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
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "-q",
        "--no-deps",
        "--no-index",
        "--no-compile",
        "--target",
        str(folder),
        str(wheel),
    ]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    return folder


@pytest.mark.slow
def test_every_file_of_the_packages_is_in_the_wheel(wheel: Path, tracked: list[str]) -> None:
    with zipfile.ZipFile(wheel) as archive:
        inside = {name for name in archive.namelist() if ".dist-info/" not in name}
        points = next(
            archive.read(name).decode()
            for name in archive.namelist()
            if name.endswith("entry_points.txt")
        )
    expected = {name if name.startswith("a2v/") else f"a2v/{name}" for name in tracked}
    assert not expected - inside, "name them in [tool.setuptools.package-data] of pyproject.toml"
    assert not inside - expected, (
        "pipelines and export lie beneath a2v: other packages have these names too"
    )
    assert "a2v = a2v.command:main" in points
    assert wheel.stat().st_size < 100 << 20  # PyPI's limit for a file


@pytest.mark.slow
def test_it_works_from_any_folder(installed: Path, tmp_path: Path) -> None:
    code = f"""
import sys; sys.path.insert(0, {str(installed)!r})
import importlib.abc
class Barred(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("pipelines", "export"):
            raise ImportError(f"{{name}} is imported, but a wheel has it beneath a2v")
sys.meta_path.insert(0, Barred())
import a2v, a2v.pipelines, a2v.export
assert all(module.__file__.startswith({str(installed)!r}) for module in (a2v, a2v.pipelines, a2v.export))
from a2v.command import load_pipelines
main = load_pipelines("cli").main
assert load_pipelines("engine.closure").top_folder().samefile({str(installed)!r})
for command in load_pipelines("cli").every_command():
    load_pipelines("cli").load_command(command)
sys.exit(main(["motion", "--action", "Walk", "--frames", "4", "--rig", "mixamo", "--out", "walk.bvh", "--json"]))
"""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert json.loads(done.stdout)["files"] == ["walk.bvh"]
    assert "mixamorig:Hips" in (tmp_path / "walk.bvh").read_text()
