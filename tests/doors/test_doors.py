"""All doors take every action and 40 prompts, and mean the same by them; each door makes some."""

from __future__ import annotations

import json
import subprocess
from collections import Counter
from pathlib import Path

import pytest

import a2v
from a2v.processes import python_command
from a2v.samples.ready import PHOTO
from pipelines.cli import main
from pipelines.commands.serve import COMPUTE
from pipelines.requests.film import FilmRequest
from pipelines.requests.video import VideoRequest
from tests.support.doors import (
    ACTIONS,
    LENGTH,
    PROMPTS,
    Asked,
    by_character,
    by_command,
    by_page,
    by_python,
    by_table,
    check_glb,
    complete,
    given,
    go_through,
    words_of,
)

NAMED: list[Asked] = [{"action": name, "seconds": LENGTH} for name in ACTIONS]
EVERYTHING = [*NAMED, *map(complete, PROMPTS)]
CHILDREN: tuple[Asked, ...] = (
    {"action": "Wave"},
    {"action": "Sit down"},
    {"action": "Disco dance"},
    {"action": "Walk"},
    {"action": "drink_bottle_lefthand"},
    {"action": "walk, then wave"},
    {"action": "sneaking like a thief"},
    {"action": "Walk", "path": "0,0 0,3"},
    {"action": "Clap", "in_place": True},
    {"action": "throw", "license": "free"},
    {"action": "", "motion": "theirs.bvh"},
)
"""Prompts that ``a2v video`` makes whole in child processes, with two small frames."""
TINY = ["--frames", 2, "--views", "front", "--size", 64, "--spp", 1, "--denoise", "false"]
TINY += ["--triangles", 2000, "--texture", 512, "--normal-map", 0]  # as `small`


def name_of(asked: Asked) -> str:
    return " ".join(map(str, asked.values())).strip()


def test_there_are_40_prompts():
    assert len(PROMPTS) == len({json.dumps(one) for one in PROMPTS}) == 40


@pytest.mark.parametrize("asked", PROMPTS, ids=name_of)
def test_python_takes_every_prompt_through_the_graph(asked, small, few, store, here):
    clip = a2v.make_motion(**complete(asked), cache=store.folder)
    request = VideoRequest(person=small.request, motion=clip.request, film=FilmRequest())
    go_through(request, few, store, len(clip.motion.joints))


def test_every_door_means_the_same(store, here):
    """What is resolved equally is the same call of every node, so it has the same result; equal
    requests are resolved equally."""
    rows, taken = by_table(EVERYTHING, here), Counter[str]()
    together = by_character({"actions": ",".join(ACTIONS), "seconds": LENGTH})
    clips = [*([one] for one in together), *map(by_character, EVERYTHING[len(NAMED) :])]
    for asked, row, clip in zip(EVERYTHING, rows, clips, strict=True):
        expected = by_python(asked)
        doors = {"command": [by_command(asked)], "table": [row], "character": clip}
        doors["page"] = by_page(asked)
        for door, requests in doors.items():
            for request in requests:
                taken[door] += 1
                if (request.person, request.motion) != (expected.person, expected.motion):
                    assert given(request, store) == given(expected, store), (door, asked)
    assert taken == {"command": 419, "table": 419, "page": 379 + 18, "character": 379 + 32}


@pytest.mark.parametrize("asked", CHILDREN, ids=name_of)
def test_the_command_line_makes_it(asked, store, here, tmp_path):
    """Each in a process of its own; a worker imports everything once more, so two have one."""
    words = ["video", "--photo", PHOTO, *words_of(asked), *TINY, "--cache", store.folder]
    words += ["--workers", 1] if asked in CHILDREN[:2] else ["--executor", "serial"]
    words += ["--quiet", "--out", tmp_path]
    code = "from pipelines.cli import main; raise SystemExit(main())"
    done = subprocess.run(
        python_command(code, *map(str, words)), capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "video.mp4").stat().st_size > 500
    assert check_glb((tmp_path / "character.glb").read_bytes()) == 1


def test_a_table_makes_them(store, here, tmp_path):
    asked = [*CHILDREN[:3], *CHILDREN[5:9]]
    by_table(asked, here)
    words = ["batch", here / "jobs.csv", "--out", tmp_path, *TINY, "--cache", store.folder]
    assert main([str(word) for word in [*words, "--executor", "serial", "--quiet"]]) == 0
    glbs = sorted(tmp_path.glob("*/character.glb"))
    assert len(glbs) == len(asked)
    assert all(check_glb(path.read_bytes()) == 1 for path in glbs)


def test_the_page_makes_them(store, tmp_path):
    """The child process of ``a2v serve`` gets the tasks that the page sends."""
    tasks = []
    for number, action in enumerate(("Wave", "Disco dance", "walk, then wave", "Sit down")):
        folder = tmp_path / str(number)
        folder.mkdir()
        said = {"action": action, "seconds": LENGTH, "views": ["front"], "size": 64, "spp": 1}
        entries = {"folder": folder, "photo": PHOTO, "cache": store.folder}
        task = {name: str(path) for name, path in entries.items()} | {"workers": 1}
        task |= {"task": "video", "wish": said, "known": False, "times": {}}
        tasks.append(task | {"corrections": None, "more": [], "clip": None})
    process = subprocess.Popen(
        python_command(COMPUTE), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdin is not None
    assert process.stdout is not None
    for task in tasks:
        process.stdin.write(json.dumps(task) + "\n")
        process.stdin.flush()
        answers = (json.loads(line) for line in process.stdout)
        answer = next(one for one in answers if "progress" not in one)
        assert "done" in answer, answer
        assert check_glb((Path(task["folder"]) / "character.glb").read_bytes()) == 1
        assert (Path(task["folder"]) / "video.mp4").stat().st_size > 500
    process.stdin.close()
    process.wait(60)


def test_python_makes_them(small, store, tmp_path):
    clips = {
        name: a2v.make_motion(name, seconds=LENGTH, cache=store.folder)
        for name in ("Wave", "Walk", "walk, then wave")
    }
    assert check_glb(small.save(tmp_path / "a.glb", clips).read_bytes()) == 3
    film = {"views": ["front"], "size": 64, "spp": 1, "denoise": False}
    made = a2v.make_video(small, clips["Wave"], tmp_path / "a.mp4", **film)
    assert made.stat().st_size > 500
