"""The fine actions of CMU: the committed table, and the data under it."""

from __future__ import annotations

import zipfile
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from a2v.datasets import load_cmu, load_cmu_fine
from a2v.datasets.cmu import ACTIONS
from a2v.datasets.cmu_fine import fine_table
from a2v.errors import InputError


def test_the_table_has_enough_actions_and_each_lies_in_few_families() -> None:
    actions = {meaning.action for meaning in fine_table().values() if meaning.action}
    assert len(actions) >= 60
    assert {meaning.coarse for meaning in fine_table().values()} == set(ACTIONS)
    assert all(description == description.lower().strip() for _, description in fine_table())


def test_the_data_under_the_table(data_dir: Path) -> None:
    fine, coarse = load_cmu_fine(data_dir), load_cmu(data_dir)
    assert len(fine) > 0.95 * len(coarse)
    by_name = dict(zip(coarse.clip_names, coarse.joints, strict=True))
    for name, joints in list(zip(fine.clip_names, fine.joints, strict=True))[::100]:
        np.testing.assert_array_equal(joints, by_name[name])
    counts = Counter(fine.labels.tolist())
    assert len(counts) == len(fine.actions) == len(fine.traits) == len(fine.descriptions)
    assert fine.actions[0] == "Walk"
    assert "walk on uneven terrain" in fine.descriptions[fine.actions.index("Walk on uneven terrain")]
    assert "direction:backward" in fine.traits[fine.actions.index("Walk backwards")]
    assert all(any(trait.startswith("coarse:") for trait in own) for own in fine.traits)


def test_a_description_that_the_table_lacks_is_named(data_dir: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(data_dir / "cmu_mocap.zip") as archive:
        index = next(name for name in archive.namelist() if name.endswith("cmu_index_with_framerate.csv"))
        text = archive.read(index).decode("latin-1").replace("salsa dance", "yodelling")
        clip = "mocap/mocap_3djoints/60_01.npy"
        (tmp_path / "mocap_3djoints").mkdir()
        (tmp_path / "mocap_3djoints" / "60_01.npy").write_bytes(archive.read(clip))
    (tmp_path / "pose_clip.csv").write_text("motion,action_type\n60_01,Dance\n")
    (tmp_path / "cmu_index_with_framerate.csv").write_text(text, encoding="latin-1")
    with pytest.raises(InputError, match=r"60_01.*yodelling.*cmu_fine.csv"):
        load_cmu_fine(tmp_path)


def test_a_folder_without_the_index_is_refused(data_dir: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(data_dir / "cmu_mocap.zip") as archive:
        (tmp_path / "60_01.npy").write_bytes(archive.read("mocap/mocap_3djoints/60_01.npy"))
    (tmp_path / "pose_clip.csv").write_text("motion,action_type\n60_01,Dance\n")
    with pytest.raises(InputError, match="holds no cmu_index"):
        load_cmu_fine(tmp_path)
