"""Rendering on the CPU: the stage, the four cameras that follow, denoising, and video files.

`choose_variant` finds the Mitsuba variant that works on this machine. `Renderer(surface,
settings).render(vertices, camera)` renders a picture. `follow_cameras` places the cameras.
`write_video`, `write_gif` and `write_webp` write files. See ``docs/rendering.md``. Importing this
package imports neither Mitsuba nor PyAV.
"""

from a2v.rendering.camera import (
    AZIMUTHS,
    CameraPath,
    ViewCamera,
    check_views,
    follow_cameras,
    read_cameras,
)
from a2v.rendering.cutout import Cutout
from a2v.rendering.denoising import Layers, denoise
from a2v.rendering.framing import Framing, extreme_points
from a2v.rendering.images import contact_sheet, side_by_side, with_caption
from a2v.rendering.looks import LOOKS, read_look
from a2v.rendering.page import write_page
from a2v.rendering.renderer import Renderer
from a2v.rendering.scene import LookSettings
from a2v.rendering.variant import activate, choose_variant
from a2v.rendering.video import (
    VideoInfo,
    probe_video,
    read_video,
    write_gif,
    write_video,
    write_webp,
    write_within,
)

__all__ = [
    "AZIMUTHS",
    "LOOKS",
    "CameraPath",
    "Cutout",
    "Framing",
    "Layers",
    "LookSettings",
    "Renderer",
    "VideoInfo",
    "ViewCamera",
    "activate",
    "check_views",
    "choose_variant",
    "contact_sheet",
    "denoise",
    "extreme_points",
    "follow_cameras",
    "probe_video",
    "read_cameras",
    "read_look",
    "read_video",
    "side_by_side",
    "with_caption",
    "write_gif",
    "write_page",
    "write_video",
    "write_webp",
    "write_within",
]
