"""Labels of the faces of an avatar."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import PARTS
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.scene import sort_faces


def test_the_mouth_is_no_surface(avatar: Avatar) -> None:
    kinds = sort_faces(avatar)
    assert kinds.shell.sum() == (avatar.mesh_ids == avatar.mesh_names.index("h_wig")).sum()
    assert 0.6 < kinds.outer.mean() < 1
    rest = avatar.skin(avatar.rest_transforms)
    middle = rest[avatar.faces].mean(axis=1)
    head = (avatar.parts[avatar.faces[:, 0]] == PARTS.index("head")) & (avatar.mesh_ids == 0)
    lips = middle[
        head & (np.abs(middle[:, 0]) < 0.01) & (middle[:, 1] > 1.5) & (middle[:, 1] < 1.54)
    ][:, 2].max()
    pocket = head & (np.abs(middle - np.array([0, 1.52, lips - 0.035])) < [0.02, 0.02, 0.015]).all(
        axis=1
    )
    assert pocket.sum() > 50
    assert kinds.outer[pocket].mean() < 0.1
    assert kinds.wall[pocket].mean() < 0.2
