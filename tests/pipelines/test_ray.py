"""Ray as the executor, in its own environment that sees this one's packages, else skipped.

`scripts/make_ray_environment.sh` makes the environment.
"""

from __future__ import annotations

import importlib
import os
import shutil
import sys
from pathlib import Path

import pytest

from a2v.io import sha256
from pipelines.engine.executors import RayExecutor
from pipelines.engine.store import Store, default_folder
from tests.support.batches import batch, dies_once, drive, task

pytest.importorskip("ray", reason="needs a2v[ray]")
SAMPLE = Path(__file__).resolve().parents[2] / "a2v" / "samples" / "person.jpg"
LIGHT = (
    "--fit.rounds",
    "2",
    "--fit.steps",
    "3",
    "--perception.refine",
    "false",
    "--implicit.resolution",
    "200",
    "--implicit.vertices",
    "25000",
    "--color.texture",
    "256",
)
OF_PEOPLE = (
    "subject",
    "photo_body",
    "surface",
    "body",
    "colored_surface",
    "character",
    "task_person",
)


def where_from(module: str) -> tuple[str, str | None, str]:
    """Return a module's file, Ray's setting of reports, and the working folder of a worker."""
    return (
        str(importlib.import_module(module).__file__),
        os.environ.get("RAY_USAGE_STATS_ENABLED"),
        str(Path.cwd()),
    )


def test_workers_import_nothing_from_the_working_folder_and_report_nothing(tmp_path, monkeypatch):
    (tmp_path / "colorsys.py").write_text("")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [folder for folder in sys.path if folder])
    executor = RayExecutor(workers=1)
    try:
        path, reports, folder = executor.submit(where_from, "colorsys").result()
    finally:
        executor.shutdown()
    assert Path(path).parent != tmp_path
    assert reports == "0"
    assert folder == str(tmp_path)


def test_a_worker_that_dies_takes_only_its_own_task(monkeypatch, tmp_path):
    over = drive(
        monkeypatch, tmp_path, [task(name) for name in ("a", "b", "c")], dies_once, executor="ray"
    )
    assert not any(result.problem for result in over.values())


@pytest.mark.slow
def test_a_batch_gives_the_same_files(tmp_path):
    """People come from the first run's store; Ray's workers make motions and videos in their own."""
    shutil.copy(SAMPLE, tmp_path / "me.jpg")
    (tmp_path / "jobs.csv").write_text("photo,action,seed\nme.jpg,Walk,7\nme.jpg,Jump,8\n")
    assert batch(tmp_path / "jobs.csv", tmp_path / "serial", *LIGHT) == 0
    other = Store(tmp_path / "store")
    shutil.copytree(default_folder() / "objects", other.folder / "objects", copy_function=os.link)
    for name in OF_PEOPLE:
        shutil.copytree(default_folder() / "calls" / name, other.folder / "calls" / name)
    assert (
        batch(
            tmp_path / "jobs.csv",
            tmp_path / "ray",
            *LIGHT,
            "--executor",
            "ray",
            "--workers",
            "2",
            "--cache",
            str(other.folder),
        )
        == 0
    )
    files = {
        path.relative_to(tmp_path / "serial"): sha256(path)
        for path in (tmp_path / "serial").glob("*/*")
        if path.name != "job.json"
    }
    assert len(files) == 2 * 7
    assert {path: sha256(tmp_path / "ray" / path) for path in files} == files
