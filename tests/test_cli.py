"""The command line starts fast, reports bad input exactly and never writes half a file."""

from __future__ import annotations

import gc
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from a2v.motion import BUNDLED
from a2v.sessions import WEIGHTS
from pipelines.cli import COMMANDS, available, main
from tests.support.commands import without_readings

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = ROOT / "a2v" / "samples" / "person.jpg"


@pytest.fixture(autouse=True)
def _own_store(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("A2V_CACHE", str(tmp_path_factory.mktemp("cache")))


def fails(capsys, *arguments: object, code: int = 2) -> str:
    """Run a command that must fail; return its only line on standard error.

    The interpretation of the action is left out.
    """
    assert main([str(argument) for argument in arguments]) == code
    captured = capsys.readouterr()
    assert captured.out == ""
    lines = [line for line in without_readings(captured.err).splitlines() if line]
    assert len(lines) == 1, captured.err
    assert lines[0].startswith("a2v: ")
    return lines[0]


HEAVY = (
    "anny",
    "cv2",
    "igl",
    "jsonargparse",
    "matplotlib",
    "mediapipe",
    "mitsuba",
    "numba",
    "onnxruntime",
    "open3d",
    "pipefunc",
    "pymeshlab",
    "scipy",
    "torch",
)


def test_help_imports_nothing_heavy():
    code = "import sys; from pipelines.cli import main; main(['--help']); print(*sys.modules)"
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    *shown, modules = result.stdout.splitlines()
    assert all(name in "\n".join(shown) for name in available())
    assert not set(HEAVY) & set(modules.split())
    assert not [name for name in modules.split() if name.startswith("pipelines.commands.")]
    assert set(available()) == set(COMMANDS)


@pytest.mark.parametrize("name", sorted(available()))
def test_every_command_explains_itself_with_examples(name, capsys):
    with pytest.raises(SystemExit) as caught:
        main([name, "--help"])
    assert caught.value.code == 0
    text = capsys.readouterr().out
    assert f"a2v {name}" in text
    assert "examples:" in text


def test_without_a_command_it_shows_the_overview(capsys):
    assert main([]) == 2
    assert "a2v video --photo" in capsys.readouterr().out
    assert main(["--version"]) == 0


def test_unknown_words_name_the_nearest(capsys, tmp_path):
    assert "did you mean video?" in fails(capsys, "vidoe")
    assert "--frmaes" in fails(capsys, "actions", "--frmaes", 3)
    line = fails(
        capsys, "video", "--photo", SAMPLE, "--action", "Walk", "--out", tmp_path, "--from", "fraem"
    )
    assert "did you mean frame" in line
    line = fails(capsys, "data", "kitti", "--data", tmp_path)
    assert "'kitti'" in line
    assert "humanact12-fine" in line
    assert "'lots'" in fails(capsys, "cache", "--trim", "lots")


needs_model = pytest.mark.skipif(
    not (WEIGHTS / BUNDLED["cmu"]).exists(),
    reason="the shipped motion model is not in this checkout",
)


@needs_model
def test_actions_lists_the_labels_in_order(capsys):
    assert main(["actions", "--model", "cmu"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "Walk",
        "Wash",
        "Run",
        "Jump",
        "Animal Behavior",
        "Dance",
        "Step",
        "Climb",
    ]


@needs_model
def test_an_unknown_action_names_the_nearest(capsys, tmp_path):
    assert "Jump" in fails(
        capsys, "video", "--photo", SAMPLE, "--action", "jumble", "--out", tmp_path / "o"
    )
    assert "Walk" in fails(capsys, "motion", "--action", "walnut", "--out", tmp_path / "w.npz")
    assert "none of the actions" in fails(
        capsys, "motion", "--model", "cmu", "--action", "boxing", "--out", tmp_path / "w.npz"
    )
    assert "none of the actions" in fails(
        capsys, "motion", "--action", "quidditch", "--out", tmp_path / "w.npz"
    )
    assert "no action given" in fails(capsys, "video", "--photo", SAMPLE, "--out", tmp_path / "o")
    assert "motion model 'nix'" in fails(capsys, "actions", "--model", "nix")
    assert not (tmp_path / "o").exists()


@needs_model
@pytest.mark.parametrize("suffix", [".npz", ".bvh", ".mp4"])
def test_motion_files(tmp_path, capsys, suffix):
    from a2v.formats import read_motion
    from a2v.rendering import probe_video

    out = tmp_path / f"walk{suffix}"
    assert (
        main(["motion", "--action", "Walk", "--frames", "24", "--seed", "3", "--out", str(out)])
        == 0
    )
    assert capsys.readouterr().out.split() == [str(out)]
    if suffix == ".mp4":
        assert probe_video(out).frames == 24
    else:
        motion = read_motion(out)
        assert motion.frames == 24
        assert np.ptp(motion.joints[:, 0], axis=0).max() > 0.1  # it walks somewhere


@needs_model
def test_many_motions(tmp_path, capsys):
    from a2v.types import Motion

    assert (
        main(
            [
                "motion",
                "--action",
                "Walk",
                "--frames",
                "10",
                "--count",
                "3",
                "--out",
                str(tmp_path / "w.npz"),
            ]
        )
        == 0
    )
    assert Motion.load(tmp_path / "w.npz").joints.shape[:2] == (3, 10)
    assert (
        main(
            [
                "motion",
                "--action",
                "Walk",
                "--frames",
                "10",
                "--count",
                "2",
                "--out",
                str(tmp_path / "w.bvh"),
            ]
        )
        == 0
    )
    assert sorted(path.name for path in tmp_path.glob("*.bvh")) == ["w_000.bvh", "w_001.bvh"]
    assert "count is 0" in fails_quietly(
        capsys, "motion", "--action", "Walk", "--count", "0", "--out", tmp_path / "x.npz"
    )
    assert "frames is 0" in fails_quietly(
        capsys, "motion", "--action", "Walk", "--frames", "0", "--out", tmp_path / "x.npz"
    )
    assert "ends in" in fails_quietly(
        capsys, "motion", "--action", "Walk", "--out", tmp_path / "x.xyz"
    )
    assert not list(tmp_path.glob("x.*"))


def fails_quietly(capsys, *arguments: object) -> str:
    capsys.readouterr()
    return fails(capsys, *arguments)


def video(out: Path, **options: object) -> list[str]:
    given = {
        "photo": SAMPLE,
        "out": out,
        "frames": 2,
        "size": 64,
        "views": "front",
        "spp": 1,
        "executor": "serial",
        **options,
    }
    return [
        "video",
        "--quiet",
        *(str(word) for name, value in given.items() for word in (f"--{name}", value)),
    ]


def write(path: Path, data: bytes | str) -> Path:
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


BVH = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  End Site
  {
    OFFSET 0 1 0
  }
}
MOTION
Frames: 2
Frame Time: 0.04
0 0 0 0 0 0
"""


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("empty.bvh", "", "empty"),
        ("truncated.bvh", BVH, "truncated.bvh"),
        ("cut.bvh", BVH[:60], "cut.bvh"),
        ("words.bvh", "once upon a time", "words.bvh"),
        ("picture.bvh", b"\x89PNG\r\n\x1a\n", "picture.bvh"),
        ("archive.npz", b"PK\x03\x04 not really", "archive.npz"),
        ("dance.fbx", "FBX", "is not an FBX file"),
        ("missing.bvh", None, "missing.bvh"),
    ],
)
def test_a_bad_motion_file_is_named(tmp_path, capsys, name, text, words):
    path = tmp_path / name
    if text is not None:
        write(path, text)
    out = tmp_path / "out"
    assert words in fails(capsys, *video(out, motion=path))
    assert not out.exists() or not list(out.iterdir())


def noise_photo() -> bytes:
    import io

    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (256, 256, 3), dtype=np.uint8)).save(
        buffer, "png"
    )
    return buffer.getvalue()


@pytest.fixture
def walk(tmp_path) -> Path:
    """Two frames of a standing CMU skeleton."""
    from a2v.kinematics import forward_kinematics
    from a2v.kinematics.skeleton import CMU
    from a2v.types import Motion

    rotations = np.zeros((2, 20, 3), np.float32)
    root = np.tile(np.float32([0, 1, 0]), (2, 1))
    joints = forward_kinematics(rotations, root, np.full(20, 0.2, np.float32), CMU).astype(
        np.float32
    )
    motion = Motion(
        joints=joints,
        rotations=rotations,
        root=root,
        fps=12,
        parents=CMU.parents,
        joint_names=CMU.joint_names,
        skeleton="cmu",
    )
    motion.save(tmp_path / "walk.npz")
    return tmp_path / "walk.npz"


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("missing.jpg", None, "missing.jpg"),
        ("empty.jpg", b"", "empty"),
        ("text.jpg", b"not a picture", "not"),
        ("cut.png", noise_photo()[:200], "photo"),
        ("noise.png", noise_photo(), "person"),
    ],
)
def test_a_bad_photo_is_explained(tmp_path, capsys, walk, name, data, words):
    path = tmp_path / name
    if data is not None:
        write(path, data)
    out = tmp_path / "out"
    line = fails(capsys, *video(out, photo=path, motion=walk))
    assert words in line
    assert str(path) in line
    assert not out.exists() or not list(out.iterdir())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"frames": 0}, "frames is 0"),
        ({"fps": -1}, "fps is -1"),
        ({"size": 63}, "size is 63"),
        ({"spp": 0}, "spp is 0"),
        ({"views": "front,top"}, "unknown view 'top'"),
        ({"views": "front,front"}, "given twice"),
        ({"camera": "cameras.yaml"}, "cannot read cameras.yaml"),
        ({"background": "beach.jpg"}, "background 'beach.jpg' is not a file"),
        ({"executor": "slurm"}, "slurm"),
        ({"frames": "many"}, "many"),
        ({"only": "vidoe"}, "did you mean video"),
    ],
)
def test_a_bad_option_is_explained(tmp_path, capsys, walk, options, words):
    out = tmp_path / "out"
    assert words in fails(capsys, *video(out, motion=walk, **options))
    assert not out.exists()


def test_an_output_that_cannot_be_written_is_told_at_once(tmp_path, capsys, walk):
    blocked = write(tmp_path / "file", "")
    assert "it is a file" in fails(capsys, *video(blocked, motion=walk))
    assert str(blocked) in fails(capsys, *video(blocked / "deeper", motion=walk))
    assert "--out" in fails(capsys, *video(Path("/proc/nowhere"), motion=walk))
    assert "cannot write" in fails(
        capsys, "dag", "--out", "/proc/nowhere/dag.svg", "--drawer", "matplotlib"
    )
    assert not list(Path(os.environ["A2V_CACHE"]).glob("calls/*")), "no node has run"


@pytest.fixture
def tiny_disk(tmp_path):
    """A file system of 64 kB, which only root can make."""
    disk = tmp_path / "disk"
    disk.mkdir()
    if (
        os.geteuid() != 0
        or subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", disk], capture_output=True
        ).returncode
    ):
        pytest.skip("needs root and mount to make a full disk")
    yield disk
    subprocess.run(["umount", disk], check=True)


def test_a_full_disk_is_one_line_and_leaves_nothing(tiny_disk, tmp_path, capsys, walk):
    (tiny_disk / "filler").write_bytes(b"x" * 60_000)
    assert (
        "space"
        in fails(capsys, "dag", "--out", tiny_disk / "dag.png", "--drawer", "matplotlib").lower()
    )
    assert [path.name for path in tiny_disk.iterdir()] == ["filler"]
    line = fails(capsys, *video(tmp_path / "out", motion=walk, cache=tiny_disk / "store"))
    assert "No space left" in line or "disk is full" in line
    assert not list((tmp_path / "out").glob("*"))


def test_data_checks_and_describes(data_dir, capsys):
    assert main(["data", "cmu", "--data", str(data_dir)]) == 0
    text = capsys.readouterr().out
    assert "1088 clips" in text
    assert "Animal Behavior" in text


@pytest.mark.parametrize("drawer", ["dot", "matplotlib"])
def test_the_picture_of_the_graph(tmp_path, capsys, drawer):
    import shutil

    if drawer == "dot" and not shutil.which("dot"):
        assert "graphviz" in fails(capsys, "dag", "--out", tmp_path / "dag.svg", "--drawer", "dot")
        return
    out = tmp_path / "dag.svg"
    assert main(["dag", "--out", str(out), "--drawer", drawer]) == 0
    text = out.read_text()
    if drawer == "dot":  # matplotlib draws letters as shapes
        assert all(
            f">{name}<" in text
            for name in ("subject", "vertices[t]", "frame[t, c]", "clip[c]", "video")
        )
    assert text.rstrip().endswith("</svg>")
    assert "expected .svg" in fails_quietly(capsys, "dag", "--out", tmp_path / "dag.gif")


def test_settings_from_a_file_have_the_names_of_the_options(tmp_path, capsys, walk):
    config = write(
        tmp_path / "a.yaml", f"photo: {SAMPLE}\nmotion: {walk}\nout: {tmp_path / 'out'}\nsize: 63\n"
    )
    assert "size is 63" in fails(capsys, "video", "--config", config)
    write(config, "sise: 64\n")
    assert "sise" in fails(capsys, "video", "--config", config)


def test_the_cache_shows_and_trims(tmp_path, capsys):
    from a2v.types import OrthographicCamera
    from pipelines.engine.store import Store

    store = Store(tmp_path / "store")
    ref = store.put(OrthographicCamera(scale=1, center_u=0, center_v=0))
    assert main(["cache", "--cache", str(store.folder)]) == 0
    assert str(store.folder) in capsys.readouterr().out
    assert main(["cache", "--cache", str(store.folder), "--trim", "1GB"]) == 0
    assert store.has(ref)
    assert main(["cache", "--cache", str(store.folder), "--clear"]) == 0
    assert not store.has(ref)


def test_messages_are_json_safe_reports(tmp_path):
    from pipelines.answer import plain
    from pipelines.report import versions

    assert json.dumps(plain({"path": tmp_path, "values": (1, 2.5, None, True)}))
    assert {"python", "numpy"} <= set(versions())


@pytest.mark.parametrize("arguments", [["cache"], ["cache", "--trim", "much"]])
def test_a_program_ends_without_a_search_for_cycles(arguments, tmp_path):
    code = (
        "import gc, sys\n"
        "from pipelines.cli import main\n"
        f"sys.argv = ['a2v', *{arguments!r}]\n"
        "main()\n"
        "print('frozen', gc.get_freeze_count() > 0, file=sys.stderr)\n"
    )
    told = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env=os.environ | {"A2V_CACHE": str(tmp_path)},
    )
    assert "frozen True" in told.stderr


def test_a_call_within_a_program_leaves_its_garbage_collection_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("A2V_CACHE", str(tmp_path))
    before = gc.get_freeze_count()
    main(["cache"])
    assert gc.get_freeze_count() == before
