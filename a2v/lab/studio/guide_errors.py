"""Errors of `a2v.body.fit_body` with one photo: turned bones, a wrong girth, a shift, a wrong
scale."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from a2v.errors import InputError
from a2v.kinematics import rotvec_to_rotmat
from a2v.lab.studio.avatars import Avatar
from a2v.lab.studio.variation import segment_of
from a2v.types import FloatArray


@dataclass(frozen=True, kw_only=True)
class GuideErrors:
    """Standard deviations of the errors of `a2v.body.fit_body` with one photo.

    The defaults imitate the errors measured on validation views (docs/research/studio.md).

    Attributes
    ----------
    depth_torso : float
        Standard deviation of the rotation of the bones of the torso about the axis in the image
        plane that is perpendicular to the bone, which the photo hardly shows, degrees.
    depth_head : float
        Standard deviation of the rotation of the bones of the head about the axis in the image
        plane that is perpendicular to the bone, which the photo hardly shows, degrees.
    depth_arms : float
        Standard deviation of the rotation of the bones of the arms about the axis in the image
        plane that is perpendicular to the bone, which the photo hardly shows, degrees.
    depth_hands : float
        Standard deviation of the rotation of the bones of the hands about the axis in the image
        plane that is perpendicular to the bone, which the photo hardly shows, degrees.
    depth_legs : float
        Standard deviation of the rotation of the bones of the legs about the axis in the image
        plane that is perpendicular to the bone, which the photo hardly shows, degrees.
    plane_torso : float
        Standard deviation of the rotation of the torso in the image plane, degrees.
    plane_limbs : float
        Standard deviation of the rotation of the limbs in the image plane, degrees.
    plane_hands : float
        Standard deviation of the rotation of the hands in the image plane, degrees.
    twist_torso : float
        Standard deviation of the rotation of the bones of the torso about themselves, degrees.
    twist_arms : float
        Standard deviation of the rotation of the bones of the arms about themselves, degrees.
    twist_hands : float
        Standard deviation of the rotation of the bones of the hands about themselves, degrees.
    twist_legs : float
        Standard deviation of the rotation of the bones of the legs about themselves, degrees.
    arms_forward : float
        Mean rotation of the arms towards the camera, degrees. The detector's depths cause it.
    lean : float
        Standard deviation of the rotation of the whole body about the image's horizontal axis,
        degrees.
    heading : float
        Standard deviation of the rotation of the trunk about its own axis, degrees.
    looks : float
        Standard deviation of the change of a bone's length in the photo, meters.
    girth : float
        Relative standard deviation of the thickness of each segment; half of its variance is common
        to all.
    shift : float
        Standard deviation of the shift of the whole body in x and y, meters.
    scale : float
        Relative standard deviation of the height, which a photo does not show. It scales the whole
        body.
    """

    depth_torso: float = 5.0
    depth_head: float = 9.0
    depth_arms: float = 20.0
    depth_hands: float = 22.0
    depth_legs: float = 8.0
    plane_torso: float = 0.7
    plane_limbs: float = 2.0
    plane_hands: float = 10.0
    twist_torso: float = 6.0
    twist_arms: float = 16.0
    twist_hands: float = 25.0
    twist_legs: float = 8.0
    arms_forward: float = 6.0
    lean: float = 3.0
    heading: float = 9.0
    looks: float = 0.02
    girth: float = 0.035
    shift: float = 0.005
    scale: float = 0.05

    def __post_init__(self) -> None:
        if min(dataclasses.asdict(self).values()) < 0:
            raise InputError(
                "a guide's errors are standard deviations: expected numbers of at least 0"
            )


_SEGMENTS = {
    "Hips": ("torso", "Spine2"),
    "Spine1": ("torso", "Neck"),
    "Neck": ("torso", "Head"),
    "Head": ("head", "HeadEnd"),
    "Arm": ("arms", "ForeArm"),
    "ForeArm": ("arms", "Hand"),
    "Hand": ("hands", "HandMiddle1"),
    "UpLeg": ("legs", "Leg"),
    "Leg": ("legs", "Foot"),
    "Foot": ("legs", "ToeBase"),
}
"""Bones with an error of their own (without their side), the kind of their errors, and the bone at
their other end."""


def disturb(
    avatar: Avatar,
    transforms: FloatArray,
    view: FloatArray,
    errors: GuideErrors,
    generator: np.random.Generator,
) -> FloatArray:
    """Add the errors of a fit to world-from-bone transforms (B, 4, 4).

    Every segment turns independently, mostly in depth.

    Parameters
    ----------
    avatar : Avatar
        The avatar (with its build) that the transforms belong to.
    transforms : (B, 4, 4)
    view : (3,)
        Direction to the camera, world, unit.
    errors : GuideErrors
    generator : numpy Generator
    """
    rest = avatar.rest_transforms.astype(np.float64)
    posed_rotmat = transforms[:, :3, :3].astype(np.float64) @ np.swapaxes(rest[:, :3, :3], 1, 2)
    heads = transforms[:, :3, 3].astype(np.float64)
    number = {name: index for index, name in enumerate(avatar.bone_names)}
    right = np.cross([0.0, 1.0, 0.0], view)
    right /= max(float(np.linalg.norm(right)), 1e-9)
    lean = _rotmat_of_degrees(errors.lean * _heavy_tailed(generator) * right)
    trunk = heads[number["Neck"]] - heads[number["Hips"]]
    heading = _rotmat_of_degrees(
        errors.heading * _heavy_tailed(generator) * trunk / max(float(np.linalg.norm(trunk)), 1e-9)
    )
    error = np.tile(np.eye(3), (len(rest), 1, 1))
    result = transforms.astype(np.float64)
    for bone, name in enumerate(avatar.bone_names):
        parent = int(avatar.bone_parents[bone])
        side = next((prefix for prefix in ("Left", "Right") if name.startswith(prefix)), "")
        stem = name.removeprefix(side)
        if stem in _SEGMENTS:
            kind, end = _SEGMENTS[stem]
            along = heads[number[side + end]] - heads[bone]
            # the errors of the parents have already moved the head of the bone: the keypoints pull
            # its other end back
            gap = (
                np.zeros(3)
                if parent < 0
                else _placed(result, error, posed_rotmat, rest, bone, parent) - heads[bone]
            )
            own = lean @ _segment_error(along, gap, view, kind, errors, generator)
            # the keypoints keep the limbs in place at any heading of the trunk
            error[bone] = own @ heading if kind in ("torso", "head") else own
        elif parent >= 0:
            error[bone] = error[parent]
        new = error[bone] @ posed_rotmat[bone]
        result[bone, :3, :3] = new @ rest[bone, :3, :3]
        if parent >= 0:
            result[bone, :3, 3] = _placed(result, error, posed_rotmat, rest, bone, parent)
    return result


_ALIGNED = (
    "Head",
    *(
        f"{side}{bone}"
        for side in ("Left", "Right")
        for bone in ("Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot")
    ),
)
"""Bones whose heads a fit aligns with the photo's joints."""


def disturb_in_place(
    avatar: Avatar,
    transforms: FloatArray,
    view: FloatArray,
    errors: GuideErrors,
    generator: np.random.Generator,
) -> FloatArray:
    """Disturb a pose (`disturb`), then move it in the image plane.

    A fit with a turned bone moves the body until its joints match the photo's again.
    """
    wrong = disturb(avatar, transforms, view, errors, generator)
    aligned = [avatar.bone_names.index(name) for name in _ALIGNED]
    gap = (wrong - transforms)[aligned, :3, 3].mean(axis=0)
    wrong[:, :3, 3] -= gap - (gap @ view) * view
    return wrong


def _placed(
    result: FloatArray,
    error: FloatArray,
    posed_rotmat: FloatArray,
    rest: FloatArray,
    bone: int,
    parent: int,
) -> FloatArray:
    """Return the position (3,) of the head of a bone that moves with its disturbed parent."""
    return np.asarray(
        result[parent, :3, 3]
        + error[parent] @ posed_rotmat[parent] @ (rest[bone, :3, 3] - rest[parent, :3, 3])
    )


def _segment_error(
    along: FloatArray,
    gap: FloatArray,
    view: FloatArray,
    kind: str,
    errors: GuideErrors,
    generator: np.random.Generator,
) -> FloatArray:
    """Draw the rotation (3, 3) of a fit's error for a segment along `along` (3,), meters, whose
    head is off by `gap` (3,)."""
    length = max(float(np.linalg.norm(along)), 1e-9)
    across = np.cross(view, along)
    across /= max(float(np.linalg.norm(across)), 1e-9)
    tilt = np.arcsin(
        np.clip(along @ view / length, -1, 1)
    )  # out of the image plane, toward the camera
    proposed = np.array([_heavy_tailed(generator) for _ in range(12)]) * np.radians(
        getattr(errors, f"depth_{kind}")
    )
    if kind in ("arms", "hands"):
        proposed -= np.radians(
            errors.arms_forward
        )  # a positive turn about `across` points away from the camera
    change = length * (np.abs(np.cos(tilt - proposed)) - np.cos(tilt))
    likely = np.exp(-0.5 * np.square(change / max(errors.looks, 1e-9))) + 1e-9
    depth = generator.choice(proposed, p=likely / likely.sum())
    plane = (
        errors.plane_hands
        if kind == "hands"
        else errors.plane_torso
        if kind == "torso"
        else errors.plane_limbs
    )
    correction = (
        -0.8 * np.degrees(gap @ across / max(length * np.cos(tilt), 0.05))
        if errors.looks > 0
        else 0.0
    )
    beside = plane * _heavy_tailed(generator) + np.clip(correction, -8, 8)
    twist = getattr(errors, f"twist_{'torso' if kind == 'head' else kind}") * _heavy_tailed(
        generator
    )
    return _rotmat_of_degrees(np.degrees(depth) * across + beside * view) @ _rotmat_of_degrees(
        twist * along / length
    )


def _heavy_tailed(generator: np.random.Generator) -> float:
    """Draw a number of standard deviation 1 with heavier tails than a Gaussian's (Student's t, 5
    degrees of freedom), within 3.5."""
    return float(np.clip(generator.standard_t(5) * np.sqrt(3 / 5), -3.5, 3.5))


def _rotmat_of_degrees(rotvec: FloatArray) -> FloatArray:
    """Return the rotation matrix (3, 3) of a rotation vector (3,) in degrees."""
    return np.asarray(rotvec_to_rotmat(np.radians(rotvec)))


def girth_errors(errors: GuideErrors, generator: np.random.Generator) -> dict[str, float]:
    """Draw factors of the guide's girth by segment: a common error times one per segment."""
    names = sorted(
        {segment_of(f"Left{bone}") for bone in ("Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot")}
        | {"torso", "neck", "head"}
    )
    half = errors.girth / np.sqrt(2)
    common = half * generator.standard_normal()
    return {
        name: float(1 + np.clip(common + half * generator.standard_normal(), -0.2, 0.2))
        for name in names
    }
