"""Synthetic people and photographs of them: what the reconstruction learns from, and is measured
with.

The people: `avatars` (rigged and textured; `avatar_files` reads them), `posing` (poses),
`variation` (builds, clothes, splits) and `solid` (inside and outside of their open meshes). `guide`
is the body that a fit would have found in a photo, `guide_errors` what fits get wrong.

Two ways to photograph them. `portrait` path traces a posed person in seconds:
``take_portrait(load_avatar(path).surface(a_pose()))``. The fast studio (``a2v studio``) casts rays,
about one view a second: `settings` say what is drawn, `stand` puts somebody before a camera,
`scene` draws a person with pose, camera and guide, `things` are around them, `lighting` has lights,
backgrounds and the sensor, `photograph` uses them, `texture` and `samples` ask the scene for the
truth, `studio` makes a `View` (`view`) of all that, and `dataset` fills a folder with views.
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
