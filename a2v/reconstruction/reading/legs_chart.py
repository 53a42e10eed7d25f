"""A chart of the legs: the photo and the mask, resampled along both legs, so that the pose changes
little. A small network finds skirts in it (`skirt`)."""

from __future__ import annotations

import numpy as np

from a2v.types import Body, BoolArray, ByteArray, Camera, FloatArray

SIDE = 96
"""Side of a chart, samples."""
ALONG = np.linspace(-0.35, 2.15, SIDE)
"""Places along both legs of the rows of a chart: 0 at the hip, 1 at the knee, 2 at the ankle."""
_WIDE = 0.55
"""Distance from the middle between the legs to the border of a chart, in lengths of a leg."""
_AXIS = 0.032
"""Standard deviation of the mark of a leg's axis, in lengths of a leg."""
_BONES = ("upperleg01", "lowerleg01", "foot")


def leg_joints(body: Body, camera: Camera) -> FloatArray:
    """Return hip, knee and ankle of the left and the right leg (2, 3, 3) in the photo: u, v and the
    depth toward the camera, pixels."""
    heads = np.stack(
        [
            body.bone_transforms[
                [body.bone_names.index(f"{bone}{side}") for bone in _BONES], :3, 3
            ].astype(np.float64)
            for side in (".L", ".R")
        ]
    )
    pixels = camera.project(heads.reshape(-1, 3)).reshape(2, 3, 2)
    return np.concatenate([pixels, camera.scale * heads[..., 2:]], axis=2)


def legs_chart(image: ByteArray, mask: FloatArray | BoolArray, legs: FloatArray) -> FloatArray:
    """Resample a photo along both legs: (6, 96, 96) float32, its rows down the legs (`ALONG`).

    The channels are red, green and blue in [0, 1], the mask, marks of the axes of the legs, and the
    half of `ALONG`.

    Parameters
    ----------
    image : (H, W, 3) uint8
        sRGB.
    mask : (H, W) float or bool
        Opacity of the person.
    legs : (2, 3, 3) float
        `leg_joints`.
    """
    import cv2

    length = float(np.linalg.norm(np.diff(legs, axis=1), axis=2).sum(axis=1).mean())
    axes = np.stack([_on_leg(leg[:, :2]) for leg in legs])
    middle = axes.mean(axis=0)
    down = (legs[:, 2, :2] - legs[:, 0, :2]).mean(axis=0)
    far = float(np.linalg.norm(down))
    down = down / far if far > 0.1 * length else np.array([0.0, 1.0])
    across, reach = np.array([down[1], -down[0]]), np.linspace(-_WIDE, _WIDE, SIDE) * length
    points = (middle[:, None] + reach[:, None] * across).astype(np.float32)
    width = max(1, int(2 * _WIDE * length / SIDE))
    # only the part of the photo that the chart shows, and what the blur reads beside it
    flat, size = points.reshape(-1, 2), np.array(image.shape[1::-1])
    corner = np.clip(np.floor(flat.min(axis=0)).astype(np.int64) - width - 2, 0, size - 1)
    end = np.maximum(np.ceil(flat.max(axis=0)).astype(np.int64) + width + 2, corner + 1)
    part = np.s_[corner[1] : end[1], corner[0] : end[0]]
    picture = np.dstack([image[part].astype(np.float32) / 255, np.asarray(mask[part], np.float32)])
    seen = cv2.remap(
        cv2.blur(picture, (width, width)),
        points[..., 0] - np.float32(0.5 + corner[0]),
        points[..., 1] - np.float32(0.5 + corner[1]),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    within = ((points >= 0) & (points < np.array(image.shape[1::-1]))).all(axis=2)
    seen[..., 3] *= within
    away = ((axes - middle) @ across)[..., None] - reach
    marks = np.exp(-0.5 * (away / (_AXIS * length)) ** 2).max(axis=0)
    places = np.broadcast_to(ALONG[:, None] / 2, marks.shape)
    channels = np.concatenate([seen.transpose(2, 0, 1), marks[None], places[None]])
    return np.asarray(channels, np.float32)


def _on_leg(joints: FloatArray) -> FloatArray:
    """Points (96, 2) at `ALONG` on a leg with these joints (3, 2); beyond them it is straight."""
    before, after = np.minimum(ALONG, 0.0), np.maximum(ALONG - 2.0, 0.0)
    inner = [np.interp(ALONG, [0.0, 1.0, 2.0], joints[:, k]) for k in (0, 1)]
    return np.asarray(
        np.stack(inner, axis=1)
        + before[:, None] * (joints[1] - joints[0])
        + after[:, None] * (joints[2] - joints[1])
    )
