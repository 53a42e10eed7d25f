"""USD files give the same vertices by USD's own skinning."""

from __future__ import annotations

import dataclasses
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from a2v import Character, InputError
from a2v.animation import deform, prepare_rig, retarget
from a2v.formats import read_motion
from a2v.formats.usd import write_usd

pxr = pytest.importorskip("pxr", reason="usd-core is not installed (the extra a2v[usd])")


@pytest.fixture(scope="module")
def textured(character: Character) -> Character:
    surface = character.surface
    uv = (surface.vertices[surface.faces][..., :2] * [0.4, 0.5] + [0.5, 0.0]).astype(np.float32)
    texture = np.random.default_rng(0).integers(0, 256, (64, 32, 3), dtype=np.uint8)
    return dataclasses.replace(
        character, surface=dataclasses.replace(surface, uv=uv, texture=texture)
    )


@pytest.fixture(scope="module")
def clips(character: Character, data_dir: Path) -> dict[str, tuple[np.ndarray, float]]:
    folder = data_dir / "motions"
    rates = {"cart wheel": ("cartwheel", 10.0), "walk": ("walk", 20.0)}
    return {
        name: (
            retarget(read_motion(folder / f"humanoid3d_{file}.txt", fps=rate), character.body),
            rate,
        )
        for name, (file, rate) in rates.items()
    }


def opened(path: Path) -> Any:
    from pxr import Usd

    return Usd.Stage.Open(str(path))


def skinned(stage: Any, time: float) -> np.ndarray:
    """The mesh's points as USD's own library skins them."""
    from pxr import Usd, UsdGeom, UsdSkel

    root = UsdSkel.Root(stage.GetDefaultPrim())
    cache = UsdSkel.Cache()
    cache.Populate(root, Usd.PrimDefaultPredicate)
    (binding,) = cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate)
    skeleton = cache.GetSkelQuery(binding.GetSkeleton())
    (query,) = binding.GetSkinningTargets()
    points = UsdGeom.Mesh(query.GetPrim()).GetPointsAttr().Get()
    assert query.ComputeSkinnedPoints(skeleton.ComputeSkinningTransforms(time), points, time)
    return np.asarray(points)


@pytest.mark.parametrize("suffix", [".usdz", ".usdc", ".usda"])
def test_usds_own_skinning_moves_the_mesh_like_our_frames(
    tmp_path: Path, textured: Character, clips: dict[str, tuple[np.ndarray, float]], suffix: str
) -> None:
    path = tmp_path / f"c{suffix}"
    write_usd(path, textured, clips)
    assert {p.name for p in tmp_path.iterdir()} == (
        {"c.usdz"} if suffix == ".usdz" else {f"c{suffix}", "c_texture.jpg"}
    )
    stage = opened(path)
    moves = clips["cart wheel"][0]
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode(), stage.GetTimeCodesPerSecond()) == (
        0,
        len(moves) - 1,
        10.0,
    )
    for frame in (0, 12):
        np.testing.assert_allclose(skinned(stage, frame), deform(textured, moves[frame]), atol=2e-4)


def test_the_stage_says_what_it_holds(
    tmp_path: Path, textured: Character, clips: dict[str, tuple[np.ndarray, float]]
) -> None:
    from pxr import UsdGeom, UsdSkel

    write_usd(tmp_path / "c.usdz", textured, clips, name="my person")
    stage = opened(tmp_path / "c.usdz")
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert stage.GetDefaultPrim().GetName() == "my_person"
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath("/my_person/skeleton"))
    assert [joint.split("/")[-1].replace("_", ".") for joint in skeleton.GetJointsAttr().Get()] == [
        bone.replace("-", ".").replace("_", ".") for bone in textured.body.bone_names
    ]
    animations = {
        prim.GetName(): UsdSkel.Animation(prim)
        for prim in stage.Traverse()
        if prim.IsA(UsdSkel.Animation)
    }
    assert set(animations) == {"cart_wheel", "walk"}
    times = animations["walk"].GetRotationsAttr().GetTimeSamples()
    assert len(times) == len(clips["walk"][0])
    assert times[1] == pytest.approx(10 / 20)  # in frames of the first clip
    with zipfile.ZipFile(tmp_path / "c.usdz") as archive:
        assert any(name.endswith("texture.jpg") for name in archive.namelist())


def test_vertex_colors_without_a_texture(tmp_path: Path, character: Character) -> None:
    from pxr import UsdGeom

    write_usd(tmp_path / "c.usdc", character)
    assert [p.name for p in tmp_path.iterdir()] == ["c.usdc"]
    stage = opened(tmp_path / "c.usdc")
    linear = np.asarray(
        UsdGeom.Mesh(stage.GetPrimAtPath("/character/surface")).GetDisplayColorAttr().Get()
    )
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(srgb, character.surface.colors, atol=2e-3)
    np.testing.assert_allclose(
        skinned(stage, 0), character.surface.vertices, atol=1e-5
    )  # the bind pose


def test_usds_own_validators_find_nothing(
    tmp_path: Path, textured: Character, clips: dict[str, tuple[np.ndarray, float]]
) -> None:
    validation = pytest.importorskip("pxr.UsdValidation", reason="this usd-core has no validators")
    write_usd(tmp_path / "c.usdz", textured, clips)
    validators = validation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 10
    found = validation.ValidationContext(validators).Validate(opened(tmp_path / "c.usdz"))
    assert [f"{error.GetName()}: {error.GetMessage()}" for error in found] == []


def test_what_cannot_be_written_is_named(tmp_path: Path, character: Character) -> None:
    with pytest.raises(InputError, match=r"ends in \.usdz"):
        write_usd(tmp_path / "c.fbx", character)
    with pytest.raises(InputError, match="clip 'odd'"):
        write_usd(tmp_path / "c.usdz", character, {"odd": (np.zeros((2, 3, 4, 4)), 20.0)})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("rig", ["mixamo", "unreal"])
def test_other_rigs_move_like_their_frames(
    tmp_path: Path, character: Character, clips: dict[str, tuple[np.ndarray, float]], rig: str
) -> None:
    person, moves = prepare_rig(character, clips, rig=rig, root_motion=True)
    write_usd(tmp_path / "c.usdc", person, moves)
    stage = opened(tmp_path / "c.usdc")
    for frame in (0, 12):
        np.testing.assert_allclose(
            skinned(stage, frame), deform(person, moves["cart wheel"][0][frame]), atol=2e-4
        )
