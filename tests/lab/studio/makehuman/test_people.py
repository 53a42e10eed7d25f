"""People in MakeHuman's real assets: their rig, their splits, and photographs of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from a2v.errors import InputError
from a2v.geometry.rays import RayScene
from a2v.lab.studio.makehuman.dressing import Dresser, filled_texture, tinted
from a2v.lab.studio.makehuman.hm08 import (
    RIG_BONES,
    RIG_PARENTS,
    load_base,
    rig_bone,
    shape_body,
    sparse_weights,
)
from a2v.lab.studio.makehuman.named import NAMED_PEOPLE, named_person
from a2v.lab.studio.makehuman.people import ARCHIVE, HELD_OUT, draw_person
from a2v.lab.studio.posing import POSED_BONES, PoseLibrary
from a2v.lab.studio.scene import Dressed
from a2v.lab.studio.settings import StudioSettings
from a2v.lab.studio.studio import Studio


@pytest.fixture(scope="module")
def dresser(data_dir: Path) -> Dresser:
    if not (data_dir / ARCHIVE).is_file():
        pytest.skip(f"real data not present: {data_dir / ARCHIVE} does not exist")
    return Dresser(data_dir, 0)


@pytest.fixture(scope="module")
def dressed(dresser: Dresser) -> Dressed:
    return dresser.dressed("training", 5)  # short trousers, bare arms


@pytest.fixture(scope="module")
def studio(dresser: Dresser, data_dir: Path) -> Studio:
    library = PoseLibrary(
        bones=POSED_BONES,
        rotations=np.zeros((1, len(POSED_BONES), 3), np.float32),
        actions=("still",),
    )
    return Studio(
        data_dir / "avatars",
        library,
        {},
        StudioSettings(people="makehuman", actions=0.9, points=2000, surface_points=1500),
        dresser,
    )


def test_the_rig_is_the_avatars() -> None:
    assert set(POSED_BONES) <= set(RIG_BONES)
    assert all(parent < index for index, parent in enumerate(RIG_PARENTS))
    assert {rig_bone(bone) for bone in load_base().model.bone_names} <= set(RIG_BONES)
    weights = load_base().weights
    assert ((weights > 0).sum(axis=1) <= 4).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    chosen, bones = sparse_weights(weights)
    np.testing.assert_allclose(np.take_along_axis(weights, bones, axis=1), chosen, atol=1e-6)


@pytest.mark.parametrize("shape", [{}, {"age": 0.4, "weight": 0.9}, {"gender": 0.0, "height": 0.7}])
def test_the_t_pose_comes_back_to_where_clothes_were_laid_on(shape: dict[str, float]) -> None:
    body, base = shape_body(shape), load_base()
    rest = body.to_t_pose(body.base, base.weights)
    back = np.einsum("vb,bij,vj->vi", base.weights, body.lower, np.c_[rest, np.ones(len(rest))])[
        :, :3
    ]
    np.testing.assert_allclose(back, body.base, atol=1e-9)
    number = {name: index for index, name in enumerate(RIG_BONES)}
    for side, sign in (("Left", 1), ("Right", -1)):
        shoulder, elbow, wrist = (
            body.heads[number[f"{side}{bone}"]] for bone in ("Arm", "ForeArm", "Hand")
        )
        for along in (elbow - shoulder, wrist - elbow):
            np.testing.assert_allclose(along / np.linalg.norm(along), [sign, 0, 0], atol=1e-6)
        thigh = body.heads[number[f"{side}Leg"]] - body.heads[number[f"{side}UpLeg"]]
        assert abs(thigh[0]) < 1e-6
        assert thigh[1] < -0.2
    assert np.ptp(rest[:, 0]) > 0.85 * np.ptp(rest[:, 1])  # as wide as tall, nearly


def test_nobody_of_the_validation_split_wears_what_training_shows(dresser: Dresser) -> None:
    people = {
        split: [draw_person(dresser.wardrobes, split, number, 0) for number in range(60)]
        for split in ("training", "validation")
    }
    worn = {
        split: {
            kind: {getattr(one, name) for one in all_} - {""}
            for kind, name in (("skins", "skin"), ("clothes", "outfit"), ("hair", "hair"))
        }
        for split, all_ in people.items()
    }
    for kind, held in HELD_OUT.items():
        assert len(held) == 3
        assert worn["validation"][kind] <= set(held)
        assert not worn["training"][kind] & set(held)
        assert len(worn["training"][kind]) > 3
    assert people["training"] == [
        draw_person(dresser.wardrobes, "training", number, 0) for number in range(60)
    ]
    assert people["training"] != [
        draw_person(dresser.wardrobes, "training", number, 1) for number in range(60)
    ]
    ages = [one.shape["age"] for one in people["training"]]
    assert min(ages) < 0.5 < 0.9 < max(ages)
    assert len({one.name for one in people["training"]}) == 60


def test_people_with_a_name_wear_what_training_never_shows(dresser: Dresser) -> None:
    people = [named_person(name) for name in NAMED_PEOPLE]
    for kind, worn in (("skins", "skin"), ("clothes", "outfit"), ("hair", "hair")):
        shown = {getattr(one, worn) for one in people}
        assert shown == set(HELD_OUT[kind])
        assert not shown & set(dresser.wardrobes.names(kind, "training"))
    assert {one.shoes for one in people} == set(dresser.wardrobes.names("shoes", "training"))
    for panel in {
        name.partition("-")[0] for name in NAMED_PEOPLE
    }:  # two panels may show one body in other clothes
        own = [named_person(name) for name in NAMED_PEOPLE if name.startswith(f"{panel}-")]
        assert (
            len({one.name for one in own})
            == len({tuple(one.shape.items()) for one in own})
            == len(own)
        )
    for one in people:
        assert (one.shape["age"] > 0.88) == one.skin.startswith("old")
        assert (one.shape["gender"] > 0.5) == one.outfit.startswith("female")
    with pytest.raises(InputError, match="none of MakeHuman's people has the name 'makehuman-99'"):
        named_person("makehuman-99")


def test_a_pinned_person_is_the_same_whatever_else_is_there(
    studio: Studio, data_dir: Path, tmp_path: Path
) -> None:
    """Avatars, settings and other draws do not change the person of a pin."""
    (tmp_path / "avatars").mkdir()
    (tmp_path / "avatars" / "Asian_F_2_Busi.glb").touch()
    (tmp_path / ARCHIVE).symlink_to(data_dir / ARCHIVE)
    alone = Studio(
        tmp_path / "avatars", studio.library, {}, StudioSettings(points=2000), data=tmp_path
    )
    among = Studio(
        data_dir / "avatars",
        studio.library,
        {},
        StudioSettings(points=2000, people="both"),
        Dresser(data_dir, 0),
        data_dir,
    )
    first, second = (
        made.scene("validation", 30021, avatar="makehuman-1", stance="kick")
        for made in (alone, among)
    )
    assert first.avatar == second.avatar == "MakeHuman_F_1_elegantsuit01"
    assert first.pose == "kick"
    assert np.array_equal(first.surface.vertices, second.surface.vertices)
    assert np.array_equal(first.surface.texture, second.surface.texture)
    # what these numbers gave when the photos were pinned
    wide, tall, _ = np.ptp(first.surface.vertices, axis=0)
    assert (first.yaw, float(wide / tall)) == pytest.approx((31.750762, 0.682095), abs=1e-4)
    with pytest.raises(InputError, match="give the folder that holds their archive"):
        Studio(tmp_path / "avatars", studio.library, {}, StudioSettings()).scene(
            "validation", 1, avatar="makehuman-1"
        )


def test_skin_goes_under_the_clothes_and_no_farther(dressed: Dressed) -> None:
    avatar = dressed.prepared.avatar
    kinds = [name.split()[0] for name in avatar.mesh_names]
    assert {"skin", "cloth", "shoes"} <= set(kinds)
    skin = avatar.faces[avatar.mesh_ids == kinds.index("skin")]
    assert 0.3 < len(skin) / len(load_base().skin) < 0.95
    person = avatar.skin(avatar.rest_transforms)
    # clothes lie on the body that is below them
    cloth = person[np.unique(avatar.faces[avatar.mesh_ids == kinds.index("cloth")])]
    guide = dressed.guide
    away = RayScene(guide.vertices, guide.faces).closest(cloth).distance
    assert np.quantile(away, 0.95) < 0.06
    # and the skin that is seen is the guide's
    assert (
        RayScene(guide.vertices, guide.faces).closest(person[np.unique(skin)]).distance.max() < 0.02
    )
    # Covered skin is not visible through clothes: of rays from the front at the guide's trunk few
    # end on skin.
    rows = np.linspace(0.95, 1.2, 20) * (guide.vertices[:, 1].max() / 1.7)
    origins = (
        np.stack(np.meshgrid(np.linspace(-0.06, 0.06, 9), rows, [1.0]), axis=-1)
        .reshape(-1, 3)
        .astype(np.float32)
    )
    met = RayScene(person, avatar.faces).cast(origins, np.array([0, 0, -1], np.float32))
    assert met.hit.all()
    assert (avatar.mesh_ids[met.face] == kinds.index("skin")).mean() < 0.05


def test_garments_alone_take_other_colors(dressed: Dressed) -> None:
    avatar, clothes = dressed.prepared.avatar, dressed.prepared.clothes
    tile = avatar.texture.shape[1] // len(avatar.mesh_names)
    assert clothes.columns.min() > 0.5 * tile  # the skin's texture is the first one
    skin = avatar.uv[avatar.mesh_ids == 0]
    assert clothes.columns.min() >= np.floor(skin[..., 0].max() * avatar.texture.shape[1])
    assert set(np.unique(clothes.region)) <= {0, 1, 2}
    assert len(np.unique(clothes.region)) > 1


def test_hair_is_tinted_and_clear_texels_are_filled() -> None:
    texture = np.zeros((4, 4, 4), np.uint8)
    texture[:, :2] = (90, 100, 110, 255)
    assert (filled_texture(texture) == [90, 100, 110]).all()
    strands = np.tile(np.array([[60], [180]], np.uint8)[:, None], (1, 4, 3))
    brown = tinted(strands, (100.0, 60.0, 30.0)).astype(int)
    assert (brown[1] > brown[0]).all()
    assert (brown[..., 0] > brown[..., 2]).all()


def test_a_view_of_them_agrees_with_itself(studio: Studio) -> None:
    scene = studio.scene("training", 0)
    assert scene.pose not in ("natural", "open", "still")  # out of all frames, not of the library
    view = studio.view("training", 0, scene)
    assert studio.avatar_of("training", 0) == view.avatar == scene.avatar
    assert view.avatar.startswith("MakeHuman_")
    assert 0.25 < (view.distance < 0).mean() < 0.5
    assert np.abs(scene.solid().signed_distance(view.surface_points)).max() < 1e-4
    inside = np.isfinite(view.depth_front)
    assert (inside == (view.mask[::2, ::2] > 127)).mean() > 0.99
    marks = scene.landmarks[[11, 12, 23, 24, 25, 26]]  # shoulders, hips, knees
    assert (scene.solid().signed_distance(marks) < 0).all()
    again = studio.scene("training", 0)
    assert np.array_equal(again.surface.vertices, scene.surface.vertices)
    assert studio.scene("training", 1).avatar == scene.avatar
    assert studio.scene("training", 4).avatar != scene.avatar


def test_both_sources_take_turns(dresser: Dresser, data_dir: Path) -> None:
    both = Studio(data_dir / "avatars", None, {}, StudioSettings(people="both"), dresser)  # type: ignore[arg-type]
    made = [both.avatar_of("training", 4 * block).startswith("MakeHuman_") for block in range(6)]
    assert made == [False, True] * 3
    with pytest.raises(InputError, match="people is 'dolls'; choose from avatars, makehuman, both"):
        StudioSettings(people="dolls")


def test_every_frame_can_be_drawn(dresser: Dresser, dressed: Dressed) -> None:
    assert dresser.frames.count > 100_000
    generator = np.random.default_rng(3)
    drawn = [dresser.frames.draw(dressed.prepared.avatar, generator) for _ in range(4)]
    assert len({name for _, name in drawn}) > 1
    for pose, _ in drawn:
        assert set(POSED_BONES) <= set(pose)
        assert np.isfinite(np.concatenate(list(pose.values()))).all()
