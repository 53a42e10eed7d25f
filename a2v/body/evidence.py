"""Evidence for a body in a photo: keypoints, depths along the limbs, the mask, standing legs."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from a2v.body.dense import DenseEvidence, gather_dense
from a2v.body.head import HEAD, head_from_face
from a2v.body.settings import FitSettings
from a2v.body.silhouette import MaskField, mask_field
from a2v.body.view import LEVEL, View, estimated_view
from a2v.errors import InputError
from a2v.kinematics import best_scale
from a2v.kinematics.names import BLAZEPOSE, LANDMARK_INDEX, LIMB_BONES, LIMBS_BY_HEIGHT
from a2v.kinematics.stance import leg_stance
from a2v.kinematics.stature import TYPICAL_HEIGHT
from a2v.types import BoolArray, FloatArray, IntArray, Subject

# Trust in each landmark, chosen by hand. The face and the hands have many landmarks, and their
# positions on a body are less certain.
_TRUST = {
    **dict.fromkeys(BLAZEPOSE, 0.4),
    "nose": 0.7,
    **{
        f"{side}_{joint}": value
        for side in ("left", "right")
        for joint, value in {
            "ear": 0.7,
            "shoulder": 1.0,
            "elbow": 1.0,
            "wrist": 1.0,
            "pinky": 0.3,
            "index": 0.3,
            "thumb": 0.2,
            "hip": 0.7,
            "knee": 1.0,
            "ankle": 1.0,
            "heel": 0.5,
            "foot_index": 0.6,
        }.items()
    },
}

_SEGMENTS = [
    *(
        (f"{side}_{first}", f"{side}_{last}")
        for side in ("left", "right")
        for first, last in (
            ("shoulder", "elbow"),
            ("elbow", "wrist"),
            ("hip", "knee"),
            ("knee", "ankle"),
            ("shoulder", "hip"),
            ("heel", "foot_index"),
        )
    ),
    ("left_shoulder", "right_shoulder"),
    ("left_hip", "right_hip"),
    ("left_ear", "right_ear"),
    ("left_ear", "nose"),
    ("right_ear", "nose"),
]
SEGMENT_ENDS = np.array([[LANDMARK_INDEX[name] for name in pair] for pair in _SEGMENTS])
"""Landmarks (S, 2) at the ends of the segments along which the detector's depth is compared."""
_SIDE_BONES = np.array(
    [[LANDMARK_INDEX[name] for name in names[:2]] for names in LIMB_BONES.values()]
)
"""Landmarks (8, 2) at the ends of the limbs' bones."""
_NAMES = {tuple(ends): name for ends, name in zip(_SIDE_BONES.tolist(), LIMB_BONES, strict=True)}
"""Names of these bones by the landmarks at their ends."""
_PROFILE = np.radians(30.0)
"""Angle from the camera, radians, from which on the landmarks of the face place the head. From the
front they make fits no better (docs/research/fitting.md)."""
_SIDE_SHARE = 0.5
"""Least depth of a bone whose side the user has given, as a fraction of its estimated depth."""
_SIDE_LEAST = 0.02
"""Least depth of such a bone relative to the person's height."""


@dataclass(frozen=True, eq=False)
class UserHints:
    """Values given by the user. They override the rest of the evidence.

    Attributes
    ----------
    landmarks : (n,) int
        Landmarks whose `Evidence.pixels` are exact.
    bones : (m, 2) int
        Landmarks at the near and the far end of limbs whose side is given.
    signs : (m,)
        1: the far end lies in front, -1: behind.
    depths : (m,)
        Least difference in depth between the ends, relative to the person's height.
    """

    landmarks: IntArray
    bones: IntArray
    signs: FloatArray
    depths: FloatArray

    @classmethod
    def of(cls, subject: Subject, evidence: Evidence) -> UserHints | None:
        """Return the hints of a subject; None if the user gave none."""
        if subject.given is None and subject.sides is None:
            return None
        given = (
            np.flatnonzero(subject.given) if subject.given is not None else np.zeros(0, np.int64)
        )
        signs = (
            subject.sides.astype(np.float64)
            if subject.sides is not None
            else np.zeros(len(_SIDE_BONES))
        )
        own = signs != 0
        bones, signs = _SIDE_BONES[own], signs[own]
        depths = np.zeros(len(bones))
        if evidence.points is not None:
            between = evidence.points[bones[:, 1], 2] - evidence.points[bones[:, 0], 2]
            depths = np.nan_to_num(np.abs(between)) * evidence.points_scale / evidence.height
        return cls(given, bones, signs, np.maximum(_SIDE_SHARE * depths, _SIDE_LEAST))

    @property
    def unseen_depths(self) -> IntArray:
        """Landmarks whose depths in a body map are overridden."""
        turned = {_NAMES[tuple(bone)] for bone in self.bones.tolist()}
        hanging = {LANDMARK_INDEX[name] for bone in turned for name in LIMB_BONES[bone][1:]}
        return np.array(sorted(hanging | set(self.landmarks.tolist())), np.int64)


@dataclass(frozen=True, eq=False)
class Evidence:
    """Evidence of a photo.

    Attributes
    ----------
    pixels : (33, 2), confidence : (33,)
    depth : (n,)
        Depth differences along `segments`, in pixels of the photo (detector's meters times its
        scale).
    segments : (n, 2) int
    depth_confidence : (n,)
    points : (33, 3) or None
        The detector's 3D keypoints, meters; NaN where unknown.
    points_scale : float
        Pixels per meter of `points`.
    height : float
        Rough standing height of the person, pixels.
    straight : tuple of bool
        Whether the left and the right leg look straight.
    standing : tuple of bool
        Whether they also look upright, as a leg that carries weight.
    mask : MaskField or None
    trust : float
        Weight of the detector's landmarks, from 0 to 1.
    dense : DenseEvidence or None
        Vertices of the body that pixels show.
    depth_scales : (33,) or None
        Expected errors in depth of the body map's landmarks, relative to the height.
    view : View
        Estimated place of the camera.
    hints : UserHints or None
        What the user has given.
    photo : tuple of 2 float
        Width and height of the whole photo, pixels.
    """

    pixels: FloatArray
    confidence: FloatArray
    depth: FloatArray
    segments: IntArray
    depth_confidence: FloatArray
    points: FloatArray | None
    points_scale: float
    height: float
    straight: tuple[bool, bool]
    standing: tuple[bool, bool]
    mask: MaskField | None
    trust: float = 1.0
    dense: DenseEvidence | None = None
    depth_scales: FloatArray | None = None
    view: View = LEVEL
    hints: UserHints | None = None
    photo: tuple[float, float] = (0.0, 0.0)

    @property
    def distance_spread(self) -> float:
        """`View.spread` if the fit may change the camera's distance; 0 if it keeps the distance.

        Only standing people show the distance: in action, errors of the pose count for more.
        """
        return self.view.spread if all(self.standing) else 0.0

    @property
    def has_depth(self) -> bool:
        """Whether any 3D keypoints are known."""
        return self.points is not None

    @property
    def weights(self) -> FloatArray:
        """Weight of each landmark (33,): its confidence times how well it is defined on a body."""
        weights: FloatArray = self.trust * self.confidence * [_TRUST[name] for name in BLAZEPOSE]
        return weights

    @property
    def mask_known(self) -> BoolArray:
        """Pixels (h, w) of the working raster that the photo covers."""
        assert self.mask is not None
        height, width = self.mask.inside.shape
        u, v = np.meshgrid(
            (np.arange(width) + 0.5) * self.mask.step, (np.arange(height) + 0.5) * self.mask.step
        )
        left, top, right, bottom = self.mask.known
        inside: BoolArray = (u > left) & (u < right) & (v > top) & (v < bottom)
        return inside

    def doubted(self, height: float) -> Evidence:
        """Return the evidence with little weight for the detector.

        It is for landmarks that do not fit the mask. The person has another standing
        `height`, pixels.
        """
        nothing = np.zeros_like(self.depth_confidence)
        return dataclasses.replace(
            self,
            trust=0.03,
            height=height,
            depth_confidence=nothing,
            points=None,
            straight=(False, False),
            standing=(False, False),
            dense=None,
        )

    @classmethod
    def build(
        cls,
        *,
        pixels: FloatArray,
        confidence: FloatArray,
        points: FloatArray,
        mask: MaskField | None,
    ) -> Evidence:
        """From keypoints (33, 2) with confidence (33,), 3D keypoints (33, 3) and the mask."""
        known = np.isfinite(points).all(axis=1) & (confidence > 0.2)
        scale = 0.0
        if known.sum() >= 8:
            weight = np.where(known, confidence, 0.0)
            flat = np.where(known[:, None], points[:, :2] * [1.0, -1.0], 0.0)
            scale = best_scale(flat, pixels, weight)
        usable = scale > 1.0
        segments = SEGMENT_ENDS
        difference = points[segments[:, 1], 2] - points[segments[:, 0], 2]
        depth_known = known[segments].all(axis=1) & usable
        height = TYPICAL_HEIGHT * scale if usable else _height_without_depth(pixels, confidence)
        legs = [
            leg_stance(side, pixels, confidence, points if usable else None)
            for side in ("left", "right")
        ]
        return cls(
            pixels=pixels,
            confidence=confidence,
            depth=np.where(depth_known, difference, 0.0) * scale,
            segments=segments,
            depth_confidence=np.where(depth_known, confidence[segments].min(axis=1), 0.0),
            points=points if usable else None,
            points_scale=scale,
            height=height,
            straight=(legs[0][0], legs[1][0]),
            standing=(legs[0][1], legs[1][1]),
            mask=mask,
        )


def _height_without_depth(pixels: FloatArray, confidence: FloatArray) -> float:
    """Return the standing height, pixels, from the longest visible limbs (a projection can only
    shorten them)."""
    estimates = []
    for (first, last), ratio in LIMBS_BY_HEIGHT.items():
        for side in ("left", "right"):
            a, b = LANDMARK_INDEX[f"{side}_{first}"], LANDMARK_INDEX[f"{side}_{last}"]
            if min(confidence[a], confidence[b]) > 0.3:
                estimates.append(np.linalg.norm(pixels[a] - pixels[b]) / ratio)
    if len(estimates) >= 2:
        return float(np.percentile(estimates, 75))
    return float(1.1 * np.ptp(pixels[confidence > 0.3, 1]) + 1.0)


def gather_evidence(subject: Subject, settings: FitSettings) -> Evidence:
    """Convert a subject to the values that the objective compares with.

    Raises
    ------
    InputError
        Too few confident keypoints.
    """
    confidence = np.clip(np.nan_to_num(subject.keypoints[:, 2]), 0, 1).astype(np.float64)
    pixels = np.nan_to_num(subject.keypoints[:, :2]).astype(np.float64)
    points = subject.keypoints_3d.astype(np.float64)
    if subject.face is not None:
        confidence, pixels, points = _with_face(subject, confidence, pixels, points)
    body = np.array(
        [
            name.split("_", 1)[-1] in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "ear")
            for name in BLAZEPOSE
        ]
    )
    if (confidence[body] > 0.3).sum() < 4:
        found = int((confidence[body] > 0.3).sum())
        raise InputError(
            f"only {found} keypoints of the body are certain; at least 4 are needed to fit a "
            "body: use a clearer photo"
        )
    left, top, right, _ = subject.crop
    width, height = subject.photo_size
    zoom = subject.image.shape[1] / (right - left)
    known = (float(-left), float(-top), float(width - left), float(height - top))
    field = (
        mask_field(subject.mask, known, size=settings.silhouette_size)
        if settings.silhouette_weight > 0
        else None
    )
    evidence = Evidence.build(
        pixels=pixels,
        confidence=confidence,
        points=points,
        mask=field,
    )
    view = estimated_view(
        subject,
        _box(subject, field),
        height=evidence.height,
        tall=settings.height,
        distance=settings.distance,
    )
    evidence = dataclasses.replace(
        evidence,
        view=view,
        hints=UserHints.of(subject, evidence),
        photo=(zoom * width, zoom * height),
    )
    if subject.bodymap is None:
        return evidence
    evidence = dataclasses.replace(
        evidence,
        depth_scales=subject.bodymap.landmark_scales[:, 1].astype(np.float64) / evidence.height,
    )
    if max(settings.dense_weight, settings.dense_depth_weight) == 0:
        return evidence
    dense = gather_dense(
        subject.bodymap,
        subject.keypoints,
        height=evidence.height,
        count=settings.dense_pixels,
        seed=settings.seed,
        standing=all(evidence.standing),
        unseen=None if evidence.hints is None else evidence.hints.unseen_depths,
    )
    return dataclasses.replace(evidence, dense=dense)


def _with_face(
    subject: Subject, confidence: FloatArray, pixels: FloatArray, points: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Confidence (33,), pixels (33, 2) and 3D keypoints (33, 3), with the head placed by the
    landmarks of the face if it is turned away.

    The body map has seen few heads that are turned aside: it places the nose of a head in profile
    near its middle. The middle of the head stays where it is in depth.
    """
    assert subject.face is not None
    placed, size, turned = head_from_face(subject.face)
    if turned < _PROFILE:
        return confidence, pixels, points
    own = np.arange(HEAD)
    if subject.given is not None:
        own = own[~subject.given[:HEAD]]
    confidence, pixels, points = confidence.copy(), pixels.copy(), points.copy()
    confidence[own], pixels[own] = 1.0, placed[own, :2]
    upright = placed * [1, -1, 1] / size
    points[own] = (upright - upright.mean(axis=0) + points[:HEAD].mean(axis=0))[own]
    return confidence, pixels, points


def _box(subject: Subject, field: MaskField | None) -> FloatArray:
    """Left, top, right, bottom (4,) of the person in pixels, by the mask or else by the
    landmarks."""
    if field is not None and field.inside.any():
        rows, columns = np.nonzero(field.inside)
        return field.step * np.array(
            [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1], np.float64
        )
    seen = subject.keypoints[subject.keypoints[:, 2] > 0.3, :2].astype(np.float64)
    return np.concatenate([seen.min(axis=0), seen.max(axis=0)])
