"""Files from outside: what is read, what is refused, and what messages quote."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError, printable
from a2v.io import claim, open_file, read_bytes, read_npz, shorten
from pipelines.cli import main


@pytest.mark.parametrize("read", [read_bytes, read_npz, open_file])
def test_a_pipe_is_refused_at_once(tmp_path, read):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="not a regular file"):
        read(tmp_path / "pipe")


@pytest.mark.parametrize("read", [read_bytes, read_npz, open_file])
def test_a_device_behind_a_link_is_refused(tmp_path, read):
    (tmp_path / "endless").symlink_to("/dev/zero")
    with pytest.raises(InputError, match="not a regular file"):
        read(tmp_path / "endless")


@pytest.mark.parametrize("read", [read_bytes, read_npz, open_file])
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("", "is a folder"),
        ("missing", "does not exist"),
        ("a\0b", "cannot read"),
        ("n" * 300, "cannot read"),
    ],
)
def test_what_cannot_be_opened_is_named(tmp_path, read, name, words):
    with pytest.raises(InputError, match=words):
        read(tmp_path / name)


def test_at_most_the_limit_is_read(tmp_path):
    file = tmp_path / "file"
    file.write_bytes(b"12345")
    assert read_bytes(file, limit=5) == b"12345"
    with pytest.raises(InputError, match="larger than"):
        read_bytes(file, limit=4)


def test_text_cannot_steer_a_terminal():
    assert printable("\x1b[2Ja\u202eb\x9bc\ud800") == "\\x1b[2Ja\\u202eb\\x9bc\\ud800"
    assert printable("Größe\tß\n人 👩\u200d🦰") == "Größe\tß\n人 👩\u200d🦰"


def test_quotes_in_messages_are_short_even_of_what_explodes():
    bomb: list = ["x"]
    for _ in range(60):
        bomb = [bomb] * 9
    for value in (
        bomb,
        "x" * 10**6,
        dict.fromkeys(range(1000), "y" * 1000),
        ValueError("z" * 10**6),
    ):
        assert len(shorten(value)) <= 200
    assert shorten("a\n b") == "a b"
    assert shorten(KeyError()) == "KeyError"


def test_errors_and_names_from_outside_reach_the_terminal_escaped(tmp_path, capsys):
    assert (
        main(
            [
                "video",
                "--photo",
                str(tmp_path / "a\x1b]0;title\x07.jpg"),
                "--action",
                "Walk",
                "--out",
                str(tmp_path / "out"),
            ]
        )
        == 2
    )
    error = capsys.readouterr().err
    assert "\x1b" not in error
    assert "\\x1b]0;title\\x07" in error


def test_files_appear_with_the_modes_of_the_umask(tmp_path):
    from a2v.io import write_npz

    write_npz(tmp_path / "a.npz", {"a": np.zeros(3)})
    mask = os.umask(0)
    os.umask(mask)
    assert stat.S_IMODE((tmp_path / "a.npz").stat().st_mode) == 0o666 & ~mask


def test_a_folder_has_one_writer_at_a_time(tmp_path: Path) -> None:
    with claim(tmp_path):
        with pytest.raises(InputError, match="another run is writing to"), claim(tmp_path):
            pass
        other = [
            sys.executable,
            "-c",
            "import sys; from a2v.io import claim\nwith claim(sys.argv[1]): pass",
            str(tmp_path),
        ]
        assert b"another run is writing" in subprocess.run(other, capture_output=True).stderr
    with claim(tmp_path):
        assert not list(tmp_path.iterdir())  # nothing marks it
    assert subprocess.run(other, capture_output=True).returncode == 0
