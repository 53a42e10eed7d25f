"""Input that once led to a traceback, gigabytes or a wrong result is now handled.

It gives one sentence or is read correctly.
"""

from __future__ import annotations

import io
import json
import os
import pickle
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from a2v.errors import InputError
from a2v.formats import read_bvh, read_deepmimic, read_motion, write_bvh
from a2v.formats.arrays_pickle import read_arrays_pickle
from a2v.formats.deepmimic import _FRAME
from a2v.io import atomic_path, clear_leftovers, write_npz
from a2v.kinematics.resample import resample_motion
from a2v.lab.datasets.files import FileSource
from a2v.lab.evaluation.survey_answers import read_key
from a2v.perception.photo import decode_photo
from a2v.rendering.camera import read_cameras
from a2v.sessions import read_metadata
from a2v.types import Motion
from pipelines.engine.store import Store
from pipelines.inputs import check_writable
from tests.support.commands import refused
from tests.support.motions import person

ROOT = Path(__file__).resolve().parents[1]
SAMPLE = ROOT / "a2v" / "samples" / "person.jpg"


# ------------------------------------------------------------------------------------------------------------------ the command line


@pytest.mark.parametrize(
    "words",
    [
        ("motion", "--seed", -1),
        ("motion", "--seed", 2**70),
        ("motion", "--count", -1),
        ("motion", "--count", 10**9),
        ("motion", "--count", 0),
        ("sample", "--to_seed", -5),
    ],
)
def test_numbers_out_of_range(capsys, tmp_path, words):
    command, *given = words
    refused(capsys, command, "--action", "Walk", "--frames", 4, *given, "--out", tmp_path / "a.npz")


@pytest.mark.parametrize("seed", [-1, 2**32])
def test_the_renderers_seed(capsys, tmp_path, seed):
    refused(
        capsys,
        "video",
        "--photo",
        SAMPLE,
        "--action",
        "Walk",
        "--render_seed",
        seed,
        "--out",
        tmp_path / "out",
    )


@pytest.mark.parametrize(
    "option", ["--out", "--photo", "--mask", "--camera", "--motion", "--background", "--cache"]
)
def test_names_that_are_too_long(capsys, tmp_path, option):
    given = {
        "--photo": SAMPLE,
        "--action": "Walk",
        "--out": tmp_path / "out",
        "--only": "subject",
    } | {option: tmp_path / ("n" * 300)}
    refused(capsys, "video", *(word for pair in given.items() for word in pair))


@pytest.mark.parametrize(
    "content",
    [
        b"\x00\xff\x89PNG",
        b"a: " + b"[" * 5000,
        b"seed: [",
        b"- 1",
        b"\xff\xfe\x00",
        b"seed: " + b"9" * 5000,
    ],
)
def test_settings_files_that_are_none(capsys, tmp_path, content):
    (tmp_path / "settings.yaml").write_bytes(content)
    refused(
        capsys,
        "motion",
        "--config",
        tmp_path / "settings.yaml",
        "--action",
        "Walk",
        "--out",
        tmp_path / "a.npz",
    )


def test_a_store_that_cannot_be_written_names_its_own_option(tmp_path):
    (tmp_path / "store").write_text("a file where the folder should be")
    with pytest.raises(InputError, match="--cache") as caught:
        Store(tmp_path / "store").put(person(frames=2))
    assert "output folder" not in str(caught.value)


# ------------------------------------------------------------------------------------------------------------------ .npz


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("fps", np.zeros(3)),
        ("fps", np.asarray("fast")),
        ("action", np.zeros((2, 2))),
        ("action", np.zeros(2)),
        ("joint_names", np.asarray("no JSON")),
        ("joint_names", np.asarray("{}")),
        ("joint_names", np.asarray("[1, 2]")),
        ("joints", np.full((3, 20, 3), "text")),
        ("parents", np.zeros(20) + 0.5),
        ("provenance", np.asarray("[]")),
        ("provenance", np.asarray("[" * 10**5)),
        ("provenance", np.asarray("9" * 5000)),
        ("seed", np.asarray(0.5)),
        ("skeleton", np.asarray(3)),
        ("given_frames", np.asarray("x")),
    ],
)
def test_motions_with_members_of_the_wrong_kind(tmp_path, name, value):
    write_npz(tmp_path / "m.npz", {**person(frames=3).to_arrays(), name: value})
    with pytest.raises(InputError, match=r"m\.npz"):
        Motion.load(tmp_path / "m.npz")


def test_what_an_archive_says_of_itself_is_bounded(tmp_path):
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        for index in range(3):
            archive.writestr(f"a{index}.npy", bytes(500 << 20), compresslevel=1)
    with pytest.raises(InputError, match="GiB"):
        Motion.load(tmp_path / "bomb.npz")


# ------------------------------------------------------------------------------------------------------------------ BVH, DeepMimic


def bvh(
    *,
    joints: int = 3,
    frames: int = 2,
    step: str = "0.03",
    channels: str = "3",
    number: str = "0",
    name: str = "j",
) -> str:
    """A chain of joints of which only the root moves."""
    lines = ["HIERARCHY"]
    for index in range(joints):
        lines += [f"{'JOINT' if index else 'ROOT'} {name}{index}", "{", "OFFSET 0 1 0"]
        lines += [f"CHANNELS {channels} Zrotation Xrotation Yrotation"] if not index else []
    lines += [
        "End Site",
        "{",
        "OFFSET 0 1 0",
        "}",
        *["}"] * joints,
        "MOTION",
        f"Frames: {frames}",
        f"Frame Time: {step}",
    ]
    return "\n".join([*lines, *[f"{number} 0 0"] * frames]) + "\n"


@pytest.mark.parametrize(
    "change",
    [
        {"channels": "²"},
        {"channels": "9" * 5000},
        {"number": "9" * 5000},
        {"number": "²"},
        {"step": "1e-400"},
        {"step": "1e400"},
    ],
)
def test_numbers_of_bvh_that_are_none(change):
    with pytest.raises(InputError):
        read_bvh(bvh(**change).encode(), person=False)


def test_a_byte_order_mark_is_accepted(tmp_path):
    assert read_bvh(b"\xef\xbb\xbf" + bvh().encode(), person=False).frames == 2
    clip = {"Frames": [[0.03, 0, 1, 0, *[1.0] * (_FRAME - 4)]] * 2}
    (tmp_path / "clip.txt").write_bytes(b"\xef\xbb\xbf" + json.dumps(clip).encode())
    assert read_deepmimic(tmp_path / "clip.txt").frames == 2
    (tmp_path / "cameras.yaml").write_bytes(b"\xef\xbb\xbfhero: {azimuth: 30}\n")
    assert read_cameras(tmp_path / "cameras.yaml")[0].azimuth == 30


def test_joints_with_accents_and_line_ends_survive_writing(tmp_path):
    import dataclasses

    motion = read_bvh(bvh().encode(), person=False)
    odd = dataclasses.replace(motion, joint_names=("Hüfte", "a\nMOTION", "b {", "\x1b"))
    write_bvh(tmp_path / "odd.bvh", odd)
    again = read_bvh(tmp_path / "odd.bvh", person=False)
    assert again.joint_names[0] == "Hüfte"
    assert np.allclose(again.joints, odd.joints, atol=1e-4)


LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30))
sys.path.insert(0, {root!r})
from a2v.errors import InputError
from a2v.formats import read_motion
try:
    read_motion(sys.argv[1], fps=float(sys.argv[2]) or None)
except InputError as error:
    print("refused")
# not ru_maxrss, which a child inherits from the process that started it
print(next(int(line.split()[1]) // 1024 for line in open("/proc/self/status") if line.startswith("VmHWM:")))
"""


def slow_frames() -> str:
    return json.dumps(
        {
            "Frames": [
                [step, 0, 1, 0, *[1.0] * (_FRAME - 4)]
                for step in (0.001, 0.001, 0.001, 9000.0, 0.001)
            ]
        }
    )


@pytest.mark.parametrize(
    ("name", "text", "fps"),
    [
        ("joints.bvh", lambda: bvh(joints=900, frames=9000), 0),
        ("slow.bvh", lambda: bvh(joints=300, frames=40, step="10"), 60),
        ("slow.txt", slow_frames, 0),
    ],
)
def test_small_files_of_long_motions_take_no_gigabyte(tmp_path, name, text, fps):
    (tmp_path / name).write_text(text())
    assert (tmp_path / name).stat().st_size < 200_000
    done = subprocess.run(
        [sys.executable, "-c", LIMITED.format(root=str(ROOT)), str(tmp_path / name), str(fps)],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.stdout.split()[0] == "refused", done.stderr
    assert int(done.stdout.split()[1]) < 500


def test_a_slow_npz_is_not_resampled_to_gigabytes():
    import dataclasses

    with pytest.raises(InputError, match="cut the motion"):
        resample_motion(dataclasses.replace(person(frames=3), fps=1e-6), 24.0)


def test_deepmimic_of_hundreds_of_digits(tmp_path):
    (tmp_path / "clip.txt").write_text('{"Frames": [[' + ", ".join(["9" * 400] * _FRAME) + "]]}")
    with pytest.raises(InputError, match="digits"):
        read_motion(tmp_path / "clip.txt")


# ------------------------------------------------------------------------------------------------------------------ data sets, models


def test_archives_that_cannot_be_unpacked(tmp_path):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("a.npy", b"data")
    good = buffer.getvalue()
    central = good.index(b"PK\x01\x02")
    for place, value in ((6, b"\x01"), (8, b"\x63")):  # encrypted; an unknown compression
        data = bytearray(good)
        data[place : place + 1] = value
        data[central + place + 2 : central + place + 3] = value
        (tmp_path / "a.zip").write_bytes(bytes(data))
        with pytest.raises(InputError, match="unpacked"):
            FileSource(tmp_path / "a.zip").read("a.npy")
    named = bytearray(good.replace(b"a.npy", b"\xff\xfe\xfdpy"))
    named[7], named[central + 9] = 8, 8  # the flag that says UTF-8
    (tmp_path / "b.zip").write_bytes(bytes(named))
    with pytest.raises(InputError, match="zip archive"):
        FileSource(tmp_path / "b.zip")


def test_pickles_that_explode_are_named_in_short(tmp_path):
    bomb: list = []
    for _ in range(40):
        bomb = [bomb] * 9
    data = pickle.dumps((np.zeros((2, 1), object), bomb))
    with pytest.raises(InputError) as caught:
        read_arrays_pickle(data, "clip.pkl")
    assert len(str(caught.value)) < 500
    with pytest.raises(InputError):
        read_arrays_pickle(
            b"\x80\x05\x96" + (1 << 40).to_bytes(8, "little") + b"ab.", "clip.pkl"
        )  # a terabyte is announced


@pytest.mark.parametrize(
    "text",
    [
        "[]",
        "3",
        '"text"',
        "null",
        '{"format": {"a": 1}}',
        '{"format": "a2v-motion/1"}',
        '{"format": "a2v-flow/1", "actions": 3}',
    ],
)
def test_models_that_say_nonsense_of_themselves(tmp_path, capsys, text):
    import onnx

    value = onnx.helper.make_tensor_value_info("x", onnx.TensorProto.FLOAT, [1])
    graph = onnx.helper.make_graph(
        [onnx.helper.make_node("Identity", ["x"], ["y"])],
        "g",
        [value],
        [onnx.helper.make_tensor_value_info("y", onnx.TensorProto.FLOAT, [1])],
    )
    model = onnx.helper.make_model(
        graph, opset_imports=[onnx.helper.make_opsetid("", 17)], ir_version=8
    )
    onnx.helper.set_model_props(model, {"a2v": text})
    onnx.save(model, tmp_path / "m.onnx")
    refused(capsys, "actions", "--model", tmp_path / "m.onnx")
    with pytest.raises(InputError):
        read_metadata(tmp_path / "m.onnx", ("another",), "model")
    script = [sys.executable, ROOT / "export" / "sample.py", tmp_path / "m.onnx"]
    done = subprocess.run(list(map(str, script)), capture_output=True, text=True, timeout=60)
    assert done.returncode == 2, done.stderr
    assert done.stderr.count("\n") == 1


def test_sample_script_takes_no_garbage_and_keeps_to_the_umask(tmp_path):
    script, model = (
        str(ROOT / "export" / "sample.py"),
        str(ROOT / "a2v" / "weights" / "motion_humanact12.onnx"),
    )
    (tmp_path / "garbage.onnx").write_bytes(b"garbage" * 100)
    for words in (
        [tmp_path / "garbage.onnx"],
        [model, "--action", "Jump", "--frames", 0],
        [model, "--action", "Jump", "--seed", -1],
        [model, "--action", "Jump", "--count", 10**9],
    ):
        done = subprocess.run(
            [sys.executable, script, *map(str, words), "--out", str(tmp_path / "a.npz")],
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    subprocess.run(
        [
            sys.executable,
            script,
            model,
            "--action",
            "Jump",
            "--frames",
            "4",
            "--out",
            str(tmp_path / "a.npz"),
        ],
        check=True,
        timeout=60,
    )
    mask = os.umask(0)
    os.umask(mask)
    assert (tmp_path / "a.npz").stat().st_mode & 0o777 == 0o666 & ~mask


# ------------------------------------------------------------------------------------------------------------------ cameras, surveys, pictures


@pytest.mark.parametrize(
    "text",
    [
        "hero: " + "[" * 3000,
        "hero: {azimuth: 2020-13-45}",
        "hero: {azimuth: 2020-01-01}",
        "hero: {azimuth: " + "9" * 400 + "}",
        "hero: {origin: [1, 2, " + "9" * 400 + "]}",
        "? [a, b]\n: {azimuth: 1}",
        "hero: {? [1] : 2}",
        "hero: {azimuth: \x01}",
        "2020: {azimuth: 1}",
    ],
)
def test_cameras_that_are_none(tmp_path, text):
    (tmp_path / "cameras.yaml").write_text(text)
    with pytest.raises(InputError, match=r"cameras\.yaml"):
        read_cameras(tmp_path / "cameras.yaml")


def test_yaml_that_explodes_is_named_in_short(tmp_path):
    lines = ["a0: &a0 [x, x]"] + [
        f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 40)
    ]
    (tmp_path / "cameras.yaml").write_text("\n".join([*lines, "hero: {azimuth: *a39}"]))
    with pytest.raises(InputError) as caught:
        read_cameras(tmp_path / "cameras.yaml")
    (tmp_path / "cameras.yaml").write_text(
        "hero:\n  azimuth:\n" + "\n".join(f"    {line}" for line in lines)
    )
    with pytest.raises(InputError) as caught:
        read_cameras(tmp_path / "cameras.yaml")
    assert len(str(caught.value)) < 500


def test_a_survey_key_without_title(tmp_path):
    (tmp_path / "key.json").write_text(
        json.dumps({"format": "a2v-survey-key/1", "survey": "a", "questions": [], "clips": {}})
    )
    with pytest.raises(InputError, match="not a key of a survey"):
        read_key(tmp_path / "key.json")


@pytest.mark.parametrize("form", ["AVIF", "JPEG2000", "MPO"])
def test_pictures_of_every_listed_kind_are_read(form):
    pixels = np.full((140, 150, 3), (200, 120, 40), np.uint8)
    buffer = io.BytesIO()
    try:
        Image.fromarray(pixels).save(buffer, form)
    except (KeyError, OSError):
        pytest.skip(f"this Pillow does not write {form}")
    assert np.abs(decode_photo(buffer.getvalue()).astype(int) - pixels).max() < 12


@pytest.mark.parametrize("top", [255, 65535, 2**31 - 1])
def test_whole_numbers_of_every_depth_keep_their_grays(top):
    values = np.linspace(0, top, 140 * 140).reshape(140, 140).astype(np.int32)
    buffer = io.BytesIO()
    Image.fromarray(values, mode="I").save(buffer, "TIFF")
    found = decode_photo(buffer.getvalue())[..., 0]
    assert np.abs(found - values / top * 255).max() <= 1


# ------------------------------------------------------------------------------------------------------------------ what a killed run leaves


def test_leftovers_of_a_killed_run_are_removed_and_files_in_the_making_stay(tmp_path):
    code = f"import os, sys; sys.path.insert(0, {str(ROOT)!r}); from a2v.io import atomic_path\nwith atomic_path({str(tmp_path / 'video.mp4')!r}): os._exit(9)"
    subprocess.run([sys.executable, "-c", code], check=False, timeout=60)
    assert len(list(tmp_path.glob(".video-*.mp4"))) == 1
    mine = tmp_path / ".video-mine.mp4"
    mine.write_bytes(b"not ours")
    with atomic_path(tmp_path / "front.mp4") as busy:
        busy.write_bytes(b"half")
        check_writable(tmp_path)
        assert set(tmp_path.iterdir()) == {mine, busy}
        clear_leftovers(tmp_path)
        assert busy.exists()
    assert set(tmp_path.iterdir()) == {mine, tmp_path / "front.mp4"}
