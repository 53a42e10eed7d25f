"""Every option, and tables of jobs, take hostile values or refuse them in one sentence."""

from __future__ import annotations

import functools
import json
import os
import tempfile
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2v.formats import read_motion
from a2v.io import read_npz
from pipelines.batch.rows import read_rows
from pipelines.batch.tasks import Planner
from pipelines.cli import every_command, load_command
from pipelines.engine.store import Store
from pipelines.options import actions_of, parse
from pipelines.requests.video import VideoRequest
from tests.support.commands import end
from tests.support.hostile import (
    COUNT,
    FEW,
    NUMBERS,
    TEXTS,
    VALUES,
    are_whole,
    owes_a_sentence,
    retold,
    trees,
)

ROOT = Path(__file__).resolve().parents[2]
MODULES = [name.replace(" ", "_") for name in every_command()]
PIPE = str(Path(tempfile.mkdtemp()) / "pipe")
"""A pipe that nobody writes to."""
os.mkfifo(PIPE)
WORDS = st.one_of(
    st.sampled_from(
        [
            "",
            "-",
            "--",
            "a" * 5000,
            "/dev/zero",
            "/proc/self/mem",
            PIPE,
            "/",
            "..",
            "null",
            "[]",
            "{}",
            "1,2",
            "nan",
            "1_000",
            "٣",
            "0x10",
            "!!python/name:os",
        ]
    ),
    TEXTS,
    NUMBERS.map(lambda number: str(number) if abs(number) != 10**400 else "1" + "0" * 400),
    VALUES.map(lambda value: repr(value)[:2000]),
).map(lambda text: text.replace("\0", ""))

PLAIN = st.sampled_from(
    [
        "1",
        "2",
        "4",
        "12",
        "0.5",
        "true",
        "false",
        "Jump",
        "walk",
        "cmu",
        "humanact12",
        "front",
        "front,left",
        "none",
    ]
)
"""Values that some option takes: if none is refused, files are written."""


def command(name: str) -> ModuleType:
    return load_command(name)


@functools.cache
def names_of(module: ModuleType) -> list[str]:
    found = [
        name
        for action in actions_of(module.Options)
        for name in action.option_strings[:1]
        if name.startswith("--")
    ]
    return [name for name in found if name not in ("--help-all", "--help-lab")]


@st.composite
def given_options(draw: st.DrawFn, names: list[str]) -> list[str]:
    chosen = draw(st.lists(st.sampled_from(names), min_size=1, max_size=3))
    return [f"{name}={draw(st.one_of(WORDS, PLAIN))}" for name in chosen]


@pytest.mark.parametrize("name", [name for name in MODULES if hasattr(command(name), "Options")])
@settings(max_examples=COUNT // 4 or 4)
@given(data=st.data())
def test_options(name, data):
    module = command(name)
    words = data.draw(given_options(names_of(module)))
    owes_a_sentence(lambda: parse(module.Options, words, command=name, about="", examples=""))


@pytest.mark.parametrize("name", [name for name in MODULES if hasattr(command(name), "Options")])
def test_every_choice(name):
    """Each choice in an option's help is accepted, or the whole line is refused in one sentence."""
    options = command(name).Options
    for action in actions_of(options):
        for choice in action.choices or ():
            given = (
                [f"{action.option_strings[0]}={choice}"] if action.option_strings else [str(choice)]
            )
            owes_a_sentence(
                lambda given=given: parse(options, given, command=name, about="", examples="")
            )


def made_by(name: str) -> st.SearchStrategy[tuple[str, list[str]]]:
    """Draw a command that makes motions from actions, and options of it."""
    known = [one for one in names_of(command(name)) if one not in ("--out", "--model", "--config")]
    return st.tuples(st.just(name), given_options(known))


@settings(max_examples=FEW)
@given(st.one_of(made_by("motion"), made_by("sample")))
def test_motions(asked):
    name, words = asked
    with tempfile.TemporaryDirectory() as folder:
        base = [
            name,
            "--action=Walk",
            "--frames=4",
            "--model=humanact12",
            f"--out={folder}/a.npz",
        ]
        owes_a_sentence(lambda: end([*base, *words]))
        are_whole(Path(folder), "*.npz", read_motion)


VIDEO = [
    "--action",
    "--model",
    "--motion",
    "--frames",
    "--fps",
    "--seed",
    "--views",
    "--camera",
    "--background",
    "--size",
    "--spp",
    "--variant",
    "--render-seed",
    "--mask",
    "--keypoints",
    "--photo",
]


@settings(max_examples=FEW)
@given(given_options(VIDEO))
def test_videos_as_far_as_their_motion(words):
    with tempfile.TemporaryDirectory() as folder:
        base = [
            "video",
            f"--photo={ROOT / 'a2v/samples/person.jpg'}",
            "--action=Jump",
            "--model=humanact12",
            "--frames=4",
            "--only=motion",
        ]
        base += [f"--out={folder}/out", f"--cache={folder}/store", "--executor=serial", "--quiet"]
        owes_a_sentence(lambda: end([*base, *words]))
        are_whole(Path(folder), "*.npz", read_npz)


ROW: dict[str, Any] = {
    "name": "a",
    "photo": "me.jpg",
    "action": "Walk",
    "seed": 4,
    "views": "front",
    "fps": 12.5,
    "denoise": True,
    "size": 64,
}
TABLE = 'name,photo,action,seed,views\na,me.jpg,Walk,4,front\nb,me.jpg,"Walk,Jump",,\n'


@given(
    st.one_of(
        trees([ROW, ROW]).map(lambda tree: (json.dumps(tree), ".yaml")),
        retold(TABLE).map(lambda text: (text, ".csv")),
    )
)
def test_tables_of_jobs(table):
    text, suffix = table
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"jobs{suffix}"
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        (Path(folder) / "me.jpg").write_bytes((ROOT / "a2v/samples/person.jpg").read_bytes())

        def plan() -> None:
            planner = Planner(Store(Path(folder) / "store"))
            for job in map(
                planner.job, read_rows(path, VideoRequest.of(photo="", frames=4, size=64))
            ):
                assert "\n" not in job.row.problem
                assert (Path(folder) / job.name).parent == Path(folder)

        owes_a_sentence(plan)
