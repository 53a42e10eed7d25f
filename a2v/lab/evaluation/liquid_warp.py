"""Films of Liquid Warping GAN: its generator's inputs from a photo and a posed body, and its
pictures."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from a2v.errors import InputError
from a2v.geometry.rays import Hits, RayScene
from a2v.io import read_bytes
from a2v.lab.evaluation.warp import directions
from a2v.lab.studio.obj import parse_obj
from a2v.reconstruction.implicit.inputs import make_frame
from a2v.rendering import ViewCamera
from a2v.types import Body, ByteArray, FloatArray, IntArray, OrthographicCamera, Subject

if TYPE_CHECKING:
    from torch import Tensor

    from a2v.lab.evaluation.liquid import Generator

MAX_BYTES = 64 << 20
GROWN_FRONT = 3
"""Pixels by which the body is dilated where the photo's person is cut out."""
GROWN_BACK = 13
"""Pixels by which the person is dilated to find the background."""
NOWHERE = -2.0


def read_face_texture(path: str | os.PathLike[str], faces: IntArray) -> FloatArray:
    """Read the texture coordinates (F, 3) by which the generator identifies a body's faces (F, 3).

    The three numbers of a face are u and v (downwards) of the middle of its first edge, and 0.

    Parameters
    ----------
    path
        An OBJ of SMPL's mesh with texture coordinates (the published ``mapper.txt``, or the model's
        own).

    Raises
    ------
    InputError
        The file is not such an OBJ, or lacks a face of the body.
    """
    name = Path(path).name
    try:
        mesh = parse_obj(read_bytes(path, limit=MAX_BYTES).decode("ascii"), name)
    except UnicodeDecodeError:
        raise InputError(
            f"{name} is not an OBJ file with texture coordinates (lines vt u v, f v/vt ...)"
        ) from None
    found = {tuple(sorted(face)): index for index, face in enumerate(mesh.faces.tolist())}
    chosen = [found.get(tuple(sorted(face)), -1) for face in faces.tolist()]
    if min(chosen) < 0:
        raise InputError(
            f"{name} lacks faces of the body; expected the OBJ of SMPL's mesh, and "
            "--fit.model with SMPL's file"
        )
    middles = mesh.uv[chosen][:, :2].mean(axis=1)
    return np.asarray(
        np.stack([middles[:, 0], 1 - middles[:, 1], 0 * middles[:, 0]], axis=1), np.float32
    )


class LiquidWarp:
    """The photo's person, moved by the generator.

    Parameters
    ----------
    generator : Generator
    texture : (F, 3)
        Result of `read_face_texture`.
    subject, body, camera
        As for `a2v.lab.evaluation.warp.Warp`; the body is SMPL's.
    pixels : int
        Side of the generator's pictures.
    """

    def __init__(
        self,
        generator: Generator,
        texture: FloatArray,
        subject: Subject,
        body: Body,
        camera: OrthographicCamera,
        *,
        pixels: int = 256,
    ) -> None:
        import cv2
        import torch

        self._generator, self._texture, self._pixels = generator, texture, pixels
        self._vertices, self._faces = np.asarray(body.vertices, np.float32), body.faces
        frame = make_frame(subject.image, subject.mask, camera, pixels)
        self._camera = frame.camera
        self._picture = _as_input(frame.image)
        hits = self._seen_in_photo()
        condition = self._condition(hits)
        grown = cv2.dilate(
            hits.hit.reshape(pixels, pixels).astype(np.uint8),
            np.ones((GROWN_FRONT, GROWN_FRONT), np.uint8),
        )
        person = cv2.dilate(
            (frame.mask > 0.5).astype(np.uint8), np.ones((GROWN_BACK, GROWN_BACK), np.uint8)
        )
        with torch.inference_mode():
            self._background = generator.background(self._picture, _as_mask(person))
            self._features = generator.read(self._picture * _as_mask(grown), condition)

    def frame(self, posed: FloatArray, view: ViewCamera, size: int) -> ByteArray:
        """Render a picture (size, size, 3) uint8 of the posed body in front of the photo's
        background.

        `posed` are the vertices (V, 3), meters, seen by `view`.
        """
        import cv2
        import torch

        side = self._pixels
        hits = RayScene(posed, self._faces).cast(
            np.tile(np.asarray(view.origin, np.float32), (side * side, 1)), directions(view, side)
        )
        places = torch.from_numpy(self.places(hits)).view(1, side, side, 2)
        with torch.inference_mode():
            moved = torch.nn.functional.grid_sample(
                self._picture, places, mode="bilinear", padding_mode="zeros", align_corners=True
            )
            drawn, behind = self._generator.draw(
                self._features, moved, self._condition(hits), places
            )
            picture = (behind * self._background + (1 - behind) * drawn)[0].permute(1, 2, 0).numpy()
        return np.asarray(
            cv2.resize(
                np.clip(127.5 * picture + 127.5, 0, 255).astype(np.uint8),
                (size, size),
                interpolation=cv2.INTER_CUBIC,
            )
        )

    def places(self, hits: Hits) -> FloatArray:
        """Return the places (n, 2) in the photo's square, [-1, 1], of the body's points hit by rays
        (n,); `NOWHERE` for misses."""
        out = np.full((len(hits.hit), 2), NOWHERE, np.float32)
        out[hits.hit] = (
            self._camera.project(hits.interpolate(self._vertices, self._faces)) / (self._pixels / 2)
            - 1
        )
        return out

    def _seen_in_photo(self) -> Hits:
        """Hits of the body's faces at the centers of the square's pixels."""
        middles = np.arange(self._pixels) + 0.5
        u, v = np.meshgrid(middles, middles)
        x, y = (
            (u - self._camera.center_u) / self._camera.scale,
            (self._camera.center_v - v) / self._camera.scale,
        )
        origins = np.stack(
            [x, y, np.full_like(x, 1 + self._vertices[:, 2].max())], axis=-1
        ).reshape(-1, 3)
        return RayScene(self._vertices, self._faces).cast(
            origins.astype(np.float32), np.array([0, 0, -1], np.float32)
        )

    def _condition(self, hits: Hits) -> Tensor:
        """Return texture coordinates and background (1, 3, S, S) of the hits of a square's rays."""
        import torch

        values = np.tile(np.array([0, 0, 1], np.float32), (len(hits.hit), 1))
        values[hits.hit] = self._texture[hits.face[hits.hit]]
        return torch.from_numpy(values.T.reshape(1, 3, self._pixels, self._pixels).copy())


def _as_input(image: ByteArray) -> Tensor:
    import torch

    return torch.from_numpy((image.astype(np.float32) / 127.5 - 1).transpose(2, 0, 1)[None].copy())


def _as_mask(mask: ByteArray) -> Tensor:
    import torch

    return torch.from_numpy(mask.astype(np.float32)[None, None])
