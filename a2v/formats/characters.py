"""What every format of characters needs: clips that are checked, transforms in the parents' frames, encoded textures, linear colours."""

from __future__ import annotations

import io
from collections.abc import Mapping

import numpy as np

from a2v.errors import InputError
from a2v.types import ByteArray, FloatArray, IntArray

Clips = Mapping[str, tuple[FloatArray, float]]
"""By name: bone transforms (T, B, 4, 4), world from bone, metres, and frames per second."""

Strengths = Mapping[str, Mapping[str, FloatArray]]
"""By clip and ARKit's names of expressions: strengths (T,), usually in [0, 1]."""


def check_clips(clips: Clips | None, bones: int) -> dict[str, tuple[FloatArray, float]]:
    """Clips with their transforms as (T, B, 4, 4) float64.

    Parameters
    ----------
    clips : Clips or None
    bones : int
        B, of the character.

    Raises
    ------
    InputError
        A clip has the wrong shape, is not finite, has no frames or no usable rate; it is named.
    """
    return {name: _check_clip(name, clip, bones) for name, clip in (clips or {}).items()}


def _check_clip(name: str, clip: tuple[FloatArray, float], bones: int) -> tuple[FloatArray, float]:
    transforms, fps = np.asarray(clip[0], dtype=np.float64), float(clip[1])
    if transforms.ndim != 4 or transforms.shape[1:] != (bones, 4, 4) or len(transforms) == 0:
        raise InputError(f"clip '{name}' has bone transforms of shape {transforms.shape}; expected (T, {bones}, 4, 4) with T >= 1")
    if not np.isfinite(transforms).all():
        raise InputError(f"clip '{name}' holds NaN or infinite numbers")
    if not (np.isfinite(fps) and fps > 0):
        raise InputError(f"clip '{name}' runs at {fps} frames per second; expected a positive number")
    return transforms, fps


def parent_from_bone(transforms: FloatArray, parents: IntArray) -> FloatArray:
    """Rigid transforms (T, B, 4, 4), world from bone, relative to the parents' (B,); the roots' stay as they are."""
    local = transforms.copy()
    for bone, parent in enumerate(parents.tolist()):
        if parent >= 0:
            from_world = np.swapaxes(transforms[:, parent, :3, :3], 1, 2)
            local[:, bone, :3, :3] = from_world @ transforms[:, bone, :3, :3]
            local[:, bone, :3, 3] = np.einsum("tab,tb->ta", from_world, transforms[:, bone, :3, 3] - transforms[:, parent, :3, 3])
    return local


def linear_colors(colors: FloatArray) -> FloatArray:
    """Linear light (V, 3) float64 of sRGB vertex colours (V, 3) in [0, 1], as glTF and USD keep them."""
    encoded = np.clip(colors.astype(np.float64), 0, 1)
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def encode_texture(texture: ByteArray, quality: int) -> tuple[bytes, str]:
    """A texture (H, W, 3) uint8 sRGB as JPEG of a `quality` from 1 to 100, or as PNG for 0, and its MIME type."""
    from PIL import Image

    stream = io.BytesIO()
    if quality > 0:
        Image.fromarray(texture).save(stream, format="JPEG", quality=min(quality, 100), subsampling=0)
        return stream.getvalue(), "image/jpeg"
    Image.fromarray(texture).save(stream, format="PNG")
    return stream.getvalue(), "image/png"
