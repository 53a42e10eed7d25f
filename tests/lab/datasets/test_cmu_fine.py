"""The fine actions of CMU: the committed table and its data."""

from __future__ import annotations

import zipfile
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.lab.datasets import ActionDataset, load_cmu, load_cmu_fine
from a2v.lab.datasets.cmu import ACTIONS
from a2v.lab.datasets.cmu_fine import clip_parts, fine_table, recording_of
from a2v.lab.datasets.floors import floors_apart


def test_the_table_has_enough_actions_and_each_lies_in_few_families() -> None:
    actions = {meaning.action for meaning in fine_table().values() if meaning.action}
    assert len(actions) >= 60
    assert {meaning.coarse for meaning in fine_table().values()} == set(ACTIONS)
    assert all(description == description.lower().strip() for _, description in fine_table())


@pytest.fixture(scope="module")
def fine(data_dir: Path) -> ActionDataset:
    return load_cmu_fine(data_dir)


def test_the_data_under_the_table(data_dir: Path, fine: ActionDataset) -> None:
    coarse = load_cmu(data_dir)
    assert len({recording_of(name) for name in fine.clip_names}) > 0.93 * len(coarse)
    counts = Counter(fine.labels.tolist())
    assert len(counts) == len(fine.actions) == len(fine.traits) == len(fine.descriptions)
    assert fine.actions[0] == "Walk"
    assert (
        "walk on uneven terrain" in fine.descriptions[fine.actions.index("Walk on uneven terrain")]
    )
    assert "direction:backward" in fine.traits[fine.actions.index("Walk backwards")]
    assert all(any(trait.startswith("coarse:") for trait in own) for own in fine.traits)
    # Clips that the index calls "clean" were cleaned up and copy other described clips.
    assert "Clean" not in fine.actions
    at = {name: index for index, name in enumerate(fine.clip_names)}
    assert fine.labels[at["122_47"]] == fine.labels[at["83_47"]]
    np.testing.assert_allclose(fine.joints[at["122_47"]], fine.joints[at["83_47"]], atol=0.02)


def test_people_fall_as_fast_as_they_do(fine: ActionDataset) -> None:
    """Clips recorded at 60 frames per second have their true speed: falls have 9.8 m/s^2."""
    unit = fine.frame.meters_per_unit
    for name in ("75_07", "75_10", "75_12", "75_13", "75_15", "13_40", "118_30"):
        height = fine.joints[fine.clip_names.index(name)][:, 0, 1].astype(np.float64) * unit
        fall = np.sort(np.diff(height, 2) * fine.fps**2)[:2]
        assert np.all((fall > -20) & (fall < -7.5)), (
            name
        )  # at twice the speed they are -39; splines overshoot where feet leave the ground


def test_feet_stand_equally_high(fine: ActionDataset) -> None:
    unit = fine.frame.meters_per_unit
    walks = [
        joints * unit
        for joints, label in zip(fine.joints, fine.labels, strict=True)
        if fine.actions[label] == "Walk"
    ][:40]
    apart = np.array([floors_apart(joints, fine.skeleton, fine.fps) for joints in walks])
    assert np.nanquantile(np.abs(apart), 0.9) < 0.01
    assert (
        np.nanmax(np.abs(apart)) < 0.035
    )  # one that differs from its subject's others is levelled as they are
    before, after = (
        np.ptp(np.linalg.norm(joints[:, 13] - joints[:, 14], axis=-1)) for joints in walks[:2]
    )
    assert max(before, after) < 1e-3  # bones keep their lengths


def test_what_measurements_show_of_a_clip_goes_before_its_description(fine: ActionDataset) -> None:
    at = {name: index for index, name in enumerate(fine.clip_names)}
    assert fine.actions[fine.labels[at["91_34"]]] == "Walk around"  # it turns by 200 degrees
    assert "133_21" not in at
    jacks = [
        len(joints)
        for joints, label in zip(fine.joints, fine.labels, strict=True)
        if fine.actions[label] == "Jumping jacks"
    ]
    assert len(jacks) == 6
    assert max(jacks) < 60
    assert {"01_02", "01_02/2"} <= set(at)
    known = {name.split("/")[0] for name in at} | {"133_21", "133_22", "133_23"}
    assert set(clip_parts()) <= known
    actions = {meaning.action for meaning in fine_table().values()} | {"-", ""}
    assert all(part.action in actions for parts in clip_parts().values() for part in parts)


def test_a_description_that_the_table_lacks_is_named(data_dir: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(data_dir / "cmu_mocap.zip") as archive:
        index = next(
            name for name in archive.namelist() if name.endswith("cmu_index_with_framerate.csv")
        )
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
