"""Every action of ``a2v actions`` goes through the whole graph, and many into one file of clips."""

from __future__ import annotations

import pytest

from a2v.samples.ready import PHOTO
from pipelines.cli import main
from tests.support.doors import ACTIONS, LENGTH, by_python, check_glb, go_through

CHUNK = 16
TOGETHER = ACTIONS[::12]
"""Actions of one file; ``test_doors.py`` shows that the command means the same by all others."""


def test_there_are_379_actions(capsys):
    assert main(["actions", "--json"]) == 0
    assert len(ACTIONS) == len(set(ACTIONS)) == 379
    listed = capsys.readouterr().out
    assert all(name in listed for name in ACTIONS)


@pytest.mark.parametrize("start", range(0, len(ACTIONS), CHUNK))
def test_every_action_goes_through_the_graph(start, few, store):
    """The request that `make_motion` makes, up to the vertices of each frame and the GLB."""
    for name in ACTIONS[start : start + CHUNK]:
        request = by_python({"action": name, "seconds": LENGTH})
        assert go_through(request, few, store).action == name


def test_one_character_file_holds_many_actions(store, tmp_path):
    """The command makes one clip of each action; poses are those of the other test."""
    words = ["--photo", PHOTO, "--actions", ",".join(TOGETHER), "--seconds", LENGTH, "--quiet"]
    size = ["--triangles", 2000, "--texture", 512, "--normal-map", 0, "--cache", store.folder]
    target = tmp_path / "all.glb"
    assert main([str(word) for word in ["character", *words, *size, "--out", target]]) == 0
    assert check_glb(target.read_bytes()) == len(TOGETHER) == 32
