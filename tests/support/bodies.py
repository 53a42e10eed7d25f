"""Synthetic subjects: a random body in a random natural pose, seen by a random camera."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from a2v.body import JOINT_BONES, AnnyModel, FitResult, load_body_model, make_body
from a2v.body.fingers import reskinned
from a2v.body.pose_space import pose_space
from a2v.body.silhouette import rasterize
from a2v.kinematics.skeleton import subtree
from a2v.kinematics.so3 import rotmat_to_rotvec, rotvec_to_rotmat
from a2v.types import Body, OrthographicCamera, PhotoCamera, Subject


def landmarks_of(model: AnnyModel, body: Body) -> np.ndarray:
    """The 33 landmarks of a body, meters."""
    with torch.no_grad():
        state = model.forward(
            *(
                torch.from_numpy(body.parameters[key])
                for key in ("rotations", "shape", "translation")
            )
        )
        return model.landmarks(state).numpy()


def random_body(
    seed: int, *, spread: float = 0.7, yaw: float | None = None, bend_legs: bool = False
) -> Body:
    """A plausible body and pose, standing on the ground."""
    rng = np.random.default_rng(seed)
    model = load_body_model("anny")
    space = pose_space(model)
    angles = space.natural + spread * space.spread * rng.normal(size=len(space))
    for name in space.names:
        if "knee" in name or "hip_bend" in name:
            sign = 1.0 if "knee" in name else -1.0
            angles[space.index(name)] = (
                sign * abs(rng.normal()) * 0.8 if bend_legs and "twist" not in name else 0.0
            )
    angles = np.clip(angles, space.limits[:, 0], space.limits[:, 1]).astype(np.float32)
    shape = model.shape_default + rng.normal(size=model.n_shape) * 0.15
    shape[model.shape_names.index("age")] = 0.67
    shape[model.shape_names.index("height")] = 0.39 + 0.03 * rng.normal()
    rotations = space.rotvecs(torch.from_numpy(angles)).numpy()
    turn = rng.uniform(-0.5, 0.5) if yaw is None else yaw
    rotations[0] = rotmat_to_rotvec(rotvec_to_rotmat(np.array([0.0, turn, 0.0])))
    return make_body(
        model,
        rotations,
        np.clip(shape, model.shape_bounds[:, 0], model.shape_bounds[:, 1]),
        grounded=True,
    )


def subject_of(
    body: Body,
    *,
    depth: bool = True,
    noise: float = 0.0,
    seed: int = 0,
    size: tuple[int, int] = (480, 480),
) -> tuple[Subject, OrthographicCamera]:
    """Return the subject of a body: keypoints, mask and, on request, 3D keypoints.

    `noise` is in fractions of the height.
    """
    rng = np.random.default_rng(seed)
    model = load_body_model("anny")
    tall = float(np.ptp(body.vertices[:, 1]))
    camera = OrthographicCamera(
        scale=0.85 * size[1] / max(tall, 1.6), center_u=size[0] * 0.48, center_v=size[1] * 0.95
    )
    mask = rasterize(body.vertices, body.faces, camera, (size[1], size[0]))["mask"]
    points = landmarks_of(model, body)
    pixels = camera.project(points) + noise * tall * camera.scale * rng.normal(size=(33, 2))
    middle = points[[23, 24]].mean(axis=0)
    points_3d = (
        points - middle + noise * tall * rng.normal(size=points.shape)
        if depth
        else np.full_like(points, np.nan)
    )
    subject = Subject(
        image=np.full((*mask.shape, 3), 128, np.uint8),
        mask=mask.astype(np.float32),
        keypoints=np.concatenate([pixels, np.ones((33, 1))], axis=1).astype(np.float32),
        keypoints_3d=points_3d.astype(np.float32),
        crop=(0, 0, size[0], size[1]),
        photo_size=size,
    )
    return subject, camera


def near_view(body: Body, *, distance: float, pitch: float) -> tuple[Subject, PhotoCamera]:
    """A body as a perspective camera sees it (`subject_of` is orthographic)."""
    middle = body.vertices.mean(axis=0)
    flat = OrthographicCamera(
        scale=230.0, center_u=240.0, center_v=240.0 + 230.0 * float(middle[1])
    )
    camera = PhotoCamera(
        flat=flat, aim=(0.0, float(middle[1]), 0.0), distance=distance, pitch=pitch
    )
    points = landmarks_of(load_body_model("anny"), body)
    mask = rasterize(camera.flatten(body.vertices), body.faces, flat, (480, 480))["mask"]
    subject = Subject(
        image=np.full((480, 480, 3), 128, np.uint8),
        mask=mask.astype(np.float32),
        keypoints=np.concatenate([camera.project(points), np.ones((33, 1))], axis=1).astype(
            np.float32
        ),
        keypoints_3d=(points - points[[23, 24]].mean(axis=0)).astype(np.float32),
        crop=(0, 0, 480, 480),
        photo_size=(480, 480),
    )
    return subject, camera


def turned(body: Body, angle: float) -> Body:
    """The same body turned about the vertical, on the ground."""
    rotations = body.parameters["rotations"].copy()
    rotations[0] = rotmat_to_rotvec(
        rotvec_to_rotmat(np.array([0.0, angle, 0.0]))
        @ rotvec_to_rotmat(rotations[0].astype(np.float64))
    )
    return make_body(load_body_model("anny"), rotations, body.parameters["shape"], grounded=True)


def with_turned_limb(body: Body, name: str, degrees: Sequence[float]) -> Body:
    """The body with a limb, from the bone `name` on, turned about the world's x, y and z axes."""
    bone = body.bone_names.index(name)
    transforms = body.bone_transforms.astype(np.float64)
    moved, center = np.eye(4), transforms[bone, :3, 3]
    moved[:3, :3] = Rotation.from_euler("xyz", degrees, degrees=True).as_matrix()
    moved[:3, 3] = center - moved[:3, :3] @ center
    below = subtree(body.bone_parents, bone)
    transforms[below] = moved @ transforms[below]
    return reskinned(body, transforms)


def joint_errors(truth: Body, camera: OrthographicCamera, result: FitResult) -> np.ndarray:
    """Errors (n,) of the main joints relative to the pelvis, meters, with free scale."""
    bones = [truth.bone_names.index(bone) for bone in JOINT_BONES.values()]
    want = truth.bone_transforms[bones, :3, 3]
    got = result.body.bone_transforms[bones, :3, 3] * (result.camera.scale / camera.scale)
    return np.linalg.norm((got - got[0]) - (want - want[0]), axis=1)
