"""Error messages are one short line, whatever they quote."""

from __future__ import annotations

import pickle

import pytest

from a2v.errors import MAX_MESSAGE, A2VError, InputError, MissingDependencyError
from a2v.formats import read_bvh, write_bvh
from tests.support.commands import end
from tests.support.motions import person


@pytest.mark.parametrize("kind", [A2VError, InputError, MissingDependencyError])
def test_a_message_is_one_short_line_that_keeps_both_ends(kind):
    said = str(kind("given 'a\nb\r\n c\u2028d" + "9" * 5000 + "'; expected less"))
    assert said.startswith("given 'a b c d999")
    assert said.endswith("999'; expected less")
    assert len(said) <= MAX_MESSAGE
    assert str(kind("as it is;  two spaces")) == "as it is;  two spaces"
    assert str(pickle.loads(pickle.dumps(kind(said)))) == said


@pytest.mark.parametrize("line", ["action:", "count:", "action: 1", "frames: 9\nspeed: 1.0e+308"])
def test_settings_without_a_value_and_a_speed_that_is_none(tmp_path, line):
    (tmp_path / "a.yaml").write_text(f"seed: 1\n{line}\n")
    with pytest.raises(
        A2VError,
        match="no value; give one"
        if line.endswith(":")
        else "expected text"
        if "action" in line
        else "speed",
    ):
        end(
            [
                "motion",
                "--action=Walk",
                "--model=humanact12",
                f"--config={tmp_path / 'a.yaml'}",
                f"--out={tmp_path / 'a.npz'}",
            ]
        )


def test_a_leg_without_a_hip(tmp_path):
    write_bvh(tmp_path / "a.bvh", person(frames=3))
    text = (tmp_path / "a.bvh").read_text()
    assert "left_hip" in text
    read_bvh(text.replace("left_hip", "left_thing").encode(), fps=0.1, person=False)
