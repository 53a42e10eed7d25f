"""A notebook's source and its executed copy agree, and the copy was executed to its end."""

from __future__ import annotations

import ast
import base64
import importlib
import inspect
import io
import re
from pathlib import Path

import jupytext
import numpy as np
import pytest
from PIL import Image

from scripts.make_notebooks import (
    NOTEBOOK_BYTES,
    PICTURE_BYTES,
    VIEW_BYTES,
    WIDGET,
    encoded,
    shrink,
    smaller,
)
from tests.support.examples import prose

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
SOURCES = sorted(FOLDER.glob("[0-9]*.py"))


def test_there_are_notebooks_and_each_has_its_pair():
    assert SOURCES
    assert {path.stem for path in SOURCES} == {path.stem for path in FOLDER.glob("*.ipynb")}


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_cells_agree(source):
    written, executed = (jupytext.read(path) for path in (source, source.with_suffix(".ipynb")))
    assert [(cell.cell_type, cell.source) for cell in executed.cells] == [
        (cell.cell_type, cell.source) for cell in written.cells
    ]


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_the_copy_is_executed_without_errors_and_small(source):
    path = source.with_suffix(".ipynb")
    cells = [cell for cell in jupytext.read(path).cells if cell.cell_type == "code"]
    assert all(cell.execution_count for cell in cells)
    assert not [
        output for cell in cells for output in cell.outputs if output.output_type == "error"
    ]
    shown = [output.get("data", {}) for cell in cells for output in cell.outputs]
    pictures = [
        text for data in shown for kind, text in data.items() if kind in ("image/png", "image/jpeg")
    ]
    assert pictures
    assert max(map(len, pictures)) <= PICTURE_BYTES, "run make notebooks"
    assert not [data for data in shown if WIDGET in data]
    assert path.stat().st_size <= NOTEBOOK_BYTES, "run make notebooks"


SAID_ONLY = {"export_flow": "export.flow", "body_prior_surface": "a2v.reconstruction"}
SAID_ONLY |= {"load_body_model": "a2v.body", "read_motion": "a2v.formats"}
"""Modules of functions that the text names although no cell imports them."""


def calls_in_prose(source: Path) -> list[ast.Call]:
    """Calls of functions in the text's code, such as `read_motion("clip.bvh")`."""
    found = list[ast.Call]()
    text = re.sub(r"^```.*?^```", "", prose(source), flags=re.MULTILINE | re.DOTALL)
    for code in re.findall(r"`([^`]+)`", text):
        try:
            tree = ast.parse(" ".join(code.split()), mode="eval")
        except SyntaxError:  # a command, a file, a formula
            continue
        calls = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
        found += [call for call in calls if isinstance(call.func, ast.Name)]
    return found


def named(source: Path, name: str) -> object:
    """What a name is in a notebook: a function of a cell, or what the cells import."""
    for node in ast.walk(ast.parse(source.read_text())):
        if isinstance(node, ast.FunctionDef) and node.name == name:
            exec(compile(f"def {name}({ast.unparse(node.args)}): ...", source, "exec"), space := {})
            return space[name]
        if isinstance(node, ast.ImportFrom) and name in {
            one.asname or one.name for one in node.names
        }:
            return getattr(importlib.import_module(node.module or ""), name)
    return getattr(importlib.import_module(SAID_ONLY[name]), name)


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_the_texts_calls_fit_their_functions(source):
    """They show a call beside the cells that run: the function exists and takes the arguments."""
    for call in calls_in_prose(source):
        assert isinstance(call.func, ast.Name)
        if call.func.id == "cKDTree":  # of SciPy, without a signature
            continue
        given = [one for one in call.args if ast.unparse(one) != "..."]
        options = {one.arg: None for one in call.keywords}
        inspect.signature(named(source, call.func.id)).bind(*given, **options)


def test_some_texts_call_functions():
    assert sum(len(calls_in_prose(source)) for source in SOURCES) > 8


def test_a_large_picture_becomes_small_and_keeps_its_content():
    noise = np.random.default_rng(0).integers(0, 255, (300, 400, 3)).astype(np.uint8)
    noise[:, :200] = (200, 30, 30)
    text, kind = smaller(encoded(Image.fromarray(noise), "png"), 40_000)
    assert len(text) <= 40_000
    with Image.open(io.BytesIO(base64.b64decode(text))) as picture:
        assert picture.format.lower() == kind
        shown = np.asarray(picture.convert("RGB")).astype(float)
    assert shown.shape[1] / shown.shape[0] == pytest.approx(4 / 3, abs=0.02)
    left = shown[:, : shown.shape[1] // 2 - 8]
    assert np.abs(left.mean(axis=(0, 1)) - (200, 30, 30)).max() < 8
    same = encoded(Image.fromarray(noise[:20, :20]), "png")
    assert smaller(same, 40_000) == (same, "png")


def test_views_widgets_and_bars_are_left_out_of_a_stored_copy():
    bar = {"data": {WIDGET: {}, "text/plain": "frame 0% | | 0/3"}}
    chooser = {"data": {WIDGET: {}, "text/plain": "interactive"}}
    line = {"output_type": "stream", "name": "stderr", "text": ["\r 3 % frames 1 of 9  "]}
    view = {"data": {"text/html": ["x" * (VIEW_BYTES + 1)]}}
    notebook = {"metadata": {"widgets": {}}, "cells": [{"outputs": [bar, line, chooser, view]}]}
    shrink(notebook)
    first, second = notebook["cells"][0]["outputs"]
    assert first == {"data": {"text/plain": "interactive"}}
    assert "0.2 MB" in second["data"]["text/html"]
    assert notebook["metadata"] == {}
