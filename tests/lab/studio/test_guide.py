"""The guide body is bound to the rig and has errors like fits."""

from __future__ import annotations

import dataclasses

import numpy as np

from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.guide import Guide
from a2v.lab.studio.guide_errors import GuideErrors, disturb
from a2v.lab.studio.posing import natural_pose
from a2v.lab.studio.variation import Build, rebuild

EXACT = GuideErrors(**{item.name: 0.0 for item in dataclasses.fields(GuideErrors)})


def test_guide_follows_the_avatar(avatar: Avatar, guide: Guide) -> None:
    from a2v.geometry.rays import RayScene

    gap = (
        RayScene(avatar.skin(avatar.rest_transforms), avatar.faces).closest(guide.vertices).distance
    )
    assert np.median(gap) < 0.012
    pose = natural_pose(np.random.default_rng(4))
    build = Build(height=1.05, girth={"thigh": 1.1})
    built = rebuild(avatar, build)
    transforms = built.bone_transforms(pose)
    posed = guide.posed(avatar, build, transforms)
    person = built.skin(transforms)
    gap = RayScene(person, avatar.faces).closest(posed).distance
    assert np.median(gap) < 0.013  # scaled, bent and thickened alike
    assert np.allclose(
        disturb(built, transforms, np.array([0, 0, 1.0]), EXACT, np.random.default_rng(0)),
        transforms,
        atol=1e-6,
    )


def test_fits_err_in_depth_more_than_in_the_photo(avatar: Avatar) -> None:
    generator, view = np.random.default_rng(0), np.array([0, 0.1, 0.995])
    view = view / np.linalg.norm(view)
    wrists = [avatar.bone_names.index(f"{side}Hand") for side in ("Left", "Right")]
    shifts = []
    for _ in range(60):
        true = avatar.bone_transforms(natural_pose(generator))
        wrong = disturb(avatar, true, view, GuideErrors(), generator)
        assert np.allclose(np.linalg.det(wrong[:, :3, :3]), 1)
        bones = np.linalg.norm(wrong[1:, :3, 3] - wrong[avatar.bone_parents[1:], :3, 3], axis=1)
        assert np.allclose(
            bones,
            np.linalg.norm(true[1:, :3, 3] - true[avatar.bone_parents[1:], :3, 3], axis=1),
            atol=1e-5,
        )
        shifts.append((wrong - true)[wrists, :3, 3])
    shift = np.concatenate(shifts)
    depth = shift @ view
    beside = np.linalg.norm(shift - depth[:, None] * view, axis=1)
    assert 0.04 < depth.std() < 0.16
    assert np.sqrt((beside**2).mean() / 2) < 0.5 * depth.std()
