"""Held things lie in hands, and furniture is where it occludes or supports people."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from a2v.body.parts import PARTS
from a2v.errors import InputError
from a2v.geometry.rays import RayScene
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.posing import natural_pose
from a2v.lab.studio.stances import draw_stance
from a2v.lab.studio.things.backgrounds import WHEEL, Backgrounds
from a2v.lab.studio.things.furniture import Body, draw_furniture
from a2v.lab.studio.things.held import KINDS, Held, draw_held


def held_things(count: int) -> list[Held]:
    generator = np.random.default_rng(1)
    return [draw_held(generator) for _ in range(count)]


def test_every_kind_is_drawn() -> None:
    assert {held.kind for held in held_things(150)} == set(KINDS)
    assert {side for held in held_things(150) for side in held.things} == {"Left", "Right", "Both"}


@pytest.mark.parametrize("number", range(0, 40))
def test_things_are_in_the_hands(avatar: Avatar, number: int) -> None:
    """A hand's vertices touch what it holds; the other hand usually does not touch it."""
    held = held_things(40)[number]
    pose = natural_pose(np.random.default_rng(number)) | held.pose
    transforms = avatar.bone_transforms(pose)
    person, thing = avatar.skin(transforms), held.placed(avatar, transforms)
    rays = RayScene(thing.vertices, thing.faces)
    hands = {
        side: person[avatar.parts == PARTS.index(f"{side.lower()}_hand")]
        for side in ("Left", "Right")
    }
    for side in held.things if "Both" not in held.things else hands:
        away = rays.closest(hands[side].astype(np.float32)).distance
        assert away.min() < 0.012
        assert np.median(away) < 0.06
    if held.kind in ("box", "large ball"):  # between the palms
        x = np.sort([hands[side][:, 0].mean() for side in hands])
        assert x[0] - 0.05 < thing.vertices[:, 0].mean() < x[1] + 0.05
    if held.hangs:
        assert thing.vertices[:, 1].mean() < min(
            hand[:, 1].min() for side, hand in hands.items() if side in held.things
        )


def test_fingers_close_around_thin_things(avatar: Avatar) -> None:
    generator = np.random.default_rng(0)
    held = next(made for made in iter(lambda: draw_held(generator), None) if made.kind == "stick")
    (side,) = held.things
    rest = {name: np.zeros(3) for name in held.pose}
    knuckle, tip = (avatar.bone_names.index(f"{side}Hand{bone}") for bone in ("Middle1", "Middle3"))
    reach = []
    for pose in (rest, held.pose):
        transforms = avatar.bone_transforms(pose)
        wrist = transforms[avatar.bone_names.index(f"{side}Hand"), :3, 3]
        reach.append([np.linalg.norm(transforms[bone, :3, 3] - wrist) for bone in (knuckle, tip)])
    assert reach[1][0] == pytest.approx(reach[0][0], rel=1e-4)
    assert reach[1][1] < 0.85 * reach[0][1]


def body_in(avatar: Avatar, stance: str, seed: int) -> Body:
    transforms = avatar.bone_transforms(draw_stance(stance, np.random.default_rng(seed))[0])
    person = avatar.skin(transforms)
    transforms[:, 1, 3] -= person[:, 1].min()
    return Body.of(avatar, transforms, person - np.array([0, person[:, 1].min(), 0], np.float32))


@pytest.mark.parametrize("seed", range(12))
def test_seats_are_below_who_sits_and_other_furniture_is_on_the_ground(
    avatar: Avatar, seed: int
) -> None:
    sitting, standing = body_in(avatar, "sit", seed), body_in(avatar, "standing", seed)
    assert sitting.hips[1] < 0.42 * sitting.height < standing.hips[1]
    for body in (sitting, standing):
        generator = np.random.default_rng(seed)
        for _ in range(6):
            low = draw_furniture(body, generator).vertices[:, 1].min()
            assert -1e-6 < low < 0.5 * body.height  # railings have no foot
    below = 0
    generator = np.random.default_rng(seed)
    for _ in range(12):
        thing = draw_furniture(sitting, generator)
        under = RayScene(thing.vertices, thing.faces).cast(
            sitting.hips[None].astype(np.float32), np.array([0, -1, 0], np.float32)
        )
        below += bool(under.hit[0] and 0.03 < under.distance[0] < 0.25)
    assert below >= 5


def test_backgrounds_are_the_wheels_and_a_folders(tmp_path: Path) -> None:
    wheel = Backgrounds()
    assert {path.name for path in wheel.paths} == set(WHEEL)
    generator = np.random.default_rng(0)
    drawn = [wheel.draw(64, generator) for _ in range(6)]
    assert {one.shape for one in drawn} == {(64, 64, 3)}
    assert all(one.min() >= 0 and one.std() > 0.001 for one in drawn)
    again = wheel.draw(64, np.random.default_rng(0))
    assert np.array_equal(again, drawn[0])
    with pytest.raises(InputError, match="no picture"):
        Backgrounds(tmp_path)
    (tmp_path / "below").mkdir()
    cv2.imwrite(str(tmp_path / "below" / "red.png"), np.full((40, 90, 3), (0, 0, 250), np.uint8))
    (tmp_path / "broken.jpg").write_bytes(b"no picture")
    mine = Backgrounds(tmp_path)
    assert len(mine.paths) == len(WHEEL) + 2
    mine.paths = mine.paths[-2:-1]
    red = mine.draw(64, generator)
    assert red[..., 0].mean() > 5 * red[..., 2].mean()
    mine.paths = [tmp_path / "broken.jpg"]
    with pytest.raises(InputError, match=r"broken\.jpg is not a picture"):
        mine.draw(64, generator)
