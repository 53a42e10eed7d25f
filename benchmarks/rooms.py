"""Measure the removal of a person from twelve ordinary rooms whose empty state is known: `python -m
benchmarks.rooms --data ../shared/data`.

Rooms and people are rendered (`a2v.lab.studio.rooms`, two minutes of one core each; `--kept` keeps
them). For each: PSNR over the hole, and over the hole and all that the person's shadow changes by
over 8 levels, against the empty room; how well the floor and what stands in front of the person are
found (IoU inside the photo); and walks of five seconds in six directions, straight and as
`find_detour` bends them: the share of their frames whose root is over the true floor, and the share
in which a person .6 m wide is wholly in the picture. Mask and camera are the true ones.
"""

from __future__ import annotations

import argparse
import itertools
import time
from pathlib import Path

import numpy as np

from a2v.io import atomic_path
from a2v.lab.studio.rooms import ROOMS, RoomCase, open_room
from a2v.perception.behind import regions_of
from a2v.perception.paint_out import paint_out
from a2v.rendering.camera import ViewCamera
from a2v.rendering.occluders import CLEARANCE, find_things
from a2v.rendering.place import square, square_mask
from a2v.rendering.room import SIDE, find_detour, find_floor, standing_room
from a2v.types import BoolArray, ByteArray, FloatArray

_CHANGED = 8
"""Levels by which a shadow changes a pixel."""
_HOLE = 10
"""Width of the hole's margin around the person, pixels."""
_TALL = 1.7
"""Height of the person, meters."""


def psnr(one: ByteArray, other: ByteArray, where: BoolArray) -> float:
    """Peak signal to noise ratio over some pixels, dB."""
    return float(
        10 * np.log10(255**2 / np.mean((one[where].astype(np.float64) - other[where]) ** 2))
    )


def walks(case: RoomCase, picture: ByteArray) -> tuple[float, float, tuple[float, ...]]:
    """IoU of the floor; IoU of what stands in front of the person (NaN where nothing does); and of
    straight and of bent walks the shares of frames with the feet on the true floor and with the
    whole person in the picture: straight on the floor, bent on the floor, straight in the picture,
    bent in the picture."""
    shown, frame = square(picture)
    facts = case.facts
    camera = ViewCamera(
        origin=tuple(facts["origin"]), target=tuple(facts["target"]), fov=float(facts["fov"])
    )
    regions = regions_of(shown, min(SIDE, len(shown)))
    floor = find_floor(shown, camera, np.zeros(2), regions)
    things = find_things(floor, regions, camera)
    truth, front, inside = (
        _small(one, frame, len(floor)) for one in (case.floor, case.front, np.ones_like(case.floor))
    )
    away = float(np.hypot(camera.origin[0], camera.origin[2]))
    hides = (things < away - CLEARANCE) & inside
    found = standing_room(floor, camera, frame, len(shown), _TALL)
    shares = []
    for angle in np.radians(np.arange(0, 360, 60)):
        roots = np.arange(150)[:, None] * 0.04 * np.array([np.sin(angle), np.cos(angle)])
        places = find_detour(roots, found, fps=30, entering=True).places
        shares.append(
            [
                _stands(roots, truth, front, camera),
                _stands(places, truth, front, camera),
                _in_picture(roots, camera, frame, len(shown)),
                _in_picture(places, camera, frame, len(shown)),
            ]
        )
    return (
        _iou(floor & inside, truth),
        _iou(hides, front) if front.any() else float("nan"),
        tuple(np.mean(shares, axis=0).tolist()),
    )


def _small(mask: FloatArray, frame: tuple[int, ...], side: int) -> BoolArray:
    """Return a mask of the photo over its square with `side` pixels."""
    import cv2

    whole = cv2.resize(square_mask(mask, frame), (side, side), interpolation=cv2.INTER_AREA)
    return np.asarray(whole > 0.5)


def _iou(one: BoolArray, other: BoolArray) -> float:
    return float((one & other).sum() / max((one | other).sum(), 1))


def _stands(places: FloatArray, truth: BoolArray, front: BoolArray, camera: ViewCamera) -> float:
    """Share of the frames whose root is over the true floor, or over floor that something in front
    hides."""
    points = np.stack([places[:, 0], np.zeros(len(places)), places[:, 1]], axis=1)
    pixels = camera.project(points, len(truth))
    inside = ((pixels >= 0) & (pixels < len(truth))).all(axis=1)
    at = np.clip(np.nan_to_num(pixels), 0, len(truth) - 1).astype(np.int64)
    return float((inside & (truth | front)[at[:, 1], at[:, 0]]).mean())


def _in_picture(places: FloatArray, camera: ViewCamera, frame: tuple[int, ...], size: int) -> float:
    """Share of the frames in which the whole person, .6 m wide, is in the picture."""
    everywhere = np.ones((SIDE, SIDE), bool)
    return float(standing_room(everywhere, camera, frame, size, _TALL)(places).mean())


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
        "| room | hole, dB | with shadow, dB | floor, IoU | things in front, IoU "
        "| straight: on the floor | bent | straight: in the picture | bent | painting, CPU s |"
    )
    print("|---" * 10 + "|")
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
            *itertools.chain(
                *((one,) if isinstance(one, float) else one for one in walks(case, painted))
            ),
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
    print("| mean | " + " | ".join(_text(np.nanmean(values, axis=0))) + " |")
    if options.sheet is not None:
        with atomic_path(options.sheet) as temporary:
            PIL.Image.fromarray(np.concatenate(rows)).save(temporary, "jpeg", quality=85)


def _text(values: FloatArray | tuple[float, ...]) -> list[str]:
    hole, changed, floor, front, *walked, seconds = values
    return [
        f"{hole:.1f}",
        f"{changed:.1f}",
        f"{floor:.3f}",
        "" if np.isnan(front) else f"{front:.2f}",
        *(f"{share:.0%}" for share in walked),
        f"{seconds:.1f}",
    ]


if __name__ == "__main__":
    main()
