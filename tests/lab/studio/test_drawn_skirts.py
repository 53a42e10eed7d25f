"""Skirts drawn around the legs of the studio's people."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.body.parts import on_parts
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.drawn_skirts import draw_cloth, draw_skirt, leg_heights, with_skirt


@pytest.mark.parametrize("coat", [False, True])
def test_a_skirt_lies_around_both_legs_and_moves_with_them(avatar: Avatar, coat: bool) -> None:
    generator = np.random.default_rng(3)
    hip, knee, _ = leg_heights(avatar)
    skirt = draw_skirt(avatar, float(knee), generator, coat=coat)
    assert skirt.vertices[:, 1].min() == pytest.approx(knee, abs=0.06)
    assert skirt.vertices[:, 1].max() > hip
    np.testing.assert_allclose(skirt.weights.sum(axis=1), 1.0, atol=1e-5)
    rest = avatar.skin(avatar.rest_transforms)
    thighs = rest[on_parts(avatar.parts, "left_thigh", "right_thigh")]
    assert skirt.vertices[:, 0].max() > thighs[:, 0].max()
    assert skirt.vertices[:, 0].min() < thighs[:, 0].min()
    cloth = draw_cloth(avatar.texture.shape[1], 64, np.array([60.0, 20.0, 10.0]), generator)
    dressed = with_skirt(avatar, avatar.texture, skirt, cloth)
    count = len(avatar.weights)
    lifted = {"LeftUpLeg": np.array([-0.6, 0.0, 0.0])}
    moved = dressed.skin(dressed.bone_transforms(lifted)) - dressed.skin(dressed.rest_transforms)
    np.testing.assert_allclose(
        moved[:count],
        avatar.skin(avatar.bone_transforms(lifted)) - avatar.skin(avatar.rest_transforms),
        atol=1e-5,
    )
    way = np.linalg.norm(moved[count:], axis=1)
    left = dressed.skin(dressed.rest_transforms)[count:, 0] > 0.1
    right = dressed.skin(dressed.rest_transforms)[count:, 0] < -0.1
    assert way[left].mean() > 3 * way[right].mean()


def test_the_old_texture_stays_where_it_was(avatar: Avatar) -> None:
    generator = np.random.default_rng(4)
    skirt = draw_skirt(avatar, float(leg_heights(avatar)[1]), generator, coat=False)
    cloth = draw_cloth(avatar.texture.shape[1], 64, np.array([60.0, 20.0, 10.0]), generator)
    dressed = with_skirt(avatar, avatar.texture, skirt, cloth)
    colors = dressed.vertex_colors()[: len(avatar.weights)]
    assert np.abs(colors - avatar.vertex_colors()).mean() < 0.01
