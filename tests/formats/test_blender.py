"""Blender opens our files with the same bones, textures and motions."""

from __future__ import annotations

import dataclasses
import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from a2v import Character
from a2v.animation import retarget, rig_motion
from a2v.formats import fbx, read_motion
from a2v.formats.bvh import write_bvh
from a2v.formats.fbx import write_fbx
from a2v.formats.gltf import write_glb

BONES = ("wrist.L", "wrist.R", "head", "foot.L")


@pytest.fixture(scope="module")
def clips(character: Character, data_dir: Path) -> dict[str, tuple[np.ndarray, float]]:
    folder = data_dir / "motions"
    names = ("cartwheel", "walk")
    return {
        name: (
            retarget(read_motion(folder / f"humanoid3d_{name}.txt", fps=10), character.body),
            10.0,
        )
        for name in names
    }


@pytest.fixture(scope="module")
def seen(
    blender: str,
    expressive: Character,
    clips: dict[str, tuple[np.ndarray, float]],
    tmp_path_factory: pytest.TempPathFactory,
) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("blender")
    character, surface = expressive, expressive.surface
    uv = (surface.vertices[surface.faces][..., :2] * [0.4, 0.5] + [0.5, 0.0]).astype(np.float32)
    textured = dataclasses.replace(surface, uv=uv, texture=np.full((32, 32, 3), 128, np.uint8))
    person = dataclasses.replace(character, surface=textured)
    shut = {
        "cartwheel": {
            "eyeBlinkLeft": (np.arange(len(clips["cartwheel"][0])) == 5).astype(np.float32)
        }
    }
    write_glb(folder / "c.glb", person, clips, expressions=shut)
    filmed = folder / "c.fbx" if fbx.can_write() else "-"
    if filmed != "-":
        write_fbx(folder / "c.fbx", person, clips, expressions=shut)
    write_bvh(folder / "m.bvh", rig_motion(clips["cartwheel"][0], character.body, 10.0))
    script = str(Path(__file__).with_name("look_in_blender.py"))
    command = [
        blender,
        script,
        str(folder / "c.glb"),
        str(folder / "m.bvh"),
        str(filmed),
        "10",
        ",".join(BONES),
        "0,5,12",
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    lines = [line for line in done.stdout.splitlines() if line.startswith("TOLD ")]
    assert lines, done.stdout[-2000:] + done.stderr[-2000:]
    told: dict[str, Any] = json.loads(lines[0].removeprefix("TOLD "))
    return told


def ours(character: Character, transforms: np.ndarray) -> np.ndarray:
    bones = [character.body.bone_names.index(bone) for bone in BONES]
    return transforms[[0, 5, 12]][:, bones][..., :3, 3]


@pytest.mark.slow
def test_the_glb_has_our_bones_clips_frames_hands_and_shapes(
    seen: dict[str, Any],
    character: Character,
    expressive: Character,
    clips: dict[str, tuple[np.ndarray, float]],
) -> None:
    told = seen["glb"]
    assert told["bones"] == len(character.body.bone_names)
    assert told["vertices"] >= len(character.surface.vertices)
    assert told["images"] == 1
    assert {name.split("_")[0] for name in told["clips"]} == set(clips)
    for name, clip in told["clips"].items():
        moves = clips[name.split("_")[0]][0]
        first, last = clip["range"]
        assert last - first + 1 == pytest.approx(len(moves), abs=1e-3)
        np.testing.assert_allclose(clip["heads"], ours(character, moves), atol=1e-3)
    check_shapes(told["shapes"], expressive)
    assert told["lids"] == pytest.approx(1.0)


def check_shapes(told: dict[str, float], person: Character) -> None:
    """Shape keys have our names, and vertices move as far as ours."""
    face = person.surface.face
    assert face is not None
    assert set(told) == set(face.names)
    for name in ("jawOpen", "eyeBlinkLeft"):
        assert told[name] == pytest.approx(
            np.linalg.norm(face.target(name)[1], axis=1).max(), rel=1e-3
        )


@pytest.mark.slow
def test_the_fbx_has_our_height_bones_clips_frames_and_shapes(
    seen: dict[str, Any], expressive: Character, clips: dict[str, tuple[np.ndarray, float]]
) -> None:
    if "fbx" not in seen:
        pytest.skip("FBX needs node and two npm packages; a2v doctor says how")
    told = seen["fbx"]
    assert told["bones"] == len(expressive.body.bone_names)
    assert told["images"] == 1
    assert told["height"] == pytest.approx(
        float(expressive.surface.vertices[:, 1].max()), abs=1e-3
    )  # centimeters are understood
    assert {name for name in clips if any(name in action for action in told["clips"])} == set(clips)
    for action, clip in told["clips"].items():
        moves = next(moves for name, (moves, _) in clips.items() if name in action)
        assert clip["range"][1] - clip["range"][0] + 1 == pytest.approx(len(moves), abs=1e-2)
        np.testing.assert_allclose(clip["heads"], ours(expressive, moves), atol=1e-3)
    check_shapes(told["shapes"], expressive)


@pytest.mark.slow
def test_the_bvh_has_our_bones_frames_and_hands(
    seen: dict[str, Any], character: Character, clips: dict[str, tuple[np.ndarray, float]]
) -> None:
    told, moves = seen["bvh"], clips["cartwheel"][0]
    assert told["bones"] == len(character.body.bone_names)
    first, last = told["range"]
    assert last - first + 1 == len(moves)
    np.testing.assert_allclose(told["heads"], ours(character, moves), atol=2e-3)
