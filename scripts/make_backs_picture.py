"""Draw backs by Eq. 14 alone and with the photo continued: sheets/backs.jpg.

python scripts/make_backs_picture.py [PHOTO ...] [--out sheets] [--size 320] [--docs]

For every PHOTO (by default the sample and those of ``$A2V_DATA/photos``; a .glb is an avatar,
photographed here): the photo, then back, left and right with Eq. 14 alone, and the same three with
`ColorSettings.synthesis`. `--docs` writes only the back, small, to ``docs/images/backs.jpg``.
"""

from __future__ import annotations

import argparse
import io
import os
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from a2v.errors import A2VError
from a2v.io import atomic_path
from a2v.reconstruction import ColorSettings
from a2v.reconstruction.colorings import color_by_photo
from a2v.rendering.preview import PreviewStyle, preview_surface
from a2v.types import Body, PhotoCamera, Reconstruction, Subject
from pipelines.engine.store import Store
from pipelines.requests.video import video_parameters
from pipelines.run import run

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))


def row(photo: Path, size: int, turns: tuple[float, ...]) -> np.ndarray:
    """Return a photo beside its surface seen from `turns`, degrees, colored by Eq. 14 alone and
    with the photo continued, (size, W, 3)."""
    store = Store()
    outcome = run(
        ["subject", "body", "photo_camera", "surface_with_face"],
        store=store,
        **video_parameters(store, photo, "Walk"),
    )
    subject, person, body = (
        outcome.get(name, kind)
        for name, kind in (
            ("subject", Subject),
            ("surface_with_face", Reconstruction),
            ("body", Body),
        )
    )
    camera = outcome.get("photo_camera", PhotoCamera)
    vertices = person.surface.vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    extent = 1.04 * float((high - low).max())
    wide = min(1.0, 1.04 * max(float(np.hypot(high[0] - low[0], high[2] - low[2])), 0.4) / extent)
    border = round((1 - wide) / 2 * size)
    looks = []
    for synthesis in (False, True):
        surface = color_by_photo(
            person, subject, body, camera, settings=ColorSettings(synthesis=synthesis)
        )
        seen = [
            preview_surface(
                surface,
                azimuth=turn,
                center=(low + high) / 2,
                extent=extent,
                size=size,
                style=PreviewStyle(shaded=False),
            )
            for turn in turns
        ]
        looks += [picture[:, border : size - border] for picture in seen]
    crop = Image.fromarray(subject.image)
    crop = crop.resize(
        (max(1, round(crop.width * size / crop.height)), size), Image.Resampling.LANCZOS
    )
    return np.hstack([np.asarray(crop), *looks])


def main() -> int:
    """Write the picture and print its path."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    data = Path(os.environ.get("A2V_DATA", ROOT.parent / "shared" / "data"))
    parser.add_argument("photos", nargs="*", type=Path)
    parser.add_argument("--out", type=Path, default=ROOT / "sheets")
    parser.add_argument("--size", type=int, default=320)
    parser.add_argument("--docs", action="store_true")
    given = parser.parse_args()
    from scripts.make_gallery import photos_of
    from scripts.make_sheets import photographed

    photos = given.photos or [ROOT / "a2v" / "samples" / "person.jpg", *photos_of(data / "photos")]
    given.out.mkdir(parents=True, exist_ok=True)
    rows = []
    for photo in photos:
        try:
            taken = photographed(photo, given.out) if photo.suffix == ".glb" else photo
            rows.append(row(taken, given.size, (180.0,) if given.docs else (180.0, 90.0, 270.0)))
        except A2VError as error:
            print(f"{photo.stem}: {error}", flush=True)
    if not rows:
        print("no photo of a person", file=sys.stderr)
        return 2
    if given.docs:  # side by side
        picture = np.hstack(rows)
    else:
        width = max(line.shape[1] for line in rows)
        picture = np.vstack(
            [
                np.pad(line, ((0, 0), (0, width - line.shape[1]), (0, 0)), constant_values=255)
                for line in rows
            ]
        )
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, "jpeg", quality=85, optimize=True)
    target = ROOT / "docs" / "images" / "backs.jpg" if given.docs else given.out / "backs.jpg"
    with atomic_path(target) as temporary:
        temporary.write_bytes(buffer.getvalue())
    print(target)
    return 0


if __name__ == "__main__":  # worker processes import this file again
    sys.exit(main())
