"""Keep standing feet still: find the ground, lock contacts, move the pelvis with them."""

from __future__ import annotations

import numpy as np

from a2v.animation.contacts import ContactSettings
from a2v.animation.curves import eased, speed_of
from a2v.animation.feet import carry_pelvis, keep_clear, needed_drop, plan_foot, reach_plan
from a2v.animation.rig import SIDES, Rig, joints_of, place, sole_points
from a2v.kinematics.skeleton import subtree
from a2v.types import FloatArray


def clean_contacts(
    transforms: FloatArray,
    rig: Rig,
    fps: float,
    settings: ContactSettings,
    steps: FloatArray | None = None,
) -> FloatArray:
    """Put a retargeted clip on the ground and keep its standing feet in place.

    1. The ground level is found under the body's lowest points and followed if it drifts. It is
       then refined under the standing feet.
    2. Heel and toes are in contact while they are low and slow (with hysteresis).
    3. A foot in contact turns flat where heel and toes both touch; its touching end is held at one
       place, first the heel and then the toes as the foot rolls. Between contacts the correction
       changes smoothly from one to the next.
    4. Body parts below the ground lift the pelvis, standing feet move it with them, and legs that
       are too short lower it; all smoothly.
    5. Toes bend while the heel is raised; a fast foot stays clear of the ground. Thigh and shin
       follow by two-bone inverse kinematics in the plane of the knee.

    Parameters
    ----------
    transforms : (T, B, 4, 4) float64
        World from bone, meters, y up.
    rig : Rig
    fps : float
    settings : ContactSettings
    steps : (2, T) float or None
        Height above the ground of the surface under the left and the right foot. The ground is then
        level, at the height that the motion gives.

    Returns
    -------
    (T, B, 4, 4) float64
        The ground is y = 0.
    """
    transforms = transforms.copy()
    if steps is None:
        transforms[..., 1, 3] -= _ground(transforms, rig, fps, settings)[:, None]
        transforms[..., 1, 3] -= _drift(transforms, rig, fps, settings)[:, None]
    else:
        transforms[..., 1, 3] -= _below_steps(transforms, rig, steps)
    transforms[..., 1, 3] += _lift(transforms, rig, fps, settings)[:, None]
    under = np.zeros((2, len(transforms))) if steps is None else steps
    left, right = (
        plan_foot(transforms, rig, side, fps, settings, own)
        for side, own in zip(SIDES, under, strict=True)
    )
    plans = dict(zip(SIDES, (keep_clear(left, right), keep_clear(right, left)), strict=True))
    pelvis = carry_pelvis(plans, fps, settings)
    transforms[..., :3, 3] += pelvis[:, None]
    transforms[..., 1, 3] += _lift(transforms, rig, fps, settings)[:, None]
    drop = np.zeros(len(transforms))
    for side in SIDES:
        drop = np.maximum(drop, needed_drop(transforms, rig, side, plans[side].ankle))
    transforms[..., 1, 3] -= eased(drop, 0.5 * settings.blend * fps)[:, None]
    for side in SIDES:
        reach_plan(transforms, rig, side, plans[side])
    return transforms


def _ground(transforms: FloatArray, rig: Rig, fps: float, settings: ContactSettings) -> FloatArray:
    """Level (T,) of the ground under a clip whose root may rise or sink slowly, as in generated
    clips.

    It is the smoothed lower envelope (a morphological opening) of the body's lowest point, since no
    person is airborne for longer than `ContactSettings.flight`.
    """
    from scipy.ndimage import gaussian_filter1d, maximum_filter1d, minimum_filter1d

    soles = np.minimum(*(sole_points(transforms, rig, side)[..., 1].min(-1) for side in SIDES))
    if settings.flight <= 0:
        return np.full(len(transforms), np.quantile(soles, 0.1))
    lowest = np.minimum(soles, place(rig.skin, transforms)[..., 1].min(-1))
    reach = max(1, round(settings.flight * fps))
    envelope = maximum_filter1d(
        minimum_filter1d(lowest, reach, mode="nearest"), reach, mode="nearest"
    )
    smooth: FloatArray = gaussian_filter1d(envelope, reach / 2, mode="nearest")
    level: FloatArray = smooth + float(np.quantile(soles - smooth, 0.1))
    return level


def _below_steps(transforms: FloatArray, rig: Rig, steps: FloatArray) -> float:
    """Return the level of the ground under a clip whose feet stand on `steps` (2, T). It is a low
    quantile of the height of the lower foot above its step."""
    over = [
        sole_points(transforms, rig, side)[..., 1].min(-1) - own
        for side, own in zip(SIDES, steps, strict=True)
    ]
    return float(np.quantile(np.minimum(*over), 0.1))


def _drift(transforms: FloatArray, rig: Rig, fps: float, settings: ContactSettings) -> FloatArray:
    """Level (T,) of the ground under slow, low feet, followed over `follow_ground` seconds."""
    frames = len(transforms)
    if settings.follow_ground <= 0:
        return np.zeros(frames)
    joints = joints_of(transforms, rig)
    total, weight = np.zeros(frames), np.full(frames, 1e-3)
    for side in SIDES:
        height = sole_points(transforms, rig, side)[..., 1].min(-1)
        slow = np.minimum(
            speed_of(joints[f"{side}_ankle"], fps), speed_of(joints[f"{side}_foot"], fps)
        )
        sure = np.exp(-((slow / settings.speed_on) ** 2)) * (np.abs(height) < 0.1)
        total += sure * height
        weight += sure
    # the lower standing foot is on the ground: weigh by evidence, smooth both
    from scipy.ndimage import gaussian_filter1d

    sigma = settings.follow_ground * fps
    smooth: FloatArray = gaussian_filter1d(total, sigma, mode="nearest") / gaussian_filter1d(
        weight, sigma, mode="nearest"
    )
    return smooth


def _lift(transforms: FloatArray, rig: Rig, fps: float, settings: ContactSettings) -> FloatArray:
    """Depth (T,) of body parts other than the legs below the ground, smoothed over time."""
    feet = set()
    for side in SIDES:
        feet |= set(subtree(rig.parents, rig.bones[f"{side}_ankle"]))
    bones, points = rig.skin
    rest = ~np.isin(bones, list(feet))
    at_rest = np.einsum("kab,kb->ka", rig.rest[bones], points) + rig.heads[bones]
    rest &= (
        at_rest[:, 1] > max(rig.joints[f"{side}_ankle"][1] for side in SIDES) + 0.12
    )  # the ankles go with the feet
    if not rest.any():
        return np.zeros(len(transforms))
    lowest = place((bones[rest], points[rest]), transforms)[..., 1].min(-1)
    return eased(np.maximum(0.002 - lowest, 0), settings.blend * fps)
