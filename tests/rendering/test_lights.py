"""Sun and spot light as disks."""

from __future__ import annotations

import numpy as np
import pytest

from a2v.rendering.lights import AIM, SUN_DISTANCE, DiskLight
from a2v.rendering.scene import LookSettings

SCENE = LookSettings(sun_direction=(0.3, 1.0, -0.2), spot_position=(1.0, 3.0, 2.0))


def lights() -> list[DiskLight]:
    return [SCENE.sun_light, SCENE.spot_light((2.0, 1.4, -3.0))]


@pytest.mark.parametrize("light", lights(), ids=["sun", "spot"])
def test_the_disk_is_a_rotation_times_its_radius(light: DiskLight) -> None:
    turn = light.matrix[:3, :3] / light.radius
    assert np.allclose(turn.T @ turn, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1)
    assert np.allclose(turn[:, 2], light.normal)


def test_the_spot_light_follows_the_place_on_the_ground_and_aims_at_the_person() -> None:
    light = SCENE.spot_light((2.0, 1.4, -3.0))
    assert light.center == pytest.approx([3.0, 3.0, -1.0])
    aim = np.array([2.0, 0.0, -3.0]) + AIM
    assert light.center + light.normal * light.reach == pytest.approx(aim)


def test_the_sun_shines_from_its_direction() -> None:
    light = SCENE.sun_light
    assert light.center / SUN_DISTANCE == pytest.approx(
        np.array(SCENE.sun_direction) / np.linalg.norm(SCENE.sun_direction)
    )
    assert light.normal == pytest.approx(-light.center / SUN_DISTANCE)


@pytest.mark.parametrize("light", lights(), ids=["sun", "spot"])
def test_irradiance_holds_at_the_reach(light: DiskLight) -> None:
    """The radiance integrated over the disk gives the requested irradiance on a surface that faces
    it."""
    rings = (np.arange(20_000) + 0.5) / 20_000 * light.radius
    square = rings**2 + light.reach**2
    factor = (2 * np.pi * rings * light.reach**2 / square**2).sum() * light.radius / 20_000 / np.pi
    assert light.radiance * factor == pytest.approx(light.irradiance, rel=1e-4)
