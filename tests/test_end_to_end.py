"""From the bundled photo and an action to all files: small, repeated, interrupted and partial."""

from __future__ import annotations

import dataclasses
import functools
import json
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from a2v.body.second_photo import SIDES
from a2v.io import sha256
from a2v.samples import load_ready_person
from a2v.types import Motion, Subject
from pipelines.cli import main
from tests.support.glb import Glb
from tests.support.ready_store import fill
from tests.support.whole_run import FRAMES, OPTIONS, ROOT, SAMPLE, SIZE, VIEWS, whole_run

STILL = ("subject", "photo_body", "surface", "body", "colored_surface", "character")


def command(out: Path, *more: object, photo: Path = SAMPLE, action: str = "Walk") -> list[str]:
    given = ["--photo", photo, "--action", action, "--out", out, *OPTIONS]
    given += ["--cache", whole_run().store, *more]
    return [sys.executable, "-m", "pipelines", "video", *map(str, given)]


def execute(out: Path, *more: object, **options: object) -> None:
    """Run the command in this process, which has imported what it needs."""
    assert main([*command(out, *more, **options)[3:], "--executor", "serial"]) == 0


def report(out: Path) -> dict:
    return json.loads((out / "report.json").read_text())


@pytest.fixture(scope="module")
def made() -> tuple[Path, subprocess.CompletedProcess[str]]:
    run = whole_run()
    assert run.done.returncode == 0, run.done.stderr
    return run.out, run.done


def test_every_promised_file_is_there_and_the_path_comes_last(made):
    out, result = made
    names = {
        "video.mp4",
        "front.mp4",
        "left.mp4",
        "character.glb",
        "motion.bvh",
        "motion.npz",
        "preview.html",
        "report.json",
    }
    assert {path.name for path in out.iterdir()} == names
    assert result.stdout.splitlines()[-1] == str(out / "video.mp4")


def test_the_character_moves_in_its_page_before_the_frames_are_traced(made):
    out, result = made
    said = f"the moving character can be seen in {out / 'preview.html'}"
    lines = result.stderr.splitlines()
    assert "frames " not in result.stderr[: result.stderr.index(said)]
    assert re.match(
        r"made in \d+ (s|min): video.mp4, front.mp4, left.mp4, character.glb", lines[-2]
    )
    assert lines[-1] == f"in {out}"
    assert len(lines) < 40


def test_the_videos_have_the_asked_size_length_and_speed(made):
    from a2v.rendering import probe_video, read_video

    out, _ = made
    whole, front = probe_video(out / "video.mp4"), probe_video(out / "front.mp4")
    assert (whole.width, whole.height, whole.frames) == (SIZE * len(VIEWS), SIZE, FRAMES)
    assert (front.width, front.height, front.frames) == (SIZE, SIZE, FRAMES)
    assert (whole.codec, whole.pixel_format) == ("h264", "yuv420p")
    assert whole.fps == pytest.approx(Motion.load(out / "motion.npz").fps, rel=1e-3)
    picture = next(iter(read_video(out / "video.mp4"))).astype(int)
    assert np.ptp(picture[:, :SIZE].mean(2)) > 40  # not a blank frame
    single = next(iter(read_video(out / "front.mp4"))).astype(int)
    assert np.abs(picture[:, :SIZE] - single).mean() < 12  # the first of the views is the front


def test_the_motion_file_keeps_the_contract(made):
    with np.load(made[0] / "motion.npz") as arrays:
        joints = len(arrays["parents"])
        assert arrays["joints"].shape == arrays["rotations"].shape == (FRAMES, joints, 3)
        assert arrays["root"].shape == (FRAMES, 3)
        assert (str(arrays["action"]), int(arrays["seed"])) == ("Walk", 0)
        assert {"fps", "joint_names"} <= set(arrays)


def test_the_character_is_textured_skinned_and_animated(made):
    import pygltflib

    gltf = pygltflib.GLTF2().load(str(made[0] / "character.glb"))
    assert len(gltf.skins) == 1
    assert len(gltf.animations) == 1
    assert gltf.images
    assert any(
        primitive.attributes.JOINTS_0 is not None
        for mesh in gltf.meshes
        for primitive in mesh.primitives
    )


def test_the_bvh_moves_the_characters_bones(made):
    from a2v.formats.bvh import read_bvh

    motion = read_bvh(made[0] / "motion.bvh")
    assert motion.frames == FRAMES
    assert 1.0 < np.ptp(motion.joints[0, :, 1]) < 2.5  # a person, in meters


def test_the_report_tells_what_made_it(made):
    out, _ = made
    told = report(out)
    assert told["inputs"]["photo"]["sha256"] == sha256(SAMPLE)
    assert len(told["inputs"]["model"]["sha256"]) == 64
    assert told["outputs"]["video.mp4"]["sha256"] == sha256(out / "video.mp4")
    assert told["parameters"]["seed"] == 0
    assert told["parameters"]["render"]["size"] == SIZE
    assert {"python", "mitsuba", "torch", "a2v"} <= set(told["versions"])
    nodes = told["nodes"]
    assert nodes["frame"]["calls"] == FRAMES * len(VIEWS)
    assert nodes["vertices"]["calls"] == FRAMES
    assert all(node["calls"] >= 1 for node in nodes.values())
    fit = nodes["photo_body"]["measures"]
    assert {"distance", "height", "pitch", "field_of_view", "distance_from"} <= set(fit["camera"])
    assert {"left_arm", "right_arm", "left_leg", "right_leg"} <= set(fit["limb_errors"])
    assert fit["second_photo"] in SIDES
    assert 0 < told["seconds"] < 600
    assert 50 < told["peak_memory_mb"] < 6000


def test_again_everything_is_remembered_and_equal(made, tmp_path):
    execute(tmp_path)
    told = report(tmp_path)
    assert all(
        node["remembered"] == node["calls"]
        for name, node in told["nodes"].items()
        if name != "frame_settings"
    )
    assert told["outputs"] == report(made[0])["outputs"]


def test_another_action_reuses_the_character(made, tmp_path):
    execute(tmp_path, action="Jump")
    nodes = report(tmp_path)["nodes"]
    assert all(nodes[name]["remembered"] == 1 for name in STILL)
    assert nodes["motion"]["remembered"] == nodes["frame"]["remembered"] == 0


def test_a_run_from_a_node_computes_it_and_what_follows(made, tmp_path):
    execute(tmp_path, "--from", "pose")
    nodes = report(tmp_path)["nodes"]
    assert (
        nodes["pose"]["remembered"]
        == nodes["vertices"]["remembered"]
        == nodes["frame"]["remembered"]
        == 0
    )
    assert nodes["poses"]["remembered"] == nodes["character"]["remembered"] == 1


def test_a_run_of_only_one_node_stops_there(made, tmp_path):
    execute(tmp_path, "--only", "frame")
    names = {f"{view}_{t:04d}.png" for view in VIEWS for t in range(FRAMES)}
    assert {path.name for path in (tmp_path / "frame").iterdir()} == names
    assert Image.open(tmp_path / "frame" / "left_0001.png").size == (SIZE, SIZE)
    assert "video" not in report(tmp_path)["nodes"]
    execute(tmp_path, "--only", "subject")
    assert Subject.load(tmp_path / "subject.npz").image.ndim == 3


def test_a_recorded_motion_moves_the_character(made, tmp_path):
    execute(tmp_path / "o", "--motion", made[0] / "motion.bvh")
    told = report(tmp_path / "o")
    assert told["nodes"]["recorded_motion"]["calls"] == 1
    assert told["inputs"]["motion"]["sha256"] == sha256(made[0] / "motion.bvh")
    assert told["nodes"]["character"]["remembered"] == 1


def count(cache: Path, node: str) -> int:
    return sum(1 for _ in (cache / "calls" / node).glob("*/*.json"))


def settled_count(cache: Path, node: str) -> int:
    """Return the count after all workers have ended.

    Workers end with their parent, but on a busy machine their current task may finish first.
    """
    kept, since = count(cache, node), time.monotonic()
    while time.monotonic() < since + 2:
        time.sleep(0.1)
        if count(cache, node) != kept:
            kept, since = count(cache, node), time.monotonic()
    return kept


@pytest.fixture
def copied_store(made, tmp_path) -> Path:
    """The store as `made` left it, for tests that count calls."""
    return shutil.copytree(whole_run().store, tmp_path / "store")


def start(
    out: Path, cache: Path, until: int, *extra: object, node: str = "frame", photo: Path = SAMPLE
) -> subprocess.Popen[str]:
    """Start a run of new frames, and return when `until` calls of `node` are finished."""
    before = count(cache, node)
    more = ["--cache", cache, "--seed", 5, "--frames", 10, "--spp", 32, *extra]
    listen = functools.partial(
        signal.signal, signal.SIGINT, signal.SIG_DFL
    )  # a job in the background inherits that Ctrl-C is ignored
    process = subprocess.Popen(
        command(out, *more, photo=photo),
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=listen,
    )
    deadline = time.monotonic() + 480  # a busy machine
    while count(cache, node) < before + until:
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return process


def test_a_killed_run_goes_on_where_it_was(copied_store, tmp_path):
    before = count(copied_store, "frame")
    process = start(tmp_path / "o", copied_store, until=4)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert {path.name for path in (tmp_path / "o").iterdir()} <= {
        "preview.html"
    }  # which is there before the frames, and whole
    kept = settled_count(copied_store, "frame") - before
    assert 4 <= kept < 20
    execute(tmp_path / "o", "--cache", copied_store, "--seed", 5, "--frames", 10, "--spp", 32)
    frame = report(tmp_path / "o")["nodes"]["frame"]
    assert (frame["calls"], frame["remembered"]) == (20, kept)


def test_a_killed_run_out_of_the_photo_goes_on_with_pictures_of_an_odd_size(tmp_path):
    """As above, of another shape: 62 pixels, which no tile divides, and the photo cut so that it is
    higher than wide. The ready person steps out of it."""
    from a2v.rendering import read_video

    cut, seen = tmp_path / "high.png", load_ready_person().subject
    with Image.open(SAMPLE) as whole:
        wide = whole.width // 6
        high = whole.crop((wide, 0, whole.width - wide, whole.height))
        high = high.resize((high.width // 2, high.height // 2))
        high.save(cut)
    left, top, right, bottom = seen.crop
    crop = ((left - wide) // 2, top // 2, (right - wide) // 2, bottom // 2)
    subject = dataclasses.replace(seen, crop=crop, photo_size=high.size)
    store = fill(tmp_path / "store", cut, subject).folder
    extra = ["--background", "photo", "--from-photo", "--views", "front", "--size", 62]
    process = start(tmp_path / "o", store, 2, *extra, node="photo_frame", photo=cut)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    kept = settled_count(store, "photo_frame")
    assert 2 <= kept < 10
    same = ["--cache", store, "--seed", 5, "--frames", 10, "--spp", 32]
    execute(tmp_path / "o", *same, *extra, photo=cut)
    nodes = report(tmp_path / "o")["nodes"]
    assert (nodes["photo_frame"]["calls"], nodes["photo_frame"]["remembered"]) == (10, kept)
    assert nodes["surface"]["remembered"] == nodes["place"]["remembered"] == 1
    frames = np.stack(list(read_video(tmp_path / "o" / "photo.mp4"))).astype(float)
    number, height, width, _ = frames.shape
    assert (number, height, width % 2) == (10, 62, 0)
    assert width < height
    with Image.open(cut) as picture:
        photo = np.asarray(picture.resize((width, height), Image.Resampling.BOX), float)[..., :3]
    assert np.abs(frames[0] - photo).mean() < 6  # it begins as the photo, person and all
    behind = np.median(photo.reshape(-1, 3), axis=0)
    assert np.abs(photo - behind).mean() > 12  # and the person is not nothing


def test_ctrl_c_says_so_and_leaves_nothing_half_written(copied_store, tmp_path):
    process = start(tmp_path / "o", copied_store, until=1)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors.splitlines()[-1].startswith("a2v: interrupted")
    assert "Traceback" not in errors
    assert {path.name for path in (tmp_path / "o").iterdir()} <= {
        "preview.html"
    }  # which is there before the frames, and whole
    assert not [path for path in copied_store.rglob(".*") if path.is_file()]


def test_a_person_without_feet_gets_a_note(tmp_path, capsys):
    picture = Image.open(SAMPLE)
    cut = tmp_path / "cut.jpg"
    picture.crop((0, 0, picture.width, int(picture.height * 0.72))).save(cut, quality=95)
    execute(tmp_path / "o", "--only", "subject", photo=cut)
    said = capsys.readouterr().err.splitlines()
    assert [line for line in said if line.startswith("note: ")]


def test_reconstruct_gives_the_photo_as_the_front_view(made, tmp_path, capsys):
    out = tmp_path / "person.glb"
    words = ["reconstruct", "--photo", str(SAMPLE), "--out", str(out)]
    assert main([*words, "--cache", str(whole_run().store)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == str(out)
    tree = Glb(out).json
    box = tree["accessors"][tree["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
    assert 1.2 < box["max"][1] - box["min"][1] < 2.3
    assert abs(box["min"][1]) < 0.2


def test_several_actions_come_in_one_file(made, tmp_path, capsys):
    target = tmp_path / "two.glb"
    words = ["character", "--photo", SAMPLE, "--actions", "Walk,Jump", "--frames", FRAMES]
    words += ["--executor", "serial", "--quiet", "--cache", whole_run().store, "--out", target]
    assert main([*map(str, words)]) == 0
    assert capsys.readouterr().out.splitlines() == [str(target)]
    tree = Glb(target).json
    assert [clip["name"] for clip in tree["animations"]] == ["Walk", "Jump"]
    assert len(tree["skins"]) == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--out", "c.stl", "--actions", "Walk"], "cannot write c.stl"),
        (["--out", "c.glb"], "no clip given"),
        (["--out", "c.glb", "--actions", "Walk,Walk"], "is given twice"),
        (["--out", "c.usdz", "--actions", "Walk", "--exact"], "--exact"),
        (["--out", "c.glb", "--actions", "walnut"], "nearest are"),
    ],
)
def test_a_character_that_cannot_be_made_is_explained(
    tmp_path, capsys, monkeypatch, words, message
):
    monkeypatch.chdir(tmp_path)
    assert main(["character", "--photo", str(SAMPLE), *words]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
