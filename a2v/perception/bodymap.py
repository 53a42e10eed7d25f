"""The body map: for each pixel of a person the place on the body and the depth, and 3D landmarks,
predicted by a network.

The network is BlazePose's, trained further in the studio (`a2v.lab.bodymap`). It cannot determine a
person's size, so all lengths are in pixels; all depths are measured over the floor from the middle
of the hips, as in `a2v.types.Subject`.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from a2v.errors import InputError
from a2v.kinematics.names import LANDMARK_INDEX, LIMBS_BY_HEIGHT, MIRRORED_BLAZEPOSE
from a2v.kinematics.stature import TYPICAL_HEIGHT
from a2v.perception.depth import HIPS, picture_plane
from a2v.sessions import open_session, read_metadata
from a2v.types import BodyMap, ByteArray, FloatArray

FORMAT = "a2v-bodymap/1"
FILE = Path(__file__).resolve().parent / "data" / "bodymap.onnx"
"""The shipped network; its card is in a2v/weights/README.md."""
PICTURE = 256
"""Side of the square that is the network's input, pixels."""
FILL = 0.8
"""Longer side of the person's box in that square."""
GRAY = 0.627
"""Color behind the person: the network has not learned from real backgrounds."""
_HALF_SURE = 0.02
"""Expected error of a landmark in the picture at which its weight is one half, relative to the
height."""
_OVERSURE = np.array([2.0, 0.7])
"""Factors on the network's expected errors in the picture and in depth. In the picture it is
overconfident on photographs; in depth the detector is even less reliable."""
_LEAST = 0.006
_DETECTOR = (0.02, 0.12)
"""Expected errors of the detector's landmarks in the picture and in depth, relative to the height
(docs/research/fitting.md)."""
_APART = 0.08
"""Distance relative to the height above which two landmarks are different places."""


def look_at_body(
    image: ByteArray, mask: FloatArray, *, weights: str | os.PathLike[str] = "", threads: int = 0
) -> BodyMap:
    """Predict the body map of a person: the mean over the photo and its mirror image.

    Parameters
    ----------
    image : (H, W, 3) uint8
        sRGB.
    mask : (H, W) float
        Opacity of the person.
    weights : path, optional
        File of another network; by default the shipped one.
    threads : int
        Of onnxruntime; 0 for its default.

    Raises
    ------
    InputError
        The mask is empty, or the file is not a body map network.
    """
    rows, columns = np.nonzero(mask > 0.5)
    if not len(rows):
        raise InputError("the mask is empty; expected white on the person")
    low, high = np.array([columns.min(), rows.min()]), np.array([columns.max(), rows.max()]) + 1
    middle, side = (low + high) / 2, float((high - low).max()) / FILL
    path = Path(weights or FILE)
    read_metadata(path, (FORMAT,), "body map network", threads)
    picture = _square(image, mask, middle, side)
    both = np.stack([picture, picture[:, :, ::-1]])
    points, scales, maps = open_session(path, threads).run(
        ["points", "log_scales", "maps"], {"picture": both}
    )
    points[1], scales[1], maps[1] = (
        points[1][MIRRORED_BLAZEPOSE],
        scales[1][MIRRORED_BLAZEPOSE],
        maps[1][:, :, ::-1],
    )
    points[1, :, 0] = 1 - points[1, :, 0]
    maps[1, 0] *= -1
    return _in_pixels(points.mean(axis=0), scales.mean(axis=0), maps.mean(axis=0), middle, side)


def height_in_pixels(landmarks: FloatArray) -> float:
    """Estimate a standing height, pixels, from the lengths of the limbs; landmarks are (33, 3)."""
    lengths = [
        np.linalg.norm(
            landmarks[LANDMARK_INDEX[f"{side}_{first}"]]
            - landmarks[LANDMARK_INDEX[f"{side}_{last}"]]
        )
        / ratio
        for (first, last), ratio in LIMBS_BY_HEIGHT.items()
        for side in ("left", "right")
    ]
    return max(float(np.median(lengths)), 1.0)


def mended(
    keypoints: FloatArray,
    keypoints_3d: FloatArray,
    found: BodyMap,
    *,
    keep: bool = False,
) -> tuple[FloatArray, FloatArray]:
    """Merge the detector's landmarks, `a2v.types.Subject.keypoints` and `keypoints_3d`, with the
    body map's: means weighted by their expected errors.

    The detector has seen more photographs, the network more poses. If the two are far apart, the
    landmark with the smaller expected error is taken, with less confidence.

    Parameters
    ----------
    keypoints : (33, 3)
        u, v in pixels, confidence.
    keypoints_3d : (33, 3)
        Meters; NaN where unknown.
    found : BodyMap
        Body map of the same picture.
    keep : bool
        The user has given `keypoints`; they replace the detector's and are not changed.

    Returns
    -------
    keypoints : (33, 3) float32
    keypoints_3d : (33, 3) float32
        Meters from the middle of the hips, y up, of a person of `TYPICAL_HEIGHT`.
    """
    height = height_in_pixels(found.landmarks)
    seen = keypoints[:, 2].astype(np.float64)
    own = np.maximum(_OVERSURE * found.landmark_scales / height, _LEAST)
    theirs = np.stack(
        [_DETECTOR[0] / np.sqrt(np.maximum(seen, 1e-3)), np.full(len(seen), _DETECTOR[1])], axis=1
    )
    gap = np.linalg.norm(keypoints[:, :2] - found.landmarks[:, :2], axis=1) / height
    share = 1 / (1 + (own / theirs) ** 2)
    apart = gap > _APART
    share[apart] = share[apart, :1] > 0.5  # never between two places
    deep = _depths_in_pixels(keypoints, keypoints_3d)
    share[~np.isfinite(deep), 1] = 1
    depth = (
        np.where(share[:, 1] == 1, 0, (1 - share[:, 1]) * np.nan_to_num(deep))
        + share[:, 1] * found.landmarks[:, 2]
    )
    if keep:
        share[:, 0] = seen <= 0.1
    pixels = share[:, :1] * found.landmarks[:, :2] + (1 - share[:, :1]) * keypoints[:, :2]
    spread = 1 / np.sqrt((1 / own**2 + 1 / theirs**2)[:, 0])
    sure = np.clip(1.3 / (1 + (spread / _HALF_SURE) ** 2), 0.05, 1) * np.where(apart, 0.5, 1)
    places = np.concatenate([pixels, depth[:, None]], axis=1)
    places = (
        (places - places[HIPS].mean(axis=0))
        * (TYPICAL_HEIGHT / height_in_pixels(places))
        * np.array([1.0, -1.0, 1.0])
    )
    merged = keypoints if keep else np.concatenate([pixels, sure[:, None]], axis=1)
    return merged.astype(np.float32), places.astype(np.float32)


def _depths_in_pixels(keypoints: FloatArray, keypoints_3d: FloatArray) -> FloatArray:
    """Return the detector's depths (33,) from the middle of the hips, pixels.

    NaN where they are unknown or do not agree with the picture.
    """
    if not np.isfinite(keypoints_3d).all():
        return np.full(len(keypoints), np.nan)
    _, scale = picture_plane(keypoints, keypoints_3d)
    if scale < 1.0:
        return np.full(len(keypoints), np.nan)
    return np.asarray(scale * (keypoints_3d[:, 2] - keypoints_3d[HIPS, 2].mean()))


def _square(image: ByteArray, mask: FloatArray, middle: FloatArray, side: float) -> FloatArray:
    """Return a square of the photo as (4, 256, 256) float32.

    The channels are RGB in [0, 1] of the person in front of gray, and the mask.
    """
    import cv2

    zoom = PICTURE / side
    shrink = max(1, int(1 / zoom))  # average areas first, to avoid aliasing
    height, width = image.shape[0] // shrink, image.shape[1] // shrink
    small, cover = image, mask.astype(np.float32)
    if shrink > 1:
        small, cover = (
            cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
            for picture in (image, cover)
        )
    across, down = image.shape[1] / small.shape[1], image.shape[0] / small.shape[0]
    # centers of pixels lie half a pixel in
    start = middle - side / 2
    move = np.array(
        [
            [zoom * across, 0, zoom * (across / 2 - start[0]) - 0.5],
            [0, zoom * down, zoom * (down / 2 - start[1]) - 0.5],
        ]
    )
    seen = cv2.warpAffine(
        small, move, (PICTURE, PICTURE), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    inside = (cv2.warpAffine(cover, move, (PICTURE, PICTURE), flags=cv2.INTER_LINEAR) > 0.5).astype(
        np.float32
    )
    picture = np.concatenate(
        [on_gray(seen.astype(np.float32) / 255, inside), inside[..., None]], axis=-1
    )
    return np.ascontiguousarray(picture.transpose(2, 0, 1))


def on_gray(
    picture: FloatArray, mask: FloatArray, *, softness: float = 1.0, gray: float | FloatArray = GRAY
) -> FloatArray:
    """Return a picture (H, W, 3) float32 of the person in front of a plain color.

    Parameters
    ----------
    picture : (H, W, 3) float32
        In [0, 1].
    mask : (H, W) float32
    softness : float
        Standard deviation of the mask's blur, pixels.
    gray : float or (3,)
        Color of the background.
    """
    import cv2

    opacity = cv2.GaussianBlur(mask, (0, 0), softness)[..., None]
    return np.asarray(opacity * picture + (1 - opacity) * gray, np.float32)


def _in_pixels(
    points: FloatArray, log_scales: FloatArray, maps: FloatArray, middle: FloatArray, side: float
) -> BodyMap:
    """Convert the network's output for a square around `middle` to pixels of the photo: landmarks
    (33, 3), scales (33, 2), maps (9, h, w)."""
    landmarks = np.concatenate(
        [middle + (points[:, :2] - 0.5) * side, points[:, 2:] * side], axis=1
    )
    return BodyMap(
        landmarks=landmarks.astype(np.float32),
        landmark_scales=(np.exp(log_scales) * side).astype(np.float32),
        places=np.ascontiguousarray(maps[:3].transpose(1, 2, 0), np.float32),
        place_scales=np.exp(np.clip(maps[7], -6, 1)).astype(np.float32),
        depths=np.ascontiguousarray(maps[3:5].transpose(1, 2, 0) * side, np.float32),
        depth_scales=np.ascontiguousarray(
            np.exp(np.clip(maps[5:7], -7, 0)).transpose(1, 2, 0) * side, np.float32
        ),
        inside=np.asarray(maps[8] > 0),
        corner=(float(middle[0] - side / 2), float(middle[1] - side / 2)),
        step=side / maps.shape[1],
    )
