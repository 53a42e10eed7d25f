"""Limbs that a fit left beside their place in the photo."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from a2v.body import FitSettings, load_body_model, make_body
from a2v.body.confidence import DOUBTFUL
from a2v.body.evidence import Evidence, gather_evidence
from a2v.body.limbs import LIMBS
from a2v.body.objective import Objective
from a2v.body.pose_space import pose_space
from a2v.body.stray import STRAY, agrees_better, mend_doubtful, mend_strays, stray_limbs
from a2v.body.unknowns import Unknowns
from a2v.types import FloatArray, OrthographicCamera
from tests.support.bodies import landmarks_of, subject_of

SETTINGS = FitSettings()
ON_HIP = {"arm_raise": -0.1, "arm_swing": -0.5, "arm_twist": -0.9, "elbow_bend": 1.0}
OVERHEAD = {"arm_raise": 1.9, "arm_swing": 0.0, "arm_twist": 0.0, "elbow_bend": 0.0}


def posed(side: str, arm: dict[str, float]) -> FloatArray:
    """Return the angles (D,) of a standing person with one arm bent as given."""
    space = pose_space(load_body_model())
    angles = space.natural.copy()
    for name, value in arm.items():
        angles[space.index(f"{side}_{name}")] = value
    return angles


def seen(side: str) -> tuple[Evidence, OrthographicCamera, FloatArray, FloatArray]:
    """Return the evidence of a person with a hand on the hip.

    Also return the true camera, landmarks and translation.
    """
    model = load_body_model()
    rotations = pose_space(model).rotvecs(torch.from_numpy(posed(side, ON_HIP))).numpy()
    body = make_body(model, rotations, model.shape_default, grounded=True)
    subject, camera = subject_of(body)
    return (
        gather_evidence(subject, SETTINGS),
        camera,
        landmarks_of(model, body),
        body.parameters["translation"],
    )


def held(
    side: str, arm: dict[str, float], camera: OrthographicCamera, translation: FloatArray
) -> Unknowns:
    """Return the true fit, except for one arm that is bent as given."""
    shape = load_body_model().shape_default
    return Unknowns.build(
        root=np.zeros(3),
        angles=posed(side, arm),
        shape=shape,
        translation=translation,
        camera=camera,
    )


def objective_of(evidence: Evidence) -> Objective:
    return Objective(load_body_model(), evidence, SETTINGS)


def gap(objective: Objective, unknowns: Unknowns, limb: str) -> float:
    return float(objective.landmark_gaps(unknowns)[list(LIMBS[limb])].max())


@pytest.mark.parametrize("side", ["left", "right"])
def test_an_arm_on_the_wrong_side_is_mended(side: str) -> None:
    evidence, camera, truth, translation = seen(side)
    objective = objective_of(evidence)
    stuck = held(side, OVERHEAD, camera, translation)
    for _ in range(2):
        objective.renew_silhouette(stuck)
        objective.minimize(stuck, 40, stage="silhouette")
    assert gap(objective, stuck, f"{side}_arm") > 2 * STRAY  # the fit alone does not find the pose
    assert list(stray_limbs(objective, stuck)) == [f"{side}_arm"]
    before = stuck.angles.detach().clone()
    mended = mend_strays(objective, load_body_model(), stuck)
    assert mended is not None
    assert stray_limbs(objective, mended) == {}
    assert torch.equal(stuck.angles.detach(), before)  # the given fit is not modified
    objective.renew_silhouette(mended)
    objective.minimize(mended, 30, stage="silhouette")
    model = load_body_model()
    with torch.no_grad():
        state = model.forward(
            mended.rotmats(pose_space(model)).float(),
            mended.shape.float(),
            mended.translation.float(),
        )
    own = list(LIMBS[f"{side}_arm"])
    depth = model.landmarks(state).numpy()[own, 2] - truth[own, 2]
    assert np.abs(depth).max() < 0.08


def test_nothing_is_changed_where_no_limb_strays() -> None:
    evidence, camera, _, translation = seen("left")
    objective = objective_of(evidence)
    true = held("left", ON_HIP, camera, translation)
    assert stray_limbs(objective, true) == {}
    assert mend_strays(objective, load_body_model(), true) is None


def test_a_limb_of_doubtful_depth_is_tried_anew() -> None:
    evidence, camera, _, translation = seen("left")
    objective, model = objective_of(evidence), load_body_model()
    overhead = held("left", OVERHEAD, camera, translation)
    assert (
        mend_doubtful(
            objective, model, overhead, {"left_arm": DOUBTFUL - 0.01, "trunk": 2 * DOUBTFUL}
        )
        is None
    )
    mended = mend_doubtful(objective, model, overhead, {"right_arm": 0.0, "left_arm": 2 * DOUBTFUL})
    assert mended is not None
    assert gap(objective, mended, "left_arm") < STRAY


def test_a_landmark_that_is_not_seen_makes_no_limb_stray() -> None:
    evidence, camera, _, translation = seen("left")
    true = held("left", ON_HIP, camera, translation)
    places = list(LIMBS["left_arm"])
    pixels, confidence = evidence.pixels.copy(), evidence.confidence.copy()
    pixels[places] += 100.0
    elsewhere = dataclasses.replace(evidence, pixels=pixels)
    assert list(stray_limbs(objective_of(elsewhere), true)) == ["left_arm"]
    confidence[places] = 0.1
    assert (
        stray_limbs(objective_of(dataclasses.replace(elsewhere, confidence=confidence)), true) == {}
    )


def test_both_legs_beside_their_landmarks_are_short_legs() -> None:
    evidence, camera, _, translation = seen("left")
    true = held("left", ON_HIP, camera, translation)
    pixels = evidence.pixels.copy()
    for side in ("left", "right"):
        pixels[list(LIMBS[f"{side}_leg"])] += [0.0, -0.1 * evidence.height]
    assert stray_limbs(objective_of(dataclasses.replace(evidence, pixels=pixels)), true) == {}
    pixels[list(LIMBS["right_leg"])] = evidence.pixels[list(LIMBS["right_leg"])]
    assert list(stray_limbs(objective_of(dataclasses.replace(evidence, pixels=pixels)), true)) == [
        "left_leg"
    ]


def test_a_limb_that_leaves_the_mask_is_not_believed() -> None:
    before = {"loss": {"keypoints": 90.0, "strays": 20.0}, "silhouette_iou": 0.85}
    assert agrees_better({**before, "loss": {"keypoints": 50.0}}, before)
    assert not agrees_better(
        {**before, "loss": {"keypoints": 50.0}, "silhouette_iou": 0.82}, before
    )
    assert not agrees_better(
        {**before, "loss": {"keypoints": 120.0}, "silhouette_iou": 0.9}, before
    )
    assert agrees_better({"loss": {"keypoints": 50.0}}, {"loss": {"keypoints": 60.0}})  # no mask


def test_many_poses_cost_what_each_does_alone() -> None:
    evidence, camera, _, translation = seen("left")
    objective = objective_of(evidence)
    poses = np.stack(
        [posed("left", ON_HIP), posed("left", OVERHEAD), posed("right", OVERHEAD)]
    ).astype(np.float32)
    costs, landmarks = objective.of_poses(held("left", OVERHEAD, camera, translation), poses)
    assert landmarks.shape == (3, 33, 3)
    for pose, cost in zip(poses, costs, strict=True):
        one = held("left", OVERHEAD, camera, translation).with_angles(pose)
        terms = objective.values(one, "silhouette")
        assert cost == pytest.approx(
            sum(terms[name] for name in ("keypoints", "strays", "depth", "pose", "limits")),
            rel=1e-3,
        )
    assert costs[0] < 0.2 * costs[1:].min()
