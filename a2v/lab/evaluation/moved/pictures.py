"""Unlit pictures of a moved character and of the truth, and how they differ."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from a2v.geometry.mesh import vertex_normals
from a2v.lab.evaluation.reconstruction.maps import surface_maps
from a2v.lab.evaluation.reconstruction.measures import image_scores
from a2v.types import BoolArray, FloatArray, OrthographicCamera, Surface

SIDES: Mapping[str, float] = {"front": 0.0, "left": 90.0, "back": 180.0, "right": 270.0}
"""Turns about the vertical, degrees."""
HEAD_TURNS = (0, 35, 90, 145, 180)
"""Turns from which heads are compared, degrees."""
HEAD_HEIGHT = 0.3
"""Height of the pictures of heads below the top of the truth, meters."""
_MARGIN = 1.15
"""Side of a picture, in lengths of what it frames."""

Picture = tuple[FloatArray, BoolArray]
"""Colors (size, size, 3) and mask (size, size)."""


def pictures_of(true: Surface, size: int) -> list[Picture]:
    """Pictures of a person from each of `SIDES`."""
    return [seen(true, true.vertices, turn, size) for turn in SIDES.values()]


def heads_of(true: Surface, size: int) -> list[Picture]:
    """Pictures of the head of a standing person from each of `HEAD_TURNS`."""
    framed = _around_head(true.vertices)
    return [seen(true, framed, float(turn), size) for turn in HEAD_TURNS]


def picture_scores(
    vertices: FloatArray, pictures: Sequence[Picture], made: Surface, size: int
) -> dict[str, float]:
    """PSNR and SSIM over the union of both masks, means of `SIDES`, beside the `pictures` of a
    truth with `vertices` (V, 3)."""
    scores = []
    for turn, (colors, mask) in zip(SIDES.values(), pictures, strict=True):
        own, covered = seen(made, vertices, turn, size)
        scores.append(image_scores(own, colors, covered | mask))
    psnr, ssim = np.mean(scores, axis=0)
    return {"psnr": float(psnr), "ssim": float(ssim)}


def head_differences(
    vertices: FloatArray, heads: Sequence[Picture], made: Surface, size: int
) -> dict[str, float]:
    """Mean CIELAB difference (CIE 1976) between a character's head in the pose of the truth, with
    `vertices` (V, 3), and `heads_of` the truth where both are seen, by `HEAD_TURNS` ("head_35"),
    and its mean ("head")."""
    import cv2

    framed, found = _around_head(vertices), {}
    for turn, (colors, there) in zip(HEAD_TURNS, heads, strict=True):
        own, here = seen(made, framed, float(turn), size)
        labs = [cv2.cvtColor(np.float32(one), cv2.COLOR_RGB2LAB) for one in (own, colors)]
        away = np.linalg.norm(labs[0] - labs[1], axis=-1)
        found[f"head_{turn}"] = float(away[here & there].mean())
    return {"head": float(np.mean(list(found.values()))), **found}


def _around_head(vertices: FloatArray) -> FloatArray:
    """Two opposite corners (2, 3) of the box that frames the head of a standing person (V, 3)."""
    top = float(vertices[:, 1].max())
    high = vertices[vertices[:, 1] > top - HEAD_HEIGHT / 2]
    middle = np.array([high[:, 0].mean(), top - HEAD_HEIGHT / 2, high[:, 2].mean()])
    return np.asarray(middle + HEAD_HEIGHT / 2 / _MARGIN * np.array([[-1.0, -1, -1], [1, 1, 1]]))


def seen(
    surface: Surface, framed: FloatArray, turn: float, size: int
) -> tuple[FloatArray, BoolArray]:
    """A surface's colors (size, size, 3) and mask from a side, in the square around `framed` (V,
    3)."""
    middle = (framed.min(axis=0) + framed.max(axis=0)) / 2
    extent = _MARGIN * float(np.ptp(framed, axis=0).max())
    angle = np.radians(-turn)
    rotation = np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    )
    turned = dataclasses.replace(
        surface, vertices=((surface.vertices - middle) @ rotation.T).astype(np.float32)
    )
    camera = OrthographicCamera(scale=size / extent, center_u=size / 2, center_v=size / 2)
    normals = vertex_normals(
        turned.vertices.astype(np.float64), turned.faces.astype(np.int64)
    ).astype(np.float32)
    maps = surface_maps(turned, normals, camera, (size, size), size=size, side=1)
    return maps.colors, maps.mask
