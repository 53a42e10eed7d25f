"""A data folder with two avatars, a quick guide, and their studio."""

from __future__ import annotations

from pathlib import Path

import pytest

from a2v.body import FitSettings
from a2v.lab.studio.avatar_files import load_avatar
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.guide import Guide, fit_guide, guide_key
from a2v.lab.studio.posing import action_poses
from a2v.lab.studio.settings import StudioSettings
from a2v.lab.studio.studio import Studio
from a2v.lab.studio.view import View

NAMES = (
    "AIAN_F_1_Busi",
    "Asian_F_2_Busi",
)  # of the training and of the validation split; the first one has a wig


@pytest.fixture(scope="session")
def data(data_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder like the data's, with two avatars."""
    folder = tmp_path_factory.mktemp("data")
    (folder / "avatars").mkdir()
    for name in NAMES:
        (folder / "avatars" / f"{name}.glb").symlink_to(data_dir / "avatars" / f"{name}.glb")
    (folder / "humanact12.zip").symlink_to(data_dir / "humanact12.zip")
    return folder


@pytest.fixture(scope="session")
def avatar(data: Path) -> Avatar:
    return load_avatar(data / "avatars" / f"{NAMES[0]}.glb")


@pytest.fixture(scope="session")
def guide(avatar: Avatar) -> Guide:
    return fit_guide(avatar, FitSettings(rounds=3, steps=8))


@pytest.fixture(scope="session")
def folder(
    data: Path, avatar: Avatar, guide: Guide, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """A data set's folder, prepared with a quick guide and few poses."""
    made = tmp_path_factory.mktemp("set")
    guide.save(made / "guides" / f"{guide_key(NAMES[0])}.npz")
    action_poses(avatar, str(data), clips=4, frames=2).save(made / "poses.npz")
    return made


@pytest.fixture(scope="session")
def studio(folder: Path, data: Path) -> Studio:
    return Studio.open(folder, data, StudioSettings(points=3000, surface_points=2000, seed=3))


@pytest.fixture(scope="session")
def view(studio: Studio) -> View:
    return studio.view("training", 1)
