"""The terms of the fit: silhouettes, collisions of limbs, the pose prior, the angles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.stats import multivariate_normal

from a2v.body import load_body_model, make_body
from a2v.body.collision import LimbBalls
from a2v.body.evidence import Evidence
from a2v.body.pose_prior import PosePrior, load_pose_prior
from a2v.body.pose_space import pose_space
from a2v.body.silhouette import mask_field, rasterize, rim_vertices
from a2v.body.terms import feet, geman_mcclure
from a2v.errors import InputError
from a2v.geometry.images import mask_iou
from a2v.io import write_npz
from a2v.kinematics.names import LANDMARK_INDEX, LIMBS_BY_HEIGHT
from a2v.kinematics.so3 import rotvec_to_rotmat
from a2v.types import OrthographicCamera


def disk(
    size: int = 400, radius: float = 120.0, center: tuple[float, float] = (200.0, 180.0)
) -> np.ndarray:
    v, u = np.mgrid[:size, :size] + 0.5
    return (np.hypot(u - center[0], v - center[1]) < radius).astype(np.float32)


def test_the_distance_field_of_a_disk() -> None:
    mask = mask_field(disk(), (0, 0, 400, 400), size=200)
    points = torch.tensor(
        [[200.0, 180.0 + offset] for offset in (-170, -130, -110, -40, 60, 125, 200)],
        dtype=torch.float64,
        requires_grad=True,
    )
    value = mask.sample(points)
    want = np.abs(np.array([-170, -130, -110, -40, 60, 125, 200])) - 120
    np.testing.assert_allclose(value.detach(), want, atol=2.5)
    value.sum().backward()
    assert points.grad is not None
    np.testing.assert_allclose(
        points.grad[:, 1], np.sign([-170, -130, -110, -40, 60, 125, 200]), atol=0.15
    )
    distance = np.hypot(*(mask.contour - [200, 180]).T)
    np.testing.assert_allclose(distance, 120, atol=2.0)
    outward = (mask.contour - [200, 180]) / distance[:, None]
    assert ((outward * mask.normals).sum(axis=1) > 0.9).all()


def test_beyond_the_photo_nothing_is_known() -> None:
    mask = mask_field(disk(center=(200, 390)), (0.0, 0.0, 400.0, 400.0), size=200)
    value = mask.sample(torch.tensor([[200.0, 450.0], [-20.0, 100.0], [20.0, 100.0]]))
    assert value[:2].tolist() == [0.0, 0.0]
    assert value[2] > 100
    assert mask.contour[:, 1].max() < 398  # no contour along the cut


def test_specks_and_empty_masks_do_no_harm() -> None:
    speckled = disk()
    speckled[5:9, 5:9] = 1
    np.testing.assert_array_equal(
        mask_field(speckled, (0, 0, 400, 400)).inside, mask_field(disk(), (0, 0, 400, 400)).inside
    )
    empty = mask_field(np.zeros((50, 40), np.float32), (0, 0, 40, 50))
    assert len(empty.contour) == 0
    assert empty.sample(torch.zeros(3, 2)).abs().sum() == 0


def test_the_rim_lies_on_the_rendered_outline() -> None:
    model = load_body_model()
    body = make_body(model, grounded=True)
    camera = OrthographicCamera(scale=200.0, center_u=200.0, center_v=380.0)
    raster = rasterize(body.vertices, body.faces, camera, (400, 400))
    assert mask_iou(raster["mask"], raster["mask"]) == 1.0
    ids, pixels, normals, weights = rim_vertices(
        body.vertices, body.faces, camera, raster["mask"], 1.0
    )
    mask = mask_field(raster["mask"].astype(np.float32), (0, 0, 400, 400), size=400)
    assert len(ids) > 200
    away = np.abs(mask.sample(torch.from_numpy(pixels)).numpy())
    assert away[weights > 0.5].max() < 3
    assert weights[away > 4].max(initial=0.0) < 0.2
    outside = mask.sample(torch.from_numpy(pixels + 6 * normals)).numpy()
    assert (outside[weights > 0.5] > 0).mean() > 0.9  # normals point out of the body


def test_rasterised_depth_is_the_surface() -> None:
    vertices = np.array([[-1, 0, 0.5], [1, 0, 0.5], [0, 2, 0.5]], dtype=np.float32)
    camera = OrthographicCamera(scale=10.0, center_u=20.0, center_v=30.0)
    raster = rasterize(vertices, np.array([[0, 1, 2]], dtype=np.int32), camera, (40, 40))
    assert raster["mask"].sum() == pytest.approx(
        200, rel=0.06
    )  # two square meters at 100 pixels each
    np.testing.assert_allclose(raster["depth"][raster["mask"]], 0.5, atol=1e-5)
    assert raster["mask"][25, 20]
    assert not raster["mask"][35, 20]


def test_arms_inside_of_the_trunk_are_noticed() -> None:
    model = load_body_model()
    space, balls = pose_space(model), LimbBalls(model)
    shape = torch.from_numpy(model.shape_default)
    natural = torch.from_numpy(space.natural)
    assert balls.penetration(model.forward(space.rotvecs(natural), shape)).sum() == 0
    inside = natural.clone()
    inside[space.index("left_arm_raise")] = -1.3
    inside.requires_grad_()
    overlap = balls.penetration(model.forward(space.rotvecs(inside), shape)).square().sum()
    assert overlap > 1e-4
    overlap.backward()
    assert inside.grad is not None
    assert inside.grad[space.index("left_arm_raise")] < 0  # raising the arm helps
    assert inside.grad[space.index("right_arm_raise")] == 0


def test_angles_mirror() -> None:
    model = load_body_model()
    space = pose_space(model)
    assert (space.limits[:, 0] <= space.natural).all()
    assert (space.natural <= space.limits[:, 1]).all()
    angles = space.natural + 0.4 * np.random.default_rng(0).normal(size=len(space)).astype(
        np.float32
    )
    mirrored = angles[space.mirror] * space.mirror_sign
    first, second = (
        make_body(model, space.rotvecs(torch.from_numpy(values.astype(np.float32))).numpy())
        for values in (angles, mirrored)
    )
    left, right = (model.bone(f"wrist.{side}") for side in "LR")
    np.testing.assert_allclose(
        first.bone_transforms[left, :3, 3],
        second.bone_transforms[right, :3, 3] * [-1, 1, 1],
        atol=2e-3,
    )


@pytest.mark.parametrize(
    ("name", "bone", "axis", "sign"),
    [
        ("left_knee_bend", "foot.L", 2, -1),  # the foot goes back
        ("right_knee_bend", "foot.R", 2, -1),
        ("left_arm_raise", "wrist.L", 1, 1),
        ("right_arm_raise", "wrist.R", 1, 1),
        ("left_arm_swing", "wrist.L", 2, 1),
        ("right_arm_swing", "wrist.R", 2, 1),
        ("left_hip_spread", "foot.L", 0, 1),
        ("right_hip_spread", "foot.R", 0, -1),
        ("waist_bend", "head", 2, 1),  # the head goes forward
    ],
)
def test_positive_angles_do_what_their_names_say(
    name: str, bone: str, axis: int, sign: int
) -> None:
    model = load_body_model()
    space = pose_space(model)
    angles = torch.from_numpy(space.natural.copy())
    before = make_body(model, space.rotvecs(angles).numpy())
    angles[space.index(name)] += 0.3
    after = make_body(model, space.rotvecs(angles).numpy())
    index = model.bone(bone)
    assert (
        sign * (after.bone_transforms[index, axis, 3] - before.bone_transforms[index, axis, 3])
        > 0.02
    )


def test_the_pose_prior_against_scikit_learn_and_scipy() -> None:
    mixture = pytest.importorskip("sklearn.mixture").GaussianMixture(
        3, random_state=0, reg_covar=1e-3
    )
    rng = np.random.default_rng(0)
    data = np.concatenate(
        [
            rng.normal(size=(200, 5)) @ rng.normal(size=(5, 5)) + 3 * rng.normal(size=5)
            for _ in range(3)
        ]
    )
    mixture.fit(data)
    prior = PosePrior(
        weights=mixture.weights_, means=mixture.means_, covariances=mixture.covariances_
    )
    points = rng.normal(size=(20, 5)) * 3
    ours = prior.log_likelihood(torch.from_numpy(points)).numpy()
    np.testing.assert_allclose(ours, mixture.score_samples(points), atol=1e-8)
    densities = [
        weight * multivariate_normal(mean, cov).pdf(points)
        for weight, mean, cov in zip(
            mixture.weights_, mixture.means_, mixture.covariances_, strict=True
        )
    ]
    np.testing.assert_allclose(ours, np.log(np.sum(densities, axis=0)), atol=1e-6)
    assert torch.autograd.gradcheck(
        prior.log_likelihood, torch.from_numpy(points[:2]).requires_grad_()
    )


def test_the_shipped_prior_knows_people() -> None:
    prior, space = load_pose_prior(), pose_space(load_body_model())
    assert prior.names == space.names
    assert prior.weights.sum() == pytest.approx(1, abs=1e-4)
    standing = torch.from_numpy(space.natural.astype(np.float64))
    backwards = standing.clone()
    backwards[space.index("left_knee_bend")] = -1.0  # no knee bends this way
    assert prior.log_likelihood(standing) > prior.log_likelihood(backwards) + 10
    mirrored = torch.from_numpy(space.natural[space.mirror] * space.mirror_sign).double()
    # the data were mirrored: a pose and its mirror image are about equally likely
    assert float(prior.log_likelihood(standing)) == pytest.approx(
        float(prior.log_likelihood(mirrored)), abs=3
    )


def test_a_file_that_is_no_prior_is_named(tmp_path: Path) -> None:
    write_npz(tmp_path / "other.npz", {"weights": np.ones(1)})
    with pytest.raises(InputError, match=r"other\.npz"):
        load_pose_prior(tmp_path / "other.npz")


def test_the_penalty_levels_off() -> None:
    square = torch.tensor([0.0, 1e-6, 1e6])
    value = geman_mcclure(square, 0.5)
    assert value[0] == 0
    assert value[1] == pytest.approx(1e-6, rel=1e-4)
    assert value[2] == pytest.approx(0.25, rel=1e-4)


def test_the_limbs_are_as_long_as_the_default_bodys() -> None:
    model = load_body_model()
    body = make_body(model)
    state = model.forward(
        *(torch.from_numpy(body.parameters[key]) for key in ("rotations", "shape", "translation"))
    )
    points = model.landmarks(state).numpy()
    for (first, last), ratio in LIMBS_BY_HEIGHT.items():
        length = np.linalg.norm(
            points[LANDMARK_INDEX[f"left_{first}"]] - points[LANDMARK_INDEX[f"left_{last}"]]
        )
        assert length / np.ptp(body.vertices[:, 1]) == pytest.approx(ratio, abs=0.012)


def legs_cost(*, turn: float, **angles: float) -> float:
    """The term of the feet for a standing person in the natural pose with other `angles`, turned
    about the vertical by `turn` degrees, without the trunk's share."""
    model = load_body_model()
    space = pose_space(model)
    pose = torch.from_numpy(space.natural.astype(np.float64))
    for name, value in angles.items():
        pose[space.index(name)] = value
    state = model.forward(space.rotvecs(pose), torch.from_numpy(model.shape_default).double())
    about = torch.tensor([0.0, np.radians(turn), 0.0], dtype=torch.float64)
    landmarks = model.landmarks(state) @ rotvec_to_rotmat(about).T
    nothing = np.zeros(0)
    evidence = Evidence(
        pixels=np.zeros((33, 2)),
        confidence=np.zeros(33),
        depth=nothing,
        segments=np.zeros((0, 2), np.int64),
        depth_confidence=nothing,
        points=None,
        points_scale=0.0,
        height=1.0,
        straight=(False, False),
        standing=(True, False),
        mask=None,
    )
    return float(feet(pose, landmarks, space=space, evidence=evidence))


@pytest.mark.parametrize("turn", [0.0, 35.0, -35.0, 180.0, 90.0])
def test_a_leg_may_stand_apart_but_not_lean_to_the_front(turn: float) -> None:
    under = legs_cost(turn=turn)
    # in profile the picture shows how far a leg leans, but not how far it stands apart
    profile = turn == 90.0
    assert legs_cost(turn=turn, left_hip_spread=0.25) < under + (15 if profile else 6)
    leaning = legs_cost(turn=turn, left_hip_bend=-0.25)
    assert leaning < under + 1 if profile else leaning > under + 20
