"""A body in the frame of the photo's orthographic camera, if the photo's own camera is a
perspective one."""

from __future__ import annotations

import dataclasses

from a2v.types import Body, Camera


def flattened(body: Body, camera: Camera) -> Body:
    """The body in the frame of ``camera.flat``: skin and joints are moved (`PhotoCamera.flatten`),
    bones keep their directions.

    Stages that use ``camera.flat`` compare with this body. It cannot be posed.
    """
    transforms = body.bone_transforms.copy()
    transforms[:, :3, 3] = camera.flatten(transforms[:, :3, 3])
    return dataclasses.replace(
        body,
        vertices=camera.flatten(body.vertices),
        bone_transforms=transforms,
        bone_tails=camera.flatten(body.bone_tails),
    )
