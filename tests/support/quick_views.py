"""Quick views of ellipses with consistent places, depths and landmarks, for tests without data."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from a2v.lab.studio.quick.settings import SHARD
from a2v.lab.studio.quick.views import MAP, PHOTO, QuickShard, QuickView, shard_path


def invented_view(generator: np.random.Generator) -> QuickView:
    """An upright ellipse, colored by its places, and landmarks on it."""
    middle, radii = generator.uniform(0.45, 0.55, 2), generator.uniform([0.1, 0.3], [0.2, 0.4])

    def inside(size: int) -> tuple[np.ndarray, np.ndarray]:
        at = (np.stack(np.meshgrid(np.arange(size), np.arange(size)), axis=-1) + 0.5) / size
        across = (at - middle) / radii
        return across, 1 - (across**2).sum(axis=-1)

    across, height = inside(MAP)
    seen = height > 0
    thick = 0.1 * np.sqrt(np.where(seen, height, np.nan))
    places = np.where(
        seen[..., None],
        np.stack([across[..., 0], -across[..., 1], np.zeros_like(height)], axis=-1),
        0,
    )
    large, high = inside(PHOTO)
    color = np.clip(127 + 100 * large, 0, 255)
    image = np.where(
        high[..., None] > 0,
        np.concatenate([color, np.full((PHOTO, PHOTO, 1), 90)], axis=-1),
        generator.integers(0, 255, 3),
    )
    marks = generator.uniform(-0.6, 0.6, (33, 2))
    return QuickView(
        photo=cv2.imencode(".jpg", image.astype(np.uint8)[..., ::-1])[1].ravel(),
        mask=high > 0,
        things=np.zeros((PHOTO, PHOTO), bool),
        places=np.rint(127 * places).astype(np.int8),
        front=(0.2 + thick).astype(np.float16),
        back=(0.2 - thick).astype(np.float16),
        landmarks=np.concatenate([middle + marks * radii, np.full((33, 1), 0.2)], axis=1).astype(
            np.float32
        ),
        scale=0.5,
        yaw=0.0,
    )


def write_invented(folder: Path, *, training: int = 1, validation: int = 1) -> Path:
    """A folder of shards of such views."""
    for number, (split, count) in enumerate((("training", training), ("validation", validation))):
        for shard in range(count):
            generator = np.random.default_rng([number, shard])
            QuickShard.of([invented_view(generator) for _ in range(SHARD)]).save(
                shard_path(folder, split, shard)
            )
    return folder
