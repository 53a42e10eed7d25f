"""The Python functions work in a plain script, in `python -c`, in a notebook, in threads and in
asyncio; a progress function stops them; type checkers know their options."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import textwrap
import threading
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

import a2v
from a2v.samples.ready import PHOTO
from tests.support.ready_store import ready_folder

ROOT = Path(__file__).resolve().parents[2]
FILM = {"views": "front", "size": 64, "spp": 1, "denoise": False}
SCRIPT = """
print("the script begins")
import a2v
me = a2v.make_character({photo!r}, cache={cache!r}, workers=1)
wave = a2v.make_motion("Wave", frames=2, seed={seed}, cache={cache!r})
film = dict(views=("front", "back"), size=64, spp=1, denoise=False)
print(a2v.make_video(me, wave, {out!r}, **film))
"""


@pytest.fixture(scope="module")
def store() -> str:
    return str(ready_folder())


@pytest.fixture(scope="module")
def me(store: str) -> a2v.Person:
    return a2v.make_character(PHOTO, cache=store)


def script(store: str, out: Path, seed: int) -> str:
    return SCRIPT.format(photo=str(PHOTO), cache=store, out=str(out), seed=seed)


@pytest.mark.parametrize("kind", ["script", "-c", "standard input"])
def test_a_script_needs_no_guard(kind, store, tmp_path):
    """Workers once imported the main module, which made the video again in each of them."""
    text = script(store, tmp_path / "me.mp4", seed=["script", "-c", "standard input"].index(kind))
    (tmp_path / "job.py").write_text(text)
    words = {"script": ["job.py"], "-c": ["-c", text], "standard input": ["-"]}[kind]
    done = subprocess.run(
        [sys.executable, *words],
        input=text,
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ["the script begins", str(tmp_path / "me.mp4")]
    assert done.stderr == ""
    assert (tmp_path / "me.mp4").stat().st_size > 1000


def test_a_script_whose_workers_are_dasks_needs_no_guard(tmp_path):
    pytest.importorskip("distributed", reason="Dask is an extra: pip install 'a2v[dask]'")
    (tmp_path / "job.py").write_text(
        "print('the script begins')\n"
        "from pipelines.engine.executors import open_executor\n"
        "with open_executor('dask', workers=2) as executor:\n"
        "    print(sorted(executor.map(len, ['a', 'bc'])))\n"
    )
    done = subprocess.run(
        [sys.executable, "job.py"],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.stdout.splitlines() == ["the script begins", "[1, 2]"], done.stderr


def test_a_notebook_cell(store, tmp_path):
    book = nbformat.v4.new_notebook()
    book.cells = [nbformat.v4.new_code_cell(script(store, tmp_path / "me.mp4", seed=7))]
    NotebookClient(book, timeout=300, resources={"metadata": {"path": str(ROOT)}}).execute()
    said = "".join(out["text"] for out in book.cells[0].outputs if out["output_type"] == "stream")
    assert said.splitlines() == ["the script begins", str(tmp_path / "me.mp4")]


def environment() -> dict[str, str]:
    import os

    return {**os.environ, "PYTHONPATH": str(ROOT)}


class StopError(Exception):
    """What a progress function raises to cancel."""


def test_a_progress_function_cancels(me, store, tmp_path):
    """Frames take long; the run ends soon after the exception, and the same call goes on later."""
    heard: list[str] = []

    def listen(update):
        heard.append(update.node)
        if update.node == "vertices":
            raise StopError("enough")

    clip = a2v.make_motion("Wave", frames=30, seed=11, cache=store)
    with pytest.raises(StopError, match="enough"):
        a2v.make_video(me, clip, tmp_path / "me.mp4", progress=listen, **FILM)
    assert heard[-1] == "vertices"
    assert not (tmp_path / "me.mp4").exists()
    with pytest.raises(StopError):
        a2v.make_motion("Jump", frames=30, seed=12, cache=store, progress=stop_at_once)
    assert threading.active_count() < 20


def stop_at_once(update):
    raise StopError(update.node)


def test_threads_and_asyncio(me, store, tmp_path, capsys):
    """Two videos at once; what other threads print is neither held back nor lost."""

    async def both() -> list[Path]:
        clips = [a2v.make_motion(name, frames=2, seed=21, cache=store) for name in ("Wave", "Walk")]
        tasks = [
            asyncio.to_thread(a2v.make_video, me, clip, tmp_path / f"{number}.mp4", **FILM)
            for number, clip in enumerate(clips)
        ]
        return await asyncio.gather(*tasks)

    before = sys.stdout
    made = asyncio.run(both())
    assert sys.stdout is before
    assert [path.name for path in made] == ["0.mp4", "1.mp4"]
    assert all(path.stat().st_size > 1000 for path in made)
    wrong: list[str] = []

    def refuse() -> None:
        try:
            a2v.make_motion("Walk", frames=-1)
        except a2v.InputError as error:
            wrong.append(str(error))

    thread = threading.Thread(target=refuse)
    thread.start()
    thread.join()
    assert wrong == ["frames is -1; expected 1 to 10000"]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda me, clip: a2v.make_character(42), "photo is 42; expected the path of an image"),
        (lambda me, clip: a2v.make_character(photos="a.jpg"), "expected a list of paths"),
        (lambda me, clip: a2v.make_character(PHOTO, progress=3), "progress is 3; expected True"),
        (lambda me, clip: a2v.make_character(PHOTO, workers=0), "workers is 0; expected"),
        (lambda me, clip: a2v.make_character(PHOTO, cache=7), "cache is 7; expected a folder"),
        (lambda me, clip: a2v.make_motion(42), "action is 42; expected text"),
        (lambda me, clip: a2v.make_video("me.jpg", clip, "a.mp4"), "expected the result of make_c"),
        (lambda me, clip: a2v.make_video(me, "Walk", "a.mp4"), "expected a result of make_motion"),
        (lambda me, clip: a2v.make_video(me, clip, 42), "path is 42; expected an .mp4"),
        (lambda me, clip: me.save(42), "path is 42; expected the name of a file"),
        (lambda me, clip: me.save("a.glb", {"x": 3}), "x is 3; expected a result of make_motion"),
        (lambda me, clip: me.save("a.glb", pose="phto"), "choose from rest, photo"),
        (lambda me, clip: me.save("a.glb", rigg="vrm"), "did you mean rig"),
        (lambda me, clip: clip.save(None), "path is None; expected the name of a file"),
    ],
)
def test_wrong_arguments_are_refused_in_a_sentence(call, words, me, store):
    clip = a2v.make_motion("Wave", frames=2, seed=21, cache=store)
    with pytest.raises(a2v.InputError) as caught:
        call(me, clip)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_type_checkers_and_editors_know_the_options(tmp_path):
    """mypy accepts every option that is right and names those that are wrong."""
    import inspect

    names = inspect.signature(a2v.make_motion).parameters
    assert {"seconds", "in_place", "seed", "path"} <= set(names)
    assert "values" not in names
    right = """
        from pathlib import Path
        import a2v

        me = a2v.make_character("me.jpg", mask=Path("m.png"), fit={"height": 1.6})
        walk = a2v.make_motion("Walk", seconds=2, loop=True, license="free")
        a2v.make_video(me, walk, "me.mp4", views=("front", "turntable"), size=720)
        me.save("me.glb", {"walk": walk}, pose="photo")
    """
    wrong = """
        import a2v

        me = a2v.make_character("me.jpg", maskx="m.png")
        walk = a2v.make_motion("Walk", secnds=2)
        fast = a2v.make_motion("Walk", license="fre")
        a2v.make_video(me, walk, "me.mp4", size="large")
        me.save("me.glb", {"walk": walk}, pose="phto")
    """
    for name, text in {"right": right, "wrong": wrong}.items():
        (tmp_path / f"{name}.py").write_text(textwrap.dedent(text))
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "mypy",
            "--config-file",
            ROOT / "pyproject.toml",
            *tmp_path.glob("*.py"),
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=600,
    )
    found = [line.partition("error: ")[2] for line in done.stdout.splitlines() if "error" in line]
    assert "right.py" not in done.stdout, done.stdout
    for word in ('"maskx"', '"secnds"', '"license"', '"size"', '"pose"'):
        assert any(word in line for line in found), (word, done.stdout)


def test_the_types_are_those_of_the_requests():
    from scripts import make_keywords

    formatted = subprocess.run(
        [sys.executable, "-m", "ruff", "format", "--stdin-filename", "a.py", "-"],
        input=make_keywords.page(),
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert make_keywords.PAGE.read_text() == formatted, (
        "the options have changed: run python scripts/make_keywords.py and ruff format"
    )
