"""Draw the sample person in every look, side by side: ``docs/images/looks.jpg``.

python scripts/make_looks_picture.py [--time 1.0] [--size 512]
"""

from __future__ import annotations

import argparse
import io
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from a2v.animation import deform
from a2v.io import atomic_path
from a2v.rendering import LOOKS, CameraPath, Renderer, contact_sheet, follow_cameras, read_look
from a2v.types import Character, RenderSettings
from pipelines.bar import Bars
from pipelines.engine.store import Store
from pipelines.nodes.values import Poses
from pipelines.requests.video import video_parameters
from pipelines.run import run

ROOT = Path(__file__).resolve().parent.parent


def main() -> int:
    """Render and write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--time", type=float, default=1.0, help="of the walk, seconds")
    parser.add_argument("--size", type=int, default=512)
    given = parser.parse_args()
    store, bars = Store(), Bars()
    outcome = run(
        ["poses", "character"],
        store=store,
        progress=bars,
        **video_parameters(store, ROOT / "a2v" / "samples" / "person.jpg", "Walk"),
    )
    bars.close()
    character, poses = outcome.get("character", Character), outcome.get("poses", Poses)
    vertices = deform(
        character,
        poses.bone_transforms[min(round(given.time * poses.fps), len(poses.bone_transforms) - 1)],
    )
    settings = RenderSettings(size=given.size, aspect="4:5", spp=16, views=("three",))
    camera = follow_cameras(
        vertices[None], settings, cameras=(CameraPath(name="three", azimuth=30, elevation=8),)
    )["three"][0]
    pictures = [
        Renderer(character.surface, settings, read_look(look)).render(vertices, camera)
        for look in LOOKS
    ]
    buffer = io.BytesIO()
    Image.fromarray(np.asarray(contact_sheet(pictures, rows=1, cols=len(pictures), gap=0))).save(
        buffer, "jpeg", quality=88, optimize=True
    )
    target = ROOT / "docs" / "images" / "looks.jpg"
    with atomic_path(target) as temporary:
        temporary.write_bytes(buffer.getvalue())
    print(target)
    return 0


if __name__ == "__main__":  # worker processes import this file again
    sys.exit(main())
