"""Options: one dataclass a command, hyphens for users, settings of stages, and the command lines
that the pages show."""

from __future__ import annotations

import argparse
import os
import re
import shlex
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import get_type_hints

import pytest

from a2v.body import FitSettings
from a2v.errors import InputError
from pipelines.cli import available, every_command, load_command, main, module_of
from pipelines.options import _parser, actions_of, flag, group, option, parse, settings
from tests.support.examples import PAGES

ROOT = Path(__file__).resolve().parents[1]
COMMANDS = every_command()
WITH_OPTIONS = [name for name in COMMANDS if name != "train"]


def options_of(name: str, *arguments: str):
    module = load_command(name)
    return parse(
        module.Options, arguments, command=name, about=module.HELP, examples=module.EXAMPLES
    )


@dataclass(frozen=True, kw_only=True)
class Shared:
    start_frames: int | None = option("frames of the start", default=None)
    quiet: bool = flag("no bars")
    shared_range: tuple[float, ...] = option("lowest and highest", default=(0.0, 1.0))


@dataclass(frozen=True, kw_only=True)
class Options:
    out: str = option("file")
    name: tuple[str, ...] = option("names", default=(), many="repeated")
    seed: int = option("seed", default=0, rare=True)
    start: str | None = option("node", default=None, names=("--from",), metavar="NODE")
    shared: Shared = group(Shared)
    fit: FitSettings = settings(FitSettings)


def given(*arguments: str) -> Options:
    return parse(Options, arguments, command="make", about="Make it.", examples="examples: none")


def test_a_command_line_fills_the_dataclass():
    assert given("--out", "a") == Options(out="a", fit=FitSettings(), shared=Shared())
    made = given(
        "--out",
        "a_b-c",
        "--name",
        "x_y",
        "--name=z-z",
        "--start-frames",
        "3",
        "--quiet",
        "--from",
        "base",
        "--fit.silhouette-weight",
        "2",
    )
    assert made.out == "a_b-c"
    assert made.name == ("x_y", "z-z")
    assert made.shared == Shared(start_frames=3, quiet=True)
    assert made.start == "base"
    assert made.fit == FitSettings(silhouette_weight=2.0)


def test_options_are_found_in_the_table_as_jsonargparse_finds_them():
    from jsonargparse import _core, _subcommands

    parser = _parser(load_command("video").Options, "a2v video", "", "", level=2)
    options = {text.lstrip("-") for one in parser._actions for text in one.option_strings}
    names = {one.dest for one in parser._actions} | options
    assert len(names) > 200
    for name in (*sorted(names), "fit.nothing", "nothing", ""):
        for exclude in (None, argparse._StoreAction):
            found = _core.find_action_and_subcommand(parser, name, exclude=exclude)
            assert found == _subcommands.find_action_and_subcommand(parser, name, exclude=exclude)


def test_hyphens_and_underscores_are_the_same_on_the_command_line_and_in_files(tmp_path):
    wanted = given("--out", "a", "--start_frames", "3", "--fit.silhouette_weight=2")
    assert given("--out", "a", "--start-frames", "3", "--fit.silhouette-weight=2") == wanted
    for text in (
        "out: a\nstart_frames: 3\nfit:\n  silhouette_weight: 2\n",
        "out: a\nstart-frames: 3\nfit:\n  silhouette-weight: 2\n",
    ):
        (tmp_path / "a.yaml").write_text(text)
        assert given("--config", str(tmp_path / "a.yaml")) == wanted
    (tmp_path / "fit.yaml").write_text("silhouette-weight: 2\n")
    assert given("--out", "a", "--start-frames", "3", "--fit", str(tmp_path / "fit.yaml")) == wanted


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "out"),
        (("--out", "a", "--sedd", "1"), "--sedd"),
        (("--out", "a", "--seed", "one"), "--seed"),
        (("--out", "a", "--fit.silhouette_weight", "much"), "--fit.silhouette-weight"),
        (("--out", "a", "--start-frames", "many"), "--start-frames"),
        (("--out", "a", "--shared-range", "1,2"), "expected a list in brackets, such as [1,2]"),
    ],
)
def test_what_is_wrong_is_one_line_with_the_options_name(arguments, words):
    with pytest.raises(InputError) as caught:
        given(*arguments)
    assert words in str(caught.value)
    assert str(caught.value).endswith("; see a2v make --help")
    assert "\n" not in str(caught.value)


def shown(capsys, *arguments: str) -> str:
    with pytest.raises(SystemExit) as caught:
        main(list(arguments))
    assert caught.value.code == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("name", WITH_OPTIONS)
def test_help_says_what_people_use_and_help_all_everything(name, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "126")
    short = shown(capsys, *name.split(), "--help")
    users = shown(capsys, *name.split(), "--help-all") if "--help-all" in short else short
    whole = shown(capsys, *name.split(), "--help-lab") if "--help-lab" in users else users
    headings = re.findall(r"^\S.*:$", whole, re.MULTILINE)
    assert len(headings) == len(set(headings))
    if module_of(name).startswith("pipelines.commands"):
        assert not re.search(r"Eq\. ?\d|`|\ba2v\.[a-z]+\.", users), "the help names the code"
    assert len(short) <= len(users) <= len(whole)
    assert "examples:" in short
    assert not re.search(r"--[\w.-]*_", whole), "names have hyphens"
    assert "<class" not in whole
    for section in re.findall(r"^--(\w+)\.\*", whole, re.MULTILINE):
        assert f"--{section}." not in short.partition("examples:")[0]
    for item, kind in get_type_hints(load_command(name).Options).items():
        if (
            is_dataclass(kind)
            and not any(one.metadata for one in fields(kind))
            and f"--{item}.*" in whole
        ):
            assert all(f"--{item}.{one.name.replace('_', '-')}" in whole for one in fields(kind)), (
                kind
            )


def test_the_videos_help_fits_a_screen(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "126")
    lines = shown(capsys, "video", "--help").splitlines()
    assert len(lines) <= 50
    assert max(map(len, lines)) <= 126
    users, everything = (shown(capsys, "video", level) for level in ("--help-all", "--help-lab"))
    assert "--fit.silhouette-weight" in everything
    assert "Weight of the silhouette" in everything
    assert "--fit.silhouette-weight" not in users
    assert "--fit.height" in users
    assert all(
        f"\n{title}:\n" in users
        for title in (
            "the person",
            "the motion",
            "the film",
            "exported files",
            "execution",
        )
    )
    assert "--help-lab" in users


def test_what_the_laboratory_sets_is_taken_everywhere():
    options = options_of(
        "video",
        "--photo",
        "a.jpg",
        "--out",
        "o",
        "--fit.silhouette-weight",
        "2",
        "--bind.far",
        "0.1",
    )
    assert (options.person.fit.silhouette_weight, options.person.bind.far) == (2.0, 0.1)


def test_training_has_a_command_for_each_kind_of_model(capsys):
    assert main(["train"]) == 2
    text = shown(capsys, "train", "--help")
    assert all(
        f"a2v train {name}" in text for name in ("motion", "flow", "classifier", "reconstruction")
    )
    assert main(["train", "flwo"]) == 2
    assert "did you mean flow?" in capsys.readouterr().err
    common = ["--dataset", "cmu", "--data", "d", "--out", "o"]
    assert options_of("train flow", *common, "--guided_until", "0.5").guided_until == 0.5
    with pytest.raises(InputError, match="guided"):
        options_of("train motion", *common, "--guided-until", "0.5")


@pytest.mark.parametrize("page", [page for page, lines in PAGES.items() if lines])
def test_the_command_lines_that_are_shown_are_understood(page):
    for line in PAGES[page]:
        words = shlex.split(re.split(r"\s{2,}|\s#\s|\s\|\s| > |;", line)[0])[
            1:
        ]  # what follows is a remark or another program
        name, rest = " ".join(words[:2]), words[2:]
        if name not in COMMANDS:
            name, rest = words[0], words[1:]
        assert words[0] in available(), line
        if name == "train" or not rest or {"--help", "--help-all", "--help-lab", "..."} & set(rest):
            continue  # names the command alone
        assert understood(name, rest, whole=not page.startswith("docs/")), line


def understood(name: str, arguments: list[str], *, whole: bool) -> bool:
    """Whether a command takes `arguments`.

    Unless they are the `whole`, required options may be missing, and values may be placeholders.
    """
    try:
        options_of(name, *arguments)
    except InputError as error:
        if whole or not re.search(
            r"required|expected one argument|invalid choice: '[A-Z]+'", str(error)
        ):
            raise
    return True


@pytest.mark.parametrize("name", ["--config", "--fit", "inside"])
def test_files_of_settings_are_regular_and_short(tmp_path, name):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "long").write_text("#" * (1 << 20) + "#")
    (tmp_path / "latin").write_bytes("# \xe4".encode("latin-1"))
    for path, words in (
        (tmp_path / "pipe", "pipe"),
        (tmp_path / "long", "MiB"),
        ("/proc/self/mem", "cannot read"),
        (tmp_path / "latin", "UTF-8"),
    ):
        option = f"{name}={path}"
        if name == "inside":  # a file that names another one
            (tmp_path / "outer.yaml").write_text(f"fit: {path}\n")
            option = f"--config={tmp_path / 'outer.yaml'}"
        with pytest.raises(InputError, match=words):
            given("--out", "a", option)
    with pytest.raises(InputError):
        given("--out", "a", f"{name}=-")


@pytest.mark.parametrize("name", WITH_OPTIONS)
def test_every_option_has_one_line_of_its_own(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """No help has a default twice, a control character, or an option without its own text."""
    command = load_command(name)
    with pytest.raises(SystemExit):
        parse(
            command.Options,
            ["--help-all"],
            command=name,
            about=command.HELP,
            examples=command.EXAMPLES,
        )
    shown = capsys.readouterr().out
    if "--help-lab" in shown:
        with pytest.raises(SystemExit):
            parse(
                command.Options,
                ["--help-lab"],
                command=name,
                about=command.HELP,
                examples=command.EXAMPLES,
            )
        shown = capsys.readouterr().out
    assert not re.search(r"(\(default: [^)]*\))\s+\1", shown)
    assert not [letter for letter in shown if ord(letter) < 32 and letter != "\n"]
    texts: dict[tuple[str, str], str] = {}
    for action in actions_of(command.Options):
        option = (action.option_strings or [action.dest])[-1]
        assert action.help, f"{option} of a2v {name} has no text"
        room = option.rpartition(".")[0]
        if action.help != "YAML file of these settings":
            assert texts.setdefault((room, action.help), option) == option, (
                f"{option} and {texts[room, action.help]} share a sentence"
            )
