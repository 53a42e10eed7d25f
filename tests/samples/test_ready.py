"""The ready person is the one that the pipeline makes of the sample photo today.

Where this fails after a change of perception, fit or reconstruction, and the pipeline's person is
right: ``python scripts/make_ready_person.py``, then ``make notebooks``.
"""

from __future__ import annotations

import dataclasses
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from a2v.processes import python_command
from a2v.samples import ReadyPerson, load_ready_person
from a2v.samples.ready import FACE_STEP, PHOTO, STEP
from a2v.types import Character
from pipelines.engine.store import Store
from pipelines.requests.video import photo_parameters
from pipelines.run import run
from scripts.make_ready_person import made_now
from tests.support.whole_run import whole_run

ROOT = Path(__file__).resolve().parents[2]
FITTED = 0.001
"""Largest distance of bones, meters. What rounding moves by more has not ended at its minimum
(docs/results/machines.md)."""
SHAPED = 0.001
"""The same of surfaces, on average."""
COLORED = 0.02
"""Largest mean difference of colors, as a share of white. The unseen sides are matched from patches,
whose order a rounded color can change."""
KERNELS = ("native", "default")
"""Kernels of PyTorch: those of this processor, and those of any processor."""


@pytest.fixture(scope="module")
def ready() -> ReadyPerson:
    return load_ready_person()


@pytest.fixture(scope="module", params=KERNELS)
def today(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> ReadyPerson:
    """Made by ``a2v video`` with this processor's kernels, and in a process of its own with the
    others."""
    folder = tmp_path_factory.mktemp("ready") / "store"
    if request.param == "native":
        folder = whole_run().store
    else:
        code = (
            "from pathlib import Path; from scripts.make_ready_person import made_now; "
            f"from pipelines.engine.store import Store; made_now(Store(Path({str(folder)!r})))"
        )
        environment = {**os.environ, "ATEN_CPU_CAPABILITY": request.param}
        subprocess.run(python_command(code), env=environment, check=True, cwd=ROOT)
    return made_now(Store(folder))


def test_the_subject_is_that_of_today(ready: ReadyPerson, today: ReadyPerson) -> None:
    assert np.array_equal(ready.subject.image, today.subject.image)
    assert ready.subject.crop == today.subject.crop
    assert np.abs(ready.subject.mask - today.subject.mask).mean() < 0.003
    shifts = ready.subject.keypoints[:, :2] - today.subject.keypoints[:, :2]
    assert np.linalg.norm(shifts, axis=1).max() < 3.0
    ours, theirs = ready.subject.bodymap, today.subject.bodymap
    assert ours is not None
    assert theirs is not None
    both = ours.inside & theirs.inside
    assert both.sum() > 0.97 * (ours.inside | theirs.inside).sum()
    assert np.abs(ours.places[both] - theirs.places[both]).mean() < 0.01


@pytest.mark.parametrize("name", ["photo_body", "body"])
def test_the_bodies_are_those_of_today(name: str, ready: ReadyPerson, today: ReadyPerson) -> None:
    ours, theirs = getattr(ready, name), getattr(today, name)
    assert ours.bone_names == theirs.bone_names
    for places in ("bone_transforms", "rest_transforms"):
        shifts = (getattr(ours, places) - getattr(theirs, places))[:, :3, 3]
        assert np.linalg.norm(shifts, axis=1).max() < FITTED, places
    assert np.linalg.norm(ours.vertices - theirs.vertices, axis=1).max() < 2 * FITTED


def test_the_camera_is_that_of_today(ready: ReadyPerson, today: ReadyPerson) -> None:
    points = today.body.vertices
    away = ready.photo_camera.project(points) - today.photo_camera.project(points)
    assert np.linalg.norm(away, axis=1).max() < 3.0


@pytest.mark.parametrize("name", ["colored_surface", "shaded_surface"])
def test_the_surfaces_are_those_of_today(name: str, ready: ReadyPerson, today: ReadyPerson) -> None:
    ours, theirs = getattr(ready, name), getattr(today, name)
    assert np.array_equal(ours.faces, theirs.faces)
    assert np.array_equal(ours.uv, theirs.uv)
    for mine, other in ((ours, theirs), (ours.standing, theirs.standing)):
        assert np.linalg.norm(mine.vertices - other.vertices, axis=1).mean() < SHAPED
    assert np.abs(ours.colors - theirs.colors).mean() < COLORED
    levels = ours.texture.astype(float) - theirs.texture
    assert np.abs(levels).mean() < 255 * COLORED
    assert (ours.visible == theirs.visible).mean() > 0.97


def test_the_character_is_that_of_today(ready: ReadyPerson, today: ReadyPerson) -> None:
    ours, theirs = ready.character, today.character
    for name in ("anchors", "parts"):
        assert np.array_equal(getattr(ours, name), getattr(theirs, name)), name
    assert np.abs(ours.weights - theirs.weights).mean() < 1e-3
    face, other = ours.surface.face, theirs.surface.face
    assert face is not None
    assert other is not None
    assert face.names == other.names
    assert len(face.offsets) == pytest.approx(len(other.offsets), rel=0.01)
    for name in ("jawOpen", "eyeBlinkLeft"):
        shifts = [np.linalg.norm(one.target(name)[1], axis=1).max() for one in (face, other)]
        assert shifts[0] == pytest.approx(shifts[1], rel=0.1, abs=2e-4)


def test_what_is_saved_is_what_is_read(
    ready: ReadyPerson, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    moved = ready.colored_surface.vertices + np.float32(0.01)
    other = dataclasses.replace(
        ready, colored_surface=dataclasses.replace(ready.colored_surface, vertices=moved)
    )
    path = tmp_path / "person.npz"
    other.save(path)
    monkeypatch.setattr("a2v.samples.ready.FILE", path)
    again = load_ready_person()
    assert np.abs(again.colored_surface.vertices - moved).max() <= 1.01 * STEP
    assert ready.colored_surface.standing is not None
    assert again.colored_surface.standing is not None
    standing = again.colored_surface.standing.vertices - ready.colored_surface.standing.vertices
    assert np.abs(standing).max() <= STEP / 2 + 1e-6
    faces = [one.colored_surface.face for one in (again, ready)]
    assert faces[0] is not None
    assert faces[1] is not None
    assert np.array_equal(faces[0].vertices, faces[1].vertices)
    assert np.abs(faces[0].offsets - faces[1].offsets).max() <= FACE_STEP
    assert np.array_equal(again.subject.mask, ready.subject.mask)
    assert np.abs(again.body.vertices - ready.body.vertices).max() < 1e-6
    assert path.stat().st_size < 1.2e6


def test_a_run_starts_from_its_stages(ready: ReadyPerson, tmp_path: Path) -> None:
    store = Store(tmp_path)
    given = {name: store.put(value) for name, value in ready.outputs.items()}
    outcome = run(
        "character",
        store=store,
        overrides={name: ref for name, ref in given.items() if name != "character"},
        **photo_parameters(store, PHOTO),
    )
    assert set(outcome.nodes) == {"character"}
    assert outcome.get("character", Character).to_bytes() == ready.character.to_bytes()
