"""Files of jobs: what they may contain, and that hostile ones reach nothing."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from a2v.errors import InputError
from pipelines.batch import rows
from pipelines.batch.rows import Row, read_rows
from pipelines.batch.tasks import Planner, folder_name
from pipelines.engine.store import Store
from pipelines.requests.motion import MotionRequest
from pipelines.requests.video import VideoRequest

SAMPLE = Path(__file__).resolve().parents[2] / "a2v" / "samples" / "person.jpg"


def read(tmp_path: Path, text: str | bytes, name: str = "jobs.csv") -> list[Row]:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_rows(path, VideoRequest.of(photo="", frames=8, seed=5, size=64))


def test_csv_and_yaml_say_the_same(tmp_path):
    table = read(
        tmp_path,
        b'\xef\xbb\xbfphoto, action ,seed,Render-Seed,fps,denoise\r\nme.jpg,"Walk, '
        b'Jump",3,7,12.5,no\r\n\r\nyou.jpg,Run,,,,\r\n',
    )
    listed = read(
        tmp_path,
        "- {photo: me.jpg, action: [Walk, ' Jump'], seed: 3, render-seed: 7, fps: 12.5, denoise: "
        "false}\n- {photo: you.jpg, action: Run}\n",
        "jobs.yaml",
    )
    assert table == listed
    first, second = (row.request for row in table)
    assert first.person.photo == str(tmp_path / "me.jpg")
    assert (first.motion.seed, first.film.render_seed, first.motion.fps, first.film.denoise) == (
        3,
        7,
        12.5,
        False,
    )
    assert (second.motion.seed, second.motion.frames, second.film.size) == (5, 8, 64)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("photo,action\n", "lists no jobs"),
        ("photo,acton\na,b\n", "unknown column 'acton'"),
        ("photo,photo\na,b\n", "twice"),
        ("photo,action\na,b,c\n", "more cells"),
        ('photo,action\n"a,b', "CSV"),
        (b"photo,action\n\xff\xfe,b\n", "UTF-8"),
        ("photo,out\na,../../etc\n", "unknown column 'out'"),
    ],
)
def test_a_table_that_is_none_is_told_in_one_line(tmp_path, text, words):
    with pytest.raises(InputError, match=words) as caught:
        read(tmp_path, text)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "photo: x",
        "- 3",
        "- [a",
        "!!python/object/apply:os.system [true]",
        "&a [*a, *a]",
        "- {photo: 2001-01-01}\n- x",
    ],
)
def test_yaml_is_read_without_running_anything(tmp_path, text):
    with pytest.raises(InputError):
        read(tmp_path, text, "jobs.yml")


def test_a_row_takes_an_action_in_words_as_the_command_does(tmp_path):
    shutil.copy(SAMPLE, tmp_path / "me.jpg")
    table = read(
        tmp_path,
        'photo,action,seed\nme.jpg,"walking slowly, then '
        'jump",1\nme.jpg,"Walk,Jump",1\nme.jpg,juggle fire,1\n',
    )
    listed = read(
        tmp_path, "- {photo: me.jpg, action: [walking slowly, then jump], seed: 1}\n", "jobs.yaml"
    )
    planner = Planner(Store(tmp_path / "store"))
    prompt, plain, nonsense, same = map(planner.job, [*table, *listed])
    expected = MotionRequest(action="walking slowly, then jump", frames=8).resolve().parameters
    assert prompt.tasks[1].parameters["steps"] == expected["steps"]
    assert [step.action for step in expected["steps"]] == ["Walk slowly", "Jump"]
    assert "walking slowly" in " ".join(prompt.notes)
    assert plain.notes == (
        "'Walk' is taken for Walk [CMU motion capture]",
        "'Jump' is taken for Jump [CMU motion capture]",
    )
    assert prompt.tasks[0].key == plain.tasks[0].key
    assert prompt.tasks[1].key == same.tasks[1].key != plain.tasks[1].key
    assert "juggle" in nonsense.row.problem
    assert not nonsense.tasks


def test_many_rows_are_too_many(tmp_path, monkeypatch):
    monkeypatch.setattr(rows, "MAX_ROWS", 3)
    with pytest.raises(InputError, match="more than 3"):
        read(tmp_path, "photo,action\n" + "a,b\n" * 4)


@pytest.mark.parametrize(
    "cell",
    [
        "seed\nx1",
        "frames\n1e3",
        "denoise\nmaybe",
        "fps\nnan",
        "seed\n" + "9" * 400,
        "mask\nx" + "y" * 5000,
    ],
)
def test_a_bad_cell_is_the_problem_of_its_row(tmp_path, cell):
    name, _, value = cell.partition("\n")
    found = read(tmp_path, f"photo,{name}\nme.jpg,{value}\nme.jpg,\n")
    assert name in found[0].problem
    assert not found[1].problem
    assert "no photo" in read(tmp_path, "photo,action\n,Walk\n")[0].problem


@pytest.mark.parametrize(
    "name", ["../../etc/passwd", "..", "/root", "a/b\\c", ".", "~", "‮gpj", "x" * 500, "CON", "a\nb"]
)
def test_names_of_folders_are_ours(name):
    row = Row(number=1, name=name, request=VideoRequest.of(photo="../me.jpg", action="../Walk"))
    found = folder_name(row, None)
    assert Path(found).name == found
    assert found.replace("-", "").isalnum()
    assert found.isascii()
    assert len(found) < 80
