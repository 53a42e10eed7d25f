"""Other builds, other clothes."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.body.parts import PARTS
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.variation import Build, Wardrobe, find_clothes, rebuild, recolor, segment_of


def test_builds_scale_segments(avatar: Avatar) -> None:
    assert np.allclose(
        rebuild(avatar, Build()).skin(avatar.rest_transforms),
        avatar.skin(avatar.rest_transforms),
        atol=1e-5,
    )
    tall = rebuild(avatar, Build(height=1.07))
    rest = avatar.skin(avatar.rest_transforms)
    assert np.allclose(tall.skin(tall.rest_transforms), 1.07 * rest, atol=1e-4)
    long = rebuild(avatar, Build(length={"thigh": 1.1}))
    names = list(avatar.bone_names)

    def length(who: Avatar, a: str, b: str) -> float:
        return float(
            np.linalg.norm(
                who.rest_transforms[names.index(a), :3, 3]
                - who.rest_transforms[names.index(b), :3, 3]
            )
        )

    assert length(long, "LeftUpLeg", "LeftLeg") == pytest.approx(
        1.1 * length(avatar, "LeftUpLeg", "LeftLeg"), rel=1e-4
    )
    assert length(long, "LeftLeg", "LeftFoot") == pytest.approx(
        length(avatar, "LeftLeg", "LeftFoot"), rel=1e-4
    )
    thick = rebuild(avatar, Build(girth={"lower_arm": 1.2}))
    assert length(thick, "LeftForeArm", "LeftHand") == pytest.approx(
        length(avatar, "LeftForeArm", "LeftHand"), rel=1e-4
    )
    assert segment_of("LeftHandIndex2") == "hand"
    assert segment_of("Spine1") == "torso"


def test_other_clothes_on_the_same_skin(avatar: Avatar) -> None:
    clothes = find_clothes(avatar)
    worn = np.zeros(avatar.texture.shape[:2], bool)
    worn[clothes.rows, clothes.columns] = True
    head = avatar.parts[avatar.faces[:, 0]] == PARTS.index("head")
    height, width = worn.shape
    corners = avatar.uv[head].mean(axis=1)
    assert (
        worn[((1 - corners[:, 1]) * height).astype(int), (corners[:, 0] * width).astype(int)].mean()
        < 0.02
    )
    body = np.isin(
        avatar.parts[avatar.faces[:, 0]], [PARTS.index("torso"), PARTS.index("left_thigh")]
    )
    corners = avatar.uv[body].mean(axis=1)
    assert (
        worn[((1 - corners[:, 1]) * height).astype(int), (corners[:, 0] * width).astype(int)].mean()
        > 0.8
    )
    changed = [recolor(avatar.texture, clothes, np.random.default_rng(seed)) for seed in range(6)]
    assert all(np.array_equal(texture[~worn], avatar.texture[~worn]) for texture in changed)
    means = np.array([texture[worn].mean(axis=0) for texture in changed])
    assert means.std(axis=0).min() > 10


def test_every_pattern_fits_clothes_without_a_part() -> None:
    """Barefoot in a shirt no texel is a leg's.

    Every pattern is drawn by some seed without error.
    """
    rows, columns = np.divmod(np.arange(400), 20)
    shirt = Wardrobe(
        rows,
        columns,
        np.full((400, 3), 50, np.float32),
        np.ones(400, np.float32),
        np.zeros(400, int),
        np.zeros(400, int),
    )
    texture = np.full((24, 24, 3), 90, np.uint8)
    made = [recolor(texture, shirt, np.random.default_rng(seed)) for seed in range(60)]
    assert len({one.tobytes() for one in made}) > 30
