"""The terms of a fit, each in units of squared standard deviations, so that the weights are
dimensionless.

Tolerances and scales here were chosen by hand, so that the fits of the photos of
``tests/body/test_photos.py`` and of ``python -m benchmarks.fit`` come out well; none was fitted to
data. `FitSettings` has those that a user may change.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from a2v.body.collision import LimbBalls
from a2v.body.evidence import Evidence
from a2v.body.pose_prior import PosePrior
from a2v.body.pose_space import PoseSpace
from a2v.body.silhouette import MaskField, RimMatches
from a2v.body.skinning import BodyState
from a2v.body.surface_term import SurfaceMatches
from a2v.body.view import HELD
from a2v.kinematics.names import LANDMARK_INDEX

if TYPE_CHECKING:
    from torch import Tensor


def geman_mcclure(square: Tensor, scale: float) -> Tensor:
    """Return ρ of Eq. 16 (Geman and McClure 1987) of squared residuals.

    It is nearly the square below `scale` and nearly constant above.
    """
    return scale**2 * square / (scale**2 + square)


def robust_sum(square: Tensor, *, weights: Tensor, scale: float) -> Tensor:
    """Eq. 16: weighted sum of ρ over squared errors (..., n).

    The errors of projected landmarks and of depths along limbs are relative to the person's height.
    """
    return (weights * geman_mcclure(square, scale)).sum(-1)


def form(landmarks: Tensor, points: Tensor, *, weights: Tensor) -> Tensor:
    """Penalize distances of the landmarks (33, 3) from the detector's `points` (33, 3), both in
    meters, after a shift that aligns them. The tolerance is 5 cm."""
    difference = landmarks - points
    center = (weights[:, None] * difference).sum(0) / weights.sum()
    square = (difference - center).square().sum(-1)
    return robust_sum(square, weights=weights, scale=0.2) / 0.05**2


def strays(square: Tensor, *, weights: Tensor) -> Tensor:
    """Penalize landmarks whose error is over 2.2 % of the height, with a tolerance of 0.3 %.

    It is robust, since the detector may be wrong.

    `square` (..., 33) are the squared errors of the projected landmarks, relative to the person's
    height.
    """
    over = (square.clamp_min(1e-12).sqrt() - 0.022).clamp_min(0.0)
    return robust_sum(over.square(), weights=weights.sqrt(), scale=0.03) / 0.003**2


def at_given_places(square: Tensor) -> Tensor:
    """Keep landmarks where the user has placed them, within 0.2 % of the height.

    `square` (..., n) is as in `strays`.
    """
    return square.sum(-1) / 0.002**2


def on_given_sides(along: Tensor, *, signs: Tensor, depths: Tensor) -> Tensor:
    """Keep bones on the side that the user has given, within 1 % of the height.

    `along` (..., m) is the depth of the far end minus that of the near end. It must have the given
    sign and reach `depths` (m,). All are relative to the height.
    """
    return ((depths - signs * along).clamp_min(0.0) / 0.01).square().sum(-1)


def everyday_pose(angles: Tensor, *, natural: Tensor, spread: Tensor) -> Tensor:
    """Penalize distance from everyday standing poses by a Gaussian; angles are (..., D).

    It is used for a photo without a surface.
    """
    return ((angles - natural) / spread).square().sum(-1)


def likely_pose(angles: Tensor, prior: PosePrior) -> Tensor:
    """Return the negative log-likelihood of Eq. 18, shifted to zero at the likeliest pose.

    Twice this value is a squared number of standard deviations.
    """
    return prior.best - prior.log_likelihood(angles)


def outside(values: Tensor, bounds: Tensor, *, tolerance: float) -> Tensor:
    """Return by how much values (..., n) exceed their bounds (n, 2)."""
    low, high = bounds.unbind(-1)
    beyond = (low - values).clamp(min=0) + (values - high).clamp(min=0)
    return (beyond / tolerance).square().sum(-1)


def build_of_body(
    shape: Tensor,
    *,
    mean: Tensor,
    spread: Tensor,
    state: BodyState,
    height: float,
    height_sigma: float,
) -> Tensor:
    """Penalize distance from an everyday shape (S,) and standing height by a Gaussian.

    Vertices 0 and 1 of `state` are crown and sole.
    """
    crown, sole = state.rest_vertices[0], state.rest_vertices[1]
    tall = ((crown[1] - sole[1] - height) / height_sigma).square()
    return ((shape - mean) / spread).square().sum() + tall


def collision(balls: LimbBalls, state: BodyState) -> Tensor:
    """Penalize overlap of limbs with the trunk and with each other, within 1 cm."""
    return (balls.penetration(state) / 0.01).square().sum()


def lowest(heights: Tensor) -> Tensor:
    """Return the least of `heights` (n,), meters: their mean with weights that fall by e per
    centimeter, which has no corner where two are equal."""
    weights = (-heights / 0.01).softmax(-1)
    return (weights * heights).sum(-1)


def held_camera(height: Tensor) -> Tensor:
    """Penalize an unusual `height` () of the camera above the ground, meters."""
    return ((height - HELD) / 0.2).square()


def usual_distance(log_distance: Tensor, *, estimate: float, spread: float) -> Tensor:
    """Keep the camera's distance near its `estimate`, meters.

    `spread` is the standard deviation of its logarithm.
    """
    return ((log_distance - math.log(estimate)) / spread).square()


_BEND_OF_STANDING = 0.08
"""Mean bend of a knee that looks straight, radians: one leg is often relaxed."""
_BEND_SPREAD = 0.12
"""Its standard deviation, radians."""


def feet(angles: Tensor, landmarks: Tensor, *, space: PoseSpace, evidence: Evidence) -> Tensor:
    """Keep straight legs straight, upright legs under the hips, and standing feet nearly level.

    Only depth is kept. A leg may stand apart to the side of the pelvis, so that the feet of a
    person who is turned differ in depth.
    """
    import torch

    total = 0.0 * angles.sum()
    between = landmarks[LANDMARK_INDEX["left_hip"]] - landmarks[LANDMARK_INDEX["right_hip"]]
    across = between[[0, 2]] / between[[0, 2]].norm().clamp_min(1e-6)  # horizontal: x and z
    forward = torch.stack([-across[1], across[0]])
    if all(evidence.standing):  # the trunk rests on the legs
        middle = {
            joint: (
                landmarks[LANDMARK_INDEX[f"left_{joint}"]]
                + landmarks[LANDMARK_INDEX[f"right_{joint}"]]
            )
            / 2
            for joint in ("hip", "shoulder")
        }
        total = total + ((middle["shoulder"][2] - middle["hip"][2] + 0.01) / 0.03).square()
    for side, straight, standing in zip(
        ("left", "right"), evidence.straight, evidence.standing, strict=True
    ):
        point = {
            name: landmarks[LANDMARK_INDEX[f"{side}_{name}"]]
            for name in ("hip", "ankle", "heel", "foot_index")
        }
        if straight:
            bend = angles[space.index(f"{side}_knee_bend")]
            total = total + ((bend - _BEND_OF_STANDING) / _BEND_SPREAD).square()
        if standing:
            offset = (point["hip"] - point["ankle"])[[0, 2]]
            ahead, aside = (offset * forward).sum(), (offset * across).sum()
            total = total + (ahead * forward[1] / 0.025).square()
            total = total + (aside * across[1] / 0.08).square()
            # A camera at eye level looks down on the feet, so that they may seem to point down
            # slightly.
            total = total + ((point["heel"][1] - point["foot_index"][1]) / 0.06).square()
    return total


_OUTLINE = 90.0
"""Number of independent measurements that the points of an outline count as; neighboring points are
redundant."""
_MAP = 90.0
"""The same number for the pixels of a map."""
_SURFACE = 200.0
"""The same number for the points of a surface."""


def skin_in_mask(
    pixels: Tensor, mask: MaskField, *, height: float, robust: float, sigma: float
) -> Tensor:
    """Penalize vertices at pixels (n, 2) outside of the mask by their distance from it.

    The distance is relative to the person's `height` in pixels.
    """
    distance = mask.sample(pixels).clamp(min=0) / height
    return _OUTLINE * geman_mcclure(distance.square(), 2 * robust).mean() / sigma**2


def rim_on_contour(
    pixels: Tensor, rim: RimMatches, *, height: float, robust: float, sigma: float
) -> Tensor:
    """Pull the body's rim at pixels (m, 2) to the mask's contour.

    A match may slide along the contour.
    """
    gap = (rim.matched(pixels) - rim.pixels) / height
    across = (gap * rim.normals).sum(-1).square()
    along = gap.square().sum(-1) - across
    penalty = rim.weights * geman_mcclure(across + 0.1 * along, robust)
    return _OUTLINE * penalty.sum() / rim.weights.sum() / sigma**2


def seen_at(pixels: Tensor, expected: Tensor, *, weights: Tensor, height: float) -> Tensor:
    """Keep vertices at pixels (n, 2) where the body map shows them (n, 2).

    The tolerance is 2 % of the person's `height` in pixels.
    """
    square = (pixels - expected).square().sum(-1) / height**2
    return _MAP * (weights * geman_mcclure(square, 0.05)).mean() / 0.02**2


def depths_agree(depths: Tensor, expected: Tensor, *, weights: Tensor, height: float) -> Tensor:
    """Keep the differences of the vertices' depths (n,), pixels, equal to those of the map (n,).

    The tolerance is 3 % of the person's `height` in pixels.
    """
    gap = depths - expected
    gap = (gap - (weights * gap).sum() / weights.sum().clamp_min(1e-9)) / height
    return _MAP * (weights * geman_mcclure(gap.square(), 0.1)).mean() / 0.03**2


def surface_distance(vertices: Tensor, matches: SurfaceMatches, *, robust: float) -> Tensor:
    """Eq. 17: penalize the distance of the body, whose matched vertices are at (m, 3), from the
    surface, within 1 cm.

    A match may slide along the surface.
    """
    gap = matches.matched(vertices) - matches.points
    across = (gap * matches.normals).sum(-1).square()
    square = across + 0.1 * (gap.square().sum(-1) - across)
    penalty = matches.weights * geman_mcclure(square, robust)
    return _SURFACE * penalty.sum() / matches.weights.sum() / 0.01**2


def joints_inside(landmarks: Tensor, targets: Tensor, *, weights: Tensor) -> Tensor:
    """Eq. 16 in depth: penalize the distance of landmarks (33, 3) to the joints inside of the
    surface (33, 3), within 3 cm."""
    square = (landmarks[:, 2] - targets[:, 2]).square()
    return robust_sum(square, weights=weights, scale=0.1) / 0.03**2


def alike(first: Tensor, second: Tensor, spread: Tensor) -> Tensor:
    """Penalize the difference between the angles (D,) of one person in two photos.

    The tolerance is a fifth of their `spread` (D,) among standing people. The penalty of each angle
    is bounded, so that an arm that has moved costs at most a fixed amount.
    """
    return geman_mcclure(((first - second) / (0.2 * spread)).square(), 2.0).sum(-1)
