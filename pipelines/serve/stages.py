"""Draw one image per stage of a job, which the page shows while the next stage runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from a2v.io import atomic_path
from a2v.types import Body, ByteArray, PhotoCamera, Reconstruction, Subject, Surface
from pipelines.engine.run import Early, Outcome

SIDE = 420
"""Height of an image, in pixels."""
ANGLES = (-25.0, 155.0)
"""Azimuths of the two views of a surface, in degrees: from the front and from behind."""
_GROUND = (255, 0, 255)  # background: not a color of clay
_CLAY = 0.8


def pictures(folder: Path, tell: Callable[[str], None]) -> Early:
    """Return callbacks that write the image of each finished stage into `folder`.

    `tell` is called with the name of the stage. Cached stages are not drawn, since they take no
    time.
    """

    def stage(name: str, node: str) -> Callable[[Outcome], None]:
        def draw(outcome: Outcome) -> None:
            if outcome.nodes[node].cached == outcome.nodes[node].calls:
                return
            from PIL import Image

            with atomic_path(folder / STAGES[name]) as temporary:
                Image.fromarray(_DRAWN[name](outcome)).save(temporary, "jpeg", quality=85)
            tell(name)

        return draw

    return {
        "photo_body": stage("body", "photo_body"),
        "surface": stage("surface", "surface"),
        "colored_surface": stage("textured", "colored_surface"),
    }


def body_over_photo(subject: Subject, body: Body, camera: PhotoCamera) -> ByteArray:
    """Draw the fitted body in clay over the crop of the photo, (H, W, 3) uint8."""
    import cv2

    from a2v.rendering.preview import PreviewStyle, preview_surface

    height, width = subject.image.shape[:2]
    side = max(height, width)
    middle = camera.flat.unproject(np.array([width / 2, height / 2]), 0.0)
    gray = np.full((len(body.vertices), 3), _CLAY, np.float32)
    mesh = Surface(vertices=camera.flatten(body.vertices), faces=body.faces, colors=gray)
    clay = preview_surface(
        mesh,
        size=SIDE,
        center=middle,
        extent=side / camera.scale,
        style=PreviewStyle(plain=True, background=_GROUND),
    )
    photo = np.full((side, side, 3), 235, np.uint8)
    top, left = (side - height) // 2, (side - width) // 2
    photo[top : top + height, left : left + width] = subject.image
    photo = cv2.resize(photo, (SIDE, SIDE), interpolation=cv2.INTER_AREA)
    seen = (clay != _GROUND).any(axis=2)
    over = np.where(seen[..., None], 0.2 * photo + 0.8 * clay, 0.55 * photo + 90)
    narrow = max(1, round(SIDE * width / side))
    first = (SIDE - narrow) // 2
    return np.clip(over, 0, 255).astype(np.uint8)[:, first : first + narrow]


def turned(surface: Surface, *, plain: bool) -> ByteArray:
    """Draw a surface from the front and from behind, side by side, (H, W, 3) uint8."""
    from a2v.rendering.preview import PreviewStyle, preview_surface

    views = [
        preview_surface(surface, azimuth=angle, size=SIDE, style=PreviewStyle(plain=plain))
        for angle in ANGLES
    ]
    edge = SIDE // 5
    return np.concatenate([view[:, edge : SIDE - edge] for view in views], axis=1)


STAGES: Mapping[str, str] = {
    "body": "stage_body.jpg",
    "surface": "stage_surface.jpg",
    "textured": "stage_textured.jpg",
}
"""File names of the stages' images, by stage."""
_DRAWN: Mapping[str, Callable[[Outcome], ByteArray]] = {
    "body": lambda seen: body_over_photo(
        seen.get("subject", Subject),
        seen.get("photo_body", Body),
        seen.get("photo_camera", PhotoCamera),
    ),
    "surface": lambda seen: turned(seen.get("surface", Reconstruction).surface, plain=True),
    "textured": lambda seen: turned(seen.get("colored_surface", Surface), plain=False),
}
