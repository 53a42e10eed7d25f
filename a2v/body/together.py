"""Several photos of one person fitted together: one shape, a pose and a camera for each photo."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from a2v.body.confidence import SUSPICION
from a2v.body.evidence import gather_evidence
from a2v.body.fit import Fit, FitResult, one_thread, unknowns_of
from a2v.body.lbfgs import metric_of, minimize
from a2v.body.objective import Objective, Stage
from a2v.body.registry import load_body_model
from a2v.body.second_photo import best_side, heading
from a2v.body.settings import FitSettings
from a2v.body.surface_term import SurfaceSamples
from a2v.body.terms import alike
from a2v.body.unknowns import Unknowns
from a2v.body.view import View
from a2v.errors import InputError
from a2v.types import FloatArray, Progress, Subject, Surface

if TYPE_CHECKING:
    from torch import Tensor

LEAN = 0.05
"""Radians by which the trunks of one person in two photos differ in their lean."""
LEANS = 2.0
"""Robust scale of this difference, in multiples of `LEAN`."""
ALIKE = 1.0
"""Weight of the term for nearly equal poses."""


@one_thread()
def fit_together(
    subjects: Sequence[Subject],
    fits: Sequence[FitResult],
    *,
    settings: FitSettings | None = None,
    surfaces: Sequence[Surface] | None = None,
    progress: Progress | None = None,
) -> list[FitResult]:
    """Fit one shape to several photos of the same person, and a pose and a camera to each.

    It starts from the fit to each photo alone and minimizes the sum of their objectives; the prior
    of the shape counts once. Nearly equal poses attract each other (`a2v.body.terms.alike`): a
    person photographed from two sides mostly keeps the pose, and each photo shows the depth that
    the other does not.

    Parameters
    ----------
    subjects : sequence of n Subject
    fits : sequence of n FitResult
        Of `fit_body` for each photo alone, or of this function.
    settings : FitSettings, optional
    surfaces : sequence of n Surface, optional
        Reconstructed persons in the frames of the cameras of `fits`; then the papers' objective
        (Eq. 15) is minimized, and the cameras stay.
    progress : Progress, optional

    Returns
    -------
    list of n FitResult
        In the order of `subjects`; their bodies have the same shape.

    Raises
    ------
    InputError
        The number of fits (or surfaces) differs from that of the photos.
    """
    if (
        not subjects
        or len(fits) != len(subjects)
        or (surfaces is not None and len(surfaces) != len(subjects))
    ):
        raise InputError(
            f"fit_together got {len(subjects)} photos and {len(fits)} fits; expected one fit, and "
            "one surface if any, for each photo"
        )
    settings = settings or FitSettings()
    fit = _Together.build(subjects, fits, settings, surfaces)
    return fit.to_photos(progress) if surfaces is None else fit.to_surfaces(progress)


@dataclasses.dataclass(eq=False)
class _Together:
    """The photos' fits, their objectives and their unknowns, whose shape is one tensor."""

    parts: list[Fit]
    objectives: list[Objective]
    unknowns: list[Unknowns]
    fits: Sequence[FitResult]
    samples: list[SurfaceSamples | None]
    spread: Tensor
    settings: FitSettings

    @classmethod
    def build(
        cls,
        subjects: Sequence[Subject],
        fits: Sequence[FitResult],
        settings: FitSettings,
        surfaces: Sequence[Surface] | None,
    ) -> _Together:
        import torch

        model, count = load_body_model(), len(subjects)
        share = dataclasses.replace(settings, shape_weight=settings.shape_weight / count)
        parts, objectives, samples, unknowns = [], [], [], []
        for number, (subject, fit) in enumerate(zip(subjects, fits, strict=True)):
            evidence = gather_evidence(subject, settings)
            if surfaces is not None:
                evidence = dataclasses.replace(evidence, view=View.of(fit.camera))
            sample = (
                None
                if surfaces is None
                else SurfaceSamples.build(surfaces[number], fit.camera, evidence)
            )
            parts.append(Fit(model, evidence, settings, lambda done, total: None))
            objectives.append(Objective(model, evidence, share, surface=sample))
            samples.append(sample)
            unknowns.append(unknowns_of(fit))
            if surfaces is not None:
                unknowns[-1].fix_camera(fit.camera)
        shape = torch.stack([one.shape.detach() for one in unknowns]).mean(0).requires_grad_()
        for one in unknowns:
            one.shape = shape
        return cls(
            parts,
            objectives,
            unknowns,
            fits,
            samples,
            torch.tensor(objectives[0].space.spread),
            settings,
        )

    def to_photos(self, progress: Progress | None) -> list[FitResult]:
        """Fit to landmarks and silhouettes; every body is put on the ground."""
        done = self._rounds("silhouette", progress)
        losses = [
            one.values(own, "silhouette")
            for one, own in zip(self.objectives, self.unknowns, strict=True)
        ]
        results = []
        for part, one, own, loss in zip(
            self.parts, self.objectives, self.unknowns, losses, strict=True
        ):
            camera = part._ground(own, one.space)
            results.append(
                part._expecting(
                    part._result(own, camera, one.space, {"loss": loss, "rounds": done})
                )
            )
        turned = [
            heading(part._landmarks(result.body))
            for part, result in zip(self.parts, results, strict=True)
        ]
        side = best_side(results[0].residuals["limb_errors"], *turned)
        return [
            dataclasses.replace(result, residuals={**result.residuals, "second_photo": side})
            for result in results
        ]

    def to_surfaces(self, progress: Progress | None) -> list[FitResult]:
        """Fit to the surfaces (Eq. 15), in their frames."""
        self._minimize("surface_joints")
        done = self._rounds("surface", progress)
        results = []
        for part, one, own, fit, sample in zip(
            self.parts, self.objectives, self.unknowns, self.fits, self.samples, strict=True
        ):
            found = {"loss": one.values(own, "surface"), "rounds": done}
            result = part._result(own, own.camera(), one.space, found, sample)
            results.append(dataclasses.replace(result, camera=fit.camera))
        return results

    def _rounds(self, stage: Stage, progress: Progress | None) -> int:
        """Run rounds with updated matches until a round moves nothing; return their number."""
        done = 0
        for done in range(1, self.settings.rounds + 1):
            for one, own in zip(self.objectives, self.unknowns, strict=True):
                one.renew(own, stage)
            change = self._minimize(stage)
            if progress is not None:
                progress(done, self.settings.rounds)
            if change < self.settings.tolerance:
                break
        return done

    def _minimize(self, stage: Stage) -> float:
        """Lower the sum of the objectives; return the largest change of an unknown."""
        import torch

        free = [self.unknowns[0].shape]
        for one, own in zip(self.objectives, self.unknowns, strict=True):
            free += [own.root, own.translation, own.angles]
            if own.log_scale.requires_grad:
                free.append(own.log_scale)
                if own.view.distance > 0:
                    free.append(own.pitch)
                    if one.evidence.distance_spread > 0:
                        free.append(own.log_distance)

        def loss() -> Tensor:
            values = [
                value
                for one, own in zip(self.objectives, self.unknowns, strict=True)
                for value in one.terms(own, stage).values()
            ]
            return torch.stack(values).sum() + self._pose_differences()

        return minimize(
            loss,
            free,
            steps=self.settings.steps,
            history=20,
            metric=metric_of(loss, free),
        )

    def _pose_differences(self) -> Tensor:
        """Penalize differences between the poses."""
        pairs = list(combinations(self.unknowns, 2))
        total = sum(
            alike(first.angles, second.angles, self.spread) + _upright(first, second)
            for first, second in pairs
        )
        return ALIKE * total / max(1, len(self.unknowns) - 1)  # type: ignore[return-value]


def _upright(first: Unknowns, second: Unknowns) -> Tensor:
    """Penalize different leans of the trunk.

    A standing person leans the same way in every photo.
    """
    from a2v.kinematics.so3 import rotvec_to_rotmat

    ups = [(rotvec_to_rotmat(own.root) @ own.base)[1] for own in (first, second)]
    square = (ups[0] - ups[1]).square().sum() / LEAN**2
    return square / (1 + square / LEANS**2)


UNLIKE = 0.09
"""Largest mean distance between bodies at rest of fits to single photos of one person, meters.
Those of one person were within 5 cm."""


def doubts_of(alone: Sequence[FitResult], joined: Sequence[FitResult]) -> list[str]:
    """Return a note for the user if the photos may show different persons."""
    apart = shapes_differ(alone)
    worse = [
        number
        for number, fit in enumerate(joined, 1)
        if fit.residuals.get("silhouette_iou", 1.0) < SUSPICION.overlap
    ]
    if apart > UNLIKE or worse:
        found = (
            f"their bodies differ by {100 * apart:.0f} cm"
            if apart > UNLIKE
            else f"one body does not fill photo {worse[0]}"
        )
        return [
            f"the photos may show different persons ({found}): their colors and shapes are "
            "mixed; give photos of only one person"
        ]
    return []


def shapes_differ(fits: Sequence[FitResult]) -> float:
    """Return the largest difference between the bodies of fits to single photos, meters.

    The difference of two bodies is the mean distance of their vertices in the rest pose.
    """
    import torch

    model = load_body_model()
    rests: list[FloatArray] = [
        model.rest(torch.from_numpy(fit.body.parameters["shape"]))[0].numpy() for fit in fits
    ]
    return (
        max(float(np.linalg.norm(one - two, axis=1).mean()) for one, two in combinations(rests, 2))
        if len(rests) > 1
        else 0.0
    )
