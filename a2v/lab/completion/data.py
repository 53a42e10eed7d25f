"""The data set of the completion: true colors of people on the sheets, and trust of photos."""

from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np

from a2v.io import atomic_path, read_npz
from a2v.lab.completion.layout import COLUMNS, ROWS, skin_sheets
from a2v.lab.completion.people import (
    SheetPeople,
    place_on_sheets,
    sheet_colors,
    sheet_trust,
)
from a2v.lab.studio.guide import unstack_guides
from a2v.lab.studio.quick.bank import PoseBank
from a2v.lab.studio.quick.poses import draw_pose
from a2v.lab.studio.quick.settings import QuickSettings
from a2v.lab.studio.stand import draw_outfit
from a2v.types import ByteArray, Progress

_POSES = QuickSettings(natural=0.55, free=0.15, limbs=0.1, bent=0.1)
_STREAM = 77_001
_FACING = 0.92
"""Share of people who roughly face the camera."""
PART = 12
"""People per file."""


def write_people(
    folder: str | os.PathLike[str],
    data: str | os.PathLike[str],
    split: str,
    *,
    views: str | os.PathLike[str],
    makehuman: int,
    outfits: tuple[int, int] = (8, 4),
    progress: Progress | None = None,
) -> None:
    """Write ``<split>-000.npz``... to a folder.

    They have the colors (N, 2, H / 2, W / 2, 3) uint8 and the trust (N, 2, H / 2, W / 2) uint8 of
    all avatars of a split and of `makehuman` people of MakeHuman's. Files that exist are kept.

    Parameters
    ----------
    folder : path
    data : path
        Folder with ``avatars/`` and MakeHuman's archive.
    split : "training" or "validation"
        Of the quick studio: nobody of its reports and benchmarks is in either.
    views : path
        Folder of quick views, for its guides and its bank of poses
        (`a2v.lab.studio.quick.people.prepare_folder`).
    makehuman : int
    outfits : (int, int)
        Numbers of outfits of an avatar and of a person of MakeHuman's; each is seen in one photo.
    """
    Path(folder).mkdir(parents=True, exist_ok=True)
    people = SheetPeople(data, unstack_guides(read_npz(Path(views) / "guide.npz")), _STREAM)
    poses = PoseBank.load(Path(views) / "bank.npz")
    todo = [(people.makehuman, n, outfits[1]) for n in range(makehuman)]
    todo += [(people.avatar, n, outfits[0]) for n in range(len(people.paths[split]))]
    for start in range(0, len(todo), PART):
        path = Path(folder) / f"{split}-{start // PART:03d}.npz"
        if path.exists():
            continue
        colors, trust, names = [], [], []
        for at, (make, number, count) in enumerate(todo[start : start + PART], start):
            prepared, guide = make(split, number)
            placed = place_on_sheets(prepared.avatar, guide)
            generator = np.random.default_rng([_STREAM, split == "training", at])
            for _ in range(count):
                outfit = draw_outfit(prepared, generator)
                pose = draw_pose(poses, split, _POSES, generator)
                facing = generator.random() < _FACING
                yaw = generator.normal(0, 28) if facing else generator.uniform(-180, 180)
                colors.append(halved(sheet_colors(prepared.avatar, outfit.texture, placed)))
                trust.append(_smaller(sheet_trust(outfit, placed, pose, float(yaw), generator)))
                names.append(prepared.avatar.name)
            if progress:
                progress(at + 1, len(todo))
        with atomic_path(path) as temporary, open(temporary, "wb") as file:
            np.savez(file, colors=np.stack(colors), trust=np.stack(trust), names=np.array(names))


def halved(colors: ByteArray) -> ByteArray:
    """Halve sheets of colors (2, H, W, 3); only pixels of the body count."""
    filled = skin_sheets()[0].filled.astype(np.float32)
    result = np.zeros((2, ROWS // 2, COLUMNS // 2, 3), np.uint8)
    for side in (0, 1):
        weight = _smaller(filled[side])
        value = _smaller(colors[side].astype(np.float32) * filled[side][..., None])
        result[side] = np.rint(value / np.maximum(weight, 1e-6)[..., None])
    return result


def _smaller(image: np.ndarray) -> np.ndarray:
    """Halve an image (H, W[, C]) or both sheets (2, H, W)."""
    if image.ndim == 3 and len(image) == 2:
        return np.stack([_smaller(one) for one in image])
    height, width = image.shape[:2]
    return np.asarray(cv2.resize(image, (width // 2, height // 2), interpolation=cv2.INTER_AREA))
