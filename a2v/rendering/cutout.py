"""The person and its shadow without the stage, to be composited over any picture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.geometry.colors import linear_to_srgb, srgb_to_linear, to_bytes
from a2v.types import BoolArray, ByteArray, FloatArray, RenderSettings

LUMINANCE = np.array((0.2126, 0.7152, 0.0722), np.float32)
"""Weights of linear red, green and blue in the luminance (BT.709)."""

SHADOW_FLOOR = 0.02
"""Shadows fainter than this fraction of the light count as noise (measured; see
docs/rendering.md)."""


@dataclass(frozen=True, kw_only=True)
class Cutout:
    """The person and its shadow, to be composited over any picture; linear light, float32.

    `color` (H, W, 3) is the person's color times `alpha` (H, W), the fraction of each pixel that
    the person covers. `shade` (H, W) in [0, 1] is the fraction of its light that the ground keeps.
    """

    color: FloatArray
    alpha: FloatArray
    shade: FloatArray

    @classmethod
    def of(
        cls, person: FloatArray, share: FloatArray, alpha: FloatArray, shade: FloatArray
    ) -> Cutout:
        """Build a cutout from the traced light of the person.

        `person` (H, W, 3) is the person's light in each pixel, `share` (H, W) the fraction of its
        samples that hit the person, `alpha` (H, W) the fraction that the person covers, and `shade`
        (H, W) the fraction of its light that the ground keeps. Along the rim the color is extended
        from neighboring pixels that show only the person.
        """
        straight = person / np.maximum(share, 1e-3)[..., None]
        color = continued(straight, share > 0.98, straight)
        kept = np.clip(
            shade / (1 - SHADOW_FLOOR), 0, 1
        )  # noise of the renderer does not count as a shadow
        return cls(
            color=np.asarray(color * alpha[..., None], np.float32),
            alpha=alpha,
            shade=np.asarray(kept, np.float32),
        )

    def over(self, background: FloatArray) -> FloatArray:
        """Composite over a background (H, W, 3) or (3,) in linear RGB; returns (H, W, 3)."""
        return np.asarray(
            self.color + ((1 - self.alpha) * self.shade)[..., None] * background, np.float32
        )

    def rgba(self) -> ByteArray:
        """Return (H, W, 4) uint8, sRGB with straight alpha.

        The alpha is chosen so that the usual blend of sRGB values gives the right shadow.
        """
        shadow = (1 - self.alpha) * (1 - linear_to_srgb(self.shade))
        opacity = self.alpha + shadow
        straight = self.color / np.maximum(opacity, 1e-4)[..., None]
        return np.concatenate(
            [to_bytes(linear_to_srgb(straight)), to_bytes(opacity)[..., None]], axis=-1
        )


def continued(values: FloatArray, known: BoolArray, otherwise: FloatArray | float) -> FloatArray:
    """Return `values` (H, W, ...) with unknown pixels filled.

    Pixels that are not `known` get the mean of the known ones within 1, 2 or 3 pixels, or
    `otherwise` if there are none.
    """
    import cv2

    shape = (*known.shape, *[1] * (values.ndim - 2))
    weight = known.astype(np.float32)
    filled = np.where(known.reshape(shape), values, otherwise).astype(np.float32)
    masked = np.ascontiguousarray(values * weight.reshape(shape), np.float32)
    missing = ~known
    for width in (3, 5, 7):
        near = cv2.blur(weight, (width, width))
        use = missing & (near > 1e-3)
        filled[use] = (cv2.blur(masked, (width, width))[use].T / near[use]).T
        missing &= ~use
    return filled


def behind(settings: RenderSettings, backdrop: ByteArray | None) -> FloatArray | None:
    """Return the background of a cutout: linear RGB (size, size, 3) or (3,); None if it has
    none."""
    import cv2

    if settings.background == "image":
        if (
            backdrop is None
            or backdrop.ndim != 3
            or backdrop.shape[2] != 3
            or backdrop.dtype != np.uint8
        ):
            raise InputError(
                "the background is 'image', but there is no picture (height, width, 3) uint8; give "
                "one as backdrop"
            )
        width, height = settings.shape
        scale = min(
            backdrop.shape[1] / width, backdrop.shape[0] / height
        )  # the largest centered part with the aspect ratio of the frame
        wide, high = round(scale * width), round(scale * height)
        top, left = (backdrop.shape[0] - high) // 2, (backdrop.shape[1] - wide) // 2
        how = cv2.INTER_AREA if scale > 1 else cv2.INTER_CUBIC
        whole = np.zeros((settings.size, settings.size, 3), np.uint8)
        whole[settings.window] = cv2.resize(
            backdrop[top : top + high, left : left + wide], (width, height), interpolation=how
        )
        return srgb_to_linear(whole / np.float32(255))
    if settings.background.startswith("#"):
        return srgb_to_linear(
            np.array([int(settings.background[i : i + 2], 16) for i in (1, 3, 5)], np.float32) / 255
        )
    return None
