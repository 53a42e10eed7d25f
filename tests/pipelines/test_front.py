"""The Python functions write the same bytes as the commands; `docs/python.md` runs."""

from __future__ import annotations

import doctest
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import a2v
from a2v.io import sha256
from pipelines.cli import main

ROOT = Path(__file__).resolve().parents[2]
SAMPLE = ROOT / "a2v" / "samples" / "person.jpg"
FILM = {"views": ["front"], "size": 64, "spp": 1}
SMALL = ["--views", "front", "--size", "64", "--spp", "1", "--executor", "serial", "--quiet"]


@pytest.fixture(scope="module")
def me() -> a2v.Person:
    return a2v.make_character(SAMPLE)


@pytest.fixture(scope="module")
def walk() -> a2v.MotionClip:
    return a2v.make_motion("Walk", frames=3)


def command(*words: object) -> None:
    assert main([str(word) for word in words]) == 0


def test_a_character_is_that_of_the_command(me, tmp_path):
    command("reconstruct", "--photo", SAMPLE, "--out", tmp_path / "b.glb", "--quiet")
    assert me.save(tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()


def test_clips_are_those_of_the_command(me, walk, tmp_path):
    command(
        "character",
        "--photo",
        SAMPLE,
        "--actions",
        "Walk",
        "--frames",
        3,
        "--out",
        tmp_path / "b.glb",
        "--quiet",
    )
    assert (
        me.save(tmp_path / "a.glb", motions={"Walk": walk}).read_bytes()
        == (tmp_path / "b.glb").read_bytes()
    )
    named = me.save(tmp_path / "c.glb", motions={"there": walk, "again": walk}, rig="mixamo")
    assert b'"there"' in named.read_bytes()
    assert b'"again"' in named.read_bytes()


def test_edits_reach_the_clips_of_a_character(me, walk, tmp_path):
    """--in-place and --mirror must have an effect: they were once read and ignored."""
    command(
        "character",
        "--photo",
        SAMPLE,
        "--actions",
        "Walk",
        "--frames",
        3,
        "--mirror",
        "--out",
        tmp_path / "b.glb",
        "--quiet",
    )
    mirrored = a2v.make_motion("Walk", frames=3, mirror=True)
    assert (
        me.save(tmp_path / "a.glb", motions={"Walk": mirrored}).read_bytes()
        == (tmp_path / "b.glb").read_bytes()
    )
    assert sha256(me.save(tmp_path / "c.glb", motions={"Walk": walk})) != sha256(tmp_path / "b.glb")


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"in_place": True, "seed": 3},
        {"loop": True, "in_place": True, "seconds": 3},
        {"path": "0,0 0,3"},
    ],
)
def test_a_motion_is_that_of_the_command(more, tmp_path):
    values = {"frames": 12} | more if "seconds" not in more else more
    made = a2v.make_motion("Walk", **values)
    words = [
        word
        for name, value in values.items()
        for word in ([f"--{name}".replace("_", "-")] + ([] if value is True else [value]))
    ]
    for suffix in (".npz", ".bvh"):
        command("motion", "--action", "Walk", *words, "--out", tmp_path / f"b{suffix}")
        assert (
            made.save(tmp_path / f"a{suffix}").read_bytes()
            == (tmp_path / f"b{suffix}").read_bytes()
        )


def test_a_video_is_that_of_the_command_and_is_remembered_by_it(me, walk, tmp_path):
    made = a2v.make_video(me, walk, tmp_path / "a.mp4", **FILM)
    command(
        "video",
        "--photo",
        SAMPLE,
        "--action",
        "Walk",
        "--frames",
        3,
        *SMALL,
        "--out",
        tmp_path / "b",
    )
    assert made.read_bytes() == (tmp_path / "b" / "video.mp4").read_bytes()
    whole = a2v.make_video(me, walk, tmp_path / "c", **FILM)
    assert whole == tmp_path / "c" / "video.mp4"
    kept = ("video.mp4", "front.mp4", "character.glb", "motion.bvh", "motion.npz")
    assert all(sha256(tmp_path / "b" / name) == sha256(tmp_path / "c" / name) for name in kept)
    nodes = json.loads((tmp_path / "c" / "report.json").read_text())["nodes"]
    assert all(
        node["remembered"] == node["calls"]
        for name, node in nodes.items()
        if name != "frame_settings"
    )


def test_progress_is_told_to_a_function_and_to_nobody_else(capfd):
    heard: list[object] = []
    a2v.make_motion("strolling", frames=4, seed=11, progress=heard.append)
    a2v.make_motion("strolling", frames=4, seed=12)
    assert {update.node for update in heard} == {"motion"}
    assert capfd.readouterr() == ("", "")


def test_what_cannot_be_is_said_before_anything_long_runs(me, walk, tmp_path):
    for wrong in (
        {"path": tmp_path / "a.avi"},
        {"path": tmp_path / "a.mp4", "veiws": "front"},
        {"path": tmp_path / "a.mp4", "background": "photo"},
    ):
        with pytest.raises(a2v.InputError):
            a2v.make_video(me, walk, **wrong)
    with pytest.raises(a2v.InputError, match="expected a name"):
        me.save(tmp_path / "a.stl")
    with pytest.raises(a2v.InputError, match="expected a name"):
        me.save(tmp_path / "a.obj", motions={"Walk": walk})
    with pytest.raises(a2v.InputError, match="nobody"):
        a2v.make_character(tmp_path / "nobody.jpg")


def test_importing_is_quick_and_every_name_is_there():
    heavy = {"torch", "mediapipe", "mitsuba", "onnxruntime", "pipelines", "jsonargparse"}
    text = f"import sys, a2v; print(*({heavy!r} & set(sys.modules)))"
    assert (
        subprocess.run(
            [sys.executable, "-c", text], cwd=ROOT, capture_output=True, text=True, check=True
        ).stdout.strip()
        == ""
    )
    assert all(getattr(a2v, name) is not None for name in a2v.__all__)
    with pytest.raises(AttributeError, match="make_coffee"):
        _ = a2v.make_coffee


def test_the_page_about_python_runs(me, walk, tmp_path, monkeypatch):
    shutil.copy(SAMPLE, tmp_path / "me.jpg")
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    test = doctest.DocTestParser().get_doctest(page, {}, "python.md", "docs/python.md", 0)
    said: list[str] = []
    result = doctest.DocTestRunner().run(test, out=said.append)
    assert result.failed == 0, "".join(said)
    assert result.attempted > 10
