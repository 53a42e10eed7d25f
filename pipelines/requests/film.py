"""Request for the look of a video: views, light, background, size."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path

from a2v.animation import DeformSettings, FootingSettings
from a2v.errors import InputError
from a2v.io import read_bytes
from a2v.rendering.looks import LOOKS
from a2v.types import VIEWS, RenderSettings
from pipelines.engine.graph import Parameters
from pipelines.engine.refs import Ref
from pipelines.engine.store import Store
from pipelines.inputs import MAX_PHOTO_BYTES, put_file
from pipelines.nodes.values import Blob
from pipelines.options import flag, option, settings
from pipelines.requests.fields import Request

FOLLOW = "follow"
"""The cameras of the four views follow the person."""
STILL = "still"
"""The cameras stay still and see the whole path."""

PHOTO = "photo"
"""The background in the photo's own place, and the name of its view."""
_LOOK = RenderSettings()


@dataclass(frozen=True, kw_only=True)
class FilmRequest(Request):
    """Options for the look of frames."""

    views: str | None = option(
        f"views, separated by commas: {', '.join(VIEWS)}, turntable, or names in --camera "
        "(default: the first four, or all of --camera)",
        default=None,
    )
    camera: str = option(
        f"{FOLLOW} the character, {STILL}, or a YAML file of cameras (docs/rendering.md)",
        default=FOLLOW,
        metavar="WHAT",
    )
    background: str = option(
        "stage, transparent, a color, an image file, or photo (also writes photo.mp4)",
        default=_LOOK.background,
        metavar="WHAT",
    )
    look: str = option(f"lighting: {', '.join(LOOKS)}, or a YAML file", default=LOOKS[0])
    size: int = option("longer side of each view, pixels", default=_LOOK.size)
    aspect: str = option(
        "shape of each view: 1:1, 9:16, 16:9 or another width:height",
        default=_LOOK.aspect,
        metavar="W:H",
    )
    titles: bool = flag("write the name of each view above it in video.mp4", rare=True)
    spp: int = option("samples per pixel", default=_LOOK.spp, rare=True)
    denoise: bool = option(
        "denoise every frame with Open Image Denoise", default=_LOOK.denoise, rare=True
    )
    variant: str = option(
        "variant of Mitsuba: auto, llvm_ad_rgb or scalar_rgb", default=_LOOK.variant, rare=True
    )
    no_props: bool = flag(
        "leave out the steps, ladder or bar on which the person climbs", rare=True
    )
    render_seed: int = option("seed of the renderer", default=_LOOK.seed, rare=True)
    deform: DeformSettings = settings(DeformSettings, users=("method",))

    @property
    def in_photo(self) -> bool:
        """Whether a view in the photo's own place is requested in addition to the others."""
        return self.background == PHOTO

    def resolve(self, store: Store) -> Parameters:
        """Return the parameters `render`, `cameras`, `backdrop`, `look`, `deform` and `footing`.

        Raises
        ------
        InputError
            An unknown view, background or look, or an unreadable file.
        """
        from a2v.rendering import check_views, read_cameras, read_look

        cameras = () if self.camera in (FOLLOW, STILL) else read_cameras(self.camera)
        named = (
            self.views.split(",")
            if self.views is not None
            else [one.name for one in cameras] or VIEWS
        )
        background, backdrop = _background(
            store, _LOOK.background if self.in_photo else self.background
        )
        render = RenderSettings(
            views=tuple(view.strip() for view in named),
            background=background,
            size=self.size,
            aspect=self.aspect,
            titles=self.titles,
            spp=self.spp,
            denoise=self.denoise,
            variant=self.variant,
            seed=self.render_seed,
            follow=self.camera != STILL,
        )
        check_views(render.views, cameras)
        look, footing = read_look(self.look), FootingSettings(shown=not self.no_props)
        return {
            "render": render,
            "cameras": cameras,
            "backdrop": backdrop,
            "look": look,
            "deform": self.deform,
            "footing": footing,
        }


def _background(store: Store, asked: str) -> tuple[str, Ref[Blob] | None]:
    """Return the value of `RenderSettings.background`, and the picture if one is given."""
    from PIL import ImageColor

    from a2v.perception.photo import decode_photo

    if asked in ("stage", "transparent"):
        return asked, None
    with contextlib.suppress(ValueError):
        red, green, blue, *_ = ImageColor.getrgb(asked)
        return f"#{red:02x}{green:02x}{blue:02x}", None
    if not Path(asked).is_file():
        raise InputError(
            f"background '{asked}' is not a file; expected stage, photo, transparent, a color such "
            "as #30506f, or an image"
        )
    data = read_bytes(asked, limit=MAX_PHOTO_BYTES)
    decode_photo(data, Path(asked).name)  # an error now, before a long computation
    return "image", put_file(store, asked)
