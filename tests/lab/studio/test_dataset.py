"""A data set's folder: resumed, never mixed, and wrong settings refused."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from a2v.errors import InputError
from a2v.lab.studio.dataset import OLDER, write_views
from a2v.lab.studio.index import keep_index
from a2v.lab.studio.settings import VERSION, StudioSettings
from a2v.lab.studio.view import View, list_views, view_path


def test_a_data_set_is_resumed_and_never_mixed(
    folder: Path, data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from pipelines.cli import main

    command = [
        "studio",
        "--data",
        str(data),
        "--out",
        str(folder),
        "--points",
        "500",
        "--surface_points",
        "300",
        "--validation",
        "1",
    ]
    assert main([*command, "--training", "1"]) == 0
    first = view_path(folder, "training", 0)
    before = first.stat().st_mtime_ns
    assert main([*command, "--training", "3", "--workers", "2"]) == 0
    assert "3 training and 1 validation views" in capsys.readouterr().out
    assert first.stat().st_mtime_ns == before
    assert [path.name for path in list_views(folder, "training")] == [
        "000000.npz",
        "000001.npz",
        "000002.npz",
    ]
    assert len(View.load(first).points) == 500
    assert json.loads((folder / "index.json").read_text())["settings"]["points"] == 500
    assert main([*command, "--training", "3", "--seed", "9"]) == 2
    assert "other settings" in capsys.readouterr().err
    with pytest.raises(InputError, match="no views of the split 'validation'"):
        list_views(data, "validation")
    with pytest.raises(InputError, match="unknown split 'test'"):
        write_views(folder, data, {"test": 1})
    shutil.rmtree(folder / "views")
    (folder / "index.json").unlink()


@pytest.mark.parametrize(
    "bad",
    [
        {"actions": 0.8, "open": 0.4},
        {"near_share": 0.9},
        {"distance": (5.0, 2.0)},
        {"fill": 1.5},
        {"points": 0},
        {"facing": -0.1},
    ],
)
def test_bad_settings_are_refused(bad: dict) -> None:  # type: ignore[type-arg]
    with pytest.raises(InputError):
        StudioSettings(**bad)


def test_folders_from_before_there_were_things_go_on(tmp_path: Path) -> None:
    keep_index(tmp_path, StudioSettings(), VERSION)
    index = json.loads((tmp_path / "index.json").read_text())
    index["settings"] = {
        name: value for name, value in index["settings"].items() if name not in OLDER
    }
    (tmp_path / "index.json").write_text(json.dumps(index))
    keep_index(tmp_path, StudioSettings(), VERSION, older=OLDER)
    with pytest.raises(InputError, match="other settings"):
        keep_index(tmp_path, StudioSettings(furniture=0.1), VERSION, older=OLDER)
