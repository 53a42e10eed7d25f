"""Loaders on the real files and on broken ones, and the sampler of windows."""

from __future__ import annotations

import dataclasses
import io
import zipfile

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.kinematics import CMU
from a2v.lab.datasets import ActionDataset, ClipSampler, load_cmu, load_dataset, load_humanact12


def npy(array):
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def write_zip(path, files):
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return path


def clip(frames=12, joints=24, seed=0):
    return np.random.default_rng(seed).normal(size=(frames, joints, 3)).astype(np.float32)


@pytest.fixture(scope="module")
def humanact12(data_dir):
    return load_humanact12(data_dir)


@pytest.fixture(scope="module")
def cmu(data_dir):
    return load_cmu(data_dir)


def test_humanact12_has_the_published_clips(humanact12, data_dir):
    assert len(humanact12) == 1191
    assert sum(map(len, humanact12.joints)) == 90_099
    assert len(set(humanact12.subjects)) == 12
    assert np.bincount(humanact12.labels).tolist() == [
        215,
        47,
        50,
        94,
        88,
        218,
        54,
        77,
        56,
        61,
        140,
        91,
    ]
    fine = load_humanact12(data_dir, grain="fine")
    assert len(fine.actions) == 34
    assert np.bincount(fine.labels, minlength=34).min() > 0


def test_cmu_has_the_published_clips(cmu):
    assert len(cmu) == 1088
    assert dict(zip(cmu.actions, np.bincount(cmu.labels).tolist(), strict=True)) == {
        "Walk": 474,
        "Wash": 118,
        "Run": 109,
        "Jump": 108,
        "Animal Behavior": 101,
        "Dance": 77,
        "Step": 68,
        "Climb": 33,
    }


@pytest.mark.parametrize("name", ["humanact12", "cmu"])
def test_people_stand_upright_in_meters(name, data_dir):
    dataset = load_dataset(name, data_dir)
    skeleton = dataset.skeleton
    standing = [dataset.motion(i).joints for i in range(0, len(dataset), 37)]
    head = np.median([np.median(j[:, skeleton.index("head"), 1]) for j in standing])
    assert 1.3 < head < 1.75
    assert min(j[..., 1].min() for j in standing) == pytest.approx(0, abs=1e-6)


def test_left_is_plus_x_for_people_who_face_forward(humanact12):
    """HumanAct12's actors mostly face the camera, so their left hip has the larger x."""
    left, right = humanact12.skeleton.hips
    share = np.mean([np.median(j[:, left, 0] - j[:, right, 0]) > 0 for j in humanact12.joints])
    assert share > 0.8


def test_zip_and_folder_give_the_same(tmp_path, data_dir, cmu):
    names = [f"mocap/mocap_3djoints/{name}.npy" for name in cmu.clip_names[:2]]
    with zipfile.ZipFile(data_dir / "cmu_mocap.zip") as archive:
        for name in names:
            archive.extract(name, tmp_path)
    (tmp_path / "mocap" / "pose_clip.csv").write_text(
        "motion,action_type\n" + "".join(f"{n},Walk\n" for n in cmu.clip_names[:2])
    )
    folder = load_cmu(tmp_path)
    assert all(np.array_equal(a, b) for a, b in zip(folder.joints, cmu.joints[:2], strict=True))


def test_splits_by_subject_do_not_overlap(humanact12):
    training, held_out = humanact12.split(["P11", "P12"])
    assert set(held_out.subjects) == {"P11", "P12"}
    assert not set(training.subjects) & {"P11", "P12"}
    assert len(training) + len(held_out) == len(humanact12)
    with pytest.raises(InputError, match="P99"):
        humanact12.split(["P99"])


def test_chosen_subjects_leave_every_action_and_depend_on_the_seed_alone(humanact12, cmu):
    for dataset in (humanact12, cmu):
        chosen = dataset.choose_subjects(0.2)
        training, held_out = dataset.split(chosen)
        assert 0 < len(held_out) <= 0.2 * len(dataset)
        assert set(training.labels) == set(dataset.labels)
        assert chosen == dataset.choose_subjects(0.2)
    assert len({humanact12.choose_subjects(0.2, seed=seed) for seed in range(6)}) > 1
    with pytest.raises(InputError, match="1 subjects"):
        small_dataset().choose_subjects()


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"HumanAct12/P01G01R01F0001T0064A0101.npy": npy(clip(joints=20))}, r"A0101\.npy.*24, 3"),
        ({"HumanAct12/P01G01R01F0001T0064A0101.npy": npy(clip() * np.nan)}, r"A0101\.npy.*finite"),
        (
            {"HumanAct12/P01G01R01F0001T0064A0101.npy": npy(clip(frames=0))},
            r"A0101\.npy.*no frames",
        ),
        ({"HumanAct12/P01G01R01F0001T0064A0101.npy": npy(clip(frames=1))}, r"A0101\.npy.*1 frame"),
        ({"HumanAct12/P01G01R01F0001T0064A0101.npy": b"not numpy"}, r"A0101\.npy.*not a readable"),
        (
            {"HumanAct12/P01G01R01F0001T0064A0101.npy": npy(clip())[:-100]},
            r"A0101\.npy.*not a readable",
        ),
        ({"HumanAct12/walk.npy": npy(clip())}, r"walk\.npy.*action code"),
        ({"HumanAct12/P01G01R01F0001T0064A9901.npy": npy(clip())}, r"A9901\.npy.*action code"),
        ({"readme.txt": b"hello"}, r"holds no"),
    ],
)
def test_broken_humanact12_files_are_named(tmp_path, files, message):
    with pytest.raises(InputError, match=message):
        load_humanact12(write_zip(tmp_path / "humanact12.zip", files))


def test_pickled_arrays_are_refused(tmp_path):
    stream = io.BytesIO()
    np.save(stream, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(InputError, match="not a readable"):
        load_humanact12(
            write_zip(tmp_path / "h.zip", {"P01G01R01F0001T0064A0101.npy": stream.getvalue()})
        )


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("motion,action_type\n01_01,Fly\n", "line 2.*Fly"),
        ("motion,action_type\n01_01,Walk\n02_01,Walk\n", r"02_01\.npy: the clip has 1 frame"),
        ("motion,action_type\n01_01,Walk\n09_99,Walk\n", "line 3.*09_99"),
        ("a,b\n1,2\n", "columns"),
        ("", "columns"),
    ],
)
def test_broken_cmu_lists_name_the_line(tmp_path, table, message):
    files = {
        "pose_clip.csv": table.encode(),
        "mocap_3djoints/01_01.npy": npy(clip(joints=20)),
        "mocap_3djoints/02_01.npy": npy(clip(1, 20)),
    }
    with pytest.raises(InputError, match=message):
        load_cmu(write_zip(tmp_path / "cmu_mocap.zip", files))


def test_missing_paths_and_names():
    with pytest.raises(InputError, match="does not exist"):
        load_cmu("/nowhere")
    with pytest.raises(InputError, match="unknown data set 'kinetics'"):
        load_dataset("kinetics", "/nowhere")


def small_dataset(counts=(3, 40, 100)):
    rng = np.random.default_rng(0)
    joints = tuple((rng.normal(size=(n, 20, 3)) + 5).astype(np.float32) for n in counts)
    n = len(counts)
    return ActionDataset(
        name="test",
        skeleton=CMU,
        actions=("a", "b"),
        joints=joints,
        labels=np.arange(n) % 2,
        clip_names=tuple(map(str, range(n))),
        subjects=("s",) * n,
        fps=10.0,
        length=40,
    )


def test_windows_start_at_the_origin_and_repeat_the_last_pose():
    dataset = small_dataset()
    sampler = ClipSampler(dataset, 40)
    windows = sampler.windows(np.array([0, 1, 2]), np.random.default_rng(1))
    assert np.allclose(windows[:, 0, 0], 0)
    assert np.allclose(windows[0, 3:], windows[0, 2])
    assert np.allclose(windows[1], dataset.joints[1] - dataset.joints[1][0, 0], atol=1e-6)


def test_windows_reach_the_first_and_the_last_frame_of_a_clip():
    dataset = small_dataset((43,))
    sampler = ClipSampler(dataset, 40)
    starts = set()
    for seed in range(60):
        window = sampler.windows(np.array([0]), np.random.default_rng(seed))[0]
        errors = [
            np.abs(window - (dataset.joints[0][s : s + 40] - dataset.joints[0][s, 0])).max()
            for s in range(4)
        ]
        starts.add(int(np.argmin(errors)))
    assert starts == {0, 1, 2, 3}


@pytest.mark.parametrize(("balance", "share"), [(0.0, 1 / 7), (0.5, 0.5 / 7 + 0.25), (1.0, 0.5)])
def test_actions_of_few_clips_are_drawn_as_often_as_asked_for(balance, share):
    data = dataclasses.replace(small_dataset((30,) * 7), labels=np.array([0, 0, 0, 1, 0, 0, 0]))
    sampler = ClipSampler(data, 20, balance=balance)
    clips = sampler.draw(20000, np.random.default_rng(0))
    assert abs((data.labels[clips] == 1).mean() - share) < 0.02
    assert set(clips) == set(range(7))


def test_the_seed_decides_the_batch():
    sampler = ClipSampler(small_dataset(), 20)
    first, second, other = (sampler.batch(16, np.random.default_rng(seed))[0] for seed in (5, 5, 6))
    assert np.array_equal(first, second)
    assert not np.array_equal(first, other)
