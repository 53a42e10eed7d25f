from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from a2v import Character, InputError
from a2v.animation import (
    RIGS,
    change_rig,
    deform,
    load_rig,
    prepare_rig,
    put_rig_in_place,
    retarget,
)
from a2v.animation.change_rig import RigChange
from a2v.animation.rig_spec import world_direction
from a2v.formats import read_motion, write_rig_bvh
from tests.support.bvh import Bvh

OTHERS = RIGS[1:]


@pytest.fixture(scope="module")
def walk(character: Character, data_dir: Path) -> np.ndarray:
    return retarget(
        read_motion(data_dir / "motions" / "humanoid3d_walk.txt", fps=20), character.body
    )


@pytest.fixture(scope="module", params=OTHERS)
def change(request: pytest.FixtureRequest, character: Character) -> RigChange:
    return change_rig(character, load_rig(request.param))


def test_the_tables_are_trees_of_known_bones() -> None:
    for name in OTHERS:
        spec = load_rig(name)
        assert len(set(spec.names)) == len(spec.names)
        known = {spec.root} if spec.root else {""}
        for bone in spec.bones:
            assert bone.parent in known, (name, bone.name)
            known.add(bone.name)
        assert {bone.tail for bone in spec.bones if bone.tail} <= known
        sources = [source for bone in spec.bones for source in bone.sources]
        assert len(set(sources)) == len(sources)
        assert sum("finger" in source for source in sources) == 30  # all fingers are kept
        assert spec.rest in ("T", "A")


def test_the_rest_pose_stands_on_the_ground_with_right_handed_axes(change: RigChange) -> None:
    body, vertices = change.character.body, change.character.surface.vertices
    assert abs(float(vertices[:, 1].min())) < 5e-3
    turns = body.rest_transforms[:, :3, :3].astype(np.float64)
    np.testing.assert_allclose(
        turns @ np.swapaxes(turns, 1, 2), np.tile(np.eye(3), (len(turns), 1, 1)), atol=1e-6
    )
    assert (np.linalg.det(turns) > 0.99).all()
    spec = change.spec
    heads = dict(
        zip(body.bone_names, body.rest_transforms[:, :3, 3].astype(np.float64), strict=True)
    )
    if spec.root:
        np.testing.assert_array_equal(heads[spec.root], 0)
    for bone in spec.bones:
        if spec.rest == "T" and bone.direction not in ("", "ahead") and bone.tail:
            along = heads[bone.tail] - heads[bone.name]
            np.testing.assert_allclose(
                along / np.linalg.norm(along), world_direction(bone.direction), atol=1e-4
            )
    if spec.along:
        axis = body.rest_transforms[:, :3, "xyz".index(spec.along[1])]
        for index, bone in enumerate(body.bone_names):
            row = next((item for item in spec.bones if item.name == bone), None)
            if row is not None:
                away = body.bone_tails[index] - heads[bone]
                sign = -1 if spec.mirrored and row.sources[0].endswith(".R") else 1
                assert float(axis[index] @ away) * sign > 0.999 * np.linalg.norm(away)


def test_the_skin_looks_the_same(change: RigChange, character: Character, walk: np.ndarray) -> None:
    bind = character.body.bone_transforms[None]
    given = deform(change.character, change.follow(bind)[0])
    off = np.linalg.norm(given - character.surface.vertices, axis=1)
    assert off.mean() < 3e-4
    moved = change.follow(walk)
    off = np.stack(
        [
            np.linalg.norm(deform(change.character, new) - deform(character, old), axis=1)
            for new, old in zip(moved, walk, strict=True)
        ]
    )
    exact = (
        change.spec.name == "unreal"
    )  # The only rig with all of Anny's spine. The others distribute its bend over three bones.
    assert off.mean() < (5e-4 if exact else 3e-3)
    assert np.percentile(off, 95) < (2.5e-3 if exact else 5e-3)
    np.testing.assert_allclose(change.character.weights.sum(1), 1, atol=1e-5)


def test_only_the_hips_are_carried(change: RigChange, walk: np.ndarray) -> None:
    moved, body = change.follow(walk), change.character.body
    first = int(bool(change.spec.root))
    for bone, parent in enumerate(body.bone_parents.tolist()):
        if parent >= first:
            lengths = np.linalg.norm(moved[:, bone, :3, 3] - moved[:, parent, :3, 3], axis=-1)
            assert float(np.ptp(lengths)) < 1e-5


def test_a_mixamo_bvh_shows_the_motion_by_names_alone(
    character: Character, walk: np.ndarray, tmp_path: Path
) -> None:
    """Put the file's local rotations and the place of the hips on bones of the same names.

    Engines do this.
    """
    person, clips = prepare_rig(character, {"walk": (walk, 20.0)}, rig="mixamo")
    write_rig_bvh(tmp_path / "walk.bvh", person.body, *clips["walk"])
    bvh, body = Bvh(tmp_path / "walk.bvh"), person.body
    assert sorted(bvh.names) == sorted(body.bone_names)
    assert {name for name, channels in bvh.channels.items() if len(channels) == 6} == {
        "mixamorig:Hips"
    }
    local, place = bvh.rotations(), bvh.positions("mixamorig:Hips") / 100
    rest = body.rest_transforms.astype(np.float64)
    turns, heads = {}, {}
    for bone, parent in enumerate(body.bone_parents.tolist()):
        turns[bone] = (
            local[body.bone_names[bone]]
            if parent < 0
            else turns[parent] @ local[body.bone_names[bone]]
        )
        heads[bone] = (
            place
            if parent < 0
            else heads[parent] + turns[parent] @ (rest[bone, :3, 3] - rest[parent, :3, 3])
        )
    own = character.body.bone_names
    for theirs, ours in (
        ("LeftHand", "wrist.L"),
        ("RightHand", "wrist.R"),
        ("LeftFoot", "foot.L"),
        ("RightFoot", "foot.R"),
        ("Head", "head"),
    ):
        got = heads[body.bone_names.index(f"mixamorig:{theirs}")]
        off = np.linalg.norm(got - walk[:, own.index(ours), :3, 3], axis=-1)
        assert off.max() < 0.02, (theirs, off.max())


def test_our_own_reader_takes_the_bvh(
    character: Character, walk: np.ndarray, tmp_path: Path
) -> None:
    for rig in OTHERS:
        person, clips = prepare_rig(character, {"walk": (walk, 20.0)}, rig=rig)
        write_rig_bvh(tmp_path / f"{rig}.bvh", person.body, *clips["walk"])
        again = retarget(read_motion(tmp_path / f"{rig}.bvh"), character.body)
        assert again.shape == walk.shape


@pytest.mark.parametrize("rig", ["anny", "mixamo", "unreal"])
def test_root_motion_carries_travel_and_heading(
    character: Character, walk: np.ndarray, rig: str
) -> None:
    plain, moves = prepare_rig(character, {"walk": (walk, 20.0)}, rig=rig)
    person, rooted = prepare_rig(character, {"walk": (walk, 20.0)}, rig=rig, root_motion=True)
    transforms = rooted["walk"][0]
    assert person.body.bone_parents.tolist()[0] == -1
    np.testing.assert_allclose(transforms[:, 0, 1, 3], 0)  # on the ground
    np.testing.assert_allclose(
        transforms[:, 0, :3, 1], np.tile([0, 1, 0], (len(walk), 1)), atol=1e-12
    )
    hips = transforms[:, 1, :3, 3] - transforms[:, 0, :3, 3]
    assert float(np.linalg.norm(hips[:, [0, 2]], axis=1).max()) < 0.15
    assert float(transforms[-1, 0, 2, 3] - transforms[0, 0, 2, 3]) > 0.5
    same = transforms[:, -len(plain.body.bone_names) + 1 :] - moves["walk"][0][:, 1:]
    assert np.abs(same).max() < 1e-9  # visible vertices do not move
    np.testing.assert_allclose(
        deform(person, transforms[7]), deform(plain, moves["walk"][0][7]), atol=1e-5
    )


def test_in_place_goes_nowhere(character: Character, walk: np.ndarray) -> None:
    hips = put_rig_in_place(walk, character.body, 20.0)[:, 0, :3, 3]
    assert float(np.ptp(hips[:, 2])) < 0.2 < float(np.ptp(walk[:, 0, 2, 3]))


def test_unknown_rigs_are_refused() -> None:
    with pytest.raises(InputError, match="choose from anny, mixamo"):
        load_rig("biped")
