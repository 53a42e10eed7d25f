"""Flanks beside hanging arms: which pixels do not show the trunk."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from a2v.body.parts import PARTS
from a2v.reconstruction.flanks import flanks_beside_arms, only_touching, strange_rim

SCALE = 100.0  # pixels per meter


def test_an_arm_grows_out_of_the_trunk_at_the_shoulder_and_only_touches_it_below() -> None:
    """In the picture the arm lies beside the trunk from top to bottom; at rest it is lifted, so
    that they part from the shoulder on."""
    vertex = np.arange(60 * 40).reshape(60, 40)
    row, column = np.divmod(np.arange(60 * 40), 40)
    trunk, arm = np.zeros((60, 40), bool), np.zeros((60, 40), bool)
    trunk[:, :20], arm[:, 20:] = True, True
    rest = np.stack([column / SCALE, row / SCALE, np.zeros(len(row))], axis=1)
    rest[arm.ravel(), 0] += row[arm.ravel()] / SCALE
    found = only_touching(vertex, trunk, arm, rest, SCALE)
    assert not found[:9].any()  # less than 10 cm apart at rest
    assert found[12:, 20].all()
    assert not found[:, 24:].any()  # not beside the trunk
    assert not found[trunk].any()
    turned = only_touching(vertex, arm, trunk, rest, SCALE)
    assert turned[12:, 19].all()
    assert not turned[arm].any()
    assert not only_touching(vertex, trunk, np.zeros_like(arm), rest, SCALE).any()


def test_a_color_that_the_trunk_has_nowhere_at_that_height_is_strange() -> None:
    lab = np.full((120, 60, 3), [70.0, 0.0, 0.0])
    trunk, arms = np.zeros((120, 60), bool), np.zeros((120, 60), bool)
    trunk[:, 4:40], arms[:, 40:] = True, True
    lab[:, 38:40] = [25.0, 0.0, 0.0]  # shade in front of the arm
    lab[:, 4:6] = [25.0, 0.0, 0.0]  # the same far from the arm
    assert (strange_rim(lab, trunk, arms, SCALE) == (trunk & (np.arange(60) >= 38))).all()
    lab[100:, 10:30] = [25.0, 0.0, 0.0]  # a dark band around the hips
    found = strange_rim(lab, trunk, arms, SCALE)
    assert found[:86, 38:40].all()
    assert not found[95:].any()
    assert not strange_rim(lab, trunk, np.zeros_like(arms), SCALE).any()


def test_trunk_and_upper_arm_have_a_border_where_they_only_touch() -> None:
    vertex = np.arange(30 * 40).reshape(30, 40)
    torso, arm = PARTS.index("torso"), PARTS.index("left_upper_arm")
    shown = np.where(np.arange(40) < 20, torso, arm) * np.ones((30, 1), int)
    rest = np.zeros((vertex.size, 3))
    rest[(shown == arm).ravel(), 0] = 0.5
    surface = SimpleNamespace(standing=SimpleNamespace(vertices=rest))
    none, even = np.zeros(vertex.size, bool), np.zeros((30, 40, 3))
    found = flanks_beside_arms(surface, vertex, shown, none, even, SCALE)  # type: ignore[arg-type]
    assert found[torso][:, 20].all()
    assert found[arm][:, 19].all()
    assert PARTS.index("left_lower_arm") not in found
    skirt = (shown == arm).ravel()  # a layer of cloth grows out of nothing
    layered = flanks_beside_arms(surface, vertex, shown, skirt, even, SCALE)  # type: ignore[arg-type]
    assert not layered[torso].any()
    fused = SimpleNamespace(standing=None)
    assert not flanks_beside_arms(fused, vertex, shown, none, even, SCALE)  # type: ignore[arg-type]
