"""Every example of README, ``--help``, the pages and the notebooks' text is run, or `EXCUSED`.

Commands run with few small frames and the ready person's store; Python blocks with what their page
has made before.
"""

from __future__ import annotations

import re
import shlex
import shutil
import wave as wave_file
from pathlib import Path

import numpy as np
import pytest

import a2v
from a2v.samples.ready import PHOTO, load_ready_person
from pipelines.cli import main
from pipelines.engine.store import Store
from tests.support.doors import write_files
from tests.support.examples import PAGES, blocks, command_lines, prose

ROOT = Path(__file__).resolve().parents[2]
OTHER_PERSON = "another person is a whole reconstruction, a minute: "
EXCUSED = {
    r"^a2v (train|evaluate|studio|survey|compare|data)\b": "the laboratory needs data sets and hours; "
    "tests/test_train_command.py, test_compare_command.py and tests/lab run it on small data",
    r"^a2v [a-z]+$|--help|\.\.\.|your words|\bFILE\b|--find \"words\"": "names a command or an option",
    r"^a2v serve\b": "does not end; tests/pipelines/serve",
    r"^a2v cache --": "empties the store; tests/pipelines/test_forget.py and test_engine.py",
    r"a2v follow|clip\.mp4": "needs a video of a person; tests/footage",
    r"--backend papers|SMPL": "needs files of your own; tests/lab/papers, tests/body/test_smpl.py",
    r"--mask|--keypoints|--corrections": OTHER_PERSON + "tests/perception",
    r"--fit\.|--color\.|body-prior|fused": OTHER_PERSON + "tests/body, tests/reconstruction",
    r"back\.jpg": OTHER_PERSON + "tests/pipelines/test_photos.py",
    r"s3://|--limit-memory|--retry-failed": "a cluster or a failure; tests/pipelines/test_batch.py",
    r"\.usdz|\.fbx": "needs optional packages; tests/formats",
    r"a2v motion-page": "needs a package of npm; tests/motion/test_page.py",
    r"meshopt": "needs npm; tests/formats",
    r"runs/mine/|baseline\.pt": "needs a trained model; tests/test_train_command.py",
    r"kick\.txt": "needs a DeepMimic file; tests/formats",
    r"--from body": "computes the person again, a minute; tests/pipelines/test_engine.py",
    r"^a2v doctor": "tests/test_doctor.py",
    r"\.glb#": "needs a file of several motions; tests/formats/test_clips_of_files.py",
    r"--count 100|--native": "needs the data's clips; tests/test_motion_command.py",
}
"""Why an example does not run here, by a pattern."""
PYTHON = {
    "body.md": "a fit takes a minute (tests/body/test_fit.py); SMPL's file is the user's",
    "reconstruction.md": "a surface takes a minute; tests/reconstruction",
    "character.md": "a character takes half a minute; tests/reconstruction/canonical",
    "motion_page.md": "needs a package of npm; tests/motion/test_page.py",
    "evaluation.md": "needs data sets; tests/lab/evaluation",
    "quick_views.md": "needs a set of views; tests/lab/studio/quick",
    "studio.md": "needs a data set; tests/lab/studio",
}
"""Pages whose Python is not run, and why."""
UNNAMED = {"pipeline.md": [1], "rendering.md": [1]}
"""Blocks that leave parts out (a node with `...`, a viewer of things that are not made there)."""
SMALL = {
    "size=512": "size=64",
    "frames=30": 'frames=1, views="front", size=64, spp=1',
    "seconds=6, seed=4": "frames=2",
    '"me.mp4", views=': '"me.mp4", size=64, spp=1, views=',
    '"out/me")': '"out/me", size=64, spp=1)',
}
"""What makes a Python block quick."""
LIGHT = "--triangles 2000 --texture 512 --normal-map 0 --quiet"
"""Of exports: those of the person `small`, which the store knows."""
FILM = f"--frames 1 --views front --size 64 --spp 1 --denoise false --executor serial {LIGHT}"
QUICK = {
    "video": FILM,
    "batch": FILM,
    "character": f"--frames 2 {LIGHT}",
    "reconstruct": LIGHT,
    "retarget": "--frames 2",
}
"""Options that make a command quick; the last one given counts."""
COARSE = (
    "--implicit.resolution 200 --implicit.vertices 25000 --implicit.limits false --color.texture 0"
)
"""Those of the papers' person, which the store does not know."""
KEYS = "- {time: 1, at: [0, 1]}\n"


def write_speech(path: Path) -> None:
    """A vowel-like sound of a second: a tone of 120 Hz with overtones, in 16 bits."""
    times = np.arange(16_000) / 16_000
    wave = sum(np.sin(2 * np.pi * 120 * n * times) / n for n in range(1, 12))
    with wave_file.open(str(path), "wb") as file:
        file.setparams((1, 2, 16_000, len(times), "NONE", "not compressed"))
        file.writeframes((8000 * wave / np.abs(wave).max()).astype("<i2").tobytes())


def excuse(line: str) -> str:
    return next((why for pattern, why in EXCUSED.items() if re.search(pattern, line)), "")


def examples() -> dict[str, str]:
    """Every command that is shown, without its remark, and where."""
    found: dict[str, str] = {}
    notebooks = {path.name: command_lines(prose(path)) for path in ROOT.glob("notebooks/*.py")}
    for page, lines in (PAGES | notebooks).items():
        for line in lines:
            found.setdefault(re.split(r"\s{2,}|\s#\s|\s\|\s| > |;", line)[0].strip(), page)
    return found


RUN = [line for line in examples() if not excuse(line)]


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory, store: Store) -> Path:
    """A user's folder with the files that examples name."""
    folder = tmp_path_factory.mktemp("user")
    write_files(folder)
    shutil.copy(PHOTO, folder / "me.jpg")
    for name in ("dance.bvh", "mine.bvh", "live-1.bvh", "clip.bvh"):
        shutil.copy(folder / "own.bvh", folder / name)
    shutil.copy(folder / "own.npz", folder / "a.npz")
    assert (
        main(["motion", "--action", "Walk", "--seconds", "2", "--out", str(folder / "b.bvh")]) == 0
    )
    (folder / "keys.yaml").write_text(KEYS)
    (folder / "cameras.yaml").write_text("hero: {azimuth: 30}\n")
    (folder / "a2v" / "samples").mkdir(parents=True)
    shutil.copy(PHOTO, folder / "a2v" / "samples")
    rows = ["me.jpg,Walk,4", 'me.jpg,"Walk,Jump",']
    (folder / "jobs.csv").write_text("\n".join(["photo,action,seed", *rows]))
    (folder / "jobs.yaml").write_text("- {photo: me.jpg, action: Walk, seed: 4}\n")
    (folder / "my-cache").symlink_to(store.folder)
    me = a2v.make_character(
        folder / "me.jpg", cache=store.folder, triangles=2000, texture=512, normal_map=0
    )
    me.save(folder / "theirs.glb")
    me.save(folder / "dance.glb", {"Spin": a2v.make_motion("Spin dance", seconds=1)})
    smpl = ["--rig", "smpl", "--out", str(folder / "amass.npz")]
    assert main(["motion", "--action", "Walk", "--seconds", "2", *smpl]) == 0
    write_speech(folder / "speech.wav")
    me.save(folder / "theirs.vrm", author="A", license_url="https://a.b/c")
    (folder / "out" / "me").mkdir(parents=True)
    shutil.copy(folder / "theirs.glb", folder / "out" / "me" / "character.glb")
    shutil.copy(folder / "theirs.glb", folder / "me.glb")
    return folder


@pytest.mark.parametrize("line", RUN)
def test_an_example_runs(line, here, store, monkeypatch):
    monkeypatch.chdir(here)
    monkeypatch.setenv("A2V_CACHE", str(store.folder))
    words = shlex.split(line)[1:]
    quick = [*QUICK.get(words[0], "").split(), *(COARSE.split() if "--papers" in words else [])]
    given = {"--keyframes", "--start-pose", "--end-pose"}  # these need the whole length
    if "--seconds" in words and not given.intersection(words):
        place = words.index("--seconds")
        words[place + 1 : place + 2] = ["0.2"] if "--frames" not in quick else []
        if "--frames" in quick:
            del words[place]
    if "--count" in words:
        words[words.index("--count") + 1] = "2"
    words = [re.sub(r" for \d s\b", " for 0.2 s", word) for word in words]
    if words[0] in ("motion", "sample") and words[-1].endswith(".mp4"):
        quick = ["--frames", "12"]  # a film of stick figures takes 15 ms a frame
    assert main([*words, *quick]) == 0


def test_excuses_are_needed():
    """Each pattern excuses some example, and everything else runs."""
    lines = list(examples())
    assert len(RUN) > 70
    assert not [one for one in EXCUSED if not any(re.search(one, line) for line in lines)]


def python_blocks() -> list[tuple[str, int]]:
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    return [
        (page.name, number)
        for page in pages
        for number, _ in enumerate(blocks(page, "python"))
        if page.name not in PYTHON and number not in UNNAMED.get(page.name, ())
    ]


@pytest.mark.parametrize(("page", "number"), python_blocks())
def test_a_python_block_runs(page, number, here, store, monkeypatch):
    """The first example of docs/python.md failed twice."""
    monkeypatch.chdir(here)
    monkeypatch.setenv("A2V_CACHE", str(store.folder))
    text = blocks(ROOT / "docs" / page, "python")[number]
    for long, short in SMALL.items():
        text = text.replace(long, short)
    ready = load_ready_person()
    vertices = ready.character.surface.vertices
    known = {
        "subject": ready.subject,
        "body": ready.body,
        "camera": ready.photo_camera,
        "surface": ready.character.surface,
        "vertices": np.stack([vertices, vertices]),
    }
    if page == "animation.md":  # `bind` takes a surface in the body's pose
        known["surface"] = ready.colored_surface
    exec(compile(text, page, "exec"), known)


def test_the_readmes_line_of_python_runs(here, store, monkeypatch):
    monkeypatch.chdir(here)
    monkeypatch.setenv("A2V_CACHE", str(store.folder))
    shown = re.findall(
        r"`(me = a2v\.[^`]*)`, `(a2v\.make_video[^`]*)`", (ROOT / "README.md").read_text()
    )
    assert len(shown) == 1
    text = "\n".join(shown[0]).replace('"out/me")', '"out/me", size=64, spp=1, views="front")')
    exec("import a2v\n" + text.replace('"Jump"', '"Jump", frames=1'), {})
    assert (here / "out" / "me" / "video.mp4").exists()
