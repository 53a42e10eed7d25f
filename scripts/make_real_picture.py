"""Draw photos of real people beside their characters and videos: ``docs/images/real.webp``.

python scripts/make_real_picture.py [--data ../shared/data] [--size 224]

A row per photo: the photo, the character turning, and a second of its video. The photos are
``PIFu_ryota.png`` of PIFu (MIT) and ``tfjs_pose.jpg`` of tfjs-models (Apache-2.0).
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps

from a2v.rendering import write_within
from a2v.rendering.preview import PreviewStyle, preview_surface
from a2v.types import ByteArray, Character
from pipelines.bar import Bars
from pipelines.engine.store import Store
from pipelines.nodes.values import Image as Frame
from pipelines.requests.video import video_parameters
from pipelines.run import run

ROOT = Path(__file__).resolve().parent.parent
PEOPLE = {"PIFu_ryota.png": "Jump", "tfjs_pose.jpg": "Walk"}
"""Actions by photo."""
FRAMES = 24
FPS = 12.0
MEGABYTES = 0.29
GROUND = (201, 206, 211)


def row(photo: Path, action: str, size: int) -> ByteArray:
    """Return the pictures of a person, (FRAMES, size, 3 * size, 3) uint8."""
    store, bars = Store(), Bars()
    film = {"size": size, "spp": 8, "views": ("front",)}
    asked = video_parameters(store, photo, action, frames=FRAMES, fps=FPS, **film)
    outcome = run(["character", "frame"], store=store, progress=bars, **asked)
    bars.close()
    surface = outcome.get("character", Character).surface
    style = PreviewStyle(background=GROUND)
    turning = [
        preview_surface(surface, azimuth=360 * index / FRAMES, size=size, style=style)
        for index in range(FRAMES)
    ]
    frames = [store.get(ref, Frame).pixels[..., :3] for ref in outcome.values["frame"][:, 0]]
    with Image.open(photo) as opened:
        over = Image.new("RGBA", opened.size, (*GROUND, 255))
        over.alpha_composite(opened.convert("RGBA"))
        shown = np.asarray(ImageOps.pad(over.convert("RGB"), (size, size), color=GROUND))
    return np.stack(
        [np.hstack([shown, *pair]) for pair in zip(turning, frames, strict=True)]
    ).astype(np.uint8)


def main() -> int:
    """Compute and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    data = Path(os.environ.get("A2V_DATA", ROOT.parent / "shared" / "data"))
    parser.add_argument("--data", type=Path, default=data, help="folder that holds photos/")
    parser.add_argument("--size", type=int, default=224)
    given = parser.parse_args()
    rows = [
        row(given.data / "photos" / name, action, given.size) for name, action in PEOPLE.items()
    ]
    target = ROOT / "docs" / "images" / "real.webp"
    write_within(target, np.concatenate(rows, axis=1), FPS, megabytes=MEGABYTES)
    print(target)
    return 0


if __name__ == "__main__":  # worker processes import this file again
    sys.exit(main())
