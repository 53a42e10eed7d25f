"""Images and masks as functions on the plane: values at any position, contours, distances to them,
nearest pixels."""

from __future__ import annotations

import numpy as np

from a2v.types import BoolArray, ByteArray, FloatArray, IntArray


def sample_image(
    image: FloatArray | ByteArray, pixels: FloatArray, *, linear: bool = False
) -> FloatArray:
    """Sample an image (H, W, C) or (H, W) at pixel positions (N, 2), bicubic or bilinear.

    Returns (N, C) or (N,) float32. The center of the first pixel is at (0.5, 0.5). Positions
    outside the image get the value of the border.
    """
    return sample_index(image, columns=pixels[:, 0] - 0.5, rows=pixels[:, 1] - 0.5, linear=linear)


def sample_index(
    image: FloatArray | ByteArray, *, columns: FloatArray, rows: FloatArray, linear: bool = False
) -> FloatArray:
    """`sample_image` at fractional indices (N,) of an image, where the first pixel is at 0."""
    import cv2

    u, v = (np.ascontiguousarray(index, np.float32)[None] for index in (columns, rows))
    how = cv2.INTER_LINEAR if linear else cv2.INTER_CUBIC
    step = 30_000  # OpenCV's remap takes at most 32767 columns
    out = [
        cv2.remap(
            image, u[:, i : i + step], v[:, i : i + step], how, borderMode=cv2.BORDER_REPLICATE
        )[0]
        for i in range(0, u.shape[1], step)
    ]
    return np.concatenate(out) if out else np.zeros((0, *image.shape[2:]), np.float32)


def trace_contours(mask: FloatArray) -> list[FloatArray]:
    """Return closed contours u, v (n, 2) float64, pixels, at which an opacity (H, W) in [0, 1]
    crosses 1/2.

    Outside the image the opacity is 0.
    """
    from skimage.measure import find_contours

    # one pixel of padding minus half a pixel to its center
    return [line[:, ::-1] - 0.5 for line in find_contours(np.pad(mask, 1), 0.5)]


def contour_distance(person: BoolArray) -> FloatArray:
    """Return the signed distance (H, W) to the contour of a binary map, pixels, negative inside.

    The contour runs between the pixels.
    """
    import cv2

    out = cv2.distanceTransform((~person).astype(np.uint8), cv2.DIST_L2, 5)
    into = cv2.distanceTransform(person.astype(np.uint8), cv2.DIST_L2, 5)
    return np.where(person, 0.5 - into, out - 0.5)


def nearest_known(known: BoolArray) -> tuple[IntArray, IntArray]:
    """Return row and column, each (H, W) int32, of the nearest pixel that is `known` (H, W).

    At least one pixel must be known.
    """
    from scipy.ndimage import distance_transform_edt

    rows, columns = distance_transform_edt(~known, return_distances=False, return_indices=True)
    return rows, columns


def mask_iou(first: BoolArray, second: BoolArray) -> float:
    """Return the intersection over union of two masks of one shape, in [0, 1]; 1 if both are
    empty."""
    union = np.logical_or(first, second).sum()
    return float(np.logical_and(first, second).sum() / union) if union else 1.0
