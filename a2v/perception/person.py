"""The person in a photo: landmarks, mask, crop, and notes for the user."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.kinematics.names import BLAZEPOSE, LANDMARK_INDEX
from a2v.perception.apply_corrections import (
    correct_landmarks,
    draw_strokes,
    given_landmarks,
    given_sides,
    place_landmarks,
)
from a2v.perception.bodymap import look_at_body, mended
from a2v.perception.corrections import Corrections
from a2v.perception.cut import complete_standing
from a2v.perception.face import find_face
from a2v.perception.hands import find_hands
from a2v.perception.locate import crop_box, locate, resize
from a2v.perception.matting import keep_person, keep_soft, refine_mask
from a2v.types import BoolArray, ByteArray, FloatArray, Subject


@dataclass(frozen=True)
class PerceptionSettings:
    """Settings of finding the person.

    Attributes
    ----------
    confidence : float
        Minimum confidence of a detection, in (0, 1).
    max_side : int
        Largest longer side of the crop, pixels; larger crops are reduced.
    margin : float
        Border of the crop around the person, fraction of the person's longer side.
    refine : bool
        Refine the detector's mask at full resolution (a user's mask is never changed).
    face : bool
        Detect the landmarks of the face; without them the character has no expressions.
    hands : bool
        Detect the landmarks of the hands, from which the fingers are bent.
    bodymap : bool
        Use the body map network as well (`a2v.perception.bodymap`): it finds landmarks in 3D and
        the place on the body of each pixel.
    band : float
        Largest distance by which refinement moves the mask's contour, as a fraction of the person's
        height.
    """

    confidence: float = 0.5
    max_side: int = 2048
    margin: float = 0.1
    refine: bool = True
    face: bool = True
    hands: bool = True
    bodymap: bool = True
    band: float = 0.015

    def __post_init__(self) -> None:
        if not 0 < self.confidence < 1:
            raise InputError(f"confidence is {self.confidence}; expected a number between 0 and 1")
        if not 256 <= self.max_side <= 2048:
            raise InputError(f"max_side is {self.max_side}; expected 256 to 2048 pixels")
        if not 0 <= self.margin <= 1:
            raise InputError(f"margin is {self.margin}; expected 0 to 1")
        if not 0 < self.band <= 0.1:
            raise InputError(f"band is {self.band}; expected more than 0 and at most 0.1")


def find_person(
    photo: ByteArray,
    *,
    mask: FloatArray | BoolArray | ByteArray | None = None,
    keypoints: FloatArray | None = None,
    settings: PerceptionSettings | None = None,
    corrections: Corrections | None = None,
) -> Subject:
    """Find a person in a photo: by default the largest.

    Parameters
    ----------
    photo : (H, W, 3) or (H, W, 4) uint8
        Upright, as `decode_photo` gives it. An alpha channel with at least 2 % transparent pixels
        is taken as the mask.
    mask : (H, W) bool, uint8 or float in [0, 1], optional
        The user's mask of the person; it has priority over the alpha channel.
    keypoints : (33, 3), optional
        Landmarks in pixels of the photo (`a2v.perception.read_openpose`). They replace the
        detector's.
    settings, corrections : corrections replace detected and given values

    Raises
    ------
    InputError
        Nobody is found, or mask, keypoints or corrections do not fit the photo.
    """
    settings, (height, width) = settings or PerceptionSettings(), _size_of(photo)
    given_mask = _mask_of_alpha(photo) if mask is None else _check_mask(mask, height, width)
    given_points = _check_keypoints(keypoints, height, width)
    rgb, warnings = photo[..., :3], list[str]()
    right = (corrections or Corrections()).in_pixels(width, height)
    seen = locate(
        rgb,
        given_mask,
        given_points,
        confidence=settings.confidence,
        warnings=warnings,
        who=right.person,
    )
    rough = draw_strokes(seen.mask, right.strokes)
    crop = crop_box(rough, place_landmarks(seen.keypoints, right), (width, height), settings.margin)
    image, alpha_crop, cropped = _cut_out(rgb, rough, seen.keypoints, crop, settings.max_side)
    own = in_crop(right, crop, image)
    near = None if seen.others is None else seen.others[crop[1] : crop[3], crop[0] : crop[2]]
    alpha_crop = _with_strokes(
        keep_soft(alpha_crop)
        if given_mask is not None
        else _refined(image, alpha_crop, near, settings),
        own,
    )
    bodymap = look_at_body(image, alpha_crop) if settings.bodymap else None
    points, points_3d = cropped, seen.keypoints_3d
    if bodymap is not None:
        points, points_3d = mended(cropped, points_3d, bodymap, keep=given_points is not None)
    if _cut_below(alpha_crop, crop, height):
        points, points_3d = complete_standing(points, points_3d, image.shape[0])
    points, points_3d = correct_landmarks(points, points_3d, own)
    # the detector decides which landmarks are occluded or outside of the photo
    warnings += _warn(alpha_crop, place_landmarks(cropped, own), points_3d, crop, (width, height))
    return Subject(
        image=np.ascontiguousarray(image),
        mask=np.clip(alpha_crop, 0, 1).astype(np.float32),
        keypoints=points.astype(np.float32),
        keypoints_3d=points_3d.astype(np.float32),
        crop=crop,
        photo_size=(width, height),
        warnings=tuple(warnings),
        face=find_face(image, points) if settings.face else None,
        hands=find_hands(image, points) if settings.hands else None,
        bodymap=bodymap,
        given=given_landmarks(own),
        sides=given_sides(own),
        people=seen.boxes,
        provenance=_origins(given_mask is not None, given_points is not None, settings),
    )


def _with_strokes(mask: FloatArray, own: Corrections) -> FloatArray:
    """Draw the inner part of the strokes into the refined mask; raise if no person is left."""
    drawn = draw_strokes(mask, own.strokes, core=True)
    if (drawn > 0.5).sum() < 64:
        raise InputError(
            "no person found in the photo (the mask is empty); use a photo with one whole person, "
            "or give --mask"
        )
    return drawn


def corrected(subject: Subject, corrections: Corrections) -> Subject:
    """Apply corrections of landmarks and limbs to a subject that was found without them.

    The result equals that of `find_person`, except for face and hands.

    Raises
    ------
    InputError
        The corrections do not fit the photo.
    """
    own = in_crop(corrections.in_pixels(*subject.photo_size), subject.crop, subject.image)
    points, points_3d = correct_landmarks(subject.keypoints, subject.keypoints_3d, own)
    return dataclasses.replace(
        subject,
        keypoints=points,
        keypoints_3d=points_3d,
        given=given_landmarks(own),
        sides=given_sides(own),
    )


def in_crop(corrections: Corrections, crop: tuple[int, ...], image: ByteArray) -> Corrections:
    """Convert corrections from pixels of the photo to pixels of its crop `image` (h, w, 3)."""
    left, top, right, bottom = crop
    a, b = image.shape[1] / (right - left), image.shape[0] / (bottom - top)
    return corrections.scaled((a, b), (-left * a, -top * b), math.sqrt(a * b))


def _origins(
    mask_given: bool, keypoints_given: bool, settings: PerceptionSettings
) -> dict[str, str]:
    """Origin of each part of a subject."""
    return {
        "detector": "mediapipe pose, complexity 1",
        "mask": "given" if mask_given else "detector, refined" if settings.refine else "detector",
        "keypoints": "given"
        if keypoints_given
        else "detector, body map"
        if settings.bodymap
        else "detector",
    }


def _size_of(photo: ByteArray) -> tuple[int, int]:
    """Return height and width of a photo; raise `InputError` if it is not one."""
    if photo.ndim != 3 or photo.shape[2] not in (3, 4) or photo.dtype != np.uint8:
        raise InputError(
            f"the photo is an array {photo.shape} of {photo.dtype}; expected (H, W, 3 or 4) uint8 "
            "(use decode_photo)"
        )
    return photo.shape[0], photo.shape[1]


def _check_mask(mask: FloatArray | BoolArray | ByteArray, height: int, width: int) -> FloatArray:
    """Return the user's mask (H, W) as float32 in [0, 1], without islands."""
    if mask.shape != (height, width):
        got = f"{mask.shape[1]} x {mask.shape[0]}" if mask.ndim == 2 else str(mask.shape)
        raise InputError(f"the mask has {got} pixels; expected the photo's {width} x {height}")
    values = mask.astype(np.float32) / (255 if mask.dtype == np.uint8 else 1)
    if not np.isfinite(values).all() or values.min() < 0 or values.max() > 1:
        raise InputError(
            "the mask has values outside of 0 to 1; expected opacities (0 background, 1 person)"
        )
    if not (values > 0.5).any():
        raise InputError("the mask is empty; expected white on the person")
    return np.where(keep_person(values > 0.5) | (values <= 0.5), values, 0).astype(np.float32)


def _cut_out(
    rgb: ByteArray,
    mask: FloatArray,
    points: FloatArray,
    crop: tuple[int, int, int, int],
    max_side: int,
) -> tuple[ByteArray, FloatArray, FloatArray]:
    """Return picture, mask and landmarks inside `crop`, reduced to a longer side of at most
    `max_side` pixels."""
    left, top, right, bottom = crop
    scale = min(1.0, max_side / max(right - left, bottom - top))
    size = (max(1, round((right - left) * scale)), max(1, round((bottom - top) * scale)))
    points = points.copy()
    points[:, 0] = (points[:, 0] - left) * (size[0] / (right - left))
    points[:, 1] = (points[:, 1] - top) * (size[1] / (bottom - top))
    return (
        resize(rgb[top:bottom, left:right], size),
        resize(mask[top:bottom, left:right], size),
        points,
    )


def _mask_of_alpha(photo: ByteArray) -> FloatArray | None:
    """Return the mask (H, W) in a photo's alpha channel; None if it does not cut out a person."""
    if photo.shape[2] != 4:
        return None
    alpha = photo[..., 3]
    clear = float((alpha < 128).mean())
    if clear < 0.02:  # a cut corner, not a cut-out person
        return None
    if clear > 0.9999:
        raise InputError("the photo is transparent everywhere; expected a person in it")
    mask: FloatArray = alpha.astype(np.float32) / 255
    return mask


def _refined(
    image: ByteArray, rough: FloatArray, others: BoolArray | None, settings: PerceptionSettings
) -> FloatArray:
    """Refine the detector's mask (h, w) of the crop `image` if the settings enable it.

    The `others` (a mask of any resolution) are removed.
    """
    if not settings.refine:
        return rough
    if others is not None:
        rough = rough * (1 - resize(others.astype(np.float32), (image.shape[1], image.shape[0])))
    tall = float(np.ptp(np.nonzero(rough > 0.5)[0]) + 1) if (rough > 0.5).any() else 1.0
    return refine_mask(image, rough, height=tall, band=settings.band)


def _check_keypoints(keypoints: FloatArray | None, height: int, width: int) -> FloatArray | None:
    if keypoints is None:
        return None
    points = np.asarray(keypoints, np.float32)
    if points.shape != (len(BLAZEPOSE), 3) or not np.isfinite(points).all():
        raise InputError(
            f"keypoints have shape {points.shape}; expected finite (33, 3) in BlazePose order "
            "(use read_openpose)"
        )
    points = points.copy()
    points[:, 2] = np.clip(points[:, 2], 0, 1)
    inside = (points[:, :2] >= 0).all(axis=1) & (points[:, 0] <= width) & (points[:, 1] <= height)
    points[~inside, 2] = np.minimum(points[~inside, 2], 0.3)
    if (inside & (points[:, 2] > 0.1)).sum() < 4:
        raise InputError(
            f"fewer than 4 keypoints lie within the photo's {width} x {height} pixels; do they "
            "belong to this photo?"
        )
    return points


def _cut_below(alpha: FloatArray, crop: tuple[int, int, int, int], height: int) -> bool:
    """Return whether the lower edge of a photo of `height` pixels cuts off the person with the mask
    `alpha` (h, w)."""
    solid = alpha > 0.5
    tall = int(np.ptp(np.flatnonzero(solid.any(axis=1))) + 1)
    return crop[3] >= height and _touches(solid[-2:].any(axis=0), tall)


def _touches(line: BoolArray, tall: int) -> bool:
    """Return whether a person `tall` pixels high touches the edge whose pixels `line` (n,) are the
    person's."""
    return bool(line.sum() > max(3.0, 0.02 * tall))


def _warn(
    alpha: FloatArray,
    points: FloatArray,
    points_3d: FloatArray,
    crop: tuple[int, int, int, int],
    size: tuple[int, int],
) -> list[str]:
    """Return notes for the user about problems of this photo."""
    messages: list[str] = []
    solid = alpha > 0.5
    rows = np.nonzero(solid.any(axis=1))[0]
    tall = rows[-1] - rows[0] + 1
    conf = points[:, 2]
    at_bottom = _cut_below(alpha, crop, size[1])
    feet = [
        LANDMARK_INDEX[name] for name in ("left_ankle", "right_ankle", "left_heel", "right_heel")
    ]
    feet_out = (points[feet, 1] > alpha.shape[0]).any() and crop[3] >= size[1]
    if feet_out or (at_bottom and conf[feet].max() < 0.9):
        messages.append(
            "the feet are cut off by the photo's lower edge: legs and feet are guessed and the "
            "ground may be off"
        )
    elif at_bottom:
        messages.append("the person touches the photo's lower edge: feet may be cut off")
    if crop[1] <= 0 and (
        _touches(solid[:2].any(axis=0), tall) or points[LANDMARK_INDEX["nose"], 1] < 0
    ):
        messages.append(
            "the head is cut off by the photo's upper edge: it is guessed from the body model"
        )
    if (crop[0] <= 0 and _touches(solid[:, :2].any(axis=1), tall)) or (
        crop[2] >= size[0] and _touches(solid[:, -2:].any(axis=1), tall)
    ):
        messages.append("the person is cut off by the photo's side: what lies outside is guessed")

    left, right = LANDMARK_INDEX["left_shoulder"], LANDMARK_INDEX["right_shoulder"]
    across = points_3d[left] - points_3d[right]
    if np.isfinite(across).all():
        yaw = float(np.degrees(np.arctan2(-across[2], across[0])))
    else:
        hips = points[[LANDMARK_INDEX["left_hip"], LANDMARK_INDEX["right_hip"]], :2].mean(axis=0)
        trunk = float(np.linalg.norm(points[[left, right], :2].mean(axis=0) - hips)) or 1.0
        flat = float(points[left, 0] - points[right, 0]) / trunk
        yaw = float(np.degrees(np.arccos(np.clip(flat / 0.75, -1, 1))))
    if abs(yaw) > 115:
        messages.append(
            "the person is turned away from the camera: the unseen front, face included, is guessed"
        )
    elif abs(yaw) > 50:
        messages.append(
            "the person stands sideways: the far arm and the far half are guessed; a photo from "
            "the front works better"
        )

    hidden = []
    for side in ("left", "right"):
        elbow, wrist = LANDMARK_INDEX[f"{side}_elbow"], LANDMARK_INDEX[f"{side}_wrist"]
        if min(conf[elbow], conf[wrist]) < 0.5:
            hidden.append(side)
    if hidden:
        messages.append(
            f"the {' and '.join(hidden)} arm is hidden or outside the photo: its pose is guessed"
        )
    if tall * max(1.0, (crop[3] - crop[1]) / alpha.shape[0]) < 256:
        messages.append(
            f"the person is only {tall} pixels tall: expect a soft texture and a coarse shape "
            "(400 pixels or more work well)"
        )
    return messages
