"""The house's own rules: arrows between rooms point down without circles, and functions and files
stay small."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
SOURCES = sorted(
    path for folder in ("a2v", "pipelines", "export") for path in (ROOT / folder).rglob("*.py")
)
LONGEST_FUNCTION = 80
"""Lines of at most 100 columns, its docstring included."""
LONGEST_FILE = 400
"""Lines."""
MOST_PARAMETERS = 7
"""Without self and cls; those by keyword alone count."""

#: What is longer, and why it is better whole.
LONG_FUNCTIONS: dict[str, str] = {
    "a2v/geometry/simplify.py:_collapse": "one compiled loop (numba): its inner functions share the lists of corners and the heap",
}
#: What takes more parameters, and why.
MANY_PARAMETERS: dict[str, str] = {
    "a2v/geometry/simplify.py:_collapse": "compiled by numba: arrays, no objects",
    "a2v/reconstruction/backs/matching.py:_sweep": "compiled by numba: arrays, no objects",
    "pipelines/engine/run.py:run": "the settings of a run, one keyword each; the graph's own inputs are the last",
    "pipelines/nodes/reconstruction.py:surface_with_face": "a node: one for each edge of the graph",
    "export/flow.py:forward": "the inputs of an ONNX graph, by their names",
    "export/motion.py:forward": "the inputs of an ONNX graph, by their names",
    "export/reconstruction.py:forward": "the inputs of two ONNX graphs, by their names",
    "pipelines/options.py:option": "the properties of an option, one keyword each",
}
LONG_FILES: dict[str, str] = {
    "a2v/types.py": "all types on the arrows, most of it what their fields mean",
    "export/sample.py": "one file that needs nothing of this project: it is copied alone",
}


@pytest.mark.skipif(sys.version_info < (3, 11), reason="import-linter needs Python 3.11")
def test_layers_and_circles(capfd: pytest.CaptureFixture[str]) -> None:
    from importlinter.cli import EXIT_STATUS_SUCCESS, lint_imports

    assert (
        lint_imports(config_filename=str(ROOT / "pyproject.toml"), no_cache=True)
        == EXIT_STATUS_SUCCESS
    ), capfd.readouterr().out


def test_nothing_below_imports_the_librarys_name() -> None:
    """`a2v` leads to the front door, which stands above all others."""
    found = []
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                names = [one.name for one in node.names if one.name == "a2v"]
            elif isinstance(node, ast.ImportFrom) and node.module == "a2v" and not node.level:
                folder = ROOT / "a2v"
                names = [
                    one.name
                    for one in node.names
                    if not (folder / one.name).is_dir() and not (folder / f"{one.name}.py").exists()
                ]
            else:
                continue
            found += [f"{path.relative_to(ROOT).as_posix()}: {name}" for name in names]
    assert found == []


def test_functions_and_files_are_short() -> None:
    functions, files = set(), set()
    for path in SOURCES:
        source, name = path.read_text(), path.relative_to(ROOT).as_posix()
        if len(source.splitlines()) > LONGEST_FILE:
            files.add(name)
        for node in ast.walk(ast.parse(source)):
            if (
                isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
                and (node.end_lineno or 0) - node.lineno + 1 > LONGEST_FUNCTION
            ):
                functions.add(f"{name}:{node.name}")
    assert functions == set(LONG_FUNCTIONS)
    assert files == set(LONG_FILES)
    assert len(functions) <= 2
    assert len(files) <= 5


def parameters_of(node: ast.FunctionDef | ast.AsyncFunctionDef) -> list[str]:
    given = node.args
    every = [
        *given.posonlyargs,
        *given.args,
        *given.kwonlyargs,
        *filter(None, (given.vararg, given.kwarg)),
    ]
    return [one.arg for one in every if one.arg not in ("self", "cls")]


def test_functions_take_few_parameters() -> None:
    """Parameters that belong together are one value: a small frozen dataclass."""
    found = [
        f"{path.relative_to(ROOT).as_posix()}:{node.name}"
        for path in SOURCES
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and len(parameters_of(node)) > MOST_PARAMETERS
    ]
    assert set(found) == set(MANY_PARAMETERS)
    assert len(found) <= 9


def test_constants_have_lines_of_their_own() -> None:
    """A constant has a line and a comment of its own, with its unit."""
    pairs = [
        f"{path.relative_to(ROOT).as_posix()}:{node.lineno}"
        for path in SOURCES
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Tuple)
        and isinstance(node.value, ast.Tuple)
    ]
    assert not pairs
