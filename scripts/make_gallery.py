"""Draw a gallery of real photos from four sides: sheets/gallery.jpg.

python scripts/make_gallery.py [FOLDER] [--out sheets] [--size 260]

For every photo of FOLDER (by default ``$A2V_DATA/photos``): the photo, the character from front,
left, back and right, and the same as clay; the notes for the user, and the share of slabs
(`a2v.lab.evaluation.reconstruction.thickness.slab_share`). ``make sheets PHOTOS=FOLDER`` makes it
too.
"""

from __future__ import annotations

import argparse
import dataclasses
import os
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from a2v.body import flattened
from a2v.errors import A2VError
from a2v.io import atomic_path
from a2v.lab.evaluation.reconstruction.thickness import slab_share
from a2v.rendering.preview import PreviewStyle, preview_surface
from a2v.types import Body, PhotoCamera, Subject, Surface
from pipelines.engine.store import Store
from pipelines.requests.video import video_parameters
from pipelines.run import run

ROOT = Path(__file__).resolve().parent.parent


def photos_of(folder: Path) -> list[Path]:
    """Return the photos of a folder without the masks beside them."""
    found = [
        path
        for path in folder.glob("*")
        if path.suffix.lower() in (".jpg", ".jpeg", ".png", ".webp")
    ]
    return sorted(path for path in found if not path.stem.endswith("_mask"))


def row(photo: Path, size: int) -> tuple[np.ndarray, str]:
    """Return a photo beside its surface from four sides, colored and as clay, and the notes about
    it."""
    store = Store()
    outcome = run(
        ["subject", "photo_body", "photo_camera", "colored_surface"],
        store=store,
        **video_parameters(store, photo, "Walk"),
    )
    subject, surface, camera = (
        outcome.get(name, kind)
        for name, kind in (
            ("subject", Subject),
            ("colored_surface", Surface),
            ("photo_camera", PhotoCamera),
        )
    )
    flat = dataclasses.replace(surface, vertices=camera.flatten(surface.vertices))
    share = slab_share(
        flat, flattened(outcome.get("photo_body", Body), camera), camera.flat, subject.mask
    )
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    seen = {"center": (low + high) / 2, "extent": 1.08 * float((high - low).max()), "size": size}
    crop = Image.fromarray(subject.image)
    crop.thumbnail((size, size))
    square = Image.new("RGB", (size, size), "white")
    square.paste(crop, ((size - crop.width) // 2, (size - crop.height) // 2))
    turns = (0.0, 90.0, 180.0, 270.0)
    looks = [
        preview_surface(surface, azimuth=turn, **seen, style=PreviewStyle(shaded=False))
        for turn in turns
    ]
    clay = [
        preview_surface(surface, azimuth=turn, **seen, style=PreviewStyle(shaded=False, plain=True))
        for turn in turns
    ]
    notes = "; ".join(str(note) for note in outcome.notes)
    return np.hstack(
        [np.asarray(square), *looks, *clay]
    ), f"{photo.stem}: slabs {100 * share:.2f} % of the pixels; {notes or 'no notes'}"


def main() -> int:
    """Write the gallery; print the notes about each photo, and its path."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    data = Path(os.environ.get("A2V_DATA", ROOT.parent / "shared" / "data"))
    parser.add_argument("folder", nargs="?", type=Path, default=data / "photos")
    parser.add_argument("--out", type=Path, default=ROOT / "sheets")
    parser.add_argument("--size", type=int, default=260)
    given = parser.parse_args()
    rows = []
    for photo in photos_of(given.folder):
        try:
            picture, text = row(photo, given.size)
        except A2VError as error:
            print(f"{photo.stem}: {error}", flush=True)
            continue
        print(text, flush=True)
        line = Image.new("RGB", (picture.shape[1], 18), "white")
        ImageDraw.Draw(line).text((6, 3), text, fill="black")
        rows += [np.asarray(line), picture]
    if not rows:
        print(f"no photo of a person in {given.folder}", file=sys.stderr)
        return 2
    target = given.out / "gallery.jpg"
    with atomic_path(target) as temporary:
        Image.fromarray(np.vstack(rows)).save(temporary, format="jpeg", quality=88)
    print(target)
    return 0


if __name__ == "__main__":  # worker processes import this file again
    sys.exit(main())
