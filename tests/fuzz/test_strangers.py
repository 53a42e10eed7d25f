"""Strangers' files by grammar and by size, pipes for every reader, removals at drawn moments, and
control characters in every text."""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from a2v.animation import retarget
from a2v.body.smpl import SmplModel
from a2v.errors import InputError, printable
from a2v.footage.reading import open_reel
from a2v.formats import read_motion
from a2v.formats.fbx import fbx_to_glb
from a2v.formats.gltf import read_glb
from a2v.formats.gltf.people import read_person
from a2v.formats.gltf.person_clips import write_person
from a2v.io import read_npz
from a2v.lab.datasets.files import FileSource
from a2v.lab.evaluation.survey_answers import read_key
from a2v.lab.papers.checkpoints import read_state
from a2v.lab.studio.avatar_files import load_avatar
from a2v.motion import MotionModel
from a2v.motion.keyframes import read_keyframes
from a2v.motion.prompts import Vocabulary
from a2v.motion.timeline import MAX_TIMELINE_BYTES, read_timeline
from a2v.motion.ways import MAX_BYTES, read_path
from a2v.rendering.camera import read_cameras
from a2v.rendering.looks import read_look
from a2v.rendering.page import write_page
from a2v.rendering.video import probe_video
from pipelines.batch.rows import read_rows
from pipelines.cli import main
from pipelines.engine.store import Store
from pipelines.inputs import put_file
from pipelines.requests.person import corrections_of
from pipelines.requests.video import VideoRequest
from tests.support.glb import glb
from tests.support.hostile import COUNT, FEW, Tally, count, owes_a_sentence
from tests.support.motions import person as walker
from tests.support.races import remove_at_moments
from tests.support.strangers import person

CONTROLS = st.sampled_from(
    [
        "\x07",
        "\x1b[2J",
        "\x1b]0;a\x07",
        "\x9b",
        "\x85",
        "\u202e",
        "\u2066",
        "\u061c",
        "\r",
        "\x7f",
        "\ud800",
        "\udfff",
    ]
)
COUNTS = st.sampled_from([0, 1, 2, 3, 144, 65_535, 10**6, 4 * 10**6, 10**9, 2**63])
TIMES = st.sampled_from([1, 2, 50, 2_000, 36_000, 100_000])
KINDS = st.sampled_from([5120, 5121, 5122, 5123, 5125, 5126, 5124, None])
LAYOUTS = st.sampled_from(["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4", "MAT5", None])
DEPTHS = st.sampled_from([1, 30, 62, 64, 66, 700, 990, 3000, 100_000])
MOTION = walker(frames=3)


# --- glTF by grammar


def change(draw: st.DrawFn, tree: dict[str, Any]) -> None:
    """Change a part of a person's glTF in a way that its grammar allows, or almost."""
    accessor = draw(st.sampled_from(tree["accessors"]))
    primitives = tree["meshes"][0]["primitives"]
    which = draw(st.integers(0, 14))
    if which == 0:
        accessor.pop("bufferView", None)
    elif which == 1:
        accessor["count"] = draw(COUNTS)
    elif which == 2:
        accessor["componentType"] = draw(KINDS)
    elif which == 3:
        accessor["type"] = draw(LAYOUTS)
    elif which == 4:
        accessor |= {"normalized": True} if draw(st.booleans()) else {"sparse": {"count": 1}}
    elif which == 5:
        primitives *= min(draw(TIMES), 100_000 // len(primitives))
    elif which == 6:
        tree["nodes"] += [{"mesh": 0, "skin": draw(st.sampled_from([0, 0, 5]))}] * draw(TIMES)
    elif which == 7:
        tree["skins"] += [dict(tree["skins"][0])] * draw(TIMES)
    elif which == 8:
        first, more = len(tree["nodes"]), draw(TIMES)
        tree["nodes"] += [{}] * more
        tree["skins"][0]["joints"] += list(range(first, first + more))
    elif which == 9:
        first, deep = len(tree["nodes"]), draw(st.sampled_from([10, 1999, 2001, 20_000]))
        tree["nodes"] += [{"children": [first + at + 1]} for at in range(deep)] + [{}]
        tree["nodes"][0]["children"] += [first]
    elif which == 10:
        text = draw(st.text(max_size=5)) + draw(CONTROLS)
        target = draw(st.sampled_from([tree["nodes"][0], tree["meshes"][0], tree["asset"], tree]))
        target[draw(st.sampled_from(["name", "extras", text]))] = text
    elif which == 11:
        place = draw(st.sampled_from(["translation", "rotation", "scale", "matrix"]))
        numbers = st.sampled_from([0, 1, -1, 1e-30, 1e30, 1e308, 10**400, float("nan"), "x", None])
        node = draw(st.sampled_from(tree["nodes"][:-1]))
        node[place] = draw(st.lists(numbers, min_size=3, max_size=16))
    elif which == 12:
        tree["skins"][0].pop("inverseBindMatrices", None)
    elif which == 13:
        tree["extras"] = [[]] * draw(st.sampled_from([10, 10**6, 3 * 10**6]))
    else:
        view = draw(st.sampled_from(tree["bufferViews"]))
        key = draw(st.sampled_from(["byteOffset", "byteLength", "byteStride", "buffer"]))
        view[key] = draw(COUNTS)


@st.composite
def people(draw: st.DrawFn) -> bytes:
    """A person's GLB with one to four changes, sometimes with deep JSON."""
    tree, binary = person()
    for _ in range(draw(st.integers(1, 4))):
        change(draw, tree)
    made = glb(tree, binary)
    if draw(st.integers(0, 7)) == 0:
        depth = draw(DEPTHS)
        tree["extras"] = "deep"
        text = json.dumps(tree).replace('"deep"', "[" * depth + "]" * depth).encode()
        text += b" " * (-len(text) % 4)
        old = int.from_bytes(made[12:16], "little")
        del tree["extras"]
        rest = made[20 + old :]
        made = made[:12] + len(text).to_bytes(4, "little") + b"JSON" + text + rest
    return made


def strict(path: Path) -> None:
    """Check that a GLB's JSON is what every other reader takes."""
    data = path.read_bytes()
    text = data[20 : 20 + int.from_bytes(data[12:16], "little")].decode("utf-8")

    def no(word: str) -> None:
        raise AssertionError(f"{word} in the JSON of a file of ours")

    json.loads(text, parse_constant=no)


@given(people())
def test_people_by_grammar(data):
    with tempfile.TemporaryDirectory() as folder:
        path, out = Path(folder) / "a.glb", Path(folder) / "out.glb"
        path.write_bytes(data)

        def moved() -> None:
            read = read_person(path)
            moves = retarget(MOTION, read.body)
            write_person(out, read, {"walk": (moves, MOTION.fps)})

        owes_a_sentence(moved)
        if out.exists():
            strict(out)
            read_glb(out)
            count(Tally(files=1))


@settings(max_examples=FEW)
@given(people())
def test_avatars_by_grammar(data):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.glb"
        path.write_bytes(data)
        owes_a_sentence(lambda: load_avatar(path))


# --- drawings and timelines by size

SEGMENTS = st.sampled_from(
    ["L 1 2 ", "C 1 2 3 4 5 6 ", "Q 1 2 3 4 ", "A 5 5 0 0 1 9 9 ", "T 3 4 ", "S 1 2 3 4 ", "M 1 1 ", "Z ", "H 4 "]
)  # fmt: skip
SIZES = st.sampled_from([1, 10, 600, 5_000, 30_000, 200_000])


@settings(max_examples=FEW)
@given(st.lists(st.tuples(SEGMENTS, SIZES), min_size=1, max_size=3), SIZES)
def test_drawings_by_size(parts, shapes):
    line = "M 0 0 " + "".join(segment * times for segment, times in parts)
    shape = f'<path d="{line[: MAX_BYTES - 200]}"/>'
    more = '<circle cx="5" cy="5" r="9"/>' * min(shapes, (MAX_BYTES - len(shape)) // 40)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.svg"
        path.write_text(f'<svg xmlns="http://www.w3.org/2000/svg">{shape}{more}</svg>')
        owes_a_sentence(lambda: read_path(str(path)))


STEPS = st.sampled_from(
    ["- {action: walk}\n", "- {action: jump, frames: 1}\n", "- {action: qqq}\n"]
)


@settings(max_examples=FEW)
@given(st.lists(st.tuples(STEPS, SIZES), min_size=1, max_size=3))
def test_timelines_by_size(parts):
    text = "".join(step * times for step, times in parts)[:MAX_TIMELINE_BYTES]
    vocabulary = Vocabulary.of(MotionModel.load("cmu-fine").card)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.yaml"
        path.write_text(text[: text.rfind("\n") + 1])
        owes_a_sentence(lambda: read_timeline(path, vocabulary))


# --- what is no regular file


def reel(path: Path) -> None:
    with open_reel(path) as opened:
        next(opened.frames(side=64), None)


READERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    **{f"motion{suffix}": (suffix, read_motion) for suffix in (".bvh", ".npz", ".txt")},
    "person": (".glb", read_person),
    "person of VRM": (".vrm", read_person),
    "avatar": (".glb", load_avatar),
    "fbx": (".fbx", lambda path: fbx_to_glb(path, path.with_name("out.glb"))),
    **{f"path{suffix}": (suffix, lambda path: read_path(str(path))) for suffix in (".csv", ".yaml", ".svg")},
    "timeline": (".yaml", lambda path: read_timeline(path, Vocabulary({}))),  # type: ignore[arg-type]
    "keyframes": (".yaml", lambda path: read_keyframes(path, MotionModel.load("cmu-fine"), fps=20.0)),
    "cameras": (".yaml", read_cameras),
    "look": (".yaml", read_look),
    "table": (".csv", lambda path: read_rows(path, VideoRequest.of(photo=""))),
    "photo": (".jpg", lambda path: put_file(Store(path.with_name("store")), path)),
    "corrections": (".yaml", lambda path: corrections_of(str(path))),
    "film": (".mp4", reel),
    "info of a film": (".mp4", probe_video),
    "page of a character": (".glb", lambda path: write_page(path.with_name("a.html"), path)),
    "archive": (".npz", read_npz),
    "body": (".npz", SmplModel.load),
    "checkpoint": (".pt", lambda path: read_state(path, inside="model")),
    "survey": (".json", read_key),
    "data set": (".zip", FileSource),
    "model": (".onnx", MotionModel.load),
}  # fmt: skip


@pytest.mark.parametrize("kind", ["pipe", "device", "folder", "loop", "nothing", "link to a pipe"])
@pytest.mark.parametrize("name", READERS)
def test_no_regular_file_is_waited_for(name, kind, tmp_path):
    suffix, read = READERS[name]
    path = tmp_path / f"a{suffix}"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "folder":
        path.mkdir()
    elif kind == "loop":
        path.symlink_to(path)
    elif kind == "link to a pipe":
        os.mkfifo(tmp_path / "pipe")
        path.symlink_to(tmp_path / "pipe")
    said = list[str]()

    def refused() -> None:
        try:
            read(path)
        except InputError as error:
            said.append(str(error))
            raise

    owes_a_sentence(refused)
    assert said or (name == "data set" and kind == "folder")


# --- removals, and what a terminal gets


@pytest.mark.parametrize("seed", range(max(1, COUNT // 100)))
def test_removals_at_drawn_moments(seed, tmp_path):
    moments = 20 if COUNT else 6
    remove_at_moments(tmp_path, b"no film", random.Random(seed), moments)
    count(Tally(deleted=moments))


TEXTS = st.lists(st.one_of(CONTROLS, st.sampled_from(["walk", "shuffle along", "then", " ", "qqq"]), st.text(max_size=3)), min_size=2, max_size=8).map("".join).filter(lambda text: "\0" not in text)  # fmt: skip
PLACES = ("--action", "--style", "--path", "--model", "--keyframes", "--out", "--timeline", "--hold", "--heading")  # fmt: skip


@settings(max_examples=FEW)
@given(st.sampled_from(PLACES), TEXTS)
def test_control_characters_never_reach_a_terminal(option, text):
    out, err = io.StringIO(), io.StringIO()
    with tempfile.TemporaryDirectory() as folder:
        value = f"{folder}/{text}.npz" if option == "--out" else text
        words = [
            "motion",
            "--action=walk",
            "--model=cmu-fine",
            "--frames=4",
            f"--out={folder}/a.npz",
        ]

        def told() -> None:
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                assert main([*words, f"{option}={value}"]) in (0, 2)

        owes_a_sentence(told)
    for said in (out.getvalue(), err.getvalue()):
        assert said == printable(said)


@given(st.lists(TEXTS, min_size=18, max_size=18))
def test_names_of_bones_never_reach_a_terminal(names):
    tree, binary = person()
    for node, name in zip(tree["nodes"], names, strict=False):
        node["name"] = name
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.glb"
        path.write_bytes(glb(tree, binary))
        owes_a_sentence(lambda: read_person(path))


def test_the_whole_person_moves(tmp_path):
    """An intact version of what `test_people_by_grammar` changes."""
    (tmp_path / "a.glb").write_bytes(glb(*person()))
    read = read_person(tmp_path / "a.glb")
    moves = retarget(MOTION, read.body)
    write_person(tmp_path / "out.glb", read, {"walk": (moves, MOTION.fps)})
    strict(tmp_path / "out.glb")
    assert np.isfinite(moves).all()
