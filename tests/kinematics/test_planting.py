"""Feet in contact do not slide."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from a2v.kinematics import CMU, bone_lengths
from a2v.kinematics.even_paths import evened
from a2v.kinematics.foot_contacts import PLANT, contacts
from a2v.kinematics.limbs import legs_of
from a2v.kinematics.planting import plant_feet
from a2v.types import FloatArray

FPS = 30.0
TOES = [leg[3] for leg in legs_of(CMU)]


def walker(*, slide: float = 0.0, seconds: float = 4.0, apart: float = 0.0) -> FloatArray:
    """A walk (T, J, 3) along +z at 1.2 m/s with sliding feet.

    Standing feet slide by `slide` m/s. The left toe stands `apart` meters above the floor of the
    right one.
    """
    clock = np.arange(round(seconds * FPS)) / FPS
    joints = np.zeros((len(clock), CMU.n_joints, 3))
    root = np.stack([0 * clock, 0.88 + 0 * clock, 1.2 * clock], axis=-1)
    for joint, name in enumerate(CMU.joint_names):
        side = 0.1 if name.startswith("left") else -0.1 if name.startswith("right") else 0.0
        joints[:, joint] = root + np.array(
            [side, 0.0 if "hip" in name or name == "pelvis" else 0.4, 0]
        )
    for (hip, knee, ankle, toe), begin, up in zip(
        legs_of(CMU), (0.0, 0.5), (apart, 0.0), strict=True
    ):
        phase = np.mod(clock + begin, 1.0)  # stands for .6 s, swings for .4
        step = np.floor(clock + begin)
        swing = np.clip((phase - 0.6) / 0.4, 0, 1)
        place = (
            1.2 * (step - begin + 0.3)
            + slide * (np.minimum(phase, 0.6) - 0.3)
            + (1.2 - 0.0 * slide) * (swing * swing * (3 - 2 * swing))
        )
        place += slide * swing * (-0.6)
        rise = 0.12 * np.sin(np.pi * swing)
        joints[:, toe] = np.stack([joints[:, hip, 0], up + rise, place + 0.12], axis=-1)
        joints[:, ankle] = np.stack([joints[:, hip, 0], 0.09 + rise, place], axis=-1)
        way = joints[:, ankle] - joints[:, hip]
        length = np.linalg.norm(way, axis=-1, keepdims=True)
        out = np.sqrt(np.maximum(0.46**2 - (length / 2) ** 2, 0))
        ahead = np.cross(np.array([1.0, 0, 0]), way / length)
        joints[:, knee] = joints[:, hip] + way / 2 + out * ahead * np.sign(ahead[:, 2:])
    return joints


def sliding(joints: FloatArray) -> FloatArray:
    """Speeds of toes within 3 cm of their own lowest level."""
    found = []
    for toe in TOES:
        place = joints[:, toe]
        down = place[:, 1] - np.quantile(place[:, 1], 0.05) < 0.03
        found.append(np.linalg.norm(np.gradient(place[:, [0, 2]], axis=0), axis=-1)[down] * FPS)
    return np.concatenate(found)


@pytest.mark.parametrize("slide", [0.3, -0.3])
def test_feet_that_slide_stand(slide: float) -> None:
    joints = walker(slide=slide)
    assert np.median(sliding(joints)) > 0.2
    planted = plant_feet(joints, CMU, FPS)
    assert np.median(sliding(planted)) < 0.03
    np.testing.assert_allclose(bone_lengths(planted, CMU), bone_lengths(joints, CMU), atol=1e-4)
    # without a jerk: no joint of a leg accelerates more than before
    legs = [joint for leg in legs_of(CMU) for joint in leg[1:]]
    jolt = [
        np.linalg.norm(np.diff(clip[:, legs], 2, axis=0), axis=-1).max() * FPS**2
        for clip in (joints, planted)
    ]
    assert jolt[1] < max(1.5 * jolt[0], 100)


def test_a_foot_stands_by_its_own_floor() -> None:
    joints = walker(apart=0.02)
    feet = np.stack([joints[None][:, :, [leg[2], leg[3]]] for leg in legs_of(CMU)])
    stands, _, floor = contacts(feet, joints[None][:, :, 0], FPS)
    np.testing.assert_allclose(floor[:, 0, 0, 1], [0.02, 0.0], atol=2e-3)
    shares = stands[:, 0].mean(axis=-1)
    assert abs(shares[0] - shares[1]) < 0.05
    assert 0.5 < shares[0] < 0.8


def test_even_paths_keep_what_is_slow_and_lose_what_shakes() -> None:
    t = np.arange(60)
    parabola = np.stack([0.3 * t, 0.01 * t**2, np.ones(60)], axis=-1)
    np.testing.assert_allclose(evened(parabola, 1.0), parabola, atol=1e-6)
    slow, quick = (np.sin(2 * np.pi * t / period)[:, None] for period in (30, 4))
    assert np.abs(evened(slow, 1.0) - slow).max() < 0.03
    assert np.abs(evened(quick, 1.0)[5:-5]).max() < 0.6 * np.abs(quick).max()
    both = np.stack([slow, quick])
    np.testing.assert_allclose(evened(both, 1.0)[1], evened(quick, 1.0), atol=1e-12)
    assert evened(slow[:3], 1.0).shape == (3, 1)


def test_what_stands_already_stays() -> None:
    joints = walker()
    planted = plant_feet(joints, CMU, FPS)
    assert np.abs(planted[..., [0, 2]] - joints[..., [0, 2]])[:, TOES].max() < 0.03
    assert abs(planted[-1, 0, 2] - joints[-1, 0, 2]) < 0.05


def test_the_path_is_kept_where_it_is_asked_for() -> None:
    joints = walker(slide=0.3)
    stays = np.zeros(len(joints))
    stays[40:44] = 1
    planted = plant_feet(
        joints, CMU, FPS, settings=dataclasses.replace(PLANT, carry=0.0), stays=stays
    )
    np.testing.assert_allclose(planted[:, 0, [0, 2]], joints[:, 0, [0, 2]], atol=1e-5)
    np.testing.assert_allclose(planted[40:44], joints[40:44], atol=2e-2)


def test_clips_of_a_batch_are_planted_each_by_itself() -> None:
    clips = np.stack([walker(slide=0.3), walker(slide=-0.2)])
    both = plant_feet(clips, CMU, FPS)
    for made, clip in zip(both, clips, strict=True):
        np.testing.assert_allclose(made, plant_feet(clip, CMU, FPS), atol=1e-6)


def test_a_leap_stays_a_leap_and_somebody_who_hangs_is_not_put_down() -> None:
    joints = walker(seconds=3.0)
    clock = np.arange(len(joints)) / FPS
    leap = 0.5 * np.maximum(0, 1 - ((clock - 1.5) / 0.3) ** 2)
    joints[..., 1] += leap[:, None]
    planted = plant_feet(joints, CMU, FPS)
    assert (planted[..., 1].min(axis=-1) - joints[..., 1].min(axis=-1))[leap > 0.3].min() > -0.06
