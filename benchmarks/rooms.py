"""A person is taken out of twelve ordinary rooms whose empty state is known: `python -m
benchmarks.rooms --data ../shared/data`.

Rooms and people are rendered (`a2v.lab.studio.rooms`, two minutes of one core each; `--kept` keeps
them). For each: PSNR over the hole, and over the hole and all that the person's shadow changes by
over 8 levels, against the empty room; how well the floor is found (IoU inside the photo); and
straight walks of five seconds in six directions: how many of their frames stand on the true floor
and in the picture, as they are and as `find_detour` bends them. Mask and camera are the true ones.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from a2v.io import atomic_path
from a2v.lab.studio.rooms import ROOMS, RoomCase, open_room
from a2v.perception.paint_out import paint_out
from a2v.rendering.camera import ViewCamera
from a2v.rendering.place import square, square_mask
from a2v.rendering.room import find_detour, find_floor, standing_room
from a2v.types import BoolArray, ByteArray, FloatArray

_CHANGED = 8
"""Levels by which a shadow changes a pixel."""
_HOLE = 10
"""Pixels around the person that belong to the hole."""
_TALL = 1.7
"""Meters."""


def psnr(one: ByteArray, other: ByteArray, where: BoolArray) -> float:
    """Peak signal to noise ratio over some pixels, dB."""
    return float(
        10 * np.log10(255**2 / np.mean((one[where].astype(np.float64) - other[where]) ** 2))
    )


def walks(case: RoomCase, picture: ByteArray) -> tuple[float, float, float]:
    """IoU of the floor; shares of frames on the true floor and in the picture, of straight walks
    and of bent ones."""
    import cv2

    shown, frame = square(picture)
    facts = case.facts
    camera = ViewCamera(
        origin=tuple(facts["origin"]), target=tuple(facts["target"]), fov=float(facts["fov"])
    )
    floor = find_floor(shown, camera, np.zeros(2))
    side = len(floor)
    truth = (
        cv2.resize(square_mask(case.floor, frame), (side, side), interpolation=cv2.INTER_AREA) > 0.5
    )
    inside = (
        cv2.resize(
            square_mask(np.ones_like(case.floor), frame), (side, side), interpolation=cv2.INTER_AREA
        )
        > 0.5
    )
    found = standing_room(floor, camera, frame, len(shown), _TALL)
    allowed = standing_room(truth, camera, frame, len(shown), _TALL)
    plain, bent = [], []
    for angle in np.radians(np.arange(0, 360, 60)):
        roots = np.arange(150)[:, None] * 0.04 * np.array([np.sin(angle), np.cos(angle)])
        plain.append(_good(roots, allowed(roots)))
        places = find_detour(roots, found, fps=30, entering=True).places
        bent.append(_good(places, allowed(places)))
    return (
        float((floor & truth).sum() / ((floor | truth) & inside).sum()),
        float(np.mean(plain)),
        float(np.mean(bent)),
    )


def _good(places: FloatArray, allowed: BoolArray) -> float:
    """Share of the frames that are allowed; where the photo has the person counts."""
    return float((allowed | (np.linalg.norm(places - places[0], axis=1) < 0.3)).mean())


def main() -> None:
    """Measure and print the table."""
    import cv2
    import PIL.Image

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--kept", type=Path, default=None, help="folder where rooms are kept")
    parser.add_argument("--rooms", type=int, default=ROOMS)
    parser.add_argument(
        "--sheet",
        type=Path,
        default=None,
        help="JPEG of every photo, what is painted, and the empty room",
    )
    options = parser.parse_args()
    print(
        "| room | hole, dB | with shadow, dB | floor, IoU | straight walks on floor and in picture | bent | painting, CPU s |\n|---|---|---|---|---|---|---|"
    )
    rows, values = [], []
    for number in range(options.rooms):
        case = open_room(number, options.data, options.kept)
        started = time.process_time()
        painted = paint_out(case.image, case.mask)
        seconds = time.process_time() - started
        hole = (
            cv2.dilate((case.mask > 0.02).astype(np.uint8), np.ones((2 * _HOLE + 1,) * 2, np.uint8))
            > 0
        )
        changed = hole | (np.abs(case.image.astype(np.int64) - case.empty).max(axis=-1) > _CHANGED)
        measured = (
            psnr(painted, case.empty, hole),
            psnr(painted, case.empty, changed),
            *walks(case, painted),
            seconds,
        )
        values.append(measured)
        print(f"| {number} | " + " | ".join(_text(measured)) + " |", flush=True)
        rows.append(
            np.concatenate(
                [
                    cv2.resize(one, (400, 400 * one.shape[0] // one.shape[1]))
                    for one in (case.image, painted, case.empty)
                ],
                axis=1,
            )
        )
    print("| mean | " + " | ".join(_text(np.mean(values, axis=0))) + " |")
    if options.sheet is not None:
        with atomic_path(options.sheet) as temporary:
            PIL.Image.fromarray(np.concatenate(rows)).save(temporary, "jpeg", quality=85)


def _text(values: FloatArray | tuple[float, ...]) -> list[str]:
    hole, changed, floor, plain, bent, seconds = values
    return [
        f"{hole:.1f}",
        f"{changed:.1f}",
        f"{floor:.3f}",
        f"{plain:.0%}",
        f"{bent:.0%}",
        f"{seconds:.1f}",
    ]


if __name__ == "__main__":
    main()
