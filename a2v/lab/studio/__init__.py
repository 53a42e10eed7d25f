"""Synthetic people and photographs of them, to train and to measure the reconstruction.

The people: `avatars` (rigged and textured; `avatar_files` reads them), `posing` (poses),
`variation` (builds, clothes, splits) and `solid` (inside and outside of their open meshes). `guide`
is the body that a fit would find in a photo, `guide_errors` the errors of fits.

There are two ways to photograph them. `portrait` path traces a posed person in seconds:
``take_portrait(load_avatar(path).surface(a_pose()))``. The fast studio (``a2v studio``) casts rays,
about one view per second. Its modules: `settings` (what is drawn), `stand` (a person in front of a
camera), `scene` (person, pose, camera and guide), `things` (objects around the person), `lighting`
(lights, backgrounds, sensor), `photograph` (the photo), `texture` and `samples` (ground truth of
the scene), `studio` (makes a `View` of `view`), and `dataset` (fills a folder with views).
"""

from a2v.lab.studio.avatar_files import list_avatars, load_avatar
from a2v.lab.studio.avatars import Avatar, a_pose
from a2v.lab.studio.portrait import Portrait, PortraitSettings, portrait_camera, take_portrait

__all__ = [
    "Avatar",
    "Portrait",
    "PortraitSettings",
    "a_pose",
    "list_avatars",
    "load_avatar",
    "portrait_camera",
    "take_portrait",
]
