"""What users ask for, and the doors by which they ask: command line, table, page, Python."""

from __future__ import annotations

import csv
import dataclasses
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import joblib
import numpy as np

import a2v
from a2v.animation import EngineSettings
from a2v.animation.engine import engine_ready
from a2v.motion.catalog import catalog
from a2v.samples.ready import PHOTO
from a2v.types import Character, Motion
from pipelines.batch.rows import defaults, read_rows
from pipelines.commands import character, video
from pipelines.engine.memo import plain
from pipelines.engine.refs import Ref
from pipelines.engine.store import Store
from pipelines.nodes.values import Blob, Vertices
from pipelines.options import group, parse
from pipelines.outputs import made_motion
from pipelines.requests.film import FilmRequest
from pipelines.requests.motion import MotionRequest
from pipelines.requests.person import PersonStages
from pipelines.requests.video import VideoRequest
from pipelines.run import run
from pipelines.serve.wishes import Wish

Asked = dict[str, Any]
"""Options of a motion by their names in Python."""

ACTIONS: tuple[str, ...] = tuple(entry.name for entry in catalog("any").entries)
"""Every action of ``a2v actions``."""
LENGTH = 0.1
"""Seconds of each motion: three frames."""
FILES = {
    "theirs.bvh": {"action": "Walk", "frames": 12, "rig": "mixamo"},
    "own.npz": {"action": "Wave", "frames": 60},
    "own.bvh": {"action": "Jump", "frames": 12},
}
"""Motion files that prompts name, by how they are made."""
TEXTS = {
    "t.yaml": "- {action: Walk, seconds: 0.1}\n- {action: Wave, seconds: 0.1}\n",
    "k.yaml": "- {time: 0.1, at: [0, 0.1]}\n",
    "way.csv": "x,z\n0,0\n0,2\n1,3\n",
}
"""Other files that they name."""
PROMPTS: tuple[Asked, ...] = (
    # words, of one source
    {"action": "a person walks slowly"},
    {"action": "sneaking like a thief"},
    {"action": "strolling"},
    {"action": "wlak"},
    {"action": "purple elephant"},
    {"action": "drink from a bottle"},
    # sequences, of one source and of several
    {"action": "Walk,Jump", "seconds": 2},
    {"action": "walk, then wave", "seconds": 2},
    {"action": "sneak for 3 s, then wave"},
    {"action": "sneak for 1 s, then run away"},
    {"action": "walk then sit down", "seconds": 2},
    {"action": "Wave, Walk, Clap", "seconds": 3},
    {"action": "bow, then boxing", "seconds": 2},
    {"action": "talk, then disco dance", "seconds": 2},
    {"action": "jump, then drink", "seconds": 2},
    {"action": "idle then walk then idle", "seconds": 3},
    {"action": "walk 2 s, clap 1 s"},
    {"action": "", "timeline": "t.yaml"},
    # cycles, places, ways, poses
    {"action": "Walk", "loop": True, "seconds": 2},
    {"action": "Wave", "loop": True, "seconds": 2},
    {"action": "Run", "loop": True, "in_place": True, "seconds": 2},
    {"action": "Walk", "in_place": True},
    {"action": "Clap", "in_place": True},
    {"action": "Walk", "path": "0,0 0,3"},
    {"action": "Walk", "path": "0,0 0,3 3,3", "pace": 1.2, "seconds": 1},
    {"action": "Run", "path": "way.csv", "seconds": 1},
    {"action": "Walk", "heading": 90.0, "path": "0,0 0,2"},
    {"action": "Walk", "keyframes": "k.yaml", "seconds": 1},
    {"action": "Walk", "hold": "left_wrist 0.3,1.4,0.4 from 0 to 0.1", "seconds": 1},
    {"action": "Walk", "start_pose": "own.npz", "seconds": 1},
    {"action": "Wave", "mirror": True},
    {"action": "Jump", "speed": 1.5},
    {"action": "Wave", "from_photo": True, "seconds": 1},
    # licenses and models
    {"action": "throw", "license": "free"},
    {"action": "walk, then wave", "license": "free", "seconds": 2},
    {"action": "Wave", "model": "clips"},
    {"action": "throw", "model": "humanact12"},
    # clips of others
    {"action": "", "motion": "theirs.bvh"},
    {"action": "", "motion": "own.npz", "loop": True, "in_place": True, "frames": 50, "fps": 30},
    {"action": "", "motion": "own.bvh", "mirror": True},
)


def complete(asked: Asked) -> Asked:
    """The request with its length, unless the words have one; long motions have few frames."""
    if {"seconds", "frames", "timeline"} & set(asked) or " s" in asked["action"]:
        return {"fps": 5, **asked}
    return {**asked, "seconds": LENGTH} | ({"fps": 5} if "path" in asked else {})


def write_files(folder: Path) -> None:
    """Write the files that `PROMPTS` name."""
    from pipelines.cli import main

    for name, text in TEXTS.items():
        (folder / name).write_text(text)
    for name, how in FILES.items():
        words = [word for option, value in how.items() for word in (f"--{option}", str(value))]
        assert main(["motion", *words, "--out", str(folder / name)]) == 0


def words_of(asked: Mapping[str, Any]) -> list[str]:
    """The options of a command line."""
    return [
        f"--{name.replace('_', '-')}" if value is True else f"--{name.replace('_', '-')}={value}"
        for name, value in asked.items()
    ]


# --- the doors: each returns the requests of what is asked, none if it does not take it


@dataclass(frozen=True, kw_only=True)
class MotionOnly:
    """The options of a motion among those of ``a2v video``."""

    motion: MotionRequest = group(MotionRequest)


def by_command(asked: Asked) -> VideoRequest:
    """``a2v video``. For a mere name, what its options of a motion make of it: the whole command
    has ten times as many, and reads 379 names in 20 s."""
    if set(asked) == {"action", "seconds"} and asked["action"] in ACTIONS:
        words = words_of(asked)
        options = parse(MotionOnly, words, command="video", about="", examples="")
        return dataclasses.replace(by_python(asked), motion=options.motion)
    words = ["--photo", str(PHOTO), "--out", "o", *words_of(asked)]
    return parse(video.Options, words, command="video", about="", examples="").request


def by_character(asked: Asked) -> list[VideoRequest]:
    """``a2v character``, for what it takes: one request of each of its clips."""
    given = dict(asked)
    file = given.pop("motion", None)
    known = {"seconds", "frames", "fps", "seed", "model", "license"}
    known |= {"action", "actions", "loop", "in_place", "mirror", "speed", "from_photo"}
    if set(given) - known:
        return []
    if file is not None:
        given = given | {"action": "", "motions": file}
    words = ["--photo", str(PHOTO), "--out", "o.glb", *words_of(given)]
    options = parse(character.Options, words, command="character", about="", examples="")
    return [
        VideoRequest(
            person=options.person,
            motion=options.motion("" if path else name, path),
            film=FilmRequest(),
        )
        for name, path in character._wanted(options, Path("o.glb")).items()
    ]


def by_table(asked: Sequence[Asked], folder: Path) -> list[VideoRequest]:
    """``a2v batch``: all in one table."""
    columns = sorted({name for one in asked for name in one})
    with open(folder / "jobs.csv", "w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow(["photo", *columns])
        table.writerows([[str(PHOTO), *(one.get(name, "") for name in columns)] for one in asked])
    rows = read_rows(folder / "jobs.csv", defaults(PersonStages(), MotionRequest(), FilmRequest()))
    assert not [row.problem for row in rows if row.problem]
    return [row.request for row in rows]


def by_page(asked: Asked) -> list[VideoRequest]:
    """The page's request, for what the page offers."""
    if not set(asked) <= {item.name for item in fields(Wish)} or not asked["action"]:
        return []
    if asked.get("path", "").endswith(".csv") or "seconds" not in asked:
        return []
    said = json.loads(json.dumps({**asked, "size": 512}))
    return [Wish.of(said).request(str(PHOTO))]


def by_python(asked: Asked) -> VideoRequest:
    """``a2v.make_character`` and ``a2v.make_motion``, without running them."""
    return VideoRequest.of(photo=PHOTO, **asked)


def given(request: VideoRequest, store: Store) -> dict[str, str]:
    """Digests of what the graph is given of the person and the motion, by name."""
    film = {"render", "deform", "look", "cameras", "backdrop"}
    parameters = request.resolve(store).parameters
    return {
        name: str(joblib.hash(plain(value)))
        for name, value in parameters.items()
        if name not in film
    }


# --- through the graph


def check_glb(data: bytes, clip: str | None = None) -> int:
    """Check a GLB: complete, skinned and moving; return the number of its clips."""
    assert data[:4] == b"glTF"
    assert int.from_bytes(data[8:12], "little") == len(data)
    tree = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    assert tree["skins"][0]["joints"]
    assert all(one["channels"] for one in tree["animations"])
    assert clip is None or tree["animations"][0]["name"] == clip
    return len(tree["animations"])


def reduced(person: a2v.Person, store: Store) -> Ref[Character]:
    """The person with the triangles of its exports, which has a thirtieth of the vertices, and
    without the expressions, which no action changes."""
    settings = EngineSettings(triangles=2000, texture=512, normal_map=0)
    made = engine_ready(person.character, settings)
    bare = dataclasses.replace(made.surface, face=None)
    return store.put(dataclasses.replace(made, surface=bare))


def go_through(
    request: VideoRequest, small: Ref[Character], store: Store, frames: int | None = None
) -> Motion:
    """Run the graph of a video up to the vertices and the GLB of the `small` character of
    `reduced`, check both, and return the motion, which has as many `frames` by default."""
    resolved = request.resolve(store)
    outcome = run(
        ["motion", "vertices", "glb"],
        graph=resolved.graph,
        executor="serial",
        store=store,
        overrides={"character": small, "engine_character": small},
        **resolved.parameters,
    )
    motion = made_motion(outcome, resolved.parameters["edit"])
    refs = outcome.values["vertices"]
    assert len(refs) == (len(motion.joints) if frames is None else frames)
    for ref in (refs[0], refs[-1]):
        vertices = store.get(ref, Vertices).vertices
        assert vertices.shape == store.get(small, Character).surface.vertices.shape
        assert np.isfinite(vertices).all()
        assert 0.3 < np.ptp(vertices, axis=0).max() < 2.8  # a person, upright or not
    assert check_glb(bytes(outcome.get("glb", Blob))) == 1
    return motion
