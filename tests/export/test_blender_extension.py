"""The Blender extension: its manifest, and Blender itself building, loading and using it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from a2v import Character
from a2v.animation import prepare_rig, retarget
from a2v.formats import read_motion
from a2v.formats.gltf import write_glb

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "export" / "blender"


def test_the_manifest_says_what_blender_asks_for() -> None:
    tomllib = pytest.importorskip("tomllib")
    manifest = tomllib.loads((FOLDER / "blender_manifest.toml").read_text())
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert manifest["schema_version"] == "1.0.0"
    assert (manifest["id"], manifest["type"], manifest["version"]) == (
        "a2v",
        "add-on",
        project["version"],
    )
    assert manifest["license"] == [f"SPDX:{project['license']}"]
    assert re.fullmatch(r"\d+\.\d+\.\d+", manifest["blender_version_min"])
    for text in (manifest["tagline"], *manifest["permissions"].values()):
        assert 0 < len(text) <= 64
        assert text[-1].isalnum()


def test_the_extension_needs_nothing_of_a2v() -> None:
    source = (FOLDER / "__init__.py").read_text()
    assert not re.search(r"^\s*(from|import) (a2v|pipelines|export)\b", source, re.MULTILINE)


@pytest.fixture(scope="module")
def told(
    character: Character, data_dir: Path, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Any]:
    """What Blender says; `bpy` in this environment or in one of its own."""
    folder = tmp_path_factory.mktemp("extension")
    for python in (
        os.environ.get("A2V_BLENDER_PYTHON"),
        sys.executable,
        str(ROOT / "build" / "bpy" / "bin" / "python"),
    ):
        if (
            python
            and Path(python).exists()
            and not subprocess.run(
                [python, "-c", "import bpy"], capture_output=True, check=False
            ).returncode
        ):
            break
    else:
        pytest.skip(
            "no Python with bpy; python3.11 -m venv build/bpy && build/bpy/bin/pip install bpy, or "
            "set A2V_BLENDER_PYTHON"
        )
    moves = {
        name: (
            retarget(
                read_motion(data_dir / "motions" / f"humanoid3d_{name}.txt", fps=10), character.body
            ),
            10.0,
        )
        for name in ("walk", "kick")
    }
    write_glb(folder / "person.glb", *prepare_rig(character, moves, rig="mixamo"))
    script = str(Path(__file__).with_name("look_at_extension.py"))
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
    }  # the a2v beside this Python
    (folder / "no.jpg").write_text("this is no photo")
    command = [python, script, str(FOLDER), str(folder / "person.glb"), str(folder / "no.jpg")]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=300, env=environment, check=False
    )
    lines = [line for line in done.stdout.splitlines() if line.startswith("TOLD ")]
    assert lines, done.stdout[-2000:] + done.stderr[-2000:]
    found: dict[str, Any] = json.loads(lines[0].removeprefix("TOLD "))
    return found


@pytest.mark.slow
def test_blender_builds_it_and_imports_a_character(told: dict[str, Any]) -> None:
    assert told["built"] == [["__init__.py", "blender_manifest.toml"]]
    assert told["operators"] == [True, True]
    assert told["imported"] == ["FINISHED"]
    assert told["bones"] == 52
    assert told["shapes"] == ["a2v bone"]
    assert told["actions"] == ["kick", "walk"]
    assert told["playing"] in told["actions"]
    assert told["frames"][1] > told["frames"][0]
    assert not told["extra"]
    assert not told["left"]


@pytest.mark.slow
def test_what_goes_wrong_is_said_in_blender(told: dict[str, Any]) -> None:
    assert "is no character of a2v" in told["no character"]
    assert "no.jpg" in told["no photo"]  # a2v's own sentence
    assert "a2v is not installed" in told["no a2v"]
