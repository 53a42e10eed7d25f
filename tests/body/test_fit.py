"""Fitting a body to synthetic subjects with known ground truth."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from a2v.body import JOINT_BONES, PARTS, FitResult, FitSettings, fit_body, load_body_model
from a2v.body.evidence import gather_evidence
from a2v.body.pose_space import pose_space
from a2v.body.silhouette import rasterize
from a2v.body.view import USUAL
from a2v.errors import InputError
from a2v.geometry.images import mask_iou
from a2v.geometry.mesh import vertex_normals
from a2v.kinematics.names import BLAZEPOSE
from a2v.types import Body, OrthographicCamera, Subject, Surface
from tests.support.bodies import joint_errors, landmarks_of, near_view, random_body, subject_of

QUICK = FitSettings(rounds=3)


def angle(result: FitResult, name: str) -> float:
    return float(result.body.parameters["angles"][pose_space(load_body_model()).index(name)])


@pytest.fixture(scope="module")
def standing() -> tuple[Body, Subject, OrthographicCamera, FitResult]:
    body = random_body(1)
    subject, camera = subject_of(body, noise=0.01)
    return body, subject, camera, fit_body(subject)


def test_a_standing_person_is_recovered(
    standing: tuple[Body, Subject, OrthographicCamera, FitResult],
) -> None:
    body, subject, camera, result = standing
    assert result.residuals["keypoint_mean"] < 0.015  # the noise itself is 0.0125
    assert result.residuals["silhouette_iou"] > 0.95
    errors = joint_errors(body, camera, result)
    assert errors.mean() < 0.04
    assert errors.max() < 0.15
    flat = result.camera.flatten(result.body.vertices)
    raster = rasterize(flat, result.body.faces, result.camera.flat, subject.mask.shape)["mask"]
    assert mask_iou(raster, subject.mask > 0.5) > 0.95  # the residuals hold at full resolution
    assert abs(result.residuals["height"] - 1.7) < 0.12


def test_the_frame_is_the_photos(
    standing: tuple[Body, Subject, OrthographicCamera, FitResult],
) -> None:
    _, subject, _, result = standing
    assert abs(result.body.vertices[:, 1].min()) < 1e-4
    np.testing.assert_allclose(result.body.bone_transforms[0, [0, 2], 3], 0, atol=1e-4)
    landmarks = landmarks_of(load_body_model(), result.body)
    tall = result.camera.scale * result.residuals["height"]
    error = (
        np.linalg.norm(result.camera.project(landmarks) - subject.keypoints[:, :2], axis=1) / tall
    )
    assert error.mean() == pytest.approx(result.residuals["keypoint_mean"], rel=1e-3)
    assert set(result.residuals["keypoints"]) == set(BLAZEPOSE)
    # bones and skin in the saved record agree
    weights, rest = result.body.weights, result.body.rest_transforms
    assert weights.shape[1] == len(rest) == len(result.body.bone_transforms)


def test_joints_bend_the_right_way(
    standing: tuple[Body, Subject, OrthographicCamera, FitResult],
) -> None:
    result = standing[3]
    space = pose_space(load_body_model())
    angles = result.body.parameters["angles"]
    assert (angles > space.limits[:, 0] - 0.1).all()
    assert (angles < space.limits[:, 1] + 0.1).all()


def test_the_detectors_bent_legs_are_not_believed() -> None:
    body = random_body(2)
    subject, _ = subject_of(body)
    points = subject.keypoints_3d.copy()
    for side in ("left", "right"):  # errors that mediapipe makes for standing people
        points[BLAZEPOSE.index(f"{side}_knee"), 2] -= 0.04
        for joint in ("ankle", "heel", "foot_index"):
            points[BLAZEPOSE.index(f"{side}_{joint}"), 2] -= 0.2
    result = fit_body(dataclasses.replace(subject, keypoints_3d=points), settings=QUICK)
    for side in ("left", "right"):
        assert abs(angle(result, f"{side}_knee_bend")) < np.radians(10)
        hip, ankle = (
            result.body.bone_transforms[
                result.body.bone_names.index(f"{bone}.{side[0].upper()}"), 2, 3
            ]
            for bone in ("upperleg01", "foot")
        )
        assert abs(hip - ankle) < 0.1  # the error is 0.2, and this person is turned


def test_bent_legs_that_are_seen_stay_bent() -> None:
    body = random_body(3, bend_legs=True, yaw=1.2)  # from the side
    subject, camera = subject_of(body)
    result = fit_body(subject, settings=QUICK)
    model = load_body_model()
    for side in ("L", "R"):
        want = np.linalg.norm(body.parameters["rotations"][model.bone(f"lowerleg01.{side}")])
        assert angle(result, f"{'left' if side == 'L' else 'right'}_knee_bend") == pytest.approx(
            want, abs=0.35
        )
    assert joint_errors(body, camera, result).mean() < 0.05


@pytest.mark.parametrize("depth", [True, False])
def test_a_person_seen_from_behind(depth: bool) -> None:
    body = random_body(4, yaw=np.pi, spread=0.4)
    subject, camera = subject_of(body, depth=depth)
    result = fit_body(subject, settings=QUICK)
    skull = result.body.vertices[result.body.parts == PARTS.index("head")]
    assert (
        landmarks_of(load_body_model(), result.body)[0, 2] < skull[:, 2].mean()
    )  # the nose points away
    assert joint_errors(body, camera, result).mean() < (0.04 if depth else 0.09)
    assert result.residuals["silhouette_iou"] > 0.93


def test_openpose_without_hands_and_feet_cut_off() -> None:
    body = random_body(5, spread=0.4)
    subject, _ = subject_of(body, depth=False)
    cut = int(subject.keypoints[BLAZEPOSE.index("left_knee"), 1]) + 40
    keypoints = subject.keypoints.copy()
    for index, name in enumerate(BLAZEPOSE):
        if (
            name.split("_")[-1] in ("pinky", "index", "thumb", "heel")
            or "foot" in name
            or "mouth" in name
            or keypoints[index, 1] > cut
        ):
            keypoints[index] = 0
    subject = Subject(
        image=subject.image[:cut],
        mask=subject.mask[:cut],
        keypoints=keypoints,
        keypoints_3d=subject.keypoints_3d,
        crop=(0, 0, 480, cut),
        photo_size=(480, cut),
    )
    result = fit_body(subject, settings=QUICK)
    assert np.isfinite(result.body.vertices).all()
    assert result.residuals["silhouette_iou"] > 0.9
    assert "left_ankle" not in result.residuals["keypoints"]
    feet = result.camera.project(
        result.body.vertices[result.body.parts == PARTS.index("left_foot")]
    )
    assert feet[:, 1].min() > cut  # the feet are below the photo, not squeezed into it
    assert 1.5 < result.residuals["height"] < 1.9


def test_the_seed_decides_everything_and_progress_reaches_the_end() -> None:
    subject, _ = subject_of(random_body(6))
    calls: list[tuple[int, int]] = []
    first, second = (
        fit_body(
            subject,
            settings=FitSettings(rounds=2, steps=5),
            progress=lambda done, total: calls.append((done, total)),
        )
        for _ in range(2)
    )
    np.testing.assert_array_equal(first.body.vertices, second.body.vertices)
    assert first.camera == second.camera
    assert len(calls) % 2 == 0
    assert calls[: len(calls) // 2] == calls[len(calls) // 2 :]
    done, total = zip(*calls[: len(calls) // 2], strict=True)
    assert [*done] == sorted(done)
    assert done[-1] == total[-1]


def test_the_surface_puts_the_joints_in_place(
    standing: tuple[Body, Subject, OrthographicCamera, FitResult],
) -> None:
    body, subject, camera, photo = standing
    vertices = body.vertices + 0.01 * vertex_normals(
        body.vertices, body.faces
    )  # a centimeter of clothes
    surface = Surface(
        vertices=vertices.astype(np.float32), faces=body.faces, colors=np.full_like(vertices, 0.5)
    )
    result = fit_body(subject, surface=surface, camera=camera)
    bones = [body.bone_names.index(bone) for bone in JOINT_BONES.values()]
    errors = np.linalg.norm(
        result.body.bone_transforms[bones, :3, 3] - body.bone_transforms[bones, :3, 3], axis=1
    )
    assert errors.mean() < 0.015
    assert errors.max() < 0.04
    assert errors.mean() < 0.6 * joint_errors(body, camera, photo).mean()
    assert result.residuals["surface_mean"] < 0.012
    assert result.camera.flat == camera


def test_bad_input_is_named(standing: tuple[Body, Subject, OrthographicCamera, FitResult]) -> None:
    body, subject, _, _ = standing
    few = subject.keypoints.copy()
    few[4:, 2] = 0
    with pytest.raises(InputError, match="keypoints"):
        fit_body(dataclasses.replace(subject, keypoints=few))
    surface = Surface(vertices=body.vertices, faces=body.faces, colors=np.zeros_like(body.vertices))
    with pytest.raises(InputError, match="camera"):
        fit_body(subject, surface=surface)
    with pytest.raises(InputError, match="keypoint_sigma"):
        FitSettings(keypoint_sigma=-1.0)
    with pytest.raises(InputError, match="rounds"):
        FitSettings(rounds=-1)


def test_forward_of_the_result_gives_its_vertices(
    standing: tuple[Body, Subject, OrthographicCamera, FitResult],
) -> None:
    body = standing[3].body
    model = load_body_model()
    angles = torch.from_numpy(body.parameters["angles"])
    rotations = pose_space(model).rotvecs(angles).numpy()
    np.testing.assert_allclose(rotations[1:], body.parameters["rotations"][1:], atol=1e-6)


def test_a_near_camera_is_understood_where_its_distance_is_known() -> None:
    body = random_body(6, spread=0.5, yaw=0.2)
    subject, camera = near_view(body, distance=1.8, pitch=0.3)
    near, far = (
        fit_body(subject, settings=dataclasses.replace(QUICK, distance=distance))
        for distance in (1.8, 0.0)
    )
    assert (
        joint_errors(body, camera.flat, near).mean()
        < 0.6 * joint_errors(body, camera.flat, far).mean()
    )
    assert near.camera.distance == pytest.approx(1.8)
    assert abs(near.camera.pitch - camera.pitch) < np.radians(6)
    assert abs(near.body.vertices[:, 1].min()) < 1e-4
    told = near.residuals["camera"]
    assert told["distance_from"] == "given"
    assert told["height"] == pytest.approx(near.camera.height)


def test_standing_people_show_the_distance() -> None:
    subject, _ = near_view(random_body(6, spread=0.5, yaw=0.2), distance=1.8, pitch=0.3)
    evidence = gather_evidence(subject, QUICK)
    assert all(evidence.standing)
    assert evidence.distance_spread > 0
    assert gather_evidence(subject, dataclasses.replace(QUICK, distance=3.0)).distance_spread == 0
    assert dataclasses.replace(evidence, standing=(True, False)).distance_spread == 0
    found = fit_body(subject, settings=QUICK)
    assert found.camera.distance < 0.95 * USUAL[0]
    assert found.camera.source.endswith("and the fit")
    assert 20 < found.residuals["camera"]["field_of_view"] < 70


def test_the_files_focal_length_tells_the_distance() -> None:
    subject, _ = subject_of(random_body(1))
    told = dataclasses.replace(subject, focal_length=50.0)
    view, nothing = (gather_evidence(item, FitSettings()).view for item in (told, subject))
    height = gather_evidence(told, FitSettings()).height
    assert view.distance == pytest.approx(50 / 43.27 * np.hypot(480, 480) * 1.7 / height, rel=1e-3)
    assert "focal length" in view.source
    assert nothing.distance == pytest.approx(USUAL[0])
    assert gather_evidence(told, FitSettings(distance=0.0)).view.distance == 0
