"""Godot's own importer reads a character with the names of its humanoid profile.

The importer is Debian's godot3-server, which needs no screen.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from a2v import Character
from a2v.animation import prepare_rig, retarget
from a2v.formats import read_motion, write_glb

SECONDS = 90
"""For the import of one file."""


def imported(program: str, folder: Path) -> None:
    """Open the folder in the editor until the file is imported, then end the editor."""
    editor = subprocess.Popen(
        [program, "--path", str(folder), "--editor"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        last = time.monotonic() + SECONDS
        while not list((folder / ".import").glob("person.glb-*.md5")):
            assert time.monotonic() < last, "Godot imported nothing in time"
            time.sleep(0.2)
    finally:
        editor.terminate()
        editor.wait(20)


@pytest.mark.slow
@pytest.mark.parametrize("rig", ["godot", "talkinghead"])
def test_godot_finds_the_bones_where_they_are(
    rig: str, expressive: Character, data_dir: Path, tmp_path: Path
) -> None:
    program = shutil.which("godot3-server")
    if program is None:
        pytest.skip("Godot's server is not installed (apt install godot3-server)")
    walk = retarget(
        read_motion(data_dir / "motions" / "humanoid3d_walk.txt", fps=10), expressive.body
    )
    person, clips = prepare_rig(expressive, {"walk": (walk, 10.0)}, rig=rig)
    write_glb(tmp_path / "person.glb", person, clips)
    (tmp_path / "project.godot").write_text('config_version=4\n[application]\nconfig/name="look"\n')
    (tmp_path / "look.gd").write_bytes(Path(__file__).with_name("look_in_godot.gd").read_bytes())
    imported(program, tmp_path)
    done = subprocess.run(
        [program, "--path", str(tmp_path), "-s", "look.gd"],
        capture_output=True,
        text=True,
        timeout=SECONDS,
        check=False,
    )
    assert "TOLD " in done.stdout, done.stdout[-1500:] + done.stderr[-500:]
    told = json.loads(done.stdout.rpartition("TOLD ")[2].partition(" END")[0])
    places = {
        name.lower().replace("_", ""): place for name, place in told["bones"].items()
    }  # Godot 3 writes left_upper_arm
    names = [name.lower().replace("_", "") for name in person.body.bone_names]
    assert set(names) == set(places)
    assert len(told["shapes"]) == len(person.surface.face.names)  # type: ignore[union-attr]
    assert told["clips"]["walk"] == pytest.approx((len(walk) - 1) / 10, abs=1e-3)
    np.testing.assert_allclose(
        [places[name] for name in names], person.body.rest_transforms[:, :3, 3], atol=1e-4
    )
