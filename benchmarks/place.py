"""Measure how well the photo's place agrees with the photo: `python -m benchmarks.place PHOTO...`
(a minute a photo that is not remembered).

The character in the photo's pose is rendered where the photo was taken and compared with the photo:
outline (intersection over union), colors over what both show of the person (PSNR), and how far the
soles are from the lowest row of the person. Pictures go to --sheets.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from a2v.animation.entrance import photo_to_world
from a2v.geometry.colors import to_bytes
from a2v.io import atomic_path
from a2v.perception import decode_photo
from a2v.perception.paint_out import in_photo
from a2v.rendering import Renderer
from a2v.rendering.place import Place, square, square_mask, without_light
from a2v.types import Character, RenderSettings, Subject, Surface
from pipelines.engine.store import Store
from pipelines.graph import video_graph
from pipelines.requests.video import video_parameters
from pipelines.run import run


def measure(photo: Path, size: int, sheets: Path | None) -> str:
    """One row of the table."""
    import cv2
    import PIL.Image

    store = Store()
    started = time.process_time()
    parameters = video_parameters(store, photo, "Walk", size=size)
    outcome = run(
        ["place", "shaded_surface", "character", "subject"],
        graph=video_graph(),
        store=store,
        **parameters,
    )
    place, person, subject = (
        outcome.get(name, kind)
        for name, kind in (("place", Place), ("character", Character), ("subject", Subject))
    )
    surface = without_light(outcome.get("shaded_surface", Surface), place.light)
    seconds = time.process_time() - started
    vertices = (
        person.surface.vertices + photo_to_world(person.body).astype(np.float32) + place.moved
    )
    renderer = Renderer(
        surface,
        RenderSettings(size=size, background="image"),
        look=place.look,
        backdrop=place.picture,
    )
    covered = renderer.mask(vertices, place.camera)
    picture = renderer.render(vertices, place.camera).astype(np.float32)
    seen, frame = square(decode_photo(photo.read_bytes())[..., :3])
    whole = square_mask(in_photo(subject.mask, subject.crop, subject.photo_size), frame)
    seen, mask = (
        cv2.resize(image, (size, size), interpolation=cv2.INTER_AREA) for image in (seen, whole)
    )
    both = (covered > 0.95) & (mask > 0.95)
    shown, wanted = covered > 0.5, mask > 0.5
    overlap = (shown & wanted).sum() / (shown | wanted).sum()
    psnr = 10 * np.log10(255**2 / np.mean((picture[both] - seen[both].astype(np.float32)) ** 2))
    rows = np.flatnonzero((mask > 0.5).any(axis=1))
    soles = place.camera.project(vertices, size)[:, 1].max()
    if sheets is not None:
        with atomic_path(sheets / f"{photo.stem}.png") as temporary:
            empty = cv2.resize(place.picture, (size, size), interpolation=cv2.INTER_AREA)
            PIL.Image.fromarray(
                to_bytes(np.concatenate([seen, empty, picture], axis=1) / 255)
            ).save(temporary, "png")
    return f"| {photo.stem} | {overlap:.3f} | {psnr:.1f} | {100 * (soles - rows[-1]) / np.ptp(rows):+.1f} | {seconds:.0f} |"


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("photos", nargs="*", type=Path, default=[Path("a2v/samples/person.jpg")])
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument(
        "--sheets",
        type=Path,
        default=None,
        help="folder for photo, place without the person, and render side by side",
    )
    options = parser.parse_args()
    if options.sheets is not None:
        options.sheets.mkdir(parents=True, exist_ok=True)
    print(
        "| photo | outline IoU | PSNR over the person, dB | soles below the feet, % of height | "
        "CPU s, not remembered |\n|---|---|---|---|---|"
    )
    for photo in options.photos:
        print(measure(photo, options.size, options.sheets), flush=True)


if __name__ == "__main__":
    main()
