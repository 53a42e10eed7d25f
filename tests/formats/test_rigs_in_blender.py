"""Blender sees the bones of every rig in every animated format where we put them."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from a2v import Character
from a2v.animation import prepare_rig, retarget
from a2v.animation.rig_spec import RIGS
from a2v.formats import fbx, read_motion, write_rig_bvh
from a2v.formats.fbx import write_fbx
from a2v.formats.gltf import write_glb
from a2v.formats.usd import write_usd

FRAMES, FPS = [0, 5, 12], 10.0
WRITERS = {".glb": write_glb, ".usdc": write_usd, ".fbx": write_fbx}


def plain(name: str) -> str:
    """A bone's name as USD can have it."""
    return re.sub(r"\W", "_", name)


@pytest.mark.slow
def test_every_bone_of_every_rig_is_where_it_is_meant(
    blender: str, character: Character, data_dir: Path, tmp_path: Path
) -> None:
    moves = retarget(
        read_motion(data_dir / "motions" / "humanoid3d_cartwheel.txt", fps=FPS), character.body
    )
    people = {}
    for rig in RIGS:
        person, clips = prepare_rig(
            character, {"cartwheel": (moves, FPS)}, rig=rig, root_motion=True
        )
        people[rig] = person.body, clips["cartwheel"][0]
        for suffix, write in WRITERS.items():
            if suffix != ".fbx" or fbx.can_write():
                write(tmp_path / f"{rig}{suffix}", person, clips)
        write_rig_bvh(tmp_path / f"{rig}.bvh", person.body, *clips["cartwheel"])
    files = sorted(map(str, tmp_path.iterdir()))
    script = str(Path(__file__).with_name("look_at_rigs_in_blender.py"))
    command = [blender, script, str(FPS), ",".join(map(str, FRAMES)), *files]
    done = subprocess.run(command, capture_output=True, text=True, timeout=500, check=False)
    assert "TOLD " in done.stdout, done.stdout[-1500:] + done.stderr[-2500:]
    told: dict[str, Any] = json.loads(done.stdout.rpartition("TOLD ")[2].partition(" END")[0])
    assert len(told) == len(files) + sum(file.endswith(".fbx") for file in files)
    for file, seen in told.items():
        body, transforms = people[Path(file.split()[0]).stem]
        assert seen["range"][1] - seen["range"][0] + 1 == pytest.approx(
            len(transforms), abs=1e-2
        ), file
        worst = 0.0
        for frame, heads in zip(FRAMES, seen["heads"], strict=True):
            heads = {plain(name): place for name, place in heads.items()}
            assert {plain(name) for name in body.bone_names} <= set(heads), file
            places = np.array([heads[plain(name)] for name in body.bone_names])
            worst = max(
                worst, float(np.linalg.norm(places - transforms[frame][:, :3, 3], axis=1).max())
            )
        assert worst < 1e-3, file
