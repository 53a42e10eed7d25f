"""One request has the same values from the command line, a table and Python."""

from __future__ import annotations

import csv
import dataclasses
import json
import shutil
from pathlib import Path

import pytest
from PIL import Image

from a2v.errors import InputError
from a2v.motion import MotionModel
from pipelines.batch.rows import defaults, read_rows
from pipelines.commands import video
from pipelines.engine.memo import plain
from pipelines.engine.store import Store
from pipelines.options import parse
from pipelines.requests.fields import hints_of
from pipelines.requests.film import FilmRequest
from pipelines.requests.motion import MotionRequest
from pipelines.requests.person import PersonStages
from pipelines.requests.video import FILES, VideoRequest, names, video_parameters
from pipelines.serve.wishes import Wish

SAMPLE = Path(__file__).resolve().parents[2] / "a2v" / "samples" / "person.jpg"
OTHERS = {
    "readers.without": "find_gloves",
    "face.features": "model",
    "legs_color": "803020",
    "figure.legs_color": "803020",
    "without": "find_gloves,delight",
    "color.without": "delight",
    "action": "Jump",
    "timeline": "t.yaml",
    "model": "cmu",
    "seconds": 2.5,
    "frames": 7,
    "fps": 24.0,
    "seed": 3,
    "path": "0,0 0,2 2,2",
    "pace": 1.1,
    "heading": 90.0,
    "keyframes": "k.yaml",
    "start_pose": "m.npz",
    "end_pose": "m.npz#4-6",
    "hold": "head 0,1.5,0 from 1 to 2",
    "look_at": "camera",
    "retarget.life.look": "left",
    "follow.turn": 90,
    "motion": "m.npz",
    "motion_bone_map": "k.yaml",
    "views": "front,turntable",
    "camera": "c.yaml",
    "background": "#30506f",
    "look": "night",
    "aspect": "9:16",
    "variant": "scalar_rgb",
    "photo": "b.jpg",
    "more": "c.jpg",
    "mask": "b.jpg",
    "keypoints": "b.jpg",
    "corrections": "r.yaml",
    "backend": "body-prior",
    "character": "fused",
    "texture": 4096,
    "fit.distance": 3.5,
    "normal_map": 2048,
    "deform.method": "skinning",
    "follow.lens": 35.0,
    "follow.camera": "still",
    "fit.model": "b.npz",
    "perception.max_side": 512,
    "perception.band": 0.05,
    "retarget.life.hands": "fist",
}
"""Values that are not the defaults.

Where none is named, numbers are one more and switches are inverted.
"""
UNUSABLE = {
    "pifuhd",
    "pifu_geometry",
    "pifu_color",
    "pamir_geometry",
    "pamir_texture",
    "pamir_refine",
    "implicit.weights",
    "implicit.digest",
}
"""Values that only custom files can resolve."""
FILTERS = {"license", "strict"}
"""What leaves sources out, or refuses: of "Walk" every license has the same, and all is known."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Files that values name."""
    folder = tmp_path_factory.mktemp("asked")
    for name in ("a.jpg", "b.npz"):
        shutil.copy(SAMPLE, folder / name)
    Image.open(SAMPLE).rotate(90).save(folder / "b.jpg")
    Image.open(SAMPLE).rotate(180).save(folder / "c.jpg")
    MotionModel.load("cmu-fine").sample("Walk", frames=30, seed=1).save(folder / "m.npz")
    (folder / "k.yaml").write_text("- {time: 1, at: [0, 1]}\n")
    (folder / "t.yaml").write_text("- {action: Walk, seconds: 2}\n")
    (folder / "r.yaml").write_text("landmarks: {nose: [200, 100]}\n")
    (folder / "c.yaml").write_text("mine: {azimuth: 30}\n")
    return folder


def choices_of(name: str) -> tuple[str, ...]:
    """Return all values of an option that is a choice."""
    found = [
        item
        for kind in hints_of(VideoRequest).values()
        for item in dataclasses.fields(kind)
        if item.name == name
    ]
    return tuple((found[0].metadata.get("option") or {}).get("choices") or ()) if found else ()


def other(name: str) -> object:
    """A value that is not the default."""
    if name in OTHERS:
        return OTHERS[name]
    value = value_of(VideoRequest.of(photo="a.jpg"), name)
    if choices := choices_of(name):
        return next(choice for choice in choices if choice != value)
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + 2 if name == "size" else value + 1
    return value * 0.5 + 0.125 if isinstance(value, float) else f"{value}x"


def value_of(request: VideoRequest, name: str) -> object:
    own, *inner = name.split(".")
    value = request.described()[own]
    for part in inner:
        value = getattr(value, part)
    return value


def words_of(name: str, value: object) -> str:
    """An option of the command line."""
    shown = f"--{name.replace('_', '-')}"
    is_flag = value is True and "." not in name
    return (
        shown if is_flag else f"{shown}={str(value).lower() if isinstance(value, bool) else value}"
    )


def test_every_value_is_reached_from_everywhere_and_means_the_same(folder, monkeypatch):
    monkeypatch.chdir(folder)
    values = {name: other(name) for name in names()}
    line = parse(
        video.Options,
        ["--out", "o", *map(words_of, values, values.values())],
        command="video",
        about="",
        examples="",
    ).request
    with open("jobs.csv", "w", newline="") as stream:
        csv.writer(stream).writerows([values.keys(), values.values()])
    nested: dict[str, object] = {}
    for name, value in values.items():
        head, _, inner = name.partition(".")
        nested[head] = {**nested.get(head, {}), inner: value} if inner else value  # type: ignore[dict-item]
    Path("jobs.yaml").write_text(json.dumps([nested]))
    rows = [
        read_rows(path, defaults(PersonStages(), MotionRequest(), FilmRequest()))[0]
        for path in ("jobs.csv", "jobs.yaml")
    ]
    assert not any(row.problem for row in rows), [row.problem for row in rows]
    python = VideoRequest.of(**values)
    assert line == rows[0].request == rows[1].request == python
    open_ = VideoRequest.of(photo="a.jpg")
    assert not [
        name
        for name, value in values.items()
        if value_of(python, name) == value_of(open_, name) or value_of(python, name) != value
    ]


@pytest.mark.parametrize(
    "name", [name for name in names() if name not in UNUSABLE | FILTERS and "." not in name]
)
def test_every_value_changes_what_the_graph_is_given(name, folder, monkeypatch, tmp_path):
    monkeypatch.chdir(folder)
    store = Store(tmp_path)
    more = {
        "pace": {"path": "0,0 0,3"},
        "timeline": {"action": ""},
        "action": {},
        "motion": {"action": ""},
        "motion_bone_map": {"action": "", "motion": "m.npz"},
    }.get(name, {"action": "Walk"})
    base = {"photo": "a.jpg", "action": "Walk"} | ({} if name == "motion" else more)
    before = VideoRequest.of(
        **(base | ({"action": "Walk"} if name in ("timeline", "motion") else {}))
    )
    after = VideoRequest.of(**(base | more | {name: other(name)}))
    given, changed = (plain(request.resolve(store).parameters) for request in (before, after))
    assert repr(given) != repr(changed)


def test_python_gives_the_parameters_of_the_command_line(folder, monkeypatch, tmp_path):
    monkeypatch.chdir(folder)
    store = Store(tmp_path)
    words = [
        "--photo",
        "a.jpg",
        "--out",
        "o",
        "--action",
        "strolling, then jump",
        "--heading",
        "0",
        "--keyframes",
        "k.yaml",
        "--in-place",
    ]
    line = parse(video.Options, words, command="video", about="", examples="").request.resolve(
        store
    )
    python = video_parameters(
        store,
        Path("a.jpg"),
        "strolling, then jump",
        heading=0,
        keyframes=Path("k.yaml"),
        in_place=True,
    )
    assert repr(plain(line.parameters)) == repr(plain(python))
    assert python["direction"].heading == 0
    assert "strolling" in " ".join(line.understood)


def test_the_page_asks_by_the_same_names():
    kinds = {item.name for item in dataclasses.fields(Wish)}
    # an uploaded video or motion is named by its id; the request gets its path as `motion`
    own = {"clip", "animation", "sprites"}  # the last two are files beside the video
    assert kinds - own <= set(names())
    wish = Wish(action="Walk", seconds=2.0, views=("front", "back"), size=128)
    asked = wish.request("a.jpg")
    said = {name: value for name, value in wish.said().items() if name not in {*own, "motion"}}
    assert asked == VideoRequest.of(photo="a.jpg", **(said | {"path": None}))
    assert (asked.film.views, asked.motion.seconds, asked.person.photo) == (
        "front,back",
        2.0,
        "a.jpg",
    )


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"actoin": "Walk"}, "did you mean action"),
        ({"seed": -1}, "whole number from 0"),
        ({"seed": True}, "a whole number"),
        ({"backend": "nerf"}, "choose from pifu"),
        ({"size": "large"}, "a whole number"),
        ({"fit": {"hieght": 2}}, "did you mean height"),
        ({"fit.steps": "many"}, "a whole number"),
        ({"views": 3}, "text"),
        ({"denoise": "perhaps"}, "yes or no"),
    ],
)
def test_what_cannot_be_is_told_in_one_line(values, words):
    with pytest.raises(InputError, match=words) as caught:
        VideoRequest.of(photo="a.jpg", **values)
    assert "\n" not in str(caught.value)


def test_a_photo_is_needed():
    with pytest.raises(InputError, match="no photo given"):
        VideoRequest.of(action="Walk")


def test_files_are_those_that_are_named(folder, monkeypatch):
    monkeypatch.chdir(folder)
    asked = VideoRequest.of(
        photo="a.jpg", motion="m.npz", look="night", background="b.jpg", path="0,0 1,1"
    )
    assert asked.files() == {"photo": "a.jpg", "motion": "m.npz", "background": "b.jpg"}
    assert set(FILES) <= set(names())


def test_a_body_model_counts_by_its_content_not_by_its_path(folder, monkeypatch, tmp_path):
    monkeypatch.chdir(folder)
    shutil.copy("b.npz", tmp_path / "moved.npz")
    (tmp_path / "changed.npz").write_bytes(b"other")
    files = ("b.npz", tmp_path / "moved.npz", tmp_path / "changed.npz")
    here, moved, changed = (
        {
            name: plain(
                VideoRequest.of(photo="a.jpg", **{"fit.model": path}).person.parameters()[name]
            )
            for name in ("fit", "body_model")
        }
        for path in files
    )
    assert here == moved != changed
    with pytest.raises(InputError, match="unknown body model"):
        PersonStages(fit=dataclasses.replace(PersonStages().fit, model="smpl")).parameters()


def test_parts_share_no_name():
    whole = [
        item.name for kind in hints_of(VideoRequest).values() for item in dataclasses.fields(kind)
    ]
    assert len(whole) == len(set(whole))
