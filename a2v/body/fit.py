"""Fit a body to one photo: keypoints, silhouette and, if there is one, a reconstructed surface (Eq. 15-18)."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from a2v.body.anny import AnnyModel
from a2v.body.carry import carry_over
from a2v.body.landmarks import BLAZEPOSE
from a2v.body.objective import Evidence, Objective, Unknowns
from a2v.body.pose_space import pose_space
from a2v.body.registry import load_body_model
from a2v.body.silhouette import mask_field, rasterize, silhouette_iou
from a2v.body.skinning import BodyModel, make_body
from a2v.body.surface_term import SurfaceSamples
from a2v.errors import InputError
from a2v.types import Body, OrthographicCamera, Progress, Subject, Surface


@dataclass(frozen=True, kw_only=True)
class FitSettings:
    """How `fit_body` weighs its evidence. Lengths called *relative* are fractions of the person's height.

    Attributes
    ----------
    model : str
        "anny", or the ``.npz`` file of an SMPL, SMPL-H or SMPL-X model: the fit itself always runs on Anny and is then carried over.
    keypoint_sigma : float
        Expected error of a keypoint, relative.
    keypoint_robust : float
        Scale of the Geman-McClure penalty of keypoints, relative: errors far larger count as outliers.
    depth_weight : float
        Weight of the detector's 3D keypoints, used for the depth along each limb only.
    depth_sigma : float
        Expected error of that depth, relative.
    silhouette_weight : float
        Weight of the silhouette; 0 leaves it out.
    silhouette_sigma, silhouette_robust : float
        Expected error and Geman-McClure scale of the silhouette, relative.
    silhouette_size : int
        Longer side of the raster on which silhouettes are compared, pixels.
    height, height_sigma : float
        The person's standing height and its uncertainty, metres: one photo does not show it.
    pose_weight, shape_weight : float
        Weights of the priors on pose (with the photo alone) and shape.
    feet_weight : float
        Weight of flat feet and straight legs for people who stand.
    collision_weight : float
        Weight of limbs that cut into the torso or each other.
    surface_weight : float
        Weight of the surface term (Eq. 17), both ways.
    surface_robust : float
        Geman-McClure scale of the surface distance, metres.
    joints_weight : float
        λ_j of Eq. 15.
    prior_weight : float
        λ_r of Eq. 15: the Gaussian mixture over poses (Eq. 18).
    rounds : int
        Rounds with the silhouette or the surface; the correspondences are renewed at every one.
    steps : int
        L-BFGS iterations a round.
    tolerance : float
        Stop early when a round lowers the objective by less than this fraction.
    seed : int
        Chooses the sampled vertices.
    """

    model: str = "anny"
    keypoint_sigma: float = 0.012
    keypoint_robust: float = 0.05
    depth_weight: float = 6.0
    depth_sigma: float = 0.04
    silhouette_weight: float = 1.0
    silhouette_sigma: float = 0.012
    silhouette_robust: float = 0.04
    silhouette_size: int = 256
    height: float = 1.7
    height_sigma: float = 0.04
    pose_weight: float = 1.0
    shape_weight: float = 1.0
    feet_weight: float = 1.0
    collision_weight: float = 1.0
    surface_weight: float = 1.0
    surface_robust: float = 0.05
    joints_weight: float = 2.0
    prior_weight: float = 0.2
    rounds: int = 12
    steps: int = 15
    tolerance: float = 2e-3
    seed: int = 0

    def __post_init__(self) -> None:
        for item in dataclasses.fields(self):
            value = getattr(self, item.name)
            if isinstance(value, float) and not (np.isfinite(value) and value >= 0):
                raise InputError(f"FitSettings.{item.name} is {value}; expected a number of at least 0")
        if self.rounds < 0 or self.steps < 1 or not 32 <= self.silhouette_size <= 2048:
            raise InputError("FitSettings needs rounds >= 0, steps >= 1 and silhouette_size from 32 to 2048")


@dataclass(frozen=True)
class FitResult:
    """A fitted body.

    Attributes
    ----------
    body : Body
        In the photo's frame: lowest point at y = 0, pelvis at x = z = 0 (in the surface's frame, if one was given).
    camera : OrthographicCamera
    residuals : dict
        ``keypoint_mean`` and ``keypoint_max`` (fractions of the person's height, over confident keypoints),
        ``keypoints`` (by landmark), ``silhouette_iou``, ``height`` (standing, metres), ``loss`` (by term),
        ``rounds`` (done); with a surface also ``surface_mean`` (metres, from the surface to the body); with a model of one's own
        ``carried_over`` (metres, mean distance from its skin to the fitted one).
    """

    body: Body
    camera: OrthographicCamera
    residuals: Mapping[str, Any] = field(default_factory=dict)


def fit_body(
    subject: Subject,
    *,
    settings: FitSettings | None = None,
    surface: Surface | None = None,
    camera: OrthographicCamera | None = None,
    initial: FitResult | None = None,
    progress: Progress | None = None,
) -> FitResult:
    """Fit shape and pose of the body model, and the orthographic camera, to a person in a photo.

    Without a surface: camera and orientation first, then joints with the priors, then the silhouette. With one, the
    papers' fit (Eq. 15): joints and prior for two rounds, then the surface as well, in the surface's own frame.

    Parameters
    ----------
    subject : Subject
        Keypoints with confidence 0 count for nothing; NaN in `keypoints_3d` means unknown.
    settings : FitSettings, optional
    surface : Surface, optional
        Reconstructed person in the frame of `camera`.
    camera : OrthographicCamera, optional
        Needed with `surface`, which is seen through it; then it stays as it is.
    initial : FitResult, optional
        Where to start (the fit to the photo alone, in the frame of `camera`); otherwise it is made here.
    progress : Progress, optional

    Raises
    ------
    InputError
        Fewer than four confident keypoints, or a surface without its camera.
    """
    settings = settings or FitSettings()
    wanted = load_body_model(settings.model)  # a wrong file is told before the fit
    model = load_body_model()
    if surface is not None and camera is None:
        raise InputError("fit_body got a surface without its camera; pass camera= as well")
    evidence = gather_evidence(subject, model, settings)
    total = settings.rounds + 3
    report: Progress = progress or (lambda done, of: None)
    if initial is not None:
        unknowns = _from_result(initial, model)
    else:
        unknowns = _first_guess(evidence, model, settings, report, total)
    if surface is None:
        return _carried(_fit_photo(subject, evidence, model, settings, unknowns, report, total), wanted)
    assert camera is not None
    if initial is None:
        initial = _fit_photo(subject, evidence, model, settings, unknowns, lambda done, of: None, total)
        unknowns = _from_result(initial, model)
        _move_to_camera(unknowns, initial.camera, camera)
    return _carried(_fit_surface(subject, evidence, model, settings, unknowns, surface, camera, report, total), wanted)


def _carried(result: FitResult, model: BodyModel) -> FitResult:
    """The result as a body of `model`, if that is another one than the fit's own."""
    if model.name == result.body.model:
        return result
    body, distance = carry_over(model, result.body)
    return dataclasses.replace(result, body=body, residuals={**result.residuals, "carried_over": distance})


def gather_evidence(subject: Subject, model: AnnyModel, settings: FitSettings) -> Evidence:
    """Turn a subject into numbers that the objective compares with.

    Raises
    ------
    InputError
        Too few confident keypoints.
    """
    confidence = np.clip(np.nan_to_num(subject.keypoints[:, 2]), 0, 1).astype(np.float64)
    pixels = np.nan_to_num(subject.keypoints[:, :2]).astype(np.float64)
    body = np.array([name.split("_", 1)[-1] in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "ear") for name in BLAZEPOSE])
    if (confidence[body] > 0.3).sum() < 4:
        found = int((confidence[body] > 0.3).sum())
        raise InputError(f"only {found} keypoints of the body are certain; at least 4 are needed to fit a body: use a clearer photo")
    left, top, _, _ = subject.crop
    width, height = subject.photo_size
    known = (float(-left), float(-top), float(width - left), float(height - top))
    field_ = mask_field(subject.mask, known, size=settings.silhouette_size) if settings.silhouette_weight > 0 else None
    return Evidence.build(pixels, confidence, subject.keypoints_3d.astype(np.float64), field_)


def _first_guess(evidence: Evidence, model: AnnyModel, settings: FitSettings, report: Progress, total: int) -> Unknowns:
    """Camera and orientation, from several starts; the best after a short fit of the joints."""
    from a2v.body.start import candidates

    best: tuple[float, Unknowns] | None = None
    objective = Objective(model, evidence, settings)
    for unknowns in candidates(evidence, model):
        if evidence.has_depth:
            objective.minimize(unknowns, 15, stage="depth")
        loss = objective.minimize(unknowns, 20, stage="camera")
        loss = objective.minimize(unknowns, 30, stage="joints")
        if best is None or loss < best[0]:
            best = (loss, unknowns)
    report(1, total)
    assert best is not None
    objective.minimize(best[1], 60, stage="joints")
    report(2, total)
    return best[1]


def _fit_photo(
    subject: Subject, evidence: Evidence, model: AnnyModel, settings: FitSettings, unknowns: Unknowns, report: Progress, total: int
) -> FitResult:
    objective = Objective(model, evidence, settings)
    done = 0
    if evidence.mask is not None and len(evidence.mask.contour):
        previous = np.inf
        for done in range(1, settings.rounds + 1):
            objective.renew_silhouette(unknowns)
            loss = objective.minimize(unknowns, settings.steps, stage="silhouette")
            report(2 + done, total)
            if done > 3 and previous - loss < settings.tolerance * abs(previous):
                break
            previous = loss
    return _result(subject, evidence, model, settings, objective, unknowns, "silhouette", done, report, total, grounded=True)


def _fit_surface(
    subject: Subject,
    evidence: Evidence,
    model: AnnyModel,
    settings: FitSettings,
    unknowns: Unknowns,
    surface: Surface,
    camera: OrthographicCamera,
    report: Progress,
    total: int,
) -> FitResult:
    samples = SurfaceSamples.build(surface, camera, evidence, seed=settings.seed)
    objective = Objective(model, evidence, settings, surface=samples)
    unknowns.fix_camera(camera)
    previous, done = np.inf, 0
    for done in range(1, settings.rounds + 3):
        first = done <= 2  # "during the first two iterations we only consider the joints and the pose regularization"
        if not first:
            objective.renew_surface(unknowns)
        loss = objective.minimize(unknowns, settings.steps, stage="surface_joints" if first else "surface")
        report(min(total - 1, done), total)
        if done > 5 and previous - loss < settings.tolerance * abs(previous):
            break
        previous = loss if not first else np.inf
    result = _result(subject, evidence, model, settings, objective, unknowns, "surface", done, report, total, grounded=False)
    return dataclasses.replace(result, camera=camera)


def _from_result(result: FitResult, model: AnnyModel) -> Unknowns:
    """Unknowns at a finished fit."""
    parameters = result.body.parameters
    if "angles" not in parameters:
        raise InputError("the initial body was not made by fit_body; leave `initial` out")
    return Unknowns.build(
        model,
        root=parameters["rotations"][0],
        angles=parameters["angles"],
        shape=parameters["shape"],
        translation=parameters["translation"],
        camera=result.camera,
    )


def _move_to_camera(unknowns: Unknowns, old: OrthographicCamera, new: OrthographicCamera) -> None:
    """Shift a body seen through `old` so that it lands on the same pixels through `new` (of about the same scale)."""
    import torch

    move = [(old.center_u - new.center_u) / new.scale, (new.center_v - old.center_v) / new.scale, 0.0]
    with torch.no_grad():
        unknowns.translation += torch.tensor(move, dtype=unknowns.translation.dtype)


def _result(
    subject: Subject,
    evidence: Evidence,
    model: AnnyModel,
    settings: FitSettings,
    objective: Objective,
    unknowns: Unknowns,
    stage: str,
    rounds: int,
    report: Progress,
    total: int,
    *,
    grounded: bool,
) -> FitResult:
    import torch

    space = pose_space(model)
    with torch.no_grad():
        terms = objective.terms(unknowns, stage)  # before the body moves to its place on the ground
        rotmats, shape = unknowns.rotmats(space), unknowns.shape.detach()
        state = model.forward(rotmats.float(), shape.float(), unknowns.translation.float())
        camera = unknowns.camera()
        if grounded:
            pelvis = state.joints[0].double()
            shift = torch.stack([-pelvis[0], -state.vertices[:, 1].min().double(), -pelvis[2]])
            unknowns.translation += shift
            camera = OrthographicCamera(
                scale=camera.scale,
                center_u=camera.center_u - camera.scale * float(shift[0]),
                center_v=camera.center_v + camera.scale * float(shift[1]),
            )
        standing = model.rest(shape)[0]
        height = float(standing[:, 1].max() - standing[:, 1].min())
    rotations = space.rotvecs(unknowns.angles.detach()).numpy().astype(np.float32)
    rotations[0] = unknowns.root_rotvec()
    provenance = {"model": model.name, "settings": dataclasses.asdict(settings)}
    body = make_body(model, rotations, shape.numpy(), unknowns.translation.detach().numpy(), provenance=provenance)
    body = dataclasses.replace(body, parameters={**body.parameters, "angles": unknowns.angles.detach().numpy().astype(np.float32)})

    seen = evidence.confidence > 0.3
    with torch.no_grad():
        final = model.forward(*(torch.from_numpy(body.parameters[key]) for key in ("rotations", "shape", "translation")))
        landmarks = model.landmarks(final).numpy()
    error = np.linalg.norm(camera.project(landmarks) - evidence.pixels, axis=1) / (camera.scale * height)
    residuals: dict[str, Any] = {
        "keypoint_mean": float(error[seen].mean()),
        "keypoint_max": float(error[seen].max()),
        "keypoints": {name: float(error[index]) for index, name in enumerate(BLAZEPOSE) if seen[index]},
        "height": height,
        "loss": {name: float(value) for name, value in terms.items()},
        "rounds": rounds,
    }
    if evidence.mask is not None:
        raster = rasterize(body.vertices, body.faces, camera, evidence.mask.inside.shape, step=evidence.mask.step)["mask"]
        residuals["silhouette_iou"] = silhouette_iou(raster & evidence.mask_known, evidence.mask.inside & evidence.mask_known)
    if objective.surface is not None:
        residuals["surface_mean"] = objective.surface.mean_distance(body.vertices, body.faces)
    report(total, total)
    return FitResult(body=body, camera=camera, residuals=residuals)
