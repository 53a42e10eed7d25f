"""Shared parts of character formats: checked clips, local transforms, expressions, textures,
colors."""

from __future__ import annotations

import io
from collections.abc import Mapping

import numpy as np

from a2v.errors import InputError
from a2v.geometry.vectors import unit
from a2v.types import ByteArray, Face, FloatArray, IntArray, Surface

Clips = Mapping[str, tuple[FloatArray, float]]
"""By name: bone transforms (T, B, 4, 4), world from bone, meters, and frames per second."""

Strengths = Mapping[str, Mapping[str, FloatArray]]
"""By clip and ARKit's names of expressions: strengths (T,), usually in [0, 1]."""


def check_clips(clips: Clips | None, bones: int) -> dict[str, tuple[FloatArray, float]]:
    """Check clips and return their transforms as (T, B, 4, 4) float64.

    Parameters
    ----------
    clips : Clips or None
    bones : int
        B, of the character.

    Raises
    ------
    InputError
        A clip has the wrong shape, is not finite, has no frames or no usable rate; the message
        names it.
    """
    return {name: _check_clip(name, clip, bones) for name, clip in (clips or {}).items()}


def _check_clip(name: str, clip: tuple[FloatArray, float], bones: int) -> tuple[FloatArray, float]:
    transforms, fps = np.asarray(clip[0], dtype=np.float64), float(clip[1])
    if transforms.ndim != 4 or transforms.shape[1:] != (bones, 4, 4) or len(transforms) == 0:
        raise InputError(
            f"clip '{name}' has bone transforms of shape {transforms.shape}; expected (T, {bones}, "
            "4, 4) with T >= 1"
        )
    if not np.isfinite(transforms).all():
        raise InputError(f"clip '{name}' holds NaN or infinite numbers")
    if not (np.isfinite(fps) and fps > 0):
        raise InputError(
            f"clip '{name}' runs at {fps} frames per second; expected a positive number"
        )
    return transforms, fps


def parent_from_bone(transforms: FloatArray, parents: IntArray) -> FloatArray:
    """Convert rigid transforms (T, B, 4, 4), world from bone, to transforms relative to the parents
    (B,); those of roots are unchanged."""
    local = transforms.copy()
    for bone, parent in enumerate(parents.tolist()):
        if parent >= 0:
            from_world = np.swapaxes(transforms[:, parent, :3, :3], 1, 2)
            local[:, bone, :3, :3] = from_world @ transforms[:, bone, :3, :3]
            local[:, bone, :3, 3] = np.einsum(
                "tab,tb->ta", from_world, transforms[:, bone, :3, 3] - transforms[:, parent, :3, 3]
            )
    return local


def strength_tables(
    face: Face | None, clips: Clips, expressions: Strengths | None
) -> dict[str, FloatArray]:
    """Return strengths (T, N) float32 of a face's N expressions in every clip that moves it; empty
    without a face.

    Raises
    ------
    InputError
        An expression is unknown, or its number of strengths differs from the frames of its clip.
    """
    tables: dict[str, FloatArray] = {}
    if face is None:
        return tables
    for clip, strengths in (expressions or {}).items():
        if clip not in clips or not strengths:
            continue
        frames = len(clips[clip][0])
        table = np.zeros((frames, len(face.names)), np.float32)
        for expression, values in strengths.items():
            if expression not in face.names or np.shape(values) != (frames,):
                raise InputError(
                    f"expression '{expression}' of shape {np.shape(values)}; expected ({frames},), "
                    f"and one of {', '.join(face.names)}"
                )
            table[:, face.names.index(expression)] = values
        tables[clip] = table
    return tables


class ShadedTargets:
    """A surface's expressions with their changes of normals. Without these, viewers shade a closed
    lid like an open one."""

    def __init__(self, surface: Surface):
        assert surface.face is not None
        self.face = surface.face
        self._vertices = surface.vertices.astype(np.float64)
        self._faces = surface.faces.astype(np.int64)
        self._crosses = self._cross(self._vertices, self._faces)
        self._sums = _gathered(self._faces, self._crosses, len(self._vertices))

    def __call__(self, name: str) -> tuple[IntArray, FloatArray, FloatArray]:
        """Ascending vertices (n,) whose position or normal the expression `name` changes, offsets
        (n, 3) of positions, meters, and of unit normals."""
        moved, offsets = self.face.target(name)
        vertices = self._vertices.copy()
        vertices[moved] += offsets
        is_moved = np.zeros(len(vertices), bool)
        is_moved[moved] = True
        near = is_moved[self._faces].any(axis=1)
        sums = self._sums + _gathered(
            self._faces[near],
            self._cross(vertices, self._faces[near]) - self._crosses[near],
            len(vertices),
        )
        turned = unit(sums, least=1e-20) - unit(self._sums, least=1e-20)
        places = np.flatnonzero(is_moved | (np.abs(turned).max(axis=1) > _LEAST_TURN))
        return (
            places,
            (vertices - self._vertices)[places].astype(np.float32),
            turned[places].astype(np.float32),
        )

    @staticmethod
    def _cross(vertices: FloatArray, faces: IntArray) -> FloatArray:
        corners = vertices[faces]
        return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


_LEAST_TURN = 0.02
"""Smaller changes of unit normals are dropped."""


def _gathered(faces: IntArray, values: FloatArray, count: int) -> FloatArray:
    """Return for each of `count` vertices the sum of the `values` (F, 3) of the faces around it."""
    return np.stack(
        [np.bincount(faces.ravel(), np.repeat(values[:, axis], 3), count) for axis in range(3)],
        axis=-1,
    )


def linear_colors(colors: FloatArray) -> FloatArray:
    """Convert sRGB vertex colors (V, 3) in [0, 1] to linear light (V, 3) float64, for glTF and
    USD."""
    encoded = np.clip(colors.astype(np.float64), 0, 1)
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def encode_texture(texture: ByteArray, quality: int) -> tuple[bytes, str]:
    """Encode a texture (H, W, 3) uint8 sRGB as JPEG of `quality` 1 to 100, or as PNG for 0; with
    its MIME type."""
    from PIL import Image

    stream = io.BytesIO()
    if quality > 0:
        Image.fromarray(texture).save(
            stream, format="JPEG", quality=min(quality, 100), subsampling=0
        )
        return stream.getvalue(), "image/jpeg"
    Image.fromarray(texture).save(stream, format="PNG")
    return stream.getvalue(), "image/png"
