"""Average MakeHuman's skins (CC0) to the mean face, ``a2v/reconstruction/canonical/mean_face.npz``.

    python scripts/make_mean_face.py ../shared/data/makehuman_cc0.zip

The skins lie on the model's average face, seen from the front. Skins of old people are left out.
"""

from __future__ import annotations

import sys
import zipfile

import cv2
import numpy as np
import torch

from a2v.body.face import SKIN, points_on_face, texture_corners
from a2v.body.registry import load_body_model
from a2v.geometry.colors import srgb_to_linear
from a2v.geometry.images import sample_image
from a2v.geometry.rays import RayScene, at_barycentric
from a2v.io import write_npz
from a2v.reconstruction.canonical.mean_face import EXTENT, MEAN_FACE, STEPS
from a2v.types import FloatArray

SIZE = 256
"""Width of the picture, pixels."""
CHEEKS = (50, 280, 101, 330, 117, 346)
"""The detector's landmarks at which a skin has its tone."""
AROUND = 2
"""Pixels around them that count."""


def main() -> None:
    """Write the file."""
    model = load_body_model("anny")
    rest = model.rest(torch.tensor(model.shape_default, dtype=torch.float32))[0]
    vertices = rest.detach().numpy().reshape(-1, 3)
    faces = np.flatnonzero((model.faces < SKIN.stop).all(axis=1))
    points = points_on_face(vertices)
    middle, scale = points[:, :2].mean(axis=0), SIZE / EXTENT
    places = (points[:, :2] - middle) * [1, -1] * scale + SIZE / 2
    rows, columns = np.mgrid[:SIZE, :SIZE] + 0.5
    origins = np.ones((SIZE * SIZE, 3))
    origins[:, 0] = ((columns - SIZE / 2) / scale + middle[0]).ravel()
    origins[:, 1] = (-(rows - SIZE / 2) / scale + middle[1]).ravel()
    hits = RayScene(vertices, model.faces[faces]).cast(origins, np.array([0.0, 0.0, -1.0]))
    corners = texture_corners(model.faces)[faces[hits.face[hits.hit]]]
    at = at_barycentric(corners, hits.barycentric[hits.hit])
    ratios = []
    with zipfile.ZipFile(sys.argv[1]) as archive:
        for name in archive.namelist():
            if "/skins/textures/" in name and "diffuse" in name and "/old_" not in name:
                texture = cv2.imdecode(np.frombuffer(archive.read(name), np.uint8), 1)[..., ::-1]
                picture = np.full((SIZE * SIZE, 3), np.nan)
                height, width = texture.shape[:2]
                picture[hits.hit] = sample_image(texture, at * [width, -height] + [0, height])
                ratios.append(_ratio(picture.reshape(SIZE, SIZE, 3) / 255, places))
    mean = np.nan_to_num(np.mean(ratios, axis=0))
    mean = (mean + mean[:, ::-1]) / 2
    logarithm = np.clip(np.rint(STEPS * mean), -127, 127).astype(np.int8)
    write_npz(
        MEAN_FACE,
        {"logarithm": logarithm, "places": (places / SIZE).astype(np.float32)},
        compress=True,
    )


def _ratio(picture: FloatArray, places: FloatArray) -> FloatArray:
    """Logarithm (S, S, 3) of linear light relative to that of the cheeks."""
    light = np.where(
        np.isnan(picture), np.nan, srgb_to_linear(np.clip(np.nan_to_num(picture), 1 / 255, 1))
    )
    tones = []
    for x, y in places[list(CHEEKS)].astype(int):
        around = light[y - AROUND : y + AROUND + 1, x - AROUND : x + AROUND + 1]
        tones.append(around.mean(axis=(0, 1)))
    return np.asarray(np.log(light / np.median(tones, axis=0)))


if __name__ == "__main__":
    main()
