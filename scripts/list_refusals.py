"""List every refusal that a2v can print, by topic, as a page of Markdown.

    python scripts/list_refusals.py | grep photo             search the messages
    python scripts/list_refusals.py --out docs/refusals.md   write the page (git ignores it)

A refusal is the message of an `InputError`: it says what was given, what was expected and what to
do next. The page adds the usual cause per topic. It is read from the code, so it is never out of
date.
"""

from __future__ import annotations

import argparse
import ast
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ERRORS = ("InputError", "UnknownActionError", "MissingDependencyError")
"""Classes whose messages are refusals."""
GAP = "…"
"""Stands for a value that is known only at run time."""
LEAST_WORDS = 2
"""Fixed words that a message needs to be listed."""
HEAD = """# Refusals

Every message with which a2v refuses an input, by topic. The command line prints one line and exits with code 2;
the page shows the same line. Each message says what was given, what was expected and what to do next.
`…` stands for a value of your input. The sentences that a2v prints about a *finished* result are in
[troubleshooting](troubleshooting.md). `python scripts/list_refusals.py` makes this page from the code.
"""


@dataclass(frozen=True)
class Topic:
    """A heading of the page.

    Attributes
    ----------
    title : str
        Heading.
    cause : str
        Usual cause and remedy, for all messages below the heading.
    places : tuple of str
        Files and folders whose messages belong here, relative to the repository.
    """

    title: str
    cause: str
    places: tuple[str, ...]


TOPICS = (
    Topic(
        "Photos, masks and landmarks",
        "The photo cannot be decoded, is too large or too small, or no person is found in it. "
        "Use a JPEG or PNG that shows one whole upright person; `--only subject` shows what was "
        "found, and `--corrections`, `--mask` and `--keypoints` replace it.",
        ("a2v/perception",),
    ),
    Topic(
        "Videos as motions",
        "The video cannot be decoded, is too short, or no person can be followed in it. Cut it to "
        "one shot of one person, or convert it to MP4.",
        ("a2v/footage",),
    ),
    Topic(
        "Body models and fitting",
        "A setting of `--fit` is out of range, or a body model's file is not what it should be.",
        ("a2v/body",),
    ),
    Topic(
        "Surfaces and colors",
        "A setting of the reconstruction is out of range, or a value from Python has the wrong "
        "shape.",
        ("a2v/reconstruction",),
    ),
    Topic(
        "Actions, prompts and motion models",
        "The words name no known action, a direction cannot be met, or a model's file is damaged. "
        "`a2v actions` lists what can be requested.",
        ("a2v/motion", "pipelines/motion_clips.py", "pipelines/motion_file.py"),
    ),
    Topic(
        "Skeletons, meshes and cameras",
        "A value from Python or from a file has the wrong shape or contains numbers that are not "
        "finite.",
        ("a2v/kinematics", "a2v/geometry", "a2v/camera.py", "a2v/props.py", "a2v/face.py"),
    ),
    Topic(
        "Characters, rigs and retargeting",
        "The skeleton of a file is not recognized, or a setting is out of range. `a2v character "
        "--help` lists the rigs.",
        ("a2v/animation", "pipelines/rigs.py", "pipelines/nodes"),
    ),
    Topic(
        "Files of other programs",
        "A BVH, glTF, VRM, FBX, USD, PLY or DeepMimic file is damaged or uses a feature that a2v "
        "does not read. Export it again with the options that the message names.",
        ("a2v/formats",),
    ),
    Topic(
        "Cameras, light and films",
        "An option of the film is out of range or misspelled.",
        ("a2v/rendering",),
    ),
    Topic(
        "Options, settings and saved values",
        "An option, a settings file or a saved value is misspelled, out of range or damaged. "
        "`--help-all` lists the options, `--print-config` the settings.",
        (
            "a2v/io.py",
            "a2v/types.py",
            "a2v/record.py",
            "a2v/sessions.py",
            "a2v/plain_yaml.py",
            "a2v/npm.py",
            "a2v/processes.py",
            "a2v/system.py",
            "a2v",
            "pipelines",
        ),
    ),
    Topic(
        "Tables of jobs",
        "A row or a column of the table of `a2v batch` cannot be used.",
        ("pipelines/batch",),
    ),
    Topic(
        "The page",
        "`a2v serve` cannot start, or a request to it cannot be used.",
        ("pipelines/serve",),
    ),
    Topic(
        "The store and executors",
        "The store's folder cannot be used, or a cluster cannot be reached. `a2v doctor` checks "
        "this machine.",
        ("pipelines/engine", "pipelines/engines.py"),
    ),
    Topic("Export to ONNX", "The model cannot be exported with these settings.", ("export",)),
    Topic(
        "Laboratory: data, training, evaluation",
        "A data set is not where it was expected, or a setting of a training or an evaluation is "
        "out of range.",
        ("a2v/lab", "pipelines/lab"),
    ),
)


def template(node: ast.expr) -> str:
    """The text of a message with `GAP` for each value."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(template(part) for part in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return template(node.left) + template(node.right)
    return GAP


def refusals(path: Path) -> Iterator[str]:
    """The messages of one file, without those that consist of values only."""
    return (text for _, text in placed_refusals(path))


def placed_refusals(path: Path) -> Iterator[tuple[int, str]]:
    """The messages of one file with their line numbers."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.Call) or not node.args:
            continue
        if getattr(node.func, "id", getattr(node.func, "attr", "")) in ERRORS:
            text = " ".join(template(node.args[0]).split())
            if sum(word.isalpha() for word in text.split()) >= LEAST_WORDS:
                yield node.lineno, text


def topic_of(name: str) -> Topic:
    """The topic with the longest place that `name` (relative path) lies in."""
    inside = [
        (len(place), topic)
        for topic in TOPICS
        for place in topic.places
        if name == place or name.startswith(f"{place}/")
    ]
    return max(inside, key=lambda pair: pair[0])[1]


def page() -> str:
    """The text of the page."""
    found: dict[str, set[str]] = {topic.title: set() for topic in TOPICS}
    for folder in ("a2v", "pipelines", "export"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            name = path.relative_to(ROOT).as_posix()
            found[topic_of(name).title] |= set(refusals(path))
    parts = [HEAD]
    for topic in TOPICS:
        lines = "\n".join(
            f"- `{text.replace('`', chr(39))}`" for text in sorted(found[topic.title])
        )
        parts.append(f"## {topic.title}\n\n{topic.cause}\n\n{lines}\n")
    return "\n".join(parts)


def main(words: list[str] | None = None) -> None:
    """Print the page, or write it."""
    parser = argparse.ArgumentParser(description="List every message with which a2v refuses.")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the page here")
    out = parser.parse_args(words).out
    if out is None:
        sys.stdout.write(page())
    else:
        out.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
