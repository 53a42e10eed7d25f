"""One loader for all YAML: its cost is proportional to the length of the text."""

from __future__ import annotations

import ast
import time
from pathlib import Path

import pytest
import yaml

from a2v.errors import InputError
from a2v.motion.keyframes import read_keyframes
from a2v.motion.timeline import read_timeline
from a2v.motion.ways import read_path
from a2v.plain_yaml import MAX_LEVELS, MAX_NODES, MAX_REPEATED, load_yaml, parse_yaml
from a2v.rendering.camera import read_cameras
from a2v.rendering.looks import read_look
from pipelines.batch.rows import read_rows
from pipelines.cli import main
from pipelines.requests.video import VideoRequest

ROOT = Path(__file__).resolve().parents[1]


def levels(line: str) -> str:
    """Eleven levels of nine aliases each: 500 bytes that mean 9**11 values."""
    return "\n".join(
        [
            "a0: &a0 {x: 1}",
            *(f"a{i}: &a{i} {line.format(', '.join([f'*a{i - 1}'] * 9))}" for i in range(1, 12)),
        ]
    )


HOSTILE = {
    "merge keys": levels("{{<<: [{}]}}"),
    "aliases": levels("[{}]"),
    "one alias often": "- &a [1, 2, 3]\n" + "- *a\n" * MAX_REPEATED,
    "itself": "&a [*a]",
    "itself as a value": "a: &a {b: *a}",
    "flow levels": "[" * (1 << 16),
    "block levels": "- " * (1 << 15),
    "keys of keys": "? " * (1 << 15),
    "base sixty": "a: 1" + ":1" * (1 << 15),
    "keys of one hash": "{" + ", ".join(f"{k * (2**61 - 1)}: 1" for k in range(3000)) + "}",
    "two documents": "a: 1\n---\nb: 1\n",
    "a date that is none as a tag": "!!timestamp 2020-13-45",
    "a tag of Python": "!!python/object/apply:os.system [true]",
}


def read_as(kind: str, path: Path) -> object:
    if kind == "path":
        return read_path(str(path))
    if kind == "jobs":
        return read_rows(path, VideoRequest.of(photo=""))
    if kind in (
        "timeline",
        "keyframes",
    ):  # the file is refused before the model is used
        read = {
            "timeline": read_timeline,
            "keyframes": lambda source, model: read_keyframes(source, model, fps=20.0),
        }[kind]
        return read(path, None)
    return {"camera": read_cameras, "look": read_look}[kind](path)


@pytest.mark.parametrize("kind", ["camera", "look", "path", "keyframes", "timeline", "jobs"])
@pytest.mark.parametrize("name", HOSTILE)
def test_every_reader_refuses_what_explodes(tmp_path, kind, name):
    path = tmp_path / "file.yaml"
    path.write_text(HOSTILE[name])
    begun = time.process_time()
    with pytest.raises(InputError, match=r"file\.yaml") as caught:
        read_as(kind, path)
    assert time.process_time() - begun < 2
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize("option", ["--config", "--fit", "--retarget"])
@pytest.mark.parametrize("name", HOSTILE)
def test_options_refuse_what_explodes(tmp_path, capsys, option, name):
    (tmp_path / "file.yaml").write_text(HOSTILE[name])
    begun = time.process_time()
    words = [
        "video",
        "--photo",
        str(tmp_path / "none.jpg"),
        "--action",
        "Walk",
        "--out",
        str(tmp_path / "out"),
    ]
    assert main([*words, f"{option}={tmp_path / 'file.yaml'}"]) == 2
    assert main([*words, f"{option}={HOSTILE[name][:100_000]}"]) == 2
    assert main([*words, f"--seed={HOSTILE[name][:100_000]}"]) == 2
    assert time.process_time() - begun < 8
    assert capsys.readouterr().err.count("\n") == 3


def test_what_is_written_is_read():
    assert load_yaml("[1e3, 1.5, .5, -2, 1_000, 0x10, .inf, on, ~, 'a']") == [
        1000.0,
        1.5,
        0.5,
        -2,
        1000,
        16,
        float("inf"),
        True,
        None,
        "a",
    ]
    assert load_yaml("- &a {at: [1, 2]}\n- *a\n") == [{"at": [1, 2]}] * 2
    assert load_yaml("day: 2020-01-01") == {"day": "2020-01-01"}
    assert load_yaml("'<<': 1") == {"<<": 1}
    assert load_yaml("") is None
    assert parse_yaml(b"\xef\xbb\xbfa: 1", "a.yaml", "YAML", "a") == {"a": 1}
    assert load_yaml("[" * MAX_LEVELS + "]" * MAX_LEVELS) is not None
    with pytest.raises(yaml.YAMLError, match="levels"):
        load_yaml("[" * (MAX_LEVELS + 1) + "]" * (MAX_LEVELS + 1))
    with pytest.raises(yaml.YAMLError, match="values"):
        load_yaml("[" + "a," * MAX_NODES + "]")


def test_no_other_loader_is_used():
    """PyYAML's own loaders, and jsonargparse's, are used nowhere else."""
    for room in ("a2v", "pipelines", "export"):
        for path in (ROOT / room).rglob("*.py"):
            if path.name == "plain_yaml.py":
                continue
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if (
                    isinstance(node, ast.Attribute)
                    and isinstance(node.value, ast.Name)
                    and node.value.id == "yaml"
                ):
                    assert node.attr in ("YAMLError", "safe_dump"), (
                        f"{path} uses yaml.{node.attr}; use a2v.plain_yaml"
                    )
