"""New starts for a limb that the fit put in the wrong place in the photo, or at an uncertain
depth."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from a2v.body.anny import AnnyModel
from a2v.body.limbs import LIMBS
from a2v.body.objective import Objective
from a2v.body.pose_bank import load_pose_bank
from a2v.body.pose_space import PoseSpace
from a2v.body.second_photo import DOUBTFUL
from a2v.body.unknowns import Unknowns
from a2v.types import FloatArray, IntArray

STRAY = 0.045
"""Distance of a limb's worst landmark from the photo's, relative to the height, above which the
limb is stray. In a good fit the worst landmark is 1 to 3.5 % off."""
_TRIED = 5
"""Largest number of starts of a limb."""
_APART = 0.25
"""Least mean distance between the limb's landmarks of two starts, meters."""
_KEPT = 2
"""Number of starts, the best after a fit of only the limb, that are fitted as a whole."""
_STEPS = 15
"""Iterations of each fit."""
_GAIN = 5.0
"""Least decrease of the objective, squared standard deviations."""
_LEAVES = 0.01
"""Largest decrease of the silhouettes' overlap: limbs bent to wrong landmarks leave the mask."""
_LEGS = {"left_leg", "right_leg"}
_ANGLES = {"arm": ("collar", "arm", "elbow", "forearm", "wrist"), "leg": ("hip", "knee", "ankle")}


def stray_limbs(objective: Objective, unknowns: Unknowns) -> dict[str, float]:
    """Find arms and legs that lie away from the photo's landmarks.

    Returns their distances, relative to the height, the largest first. If both legs are stray,
    neither is returned: legs seen from above look short, and a new start would make the person
    kneel.
    """
    error = np.where(objective.evidence.confidence > 0.3, objective.landmark_gaps(unknowns), 0.0)
    worst = {
        limb: float(error[list(places)].max())
        for limb, places in LIMBS.items()
        if limb.endswith(tuple(_ANGLES))
    }
    stray = {
        limb: gap for limb, gap in sorted(worst.items(), key=lambda item: -item[1]) if gap > STRAY
    }
    return (
        stray
        if not stray.keys() >= _LEGS
        else {limb: gap for limb, gap in stray.items() if limb not in _LEGS}
    )


def mend_strays(objective: Objective, model: AnnyModel, unknowns: Unknowns) -> Unknowns | None:
    """Bend stray limbs as in a recorded pose if that lowers the objective after a short fit; None
    if it helps no limb."""
    tried: set[str] = set()
    found = unknowns
    while limbs := [limb for limb in stray_limbs(objective, found) if limb not in tried]:
        tried.add(limbs[0])
        found = _mended(objective, model, found, limbs[0])
    return None if found is unknowns else found


def mend_doubtful(
    objective: Objective, model: AnnyModel, unknowns: Unknowns, errors: Mapping[str, float]
) -> Unknowns | None:
    """Do the same for arms and legs whose expected error in depth (`limb_errors`) is over
    `DOUBTFUL`, the worst first."""
    found = unknowns
    for limb in sorted(errors, key=lambda limb: -errors[limb]):
        if limb.endswith(tuple(_ANGLES)) and errors[limb] > DOUBTFUL:
            found = _mended(objective, model, found, limb)
    return None if found is unknowns else found


def agrees_better(found: Mapping[str, Any], before: Mapping[str, Any]) -> bool:
    """Return whether the first of two `FitResult.residuals` has the lower loss and covers the mask
    as well as the second.

    Landmarks may be wrong, so that they alone are not enough.
    """
    lower = sum(found["loss"].values()) < sum(before["loss"].values())
    return bool(
        lower and found.get("silhouette_iou", 1.0) > before.get("silhouette_iou", 1.0) - _LEAVES
    )


def _mended(objective: Objective, model: AnnyModel, unknowns: Unknowns, limb: str) -> Unknowns:
    """Try other starts of `limb`; return better unknowns, or the given ones."""
    own = _angles_of(limb, objective.space)
    objective.renew_silhouette(unknowns)
    best, least = unknowns, objective.cost(unknowns, "silhouette") - _GAIN
    starts = [unknowns.with_angles(pose) for pose in _starts(objective, model, unknowns, limb)]
    costs = [objective.minimize_angles(start, own, _STEPS, stage="silhouette") for start in starts]
    for number in np.argsort(costs)[:_KEPT]:
        objective.renew_silhouette(starts[number])
        objective.minimize(starts[number], _STEPS, stage="silhouette")
        cost = objective.cost(starts[number], "silhouette")
        if cost < least:
            best, least = starts[number], cost
    return best


def _starts(
    objective: Objective, model: AnnyModel, unknowns: Unknowns, limb: str
) -> list[FloatArray]:
    """Return angles (D,) of the fit with those of `limb` from the bank, the best first.

    The best have the lowest cost of landmarks with the trunk of the fit.
    """
    own = _angles_of(limb, objective.space)
    bank = load_pose_bank(model).angles
    poses = np.tile(unknowns.angles.detach().numpy().astype(np.float32), (len(bank), 1))
    poses[:, own] = bank[:, own]
    costs, landmarks = objective.of_poses(unknowns, poses)
    places = landmarks[:, list(LIMBS[limb])]
    chosen: list[int] = []
    for number in np.argsort(costs)[:500]:
        if all(
            np.linalg.norm(places[number] - places[other], axis=1).mean() > _APART
            for other in chosen
        ):
            chosen.append(int(number))
        if len(chosen) == _TRIED:
            break
    return [poses[number] for number in chosen]


def _angles_of(limb: str, space: PoseSpace) -> IntArray:
    """Indices of the angles that bend a limb."""
    side, kind = limb.split("_")
    starts = tuple(f"{side}_{joint}_" for joint in _ANGLES[kind])
    return np.array([index for index, name in enumerate(space.names) if name.startswith(starts)])
