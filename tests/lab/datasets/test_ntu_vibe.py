"""NTU-VIBE's layout, with real motion inside, and pickles that must not be opened."""

from __future__ import annotations

import contextlib
import io
import os
import pickle

import joblib
import numpy as np
import pytest

from a2v.errors import InputError
from a2v.formats.arrays_pickle import read_arrays_pickle
from a2v.kinematics import HUMANACT12, NTU_VIBE
from a2v.lab.datasets import load_dataset
from a2v.lab.datasets.ntu_vibe import KEPT_JOINTS
from a2v.lab.evaluation.classifier import load_evaluator
from a2v.lab.motion.networks import VAESettings
from a2v.lab.motion.training import TrainSettings, start
from pipelines.cli import main

NEAREST = {"head_top": "head", "left_heel": "left_ankle", "right_heel": "right_ankle"}
"""HumanAct12's joint for those of NTU_VIBE that it lacks."""


@pytest.fixture(scope="module")
def real(data_dir):
    """HumanAct12 clips in VIBE's form: (T, 49, 3), the camera's axes, around the pelvis."""
    source = load_dataset("humanact12", data_dir)
    clips = []
    for joints in source.joints[:6]:
        poses = np.zeros((len(joints), 49, 3), np.float32)
        for place, name in zip(KEPT_JOINTS, NTU_VIBE.joint_names, strict=True):
            poses[:, place] = joints[:, HUMANACT12.index(NEAREST.get(name, name))] - joints[:, 0]
        clips.append(poses * np.float32([1, -1, -1]))
    return clips


def track(poses):
    """A track as VIBE's demo writes it (arrays that are not needed included)."""
    return {
        "pred_cam": np.zeros((len(poses), 3), np.float32),
        "joints2d": None,
        "joints3d": poses,
        "frame_ids": np.arange(len(poses)),
    }


def write(folder, files):
    (folder / "vibe").mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        if isinstance(content, bytes):
            (folder / "vibe" / name).write_bytes(content)
        else:
            joblib.dump(content, folder / "vibe" / name)
    (folder / "ntu_vibe_list.txt").write_text("".join(f"vibe/{name}\n" for name in files))
    return folder


@pytest.fixture
def folder(tmp_path, real):
    names = [
        f"S001C001P00{1 + i % 2}R001A{action:03d}.pkl" for i, action in enumerate((6, 22, 102))
    ]
    files = {
        name: {1: track(poses), 2: track(poses[:3])}
        for name, poses in zip(names, real, strict=False)
    }
    return write(tmp_path / "ntu", files | {"S001C001P003R001A006.pkl": {2: track(real[3])}})


def test_the_published_layout_loads(folder, real):
    dataset = load_dataset("ntu_vibe", folder)
    assert len(dataset.actions) == 13
    assert [dataset.actions[label] for label in dataset.labels] == [
        "pickup",
        "cheer up",
        "side kick",
    ]
    assert dataset.subjects == ("P001", "P002", "P001")
    assert "1 files without a track 1" in dataset.notes[0]
    native = dataset.joints[0] * np.float32(dataset.frame.signs)
    # the root is the middle of the hips (VIBE 8), the nose (VIBE 0) takes its place; heels and top
    # of the head at the end
    for ours, theirs in ((0, 8), (8, 0), (1, 1), (15, 21), (16, 24), (17, 38)):
        assert np.array_equal(native[:, ours], real[0][:, theirs])


def test_people_stand_upright(folder):
    dataset = load_dataset("ntu_vibe", folder)
    for joints in dataset.joints:
        assert (
            np.median(
                joints[:, NTU_VIBE.index("head_top"), 1] - joints[:, NTU_VIBE.index("left_heel"), 1]
            )
            > 1
        )
        assert (
            np.median(
                joints[:, NTU_VIBE.index("left_hip"), 0] - joints[:, NTU_VIBE.index("right_hip"), 0]
            )
            > 0
        )


def test_the_authors_classifier_takes_them(folder, data_dir):
    dataset = load_dataset("ntu_vibe", folder)
    evaluator = load_evaluator(data_dir / "evaluators" / "action_recognition_model_vibe_v2.tar")
    assert evaluator.n_actions == len(dataset.actions)
    features, labels = evaluator(dataset.joints[0][None] * np.float32(dataset.frame.signs))
    assert features.shape == (1, 30)
    assert 0 <= labels[0] < 13


def test_there_is_no_trajectory_for_glmi(folder):
    dataset = load_dataset("ntu_vibe", folder)
    assert not dataset.trajectory
    with pytest.raises(InputError, match=r"ntu_vibe has no root trajectory.*'lie' or 'plain'"):
        start(dataset, VAESettings(), TrainSettings(device="cpu"))
    start(dataset, VAESettings(decoder="lie"), TrainSettings(device="cpu"))


def test_hips_that_sway_are_no_trajectory(folder, tmp_path, capsys):
    """VIBE's hips move by centimeters around the body's own center."""
    for path in (folder / "vibe").glob("*.pkl"):
        tracks = joblib.load(path)
        if 1 in tracks:
            poses = tracks[1]["joints3d"]
            poses += 0.03 * np.sin(np.arange(len(poses)) / 5).astype(np.float32)[:, None, None]
            joblib.dump(tracks, path)
    arguments = [
        "train",
        "motion",
        "--dataset",
        "ntu_vibe",
        "--data",
        str(folder),
        "--out",
        str(tmp_path / "run"),
        "--iterations",
        "1",
    ]
    assert main([*arguments, "--vae.decoder", "glmi-r"]) == 2
    assert "ntu_vibe has no root trajectory, which 'glmi-r' infers" in capsys.readouterr().err
    assert main(["data", "ntu_vibe", "--data", str(folder)]) == 0
    shown = capsys.readouterr().out
    assert "3 clips" in shown
    assert "no trajectory" in shown
    assert "1 files without a track 1" in shown


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda poses: {1: track(poses[:, :24])},
            r"A006\.pkl: joints have shape \(\d+, 24, 3\); expected \(frames, 49, 3\)",
        ),
        (lambda poses: {1: track(poses * np.nan)}, r"A006\.pkl: .*finite"),
        (lambda poses: {1: track(poses[:0])}, r"A006\.pkl: .*no frames"),
        (lambda poses: {1: track(poses[:1])}, r"A006\.pkl: .*1 frame"),
        (lambda poses: {1: track(poses.tolist())}, r"A006\.pkl: .*not an array"),
        (lambda poses: [poses], r"A006\.pkl holds a list"),
        (lambda poses: b"", r"A006\.pkl is compressed, or not a pickle"),
        (lambda poses: {2: track(poses)}, r"lists no clip with a track 1"),
    ],
    ids=["joints", "nan", "empty", "one frame", "list", "no dict", "no pickle", "no track"],
)
def test_a_broken_file_is_named_with_the_reason(tmp_path, real, change, message):
    write(tmp_path, {"S001C001P001R001A006.pkl": change(real[0])})
    with pytest.raises(InputError, match=message):
        load_dataset("ntu_vibe", tmp_path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("../secret_A006.pkl\n", "line 1.*outside of the folder"),
        ("/etc/x_A006.pkl\n", "line 1.*outside of the folder"),
        ("vibe/S001A006.pkl\nvibe/S001A005.pkl\n", "line 2.*no known action"),
        ("vibe/S001P001A007.pkl\n", "A007.pkl does not exist"),
        ("", "lists no clip"),
    ],
)
def test_broken_lists_name_the_line(tmp_path, real, text, message):
    write(tmp_path, {"S001A006.pkl": {1: track(real[0])}})
    (tmp_path / "ntu_vibe_list.txt").write_text(text)
    with pytest.raises(InputError, match=message):
        load_dataset("ntu_vibe", tmp_path)


def joblib_bytes(value):
    stream = io.BytesIO()
    joblib.dump(value, stream)
    return stream.getvalue()


def nested():
    big_endian = np.arange(3, dtype=">i4")
    return {
        1: {
            "c": np.random.default_rng(0).normal(size=(5, 7, 3)).astype(np.float32),
            "fortran": np.asfortranarray(np.arange(12.0).reshape(4, 3)),
            "sparse": np.arange(10)[::2],
            "text": np.array(["a", "bb"]),
            "none": None,
            "scalar": np.float32(3),
            "point": np.array(3.5),
            "empty": np.zeros((0, 3)),
            "shared": [big_endian, big_endian + 1, big_endian],
        },
        np.int64(7): ("x", [1, 2.5, True]),
    }


def equal(a, b):
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(equal(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(equal, a, b))
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and np.array_equal(a, b)
    return a == b


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
def test_pickles_of_arrays_are_read_exactly(protocol):
    value = nested()
    stream = io.BytesIO()
    joblib.dump(value, stream, protocol=protocol)
    assert equal(value, read_arrays_pickle(stream.getvalue(), "x"))
    assert equal(value, read_arrays_pickle(pickle.dumps(value, protocol=protocol), "x"))


class Evil:
    def __reduce__(self):
        return os.mkdir, ("pwned",)


@pytest.mark.parametrize(
    ("value", "asked"),
    [
        (Evil(), "mkdir"),
        ({1: {"joints3d": np.array([Evil()], dtype=object)}}, "(mkdir|'O')"),
        (np.ma.array([1.0]), "mareconstruct"),
        (np.zeros(2, [("a", "f4")]), "'V4'"),
        (ValueError("x"), "(ValueError|unpickle_exception)"),  # the latter where Dask is loaded
    ],
    ids=["command", "objects", "masked", "structured", "exception"],
)
def test_strangers_pickles_run_nothing(tmp_path, monkeypatch, value, asked):
    monkeypatch.chdir(tmp_path)
    for data in (pickle.dumps(value), joblib_bytes(value)):
        with pytest.raises(InputError, match=f"clip.pkl was not opened: it refers to .*{asked}"):
            read_arrays_pickle(data, "clip.pkl")
    assert not list(tmp_path.iterdir())


def test_damaged_pickles_end_in_one_line():
    good = joblib_bytes(nested())
    rng = np.random.default_rng(0)
    for cut in (1, 40, len(good) // 2, len(good) - 3):
        with pytest.raises(InputError, match="damaged pickle"):
            read_arrays_pickle(good[:cut], "x")
    for _ in range(300):
        spoiled = bytearray(good)
        for place in rng.integers(1, 600, 3):
            spoiled[place] = rng.integers(256)
        with contextlib.suppress(InputError):  # nothing else may come out
            read_arrays_pickle(bytes(spoiled), "x")


def test_a_small_file_cannot_claim_a_huge_array():
    data = joblib_bytes(np.zeros((5, 49, 3), np.float32))
    small, huge = b"K\x05K1K\x03", b"J\xff\xff\xff\x7fK1K\x03"
    assert small in data
    with pytest.raises(
        InputError, match="damaged"
    ):  # the frame's length no longer fits, or the array is cut off
        read_arrays_pickle(data.replace(small, huge), "x")
    plain = pickle.dumps(np.zeros((5, 49, 3), np.float32), protocol=2)
    assert small in plain
    with pytest.raises(InputError, match="damaged"):
        read_arrays_pickle(plain.replace(small, huge), "x")
