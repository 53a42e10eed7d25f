"""Fit a body to one photo: keypoints, silhouette and, if there is one, a reconstructed surface (Eq.
15-18)."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from a2v.body.anny import AnnyModel
from a2v.body.carry import carry_over, fitted_parameters
from a2v.body.confidence import landmarks_look_wrong, limb_errors, looks_wrong
from a2v.body.evidence import Evidence, gather_evidence
from a2v.body.objective import Objective
from a2v.body.pose_space import PoseSpace
from a2v.body.registry import load_body_model
from a2v.body.rounds import Rounds
from a2v.body.search import first_guess, guess_by_landmarks, guess_by_outline
from a2v.body.second_photo import best_side, heading
from a2v.body.settings import FitSettings
from a2v.body.silhouette import rasterize
from a2v.body.skinning import BodyModel, make_body
from a2v.body.stray import agrees_better, mend_doubtful, mend_strays
from a2v.body.surface_term import SurfaceSamples
from a2v.body.unknowns import Unknowns
from a2v.body.view import View, field_of_view
from a2v.errors import InputError
from a2v.geometry.images import mask_iou
from a2v.kinematics.names import BLAZEPOSE
from a2v.types import Body, FloatArray, OrthographicCamera, PhotoCamera, Progress, Subject, Surface


@dataclass(frozen=True)
class FitResult:
    """A fitted body.

    Attributes
    ----------
    body : Body
        In the photo's frame: lowest point at y = 0, pelvis at x = z = 0 (in the surface's frame, if
        one was given).
    camera : PhotoCamera
    residuals : dict
        ``keypoint_mean`` and ``keypoint_max`` (fractions of the person's height, over confident
        keypoints), ``keypoints`` (by landmark), ``silhouette_iou``, ``height`` (standing, meters),
        ``camera`` (distance and height, meters; pitch and field of view across the photo's longer
        side, degrees; and the source of the distance), ``loss`` (by term), ``rounds`` (done); of
        the photo alone ``limb_errors`` (by `LIMBS`: expected error in depth, meters) and
        ``second_photo`` (one of `SIDES`, from which a second photo would help most); with a surface
        also ``surface_mean`` (meters, from the surface to the body); with a custom model
        ``carried_over`` (meters, mean distance from its skin to the fitted one).
    """

    body: Body
    camera: PhotoCamera
    residuals: Mapping[str, Any] = field(default_factory=dict)


@contextmanager
def one_thread() -> Iterator[None]:
    """Limit PyTorch to one thread: the fit's tensors are small, so that a second thread doubles the
    processor time and saves no wall time."""
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@one_thread()
def fit_body(
    subject: Subject,
    *,
    settings: FitSettings | None = None,
    surface: Surface | None = None,
    camera: PhotoCamera | OrthographicCamera | None = None,
    initial: FitResult | None = None,
    progress: Progress | None = None,
) -> FitResult:
    """Fit shape and pose of the body model, and the orthographic camera, to a person in a photo.

    Without a surface: camera and orientation first, then joints with the priors, then the
    silhouette. With one, the papers' fit (Eq. 15): joints and prior for two rounds, then the
    surface as well, in the surface's own frame.

    Parameters
    ----------
    subject : Subject
        Keypoints with confidence 0 are ignored; NaN in `keypoints_3d` means unknown.
    settings : FitSettings, optional
    surface : Surface, optional
        Reconstructed person in the frame of `camera`.
    camera : PhotoCamera or OrthographicCamera, optional
        Needed with `surface`: its camera, which the fit does not change.
    initial : FitResult, optional
        Start of the fit: a fit to the photo alone, in the frame of `camera`. Without it, that fit
        is made first.
    progress : Progress, optional

    Raises
    ------
    InputError
        Fewer than four confident keypoints, or a surface without its camera.
    """
    settings = settings or FitSettings()
    wanted = load_body_model(settings.model)  # refuses a wrong file before the fit begins
    model = load_body_model()
    if surface is not None and camera is None:
        raise InputError("fit_body got a surface without its camera; pass camera= as well")
    if isinstance(camera, OrthographicCamera):
        camera = PhotoCamera(flat=camera)
    evidence = gather_evidence(subject, settings)
    if camera is not None:
        evidence = dataclasses.replace(evidence, view=View.of(camera))
    fit = Fit(model, evidence, settings, progress or _silent)
    if surface is None:
        return _carried(
            fit.to_photo() if initial is None else fit.refined(unknowns_of(initial)), wanted
        )
    assert camera is not None
    if initial is None:
        initial = dataclasses.replace(fit, progress=_silent).to_photo()
        unknowns = unknowns_of(initial)
        _move_to_camera(unknowns, old=initial.camera, new=camera)
    else:
        unknowns = unknowns_of(initial)
    return _carried(fit.to_surface(unknowns, surface, camera), wanted)


def _silent(done: int, total: int) -> None:
    """Report no progress."""


def _carried(result: FitResult, model: BodyModel) -> FitResult:
    """Convert the result to a body of `model` if the fit used another model."""
    if model.name == result.body.model:
        return result
    body, distance = carry_over(model, result.body)
    return dataclasses.replace(
        result, body=body, residuals={**result.residuals, "carried_over": distance}
    )


@dataclass(frozen=True, eq=False)
class Fit:
    """One fit: the model, the evidence, the settings and a callback for the progress."""

    model: AnnyModel
    evidence: Evidence
    settings: FitSettings
    progress: Progress

    @property
    def total(self) -> int:
        """Number of steps that the fit reports to its progress."""
        return self.settings.rounds + 3

    def to_photo(self) -> FitResult:
        """Fit to keypoints and silhouette; if the result looks wrong, try more starts."""
        objective = self._objective()
        guess = first_guess(objective, self.model, self.evidence)
        self.progress(2, self.total)
        best = self.refined(guess.unknowns)
        if self.settings.starts:
            best = self._retried(
                best, mend_strays(self._objective(), self.model, unknowns_of(best))
            )
            if looks_wrong(best.residuals):
                best = self._search(best, objective)
        best = self._expecting(best)
        if self.settings.starts and not looks_wrong(best.residuals):
            start = mend_doubtful(
                self._objective(), self.model, unknowns_of(best), best.residuals["limb_errors"]
            )
            best = self._expecting(self._retried(best, start))
        return best

    def _objective(self) -> Objective:
        """The objective of the fit to the photo, without silhouette matches."""
        return Objective(self.model, self.evidence, self.settings)

    def _expecting(self, result: FitResult) -> FitResult:
        """Add the expected errors in depth of the limbs, and the best second photo, to a result."""
        overlap = result.residuals.get("silhouette_iou", 0.8)
        landmarks = self._landmarks(result.body)
        errors = limb_errors(landmarks, self.evidence, result.camera.scale, overlap)
        expected = {"limb_errors": errors, "second_photo": best_side(errors, heading(landmarks))}
        return dataclasses.replace(result, residuals={**result.residuals, **expected})

    def _retried(self, best: FitResult, start: Unknowns | None) -> FitResult:
        """Fit from `start`, in which some limbs are bent differently.

        Returns this fit if it agrees better with the photo; otherwise, or without a start, the
        previous fit.
        """
        if start is None:
            return best
        found = dataclasses.replace(self, progress=_silent).refined(start)
        return found if agrees_better(found.residuals, best.residuals) else best

    def _search(self, best: FitResult, objective: Objective) -> FitResult:
        """Return the best of a fit and of fits that start from poses of the bank."""
        quiet = dataclasses.replace(self, progress=_silent)
        if guess := guess_by_landmarks(
            objective, self.model, self.evidence, starts=self.settings.starts
        ):
            found = quiet.refined(guess.unknowns)
            if sum(found.residuals["loss"].values()) < sum(best.residuals["loss"].values()):
                best = found
        if landmarks_look_wrong(best.residuals) and (
            guess := guess_by_outline(self.model, self.evidence, self.settings)
        ):
            found = dataclasses.replace(quiet, evidence=guess.evidence).refined(guess.unknowns)
            if found.residuals["silhouette_iou"] > best.residuals["silhouette_iou"] + 0.08:
                best = found
        return best

    def refined(self, unknowns: Unknowns) -> FitResult:
        """Fit to keypoints and silhouette from one start; the body is put on the ground."""
        objective = self._objective()
        done = 0
        if self.evidence.mask is not None and len(self.evidence.mask.contour):
            rounds = Rounds(objective, unknowns, self.settings, stage="silhouette")
            for done in rounds.run():
                self.progress(min(self.total - 1, 2 + done), self.total)
        loss = objective.values(
            unknowns, "silhouette"
        )  # before the body moves to its place on the ground
        camera = self._ground(unknowns, objective.space)
        if self.evidence.distance_spread > 0:
            camera = dataclasses.replace(camera, source=f"{self.evidence.view.source}, and the fit")
        return self._result(unknowns, camera, objective.space, {"loss": loss, "rounds": done})

    def to_surface(self, unknowns: Unknowns, surface: Surface, camera: PhotoCamera) -> FitResult:
        """Fit to keypoints and surface, in the surface's frame (Eq. 15)."""
        samples = SurfaceSamples.build(surface, camera, self.evidence)
        objective = Objective(self.model, self.evidence, self.settings, surface=samples)
        unknowns.fix_camera(camera)
        # "during the first two iterations we only consider the joints and the pose regularization"
        objective.minimize(unknowns, self.settings.steps, stage="surface_joints")
        done = 0
        for done in Rounds(objective, unknowns, self.settings, stage="surface").run():
            self.progress(min(self.total - 1, 2 + done), self.total)
        found = {"loss": objective.values(unknowns, "surface"), "rounds": done}
        result = self._result(unknowns, unknowns.camera(), objective.space, found, samples)
        return dataclasses.replace(result, camera=camera)

    def _ground(self, unknowns: Unknowns, space: PoseSpace) -> PhotoCamera:
        """Move the body's lowest point to y = 0 and its pelvis to x = z = 0; returns the camera
        that keeps it at the same place in the photo."""
        import torch

        camera = unknowns.camera()
        with torch.no_grad():
            state = self.model.forward(
                unknowns.rotmats(space).float(),
                unknowns.shape.float(),
                unknowns.translation.float(),
            )
            pelvis = state.joints[0].double()
            shift = torch.stack([-pelvis[0], -state.vertices[:, 1].min().double(), -pelvis[2]])
            unknowns.translation += shift
        return camera.moved(shift.numpy())

    def _result(
        self,
        unknowns: Unknowns,
        camera: PhotoCamera,
        space: PoseSpace,
        found: Mapping[str, Any],
        samples: SurfaceSamples | None = None,
    ) -> FitResult:
        """Make the result from `unknowns`; `found` is copied into its residuals."""
        shape = unknowns.shape.detach()
        angles = unknowns.angles.detach().numpy().astype(np.float32)
        standing = self.model.rest(shape)[0]
        height = float(standing[:, 1].max() - standing[:, 1].min())
        rotations = space.rotvecs(unknowns.angles.detach()).numpy().astype(np.float32)
        rotations[0] = unknowns.root_rotvec()
        provenance = {"model": self.model.name, "settings": dataclasses.asdict(self.settings)}
        body = make_body(
            self.model,
            rotations,
            shape.numpy(),
            unknowns.translation.detach().numpy(),
            provenance=provenance,
        )
        body = dataclasses.replace(body, parameters={**body.parameters, "angles": angles})
        residuals = {
            **self._landmark_errors(body, camera, height),
            "height": height,
            "camera": _reported(camera, self.evidence.photo),
            **found,
        }
        if (mask := self.evidence.mask) is not None:
            raster = rasterize(
                camera.flatten(body.vertices),
                body.faces,
                camera.flat,
                mask.inside.shape,
                step=mask.step,
            )["mask"]
            residuals["silhouette_iou"] = mask_iou(
                raster & self.evidence.mask_known, mask.inside & self.evidence.mask_known
            )
        if samples is not None:
            residuals["surface_mean"] = samples.mean_distance(body.vertices, body.faces)
        self.progress(self.total, self.total)
        return FitResult(body=body, camera=camera, residuals=residuals)

    def _landmarks(self, body: Body) -> FloatArray:
        """Landmarks (33, 3) of a body of this fit, meters."""
        import torch

        with torch.no_grad():
            final = self.model.forward(
                *(
                    torch.from_numpy(body.parameters[key])
                    for key in ("rotations", "shape", "translation")
                )
            )
            points: FloatArray = self.model.landmarks(final).numpy()
        return points

    def _landmark_errors(self, body: Body, camera: PhotoCamera, height: float) -> dict[str, Any]:
        """Return the distances between the confident keypoints and the body's landmarks in the
        photo, relative to the person's standing `height`, meters."""
        seen = self.evidence.confidence > 0.3
        error = np.linalg.norm(
            camera.project(self._landmarks(body)) - self.evidence.pixels, axis=1
        ) / (camera.scale * height)
        return {
            "keypoint_mean": float(error[seen].mean()),
            "keypoint_max": float(error[seen].max()),
            "keypoints": {
                name: float(error[index]) for index, name in enumerate(BLAZEPOSE) if seen[index]
            },
        }


def _reported(camera: PhotoCamera, photo: tuple[float, float]) -> dict[str, Any]:
    """Return the entry ``camera`` of the residuals, for a photo of `photo` pixels (width,
    height)."""
    found: dict[str, Any] = {"distance": camera.distance, "distance_from": camera.source}
    if camera.distance > 0:
        pitch = float(np.degrees(camera.pitch))
        angle = field_of_view(camera, max(photo))
        found |= {"height": camera.height, "pitch": pitch, "field_of_view": angle}
    return found


def unknowns_of(result: FitResult) -> Unknowns:
    """Unknowns at a finished fit, also if its body was carried over to another model."""
    parameters = fitted_parameters(result.body)
    if "angles" not in parameters:
        raise InputError("the initial body was not made by fit_body; leave `initial` out")
    return Unknowns.build(
        root=parameters["rotations"][0],
        angles=parameters["angles"],
        shape=parameters["shape"],
        translation=parameters["translation"],
        camera=result.camera.flat,
        view=View.of(result.camera),
    )


def _move_to_camera(unknowns: Unknowns, *, old: PhotoCamera, new: PhotoCamera) -> None:
    """Shift a body seen through `old` so that it lands on the same pixels through `new` (of about
    the same scale)."""
    import torch

    first, then = old.flat, new.flat
    move = [
        (first.center_u - then.center_u) / then.scale,
        (then.center_v - first.center_v) / then.scale,
        0.0,
    ]
    with torch.no_grad():
        unknowns.translation += torch.tensor(move, dtype=unknowns.translation.dtype)
