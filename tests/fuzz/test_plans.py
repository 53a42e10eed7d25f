"""Hostile timelines, keyframes, paths, directions, models, checkpoints and batch folders."""

from __future__ import annotations

import functools
import io
import json
import tempfile
from pathlib import Path
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from a2v.formats import read_motion
from a2v.lab.papers.checkpoints import read_state
from a2v.motion import MotionModel
from a2v.motion.card import parse_card
from a2v.motion.keyframes import read_keyframes
from a2v.motion.page import _character
from a2v.motion.prompts import Vocabulary, parse_prompt
from a2v.motion.timeline import read_timeline
from a2v.motion.ways import read_path, way_along
from a2v.sessions import read_metadata
from pipelines.batch.results import write_tables
from tests.support.commands import end
from tests.support.glb import glb
from tests.support.hostile import (
    FEW,
    NUMBERS,
    TEXTS,
    are_whole,
    edited,
    owes_a_sentence,
    retold,
    trees,
)


@functools.cache
def model(name: str = "cmu-fine") -> MotionModel:
    return MotionModel.load(name)


def in_file(content: bytes | str, suffix: str, read: Any) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"file{suffix}"
        path.write_bytes(
            content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")
        )
        owes_a_sentence(lambda: read(path))


STEPS = "- {action: walk, seconds: 2, style: sad}\n- {action: jump, frames: 30, seed: 4}\n- {action: run, speed: 1.5}\n"
STEP_TREE = [
    {"action": "walk", "seconds": 2, "speed": 1.2},
    {"action": "jump", "style": "high", "frames": 30, "seed": 1},
]


@given(st.one_of(retold(STEPS), trees(STEP_TREE).map(json.dumps)))
def test_timelines(text):
    in_file(text, ".yaml", lambda path: read_timeline(path, Vocabulary.of(model().card)))


KEYS = "- {time: 1, at: [0, 1], heading: 90}\n- {joint: left_wrist, at: [1, 1, 1], from: 0, to: 1}\n- {frame: 20, heading: 10}\n"
KEY_TREE = [
    {"time": 1, "at": [0, 1], "heading": 90},
    {"joint": "left_wrist", "body": [1, 1, 1], "from": 0, "to": 1},
    {"time": 2, "file": "none.bvh", "pose": 1},
]


@given(st.one_of(retold(KEYS), trees(KEY_TREE).map(json.dumps)))
def test_keyframes(text):
    in_file(text, ".yaml", lambda path: read_keyframes(path, model(), fps=20.0))


def walk(text: str) -> None:
    way_along(read_path(text), pace=1.0, fps=20.0)


POINTS = st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=6)
SVG = '<svg xmlns="http://www.w3.org/2000/svg"><path d="M 0 0 L 100 0 C 1 2 3 4 5 6 A 5 5 0 0 1 9 9 Z"/>\n<polyline points="0,0 5,5 9,9"/>\n<circle cx="5" cy="5" r="9"/></svg>'


@given(POINTS, st.sampled_from([" ", ".csv", ".yaml"]))
def test_paths(points, suffix):
    rows = [
        ",".join(str(number) if abs(number) != 10**400 else "1" + "0" * 400 for number in point)
        for point in points
    ]
    if suffix == " ":
        owes_a_sentence(lambda: walk(" ".join(rows)))
    else:
        in_file(
            "\n".join(rows if suffix == ".csv" else [f"- [{row}]" for row in rows]),
            suffix,
            lambda path: walk(str(path)),
        )


@given(st.one_of(retold(SVG), edited(SVG.encode())))
def test_drawn_paths(text):
    in_file(text, ".svg", lambda path: walk(str(path)))


PROMPT = st.lists(
    st.one_of(
        TEXTS,
        st.sampled_from(
            ["walk", "jump", "then", ",", "for", "2", "s", "slowly", "1e9", "frames", "twice"]
        ),
    ),
    max_size=30,
).map(" ".join)


@given(PROMPT)
def test_prompts(text):
    owes_a_sentence(lambda: parse_prompt(text, Vocabulary.of(model().card)))


DIRECTED = [
    "--path",
    "--pace",
    "--heading",
    "--hold",
    "--start-pose",
    "--end-pose",
    "--keyframes",
    "--speed",
    "--seconds",
    "--fps",
    "--action",
]
WORDS = st.one_of(
    NUMBERS.map(str).map(lambda text: text[:400]),
    POINTS.map(
        lambda points: " ".join(f"{float(x) if abs(x) < 1e308 else x},{y}"[:60] for x, y in points)
    ),
    st.sampled_from(
        [
            "0,0 0,2",
            "0,0 1,1 0,2",
            "left_wrist 0.3,1.4,0.4 from 1 to 2",
            "left_wrist body 0,0,0 from 0 to 1e9",
            "x.bvh#1-9",
            "#",
            "walk",
            ".nan",
        ]
    ),
    TEXTS.map(lambda text: text.replace("\0", "")),
)


@settings(max_examples=FEW)
@given(st.lists(st.tuples(st.sampled_from(DIRECTED), WORDS), min_size=1, max_size=3))
def test_directed_motions(words):
    with tempfile.TemporaryDirectory() as folder:
        base = [
            "motion",
            "--action=walk",
            "--model=cmu-fine",
            "--seconds=1",
            f"--out={folder}/a.npz",
        ]
        owes_a_sentence(lambda: end([*base, *(f"{name}={value}" for name, value in words)]))
        assert {path.name for path in Path(folder).iterdir()} <= {"a.npz"}
        are_whole(Path(folder), "a.npz", read_motion)


@given(
    st.sampled_from(["humanact12", "humanact12-plain", "cmu-fine"]).flatmap(
        lambda name: trees(read_metadata(model(name).path, ("a2v-flow/1", "a2v-motion/1"), "model"))
    )
)
def test_descriptions_of_models(tree):
    owes_a_sentence(lambda: parse_card(tree if isinstance(tree, dict) else {}, Path("model.onnx")))


def checkpoint() -> bytes:
    import torch

    buffer = io.BytesIO()
    torch.save(
        {"model": {"a": torch.zeros(3, 4), "b": torch.ones(2, dtype=torch.float16)}, "name": "x"},
        buffer,
    )
    return buffer.getvalue()


@given(edited(checkpoint()))
def test_checkpoints(data):
    in_file(data, ".pth", lambda path: read_state(path, inside="model"))


RECORD = {
    "folder": "job",
    "status": "done",
    "name": "n",
    "photo": "a.jpg",
    "action": "Walk",
    "model": "cmu",
    "motion": "",
    "seed": 1,
    "frames": 9,
    "views": "front",
    "size": 64,
    "seconds": 1.0,
    "problem": "",
    "notes": "",
    "trace": "",
    "key": "k",
    "files": {"video.mp4": 3},
}


@given(trees(RECORD))
def test_records_of_batches(tree):
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "job").mkdir()
        (Path(folder) / "job" / "job.json").write_text(json.dumps(tree), encoding="utf-8")
        owes_a_sentence(lambda: write_tables(Path(folder)))
        are_whole(Path(folder), "*.json", lambda path: json.loads(path.read_text(encoding="utf-8")))


HUMAN = [
    "Hips",
    "Spine",
    "Head",
    "LeftUpLeg",
    "LeftLeg",
    "LeftFoot",
    "RightUpLeg",
    "RightLeg",
    "RightFoot",
    "LeftArm",
    "LeftForeArm",
    "LeftHand",
    "RightArm",
    "RightForeArm",
    "RightHand",
]
FIGURE = {
    "nodes": [
        {"name": name, "children": [index + 1] if index + 1 < len(HUMAN) else []}
        for index, name in enumerate(HUMAN)
    ],
    "skins": [{"joints": list(range(len(HUMAN)))}],
}


@given(trees(FIGURE))
def test_characters_of_motion_pages(tree):
    in_file(glb(tree), ".glb", lambda path: _character(model("humanact12"), path))
