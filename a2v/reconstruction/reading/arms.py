"""Find arms and hands in the photo by landmarks and skin color, even if the fitted arms
are elsewhere."""

from __future__ import annotations

import numpy as np

from a2v.body.parts import PARTS
from a2v.reconstruction.reading.skin import (
    is_skin,
    like_skin,
    photo_and_tone,
    tone_of,
    within_mask,
)
from a2v.types import Body, BoolArray, ByteArray, Camera, FloatArray, IntArray, Subject

_SIDES = {"left": (11, 13, 15, (17, 19)), "right": (12, 14, 16, (18, 20))}
"""BlazePose's shoulder, elbow, wrist and the knuckles of little and index finger."""
_LOWER = 0.05
"""Half the width of a forearm in its sleeve, meters."""
_PALM = 0.045
"""Half the width of a hand of which only the knuckles are known, meters."""
_FINGER = 0.014
"""Half the width of a finger, meters."""
_REACH = 1.9
"""Distance of the end of a hand from the wrist, in distances of its knuckles."""
_SURE = 0.5
"""Landmarks of less confidence are not used."""
_OFF = 0.06
"""Distance of elbow or wrist from their landmarks above which the fit of an arm is wrong,
meters."""
_BEHIND = -0.12
"""Depth of a wrist relative to its shoulder below which the trunk may occlude it, meters."""
_GLOVE = 0.25
"""Share of skin below which hands wear gloves."""
_NO_SKIN = 0.1
"""A hand wears a glove if less than this share of its pixels is skin, in any light."""
_NOT_BARE = 0.25
"""Share of skin up to which the other hand may wear a glove, too."""
_ISOLATED = 0.04
"""Distance from all parts but the forearm at which a fitted hand shows itself, meters: hands in
pockets and on cloth do not."""
_MOST_OF_IT = 0.5
"""Smallest share of a fitted hand that is isolated and lies at the landmarks of the hand."""
_ONE_COLOR = 0.5
"""Smallest share of the pixels of gloves with their typical color."""
_FEW_OF_HAND = (40, 15)
"""Smallest number of pixels of a hand that wears a glove, and of the other hand."""
_BARE_ARM = 0.65
"""Smallest share of a forearm's pixels that look like skin if it is bare."""
_SKIN_SHIRT = 0.3
"""Share of such pixels on the trunk from which on cloth has the color of skin."""
_FEW_OF_ARM = 200
"""Smallest number of pixels of a forearm that tell whether it is bare."""
_LEAST = 30
"""Smallest number of pixels of hands that give their color."""
_FINGERS = (
    (0, 1, 2, 3, 4),
    (0, 5, 6, 7, 8),
    (5, 9, 10, 11, 12),
    (9, 13, 14, 15, 16),
    (13, 17, 18, 19, 20),
    (0, 17),
)


def arms_by_landmarks(
    subject: Subject, body: Body, camera: Camera, shape: tuple[int, int], step: int
) -> tuple[BoolArray, BoolArray]:
    """Pixels of forearms and hands by the landmarks, and the parts for which these are better than
    the fit.

    Parameters
    ----------
    body : Body
        Fitted.
    shape : (h, w)
        Of the picture at every `step`-th pixel.

    Returns
    -------
    (P, h, w) bool, set for forearms and hands only, and (P,) bool: forearms and hands whose fit is
    wrong, and hands whose fingers were found.
    """
    found, better = np.zeros((len(PARTS), *shape), bool), np.zeros(len(PARTS), bool)
    scale = camera.scale / step
    for number, (side, letter) in enumerate((("left", ".L"), ("right", ".R"))):
        shoulder, elbow, wrist, knuckles = _SIDES[side]
        points = subject.keypoints[:, :2].astype(np.float64) / step
        sure = subject.keypoints[[elbow, wrist], 2].min() > _SURE
        ahead = subject.keypoints_3d[wrist, 2] - subject.keypoints_3d[shoulder, 2]
        arm, hand = PARTS.index(f"{side}_lower_arm"), PARTS.index(f"{side}_hand")
        seen = subject.hands is not None and bool(subject.hands[number, 0, 3] > 0)
        if sure and not ahead < _BEHIND:
            found[arm] = _strokes([points[[elbow, wrist]]], _LOWER * scale, shape)
            middle = points[list(knuckles)].mean(axis=0)
            found[hand] = _strokes(
                [np.stack([points[wrist], points[wrist] + _REACH * (middle - points[wrist])])],
                _PALM * scale,
                shape,
            )
            joints = np.stack(
                [
                    body.bone_transforms[body.bone_names.index(f"{bone}{letter}"), :3, 3]
                    for bone in ("lowerarm01", "wrist")
                ]
            )
            off = np.linalg.norm(
                camera.project(joints.astype(np.float64)) / step - points[[elbow, wrist]], axis=1
            ).max()
            better[[arm, hand]] = off > _OFF * scale
        if seen:
            assert subject.hands is not None
            own = subject.hands[number, :, :2].astype(np.float64) / step
            found[hand] = _strokes(
                [own[list(finger)] for finger in _FINGERS], _FINGER * scale, shape
            )
            better[hand] = True
    return found, better


def bare_hands(subject: Subject, arms: BoolArray) -> BoolArray | None:
    """Return which pixels (h, w), every `STEP`-th, look like the skin of the face. None if the face
    is not visible or the hands wear gloves.

    Parameters
    ----------
    arms : (P, h, w) bool
        Of `arms_by_landmarks`.
    """
    found = photo_and_tone(subject, arms.shape[1:])
    if found is None:
        return None
    lab, face = found
    known: list[FloatArray | None] = [face]
    for number, side in enumerate(("left", "right")):
        if subject.hands is not None and subject.hands[number, 0, 3] > 0:
            known.append(tone_of(lab[arms[PARTS.index(f"{side}_hand")]]))
    tones = [tone for tone in known if tone is not None]
    like = np.any([like_skin(lab, tone) for tone in tones], axis=0)
    for number, side in enumerate(("left", "right")):
        own = arms[PARTS.index(f"{side}_hand")]
        if (
            subject.hands is not None
            and subject.hands[number, 0, 3] > 0
            and own.any()
            and like[own].mean() < _GLOVE
        ):
            return None
    return np.asarray(like)


def bare_forearms(
    subject: Subject, arms: BoolArray, skin: BoolArray | None, shown: IntArray
) -> tuple[str, ...]:
    """Names of the forearms without sleeves; both if the photo shows only one, and it is bare.

    Parameters
    ----------
    arms : (P, h, w) bool
        Of `arms_by_landmarks`.
    skin : (h, w) bool, optional
        Of `bare_hands`.
    shown : (h, w) int
        Part that the posed body shows on every pixel; -1 for none.
    """
    inside = within_mask(subject, shown.shape)
    trunk = (shown == PARTS.index("torso")) & inside & ~arms.any(axis=0)
    if skin is None or not trunk.any() or skin[trunk].mean() > _SKIN_SHIRT:
        return ()
    names = tuple(f"{side}_lower_arm" for side in _SIDES)
    told = {name: arms[PARTS.index(name)] & inside for name in names}
    told = {name: own for name, own in told.items() if own.sum() >= _FEW_OF_ARM}
    bare = tuple(name for name, own in told.items() if skin[own].mean() > _BARE_ARM)
    return names if len(bare) == len(told) == 1 else bare


def gloves(subject: Subject, arms: BoolArray, shown: IntArray, scale: float) -> BoolArray | None:
    """Return which pixels (h, w), every `STEP`-th, have the color of the gloves; None if the photo
    does not clearly show gloves.

    A hand wears a glove if its pixels have no color of skin, although the face has. Its pixels are
    those of the fingers that mediapipe found, else those of a fitted hand that is far from all
    other parts and lies at its landmarks. The other hand must not be bare.

    Parameters
    ----------
    arms : (P, h, w) bool
        Of `arms_by_landmarks`.
    shown : (h, w) int
        Part that the posed body shows on every `STEP`-th pixel; -1 for none.
    scale : float
        Pixels of `shown` per meter.
    """
    import cv2

    found = photo_and_tone(subject, shown.shape)
    if found is None:
        return None
    lab, tone = found
    mask = within_mask(subject, shown.shape)
    skin = like_skin(lab, tone) | is_skin(lab)
    worn = np.zeros(shown.shape, bool)
    for number, side in enumerate(("left", "right")):
        hand, arm = (PARTS.index(f"{side}_{name}") for name in ("hand", "lower_arm"))
        own = (shown == hand) & arms[hand] & mask
        if own.sum() >= _FEW_OF_HAND[1] and skin[own].mean() > _NOT_BARE:
            return None
        if subject.hands is not None and subject.hands[number, 0, 3] > 0:
            told = arms[hand] & mask
        else:
            other = (shown >= 0) & (shown != hand) & (shown != arm)
            away = cv2.distanceTransform((~other).astype(np.uint8), cv2.DIST_L2, 5) / scale
            told = own & (away > _ISOLATED)
            if told.sum() < _MOST_OF_IT * (shown == hand).sum():
                continue
        if told.sum() >= _FEW_OF_HAND[0] and skin[told].mean() < _NO_SKIN:
            worn |= told
    if not worn.any():
        return None
    like = like_skin(lab, np.median(lab[worn], axis=0))
    return like if like[worn].mean() > _ONE_COLOR else None


def tone_of_hands(image: ByteArray, like: BoolArray | None, arms: BoolArray) -> FloatArray | None:
    """Return the color (3,), sRGB in [0, 1], of the hands or gloves in a picture (H, W, 3), else of
    all pixels (h, w) `like` them; None if unknown. `arms` (P, h, w) is that of
    `arms_by_landmarks`."""
    import cv2

    if like is None or not like.any():
        return None
    hands = like & arms[[name.endswith("hand") for name in PARTS]].any(axis=0)
    small = cv2.resize(image, like.shape[::-1], interpolation=cv2.INTER_AREA)
    return np.asarray(np.median(small[hands if hands.sum() > _LEAST else like], axis=0) / 255.0)


def _strokes(lines: list[FloatArray], width: float, shape: tuple[int, int]) -> BoolArray:
    """Pixels (h, w) within `width` of polylines (n, 2); with several polylines, also the hull of
    their first two points."""
    import cv2

    drawn = np.zeros(shape, np.uint8)
    for line in lines:
        cv2.polylines(drawn, [np.rint(line).astype(np.int32)], False, 1, max(1, round(2 * width)))
    if len(lines) > 1:
        palm = np.concatenate([line[:2] for line in lines])
        cv2.fillConvexPoly(drawn, cv2.convexHull(np.rint(palm).astype(np.int32)), 1)
    return drawn > 0
