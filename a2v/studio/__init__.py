"""Synthetic people and photographs of them: the rigged avatars, and two studios.

`load_avatar(path).surface(a_pose())` is a posed, textured person in a2v's axes; `photograph(surface)` a picture with its mask, path traced
in seconds. The fast studio (`generate`, `view`; ``a2v studio``) makes the views that the networks are trained on, by ray casting.
"""

from a2v.studio.avatars import AVATAR_PARTS, Avatar, a_pose, list_avatars, load_avatar, part_of_bone
from a2v.studio.portrait import Photo, PhotoSettings, photo_camera, photograph

__all__ = [
    "AVATAR_PARTS",
    "Avatar",
    "Photo",
    "PhotoSettings",
    "a_pose",
    "list_avatars",
    "load_avatar",
    "part_of_bone",
    "photo_camera",
    "photograph",
]
