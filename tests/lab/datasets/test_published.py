"""AMASS, BABEL, HumanML3D and 100STYLE: files of their published layouts."""

from __future__ import annotations

import json

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.formats.bvh import write_bvh
from a2v.lab.datasets import load_dataset
from a2v.motion import MotionModel


def amass(path, *, seconds=2.0, rate=120.0):
    """A recording of SMPL-H, z up, that walks along -y, as AMASS's files are."""
    frames = round(seconds * rate)
    path.parent.mkdir(parents=True, exist_ok=True)
    poses = np.zeros((frames, 156))
    poses[:, 0] = np.pi / 2  # SMPL's y becomes the file's z
    trans = np.stack([np.zeros(frames), -np.linspace(0, 2, frames), np.full(frames, 0.95)], 1)
    np.savez(
        path, poses=poses, trans=trans, betas=np.zeros(16), gender="male", mocap_framerate=rate
    )


@pytest.fixture
def collections(tmp_path):
    for name in ("CMU/01/01_01", "CMU/02/02_01", "KIT/3/walk_fast01"):
        amass(tmp_path / f"{name}_poses.npz")
    np.savez(tmp_path / "CMU" / "01" / "shape.npz", betas=np.zeros(16))  # AMASS has such files too
    return tmp_path


def test_amass_has_its_collections_in_place_of_actions(collections):
    dataset = load_dataset("amass", collections)
    assert dataset.actions == ("CMU", "KIT")
    assert dataset.labels.tolist() == [0, 0, 1]
    assert dataset.subjects == ("CMU/01", "CMU/02", "KIT/3")
    assert (dataset.fps, dataset.length) == (20.0, 60)
    joints = dataset.joints[0]
    assert joints.shape == (40, 24, 3)  # 2 s of 120 Hz at 20 Hz
    head = dataset.skeleton.index("head")
    assert (joints[:, head, 1] > joints[:, 0, 1] + 0.3).all()  # y is up
    assert joints[-1, 0, 2] - joints[0, 0, 2] == pytest.approx(2, abs=0.1)


def labels(*segments, sequence=("walk",)):
    found = [{"act_cat": list(names), "start_t": a, "end_t": b} for names, a, b in segments]
    return {
        "seq_ann": {"labels": [{"act_cat": list(sequence), "proc_label": "x"}]},
        "frame_ann": {"labels": found} if segments else None,
    }


def test_babel_labels_parts_of_amass(collections):
    told = {
        "1": labels((["walk"], 0, 0.5), (["jump"], 0.5, 1.5), (["walk", "turn"], 1.5, 2))
        | {"feat_p": "CMU/CMU/01/01_01_poses.npz"},  # collections are named twice there
        "2": labels(sequence=("sit",)) | {"feat_p": "CMU/CMU/02/02_01_poses.npz"},
        "3": labels() | {"feat_p": "ACCAD/ACCAD/x/y_poses.npz"},
    }
    (collections / "babel_v1.0_release").mkdir()
    (collections / "babel_v1.0_release" / "train.json").write_text(json.dumps(told))
    dataset = load_dataset("babel", collections)
    assert dataset.actions == ("jump", "sit", "walk")
    assert [dataset.actions[label] for label in dataset.labels] == ["walk", "jump", "sit"]
    assert [len(joints) for joints in dataset.joints] == [10, 20, 40]
    whole = load_dataset("amass", collections).joints[0]
    assert np.array_equal(dataset.joints[1], whole[10:30])
    assert "1 recordings are not there" in dataset.notes
    assert "1 parts have several categories or none" in dataset.notes


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[]", "no object of recordings"),
        ("{", "not JSON"),
        ('{"1": {"feat_p": "../../etc/passwd.npz", "seq_ann": {"labels": []}}}', "labels of 1"),
        ('{"1": {"feat_p": "/a/b/c.npz", "seq_ann": {"labels": []}}}', "labels of 1"),
        ('{"1": {"feat_p": "CMU/CMU/01/01_01_poses.npz", "seq_ann": 3}}', "labels of 1"),
        (
            '{"1": {"feat_p": "CMU/CMU/01/01_01_poses.npz", "frame_ann": {"labels": '
            '[{"act_cat": ["a"], "start_t": NaN, "end_t": 1}]}}}',
            "labels of 1",
        ),
        ('{"1": {"feat_p": "A/A/b/c.npz", "seq_ann": {"labels": []}}}', "none of the recordings"),
    ],
)
def test_damaged_labels_are_refused_in_a_sentence(collections, text, words):
    (collections / "train.json").write_text(text)
    with pytest.raises(InputError, match=words):
        load_dataset("babel", collections)


def test_pickled_arrays_are_not_opened(tmp_path):
    path = tmp_path / "CMU" / "01" / "x_poses.npz"
    path.parent.mkdir(parents=True)
    np.savez(path, poses=np.array([{"a": 1}], dtype=object), trans=np.zeros((1, 3)))
    with pytest.raises(InputError, match="x_poses"):
        load_dataset("amass", tmp_path)


def test_humanml3d_takes_the_verb_of_its_captions(tmp_path):
    clip = MotionModel.load("cmu").sample("Walk", frames=30, seed=0).joints
    (tmp_path / "new_joints").mkdir()
    (tmp_path / "texts").mkdir()
    joints = np.concatenate([clip, clip[:, :2]], axis=1).astype(np.float32)
    for name in ("000001", "M000001", "000002", "000003"):
        np.save(tmp_path / "new_joints" / f"{name}.npy", joints)
    walk = "a man walks#a/DET man/NOUN walk/VERB#0.0#0.0\n"
    jump = "he jumps#he/PRON jump/VERB#0.0#0.0\n"
    part = "he waves#he/PRON wave/VERB#1.0#2.0\n"
    (tmp_path / "texts" / "000001.txt").write_text(walk + walk + jump)
    (tmp_path / "texts" / "000002.txt").write_text(part + jump + "not a caption\n")
    (tmp_path / "texts" / "000003.txt").write_text("a pose#a/DET pose/NOUN#nan#nan\n")
    dataset = load_dataset("humanml3d", tmp_path)
    assert dataset.actions == ("jump", "walk")
    assert dataset.clip_names == ("000001", "000002")
    assert dataset.labels.tolist() == [1, 0]
    assert dataset.joints[0].shape == (30, 22, 3)
    assert dataset.descriptions == (("he jumps",), ("a man walks", "a man walks", "he jumps"))
    assert "1 clips have no caption with a verb" in dataset.notes


def test_100style_is_cut_by_its_table(tmp_path):
    clip = MotionModel.load("cmu").sample("Walk", frames=36, seed=0)  # 3 s
    for style, code in (("Aeroplane", "FW"), ("Aeroplane", "ID"), ("Drunk", "FW"), ("Drunk", "ZZ")):
        (tmp_path / style).mkdir(exist_ok=True)
        write_bvh(tmp_path / style / f"{style}_{code}.bvh", clip)
    head = "STYLE_NAME,FW_START,FW_STOP,ID_START,ID_STOP\n"
    rows = "Aeroplane,60,120,,\nDrunk,0,100000,x,y\n"  # frames of 60 Hz
    (tmp_path / "Frame_Cuts.csv").write_text(head + rows)
    dataset = load_dataset("100style", tmp_path)
    assert dataset.actions == ("Aeroplane, forwards walk", "Drunk, forwards walk")
    assert dataset.traits[1] == ("style:Drunk", "movement:forwards walk")
    whole = dataset.joints[1]
    assert np.array_equal(dataset.joints[0], whole[20:40])  # from 1 to 2 s, at 20 Hz
    assert "1 files have no bounds in Frame_Cuts.csv" in dataset.notes
    (tmp_path / "Frame_Cuts.csv").unlink()
    with pytest.raises(InputError, match=r"Frame_Cuts\.csv does not exist"):
        load_dataset("100style", tmp_path)


@pytest.mark.parametrize("name", ["amass", "babel", "humanml3d", "100style"])
def test_another_folder_is_refused(name, tmp_path):
    with pytest.raises(InputError, match=r"holds no|does not exist"):
        load_dataset(name, tmp_path)
    with pytest.raises(InputError, match="is not a folder"):
        load_dataset(name, tmp_path / "none")
