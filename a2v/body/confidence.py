"""Judge a fit without ground truth: whether it looks wrong, and expected errors of its limbs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.body.evidence import Evidence
from a2v.body.limbs import LIMBS, TRUNK
from a2v.body.second_photo import DOUBTFUL
from a2v.kinematics.names import LANDMARK_INDEX
from a2v.types import FloatArray


@dataclass(frozen=True)
class Suspicion:
    """Thresholds at which a fit to a photo looks wrong. Distances of landmarks are relative to the
    person's height.

    Attributes
    ----------
    mean : float
        Mean distance between the landmarks of the body and those of the photo.
    largest : float
        Largest of these distances.
    overlap : float
        Intersection over union of the silhouettes below which the fit looks wrong.
    other_landmarks : float
        Overlap below which the landmarks count as wrong even if the body agrees with them. Not even
        a wide skirt gives so small an overlap.
    uneasy_mean, uneasy_overlap : float
        A fit also looks wrong if the mean distance is over the first and the overlap is below the
        second. A skirt changes only the overlap.
    """

    mean: float = 0.02
    largest: float = 0.09
    overlap: float = 0.7
    other_landmarks: float = 0.6
    uneasy_mean: float = 0.015
    uneasy_overlap: float = 0.78


SUSPICION = Suspicion()
"""Chosen on the benchmark's panel for development (docs/research/fitting.md)."""
FEATURES = ("one", "head", "arm", "leg", "depth_gap", "extent", "outside", "unsure")
"""Inputs of a limb's expected error: its kind; the difference in depth between fit and evidence,
and the limb's own extent in depth, meters; the share of the silhouettes that do not overlap; and
the logarithm of the body map's expected error, relative to the height (0 without a map)."""
_WITHOUT_MAP = (-3.336, 0.158, 0.698, 0.579, 3.31, 0.702, 1.153, 0.0)
_WITH_MAP = (-1.497, -0.233, 0.051, 0.133, 2.736, 0.215, 0.55, 0.402)
"""Coefficients of the `FEATURES`, whose weighted sum is the logarithm of the error plus 2 cm. They
are fitted by least squares to studio photographs: without a body map to the 18 of the
benchmark's panel for development, with one to 58 of people and clips that are not in its
training data (docs/research/fitting.md)."""


def looks_wrong(residuals: Mapping[str, Any]) -> bool:
    """Return whether the `FitResult.residuals` show that the body does not match the person."""
    return _is_off(residuals) or residuals.get("silhouette_iou", 1.0) < SUSPICION.overlap


def landmarks_look_wrong(residuals: Mapping[str, Any]) -> bool:
    """Return whether the residuals show that the detector's landmarks do not match the person
    either."""
    return _is_off(residuals) or residuals.get("silhouette_iou", 1.0) < SUSPICION.other_landmarks


def _is_off(residuals: Mapping[str, Any]) -> bool:
    """Return whether landmarks are too far off for the overlap of the silhouettes."""
    uneasy = (
        residuals["keypoint_mean"] > SUSPICION.uneasy_mean
        and residuals.get("silhouette_iou", 1.0) < SUSPICION.uneasy_overlap
    )
    return bool(
        uneasy
        or residuals["keypoint_mean"] > SUSPICION.mean
        or residuals["keypoint_max"] > SUSPICION.largest
    )


def limb_features(
    landmarks: FloatArray, evidence: Evidence, scale: float, overlap: float
) -> dict[str, FloatArray]:
    """The `FEATURES` (8,) of each limb of a fit; see `limb_errors`."""
    trunk = list(TRUNK)
    own = landmarks[:, 2] - landmarks[trunk, 2].mean()
    gap = np.full(len(own), 0.1)
    if evidence.points is not None:
        deep = evidence.points[:, 2] * (evidence.points_scale / scale)
        differs = np.abs(deep - deep[trunk].mean() - own)
        gap = np.where(np.isfinite(differs), differs, gap)
    unsure = np.zeros(len(own)) if evidence.depth_scales is None else np.log(evidence.depth_scales)
    found = {}
    for limb, places in LIMBS.items():
        side, _, kind = limb.rpartition("_")
        chain = {"arm": ("shoulder", "elbow", "wrist"), "leg": ("hip", "knee", "ankle")}.get(
            kind, ()
        )
        depths = [landmarks[LANDMARK_INDEX[f"{side}_{joint}"], 2] for joint in chain]
        extent = float(np.abs(np.diff(depths)).sum()) if depths else 0.0
        kinds = [float(kind == name) for name in ("head", "arm", "leg")]
        rows = list(places)
        found[limb] = np.array(
            [1.0, *kinds, gap[rows].mean(), extent, 1 - overlap, unsure[rows].mean()]
        )
    return found


def limb_errors(
    landmarks: FloatArray, evidence: Evidence, scale: float, overlap: float
) -> dict[str, float]:
    """Return the expected error in depth of each limb, relative to the trunk, meters.

    Parameters
    ----------
    landmarks : (33, 3)
        Landmarks of the fit, meters.
    evidence : Evidence
    scale : float
        Scale of the fit's camera, pixels per meter.
    overlap : float
        IoU of the silhouettes.
    """
    factors = _WITHOUT_MAP if evidence.depth_scales is None else _WITH_MAP
    found = limb_features(landmarks, evidence, scale, overlap)
    return {
        limb: max(0.0, float(np.exp(features @ factors)) - 0.02) for limb, features in found.items()
    }


def doubts(residuals: Mapping[str, Any]) -> list[str]:
    """Return at most one note for the user: which part of a fit is uncertain, and what to do."""
    if looks_wrong(residuals):
        worst = max(residuals["keypoints"], key=residuals["keypoints"].get).replace("_", " ")
        overlap = (
            f"the silhouettes share {100 * residuals['silhouette_iou']:.0f} %, "
            if "silhouette_iou" in residuals
            else ""
        )
        found = f"{overlap}the {worst} is {100 * residuals['keypoint_max']:.0f} % of the height off"
        return [
            f"the pose was not understood ({found}): expect a wrong shape; try another photo, or "
            "give --mask and --keypoints"
        ]
    limbs = [
        limb.replace("_", " ")
        for limb, error in residuals.get("limb_errors", {}).items()
        if error > DOUBTFUL
    ]
    if limbs:
        names = f"{', '.join(limbs[:-1])} and {limbs[-1]}" if len(limbs) > 1 else limbs[0]
        side = {"front": "the front", "back": "behind"}.get(
            residuals.get("second_photo", ""), f"their {residuals.get('second_photo', 'left')}"
        )
        return [
            f"the depth of the {names} is uncertain; a second photo of the same person from {side} "
            "would help most (give --photo again)"
        ]
    return []


def summary(residuals: Mapping[str, Any]) -> list[str]:
    """Return short lines on a fit with these `FitResult.residuals`: the camera, the expected errors
    of arms and legs, and the best second photo.

    The list is empty without a camera.
    """
    camera = residuals.get("camera")
    if not camera:
        return []
    place = f"camera {camera['distance']:.1f} m away" if camera["distance"] else "camera far away"
    angle = f", {camera['field_of_view']:.0f} degrees wide" if "field_of_view" in camera else ""
    lines = [f"{place}{angle} ({camera['distance_from']})"]
    limbs = [
        f"{limb.replace('_', ' ')} {100 * error:.0f} cm"
        for limb, error in residuals.get("limb_errors", {}).items()
        if limb.endswith(("arm", "leg"))
    ]
    if limbs:
        lines.append(f"expected error in depth: {', '.join(limbs)}")
    if "second_photo" in residuals:
        lines.append(f"best second photo: {residuals['second_photo']}")
    return lines
