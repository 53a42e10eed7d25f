"""VRM 1.0: contents of the files, and how @pixiv/three-vrm shows them in a browser."""

from __future__ import annotations

import base64
import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from a2v import Character, InputError
from a2v.animation import deform, express, prepare_rig, retarget
from a2v.formats import read_motion
from a2v.formats.gltf import VrmMeta, write_vrm, write_vrma
from a2v.formats.gltf.vrm import VRM_REQUIRED
from tests.support.browser import THREE_VRM, bundled, told_by
from tests.support.glb import Glb, validate

ROOT = Path(__file__).resolve().parents[2]
META = VrmMeta(name="Ada", author="A. Person", license_url="https://example.org/license")


def shut_at(frame: int, frames: int) -> np.ndarray:
    return (np.arange(frames) == frame).astype(np.float32)


@pytest.fixture(scope="module")
def person(expressive: Character, data_dir: Path) -> tuple[Character, np.ndarray]:
    moves = retarget(
        read_motion(data_dir / "motions" / "humanoid3d_walk.txt", fps=10), expressive.body
    )
    changed, clips = prepare_rig(expressive, {"walk": (moves, 10.0)}, rig="vrm")
    return changed, clips["walk"][0]


@pytest.fixture(scope="module")
def files(
    person: tuple[Character, np.ndarray], tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("vrm")
    write_vrm(folder / "ada.vrm", person[0], META)
    lids = {"eyeBlinkLeft": shut_at(4, len(person[1]))}
    write_vrma(folder / "walk.vrma", person[0].body, person[1], 10.0, name="walk", strengths=lids)
    return folder / "ada.vrm", folder / "walk.vrma"


@pytest.fixture(scope="module")
def bundle() -> str:
    """Bundle three-vrm with our script into one file."""
    return bundled(Path(__file__).with_name("look_in_three_vrm.mjs"), "three-vrm", *THREE_VRM)


def test_khronos_finds_nothing_wrong(files: tuple[Path, Path], validator: Path) -> None:
    for path in files:
        report = validate(path, validator)
        assert report["errors"] == 0, report["messages"]


def test_the_avatar_has_the_bones_and_says_who_made_it(
    files: tuple[Path, Path], person: tuple[Character, np.ndarray]
) -> None:
    document = Glb(files[0]).json
    assert document["extensionsUsed"] == ["VRMC_vrm"]
    vrm = document["extensions"]["VRMC_vrm"]
    assert vrm["specVersion"] == "1.0"
    bones = vrm["humanoid"]["humanBones"]
    assert len(VRM_REQUIRED) == 15
    assert bones.keys() >= VRM_REQUIRED
    assert (
        sum(
            any(finger in name for finger in ("Thumb", "Index", "Middle", "Ring", "Little"))
            for name in bones
        )
        == 30
    )
    assert all(document["nodes"][bone["node"]]["name"] == name for name, bone in bones.items())
    assert (vrm["meta"]["authors"], vrm["meta"]["otherLicenseUrl"]) == (
        ["A. Person"],
        META.license_url,
    )
    assert document["nodes"][vrm["firstPerson"]["meshAnnotations"][0]["node"]]["skin"] == 0
    body, vertices = person[0].body, person[0].surface.vertices
    assert abs(float(vertices[:, 1].min())) < 5e-3
    toes, ankles = (
        body.bone_transforms[body.bone_names.index(name), :3, 3]
        for name in ("leftToes", "leftFoot")
    )
    assert toes[2] > ankles[2] + 0.05  # faces +z
    clip = Glb(files[1]).json
    names = {
        clip["nodes"][channel["target"]["node"]]["name"]
        for channel in clip["animations"][0]["channels"]
    }
    assert "hips" in names
    assert "root" not in names
    moved = [
        channel["target"]["node"]
        for channel in clip["animations"][0]["channels"]
        if channel["target"]["path"] == "translation"
    ]
    said = clip["extensions"]["VRMC_vrm_animation"]
    assert moved == [
        said["humanoid"]["humanBones"]["hips"]["node"],
        said["expressions"]["preset"]["blinkLeft"]["node"],
    ]


@pytest.mark.slow
def test_three_vrm_moves_the_right_vertices(
    files: tuple[Path, Path], person: tuple[Character, np.ndarray], bundle: str
) -> None:
    character, moves = person
    face = character.surface.face
    assert face is not None
    chosen = list(range(0, len(character.surface.vertices), 97))
    frames = [0, 4, 9]
    given = {
        "vrm": base64.b64encode(files[0].read_bytes()).decode(),
        "vrma": base64.b64encode(files[1].read_bytes()).decode(),
        "vertices": chosen,
        "face": face.target("eyeBlinkLeft")[0][::7].tolist(),
        "expressions": ["blinkLeft", "aa", "blinkRight"],
        "times": [frame / 10 for frame in frames],
    }
    told: dict[str, Any] = told_by(bundle, given)
    assert set(told["bones"]) >= VRM_REQUIRED
    assert told["meta"]["name"] == "Ada"
    assert told["lookAt"]
    assert told["firstPerson"]
    assert told["duration"] == pytest.approx((len(moves) - 1) / 10, abs=1e-4)
    for frame, seen in zip(frames, told["frames"], strict=True):
        moved = express(
            character,
            deform(character, moves[frame]),
            moves[frame],
            {"eyeBlinkLeft": float(frame == 4)},
        )
        np.testing.assert_allclose(seen, moved[chosen], atol=2e-3)
    assert told["lids"] == pytest.approx([float(frame == 4) for frame in frames])
    rest = character.body.bone_transforms
    seen = face.target("eyeBlinkLeft")[0][::7]
    for name, strengths in (
        ("blinkLeft", {"eyeBlinkLeft": 1.0}),
        ("aa", {"jawOpen": 0.6}),
        ("blinkRight", {"eyeBlinkRight": 1.0}),
    ):
        expected = express(character, deform(character, rest), rest, strengths)[seen]
        np.testing.assert_allclose(told["expressions"][name], expected, atol=2e-4)


def test_what_is_not_stated_is_asked_for(character: Character, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--license-url"):
        VrmMeta(name="a", author="b", license_url="")
    with pytest.raises(InputError, match="--author"):
        VrmMeta(name="a", author=" ", license_url="https://example.org")
    with pytest.raises(InputError, match="change the rig to vrm"):
        write_vrm(tmp_path / "a.vrm", character, META)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_add_on_of_blender_finds_nothing_wrong(
    files: tuple[Path, Path], person: tuple[Character, np.ndarray], vrm_addon: str
) -> None:
    character, moves = person
    names, frames = ("leftHand", "rightHand", "leftFoot", "head"), [0, 4, 9]
    snake = ("left_hand", "right_hand", "left_foot", "head")
    script = str(Path(__file__).with_name("look_in_vrm_addon.py"))
    command = [
        vrm_addon,
        script,
        *map(str, files),
        "10",
        ",".join(map(str, frames)),
        ",".join(snake),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert "TOLD " in done.stdout, done.stdout[-1500:] + done.stderr[-1500:]
    told: dict[str, Any] = json.loads(done.stdout.rpartition("TOLD ")[2].partition(" END")[0])
    assert told["read"] == told["played"] == ["FINISHED"]
    assert told["found"] == []
    assert set(told["bones"].values()) >= VRM_REQUIRED
    assert told["meta"] == {
        "name": "Ada",
        "authors": ["A. Person"],
        "license": META.license_url,
        "look_at": "bone",
    }
    assert told["presets"] == {
        "blink": 2,
        "blink_left": 1,
        "happy": 6,
        "aa": 1,
        "oh": 2,
        "look_up": 2,
    }
    assert told["custom"] == 52
    places = moves[frames][:, [character.body.bone_names.index(name) for name in names]][..., :3, 3]
    np.testing.assert_allclose(told["heads"], places, atol=1e-3)
    assert told["lid"] == pytest.approx([0, 1, 0], abs=1e-3)
