"""Photos without a ground truth: measures beside the photo, faces seen again, sheets, tables."""

from __future__ import annotations

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from a2v.animation import load_rig
from a2v.animation.rest_pose import rest_transforms
from a2v.errors import InputError
from a2v.lab.evaluation.photos.made import Made
from a2v.lab.evaluation.photos.measures import PhotoOutcome, measure
from a2v.lab.evaluation.photos.sheets import photo_sheet
from a2v.lab.evaluation.photos.tables import (
    Grade,
    grades_table,
    measures_table,
    rank_correlation,
    read_grades,
    summary_lines,
)
from a2v.samples import load_ready_person
from a2v.samples.ready import PHOTO
from pipelines.cli import main


@pytest.fixture(scope="module")
def made() -> Made:
    person = load_ready_person()
    still = rest_transforms(person.character.body, load_rig("vrm"))
    return Made(
        person.subject,
        person.photo_camera,
        person.colored_surface,
        person.character,
        np.stack([still, still]),
        ("a note",),
    )


def test_the_sample_is_measured_as_the_same_person(made: Made) -> None:
    pytest.importorskip("dlib", reason="faces are compared by the extra a2v[evaluation]")
    found = measure(made)
    assert found["iou"] > 0.9
    assert found["color"] < 10
    assert found["face"] < 0.45
    assert found["face"] < found["face 35"] < 0.6
    assert max(found[name] for name in ("rest", "blink", "open mouth")) < 0.1


def test_a_person_in_other_colors_or_elsewhere_is_worse(made: Made) -> None:
    right = made.beside(size=160).compared()
    dark = dataclasses.replace(made.surface, texture=made.surface.texture // 2)
    darker = dataclasses.replace(made, surface=dark).beside(size=160).compared()
    assert darker["color"] > right["color"] + 10
    assert darker["iou"] == right["iou"]
    aside = dataclasses.replace(
        made.surface, vertices=made.surface.vertices + np.float32([0.3, 0, 0])
    )
    shifted = dataclasses.replace(made, surface=aside).beside(size=160).compared()
    assert shifted["iou"] < 0.5


def test_a_sheet_has_two_rows_of_eight_and_the_text(made: Made) -> None:
    picture = photo_sheet(made, ["one", "two"], size=80)
    assert picture.shape == (2 * 80 + 36, 8 * 80, 3)
    for row in (slice(0, 80), slice(80, 160)):
        for column in range(8):
            assert np.ptp(picture[row, 80 * column : 80 * (column + 1)]) > 40


def test_grades_are_read_and_correlated(tmp_path: Path) -> None:
    file = tmp_path / "grades.csv"
    file.write_text('photo,grade,reason\na.jpg,5,fine\nb,1,"no head, at all"\n')
    grades = read_grades(file)
    assert grades == {"a": Grade(5, "fine"), "b": Grade(1, "no head, at all")}
    file.write_text("photo,grade,reason\na,6,great\n")
    with pytest.raises(InputError, match="grade '6'"):
        read_grades(file)
    file.write_text("photo,mark\na,5\n")
    with pytest.raises(InputError, match="columns photo, mark"):
        read_grades(file)
    assert rank_correlation([1.0, 2.0, 3.0], [2, 3, 5]) == pytest.approx(1.0)
    assert rank_correlation([3.0, 2.0, 1.0], [2, 3, 5]) == pytest.approx(-1.0)


def test_tables_have_a_row_per_photo() -> None:
    values = {"iou": 0.9, "color": 5.0, "face": 0.4, "face 35": 0.5}
    outcomes = [
        PhotoOutcome("a", values, ("a note",)),
        PhotoOutcome("b", failure="no person"),
    ]
    grades = {"a": Grade(4, "hair")}
    assert "| a | 0.900 | 5.0 |" in measures_table(outcomes)
    assert "| b | no person |" in measures_table(outcomes)
    assert "| a | 4 | hair | a note |" in grades_table(outcomes, grades)
    lines = " ".join(summary_lines(outcomes, grades))
    assert "1 of 2 photos" in lines
    assert "1 of 1 are recognized" in lines
    assert "1 of grade 4" in lines


@pytest.mark.slow
def test_the_command_draws_measures_and_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("dlib", reason="faces are compared by the extra a2v[evaluation]")
    folder, out = tmp_path / "photos", tmp_path / "out"
    folder.mkdir()
    shutil.copy(PHOTO, folder / "someone.jpg")
    (tmp_path / "grades.csv").write_text("photo,grade,reason\nsomeone,5,all is right\n")
    quick = [
        *("--backend", "body-prior", "--fit.starts", "1", "--fit.rounds", "3", "--quiet"),
        *("--color.texture", "512", "--color.tolerance", "0.1", "--color.delight", "false"),
        *("--shape.resolution", "200", "--shape.vertices", "25000", "--color.synthesis", "false"),
    ]
    words = ["evaluate", "photos", str(folder), "--out", str(out), *quick]
    assert main([*words, "--grades", str(tmp_path / "grades.csv")]) == 0
    content = json.loads((out / "photos.json").read_text())
    assert content["photos"][0]["values"]["iou"] > 0.8
    assert "all is right" in (out / "photos.md").read_text()
    first = (out / "someone.png").stat().st_mtime_ns
    assert main(words) == 0
    assert (out / "someone.png").stat().st_mtime_ns == first
    capsys.readouterr()
    assert main([*words, "--only", "nobody"]) == 2
    assert "no photo 'nobody'" in capsys.readouterr().err
