"""Starts of a fit: from the detector's landmarks, and if that fails from similar recorded poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from a2v.body.anny import AnnyModel
from a2v.body.evidence import Evidence
from a2v.body.objective import Objective, Stage
from a2v.body.pose_bank import alike, alike_outline, load_pose_bank
from a2v.body.settings import FitSettings
from a2v.body.start import candidates
from a2v.body.unknowns import Unknowns
from a2v.body.view import View
from a2v.kinematics.stature import TYPICAL_HEIGHT
from a2v.types import FloatArray, OrthographicCamera


@dataclass(eq=False)
class Guess:
    """A start after a short fit: its unknowns, its loss, and the evidence that it was fitted to."""

    unknowns: Unknowns
    loss: float
    evidence: Evidence


def first_guess(objective: Objective, model: AnnyModel, evidence: Evidence) -> Guess:
    """Estimate camera and orientation from the keypoints.

    If no depth is known, several starts are tried. Returns the best after a fit of joints.
    """
    guesses = []
    for unknowns in candidates(evidence, model):
        stages: tuple[Stage, ...] = ("depth",) if evidence.has_depth else ()
        for stage in (*stages, "camera", "joints"):
            objective.minimize(unknowns, objective.settings.steps, stage=stage)
        guesses.append(Guess(unknowns, objective.cost(unknowns, "joints"), evidence))
    return min(guesses, key=lambda guess: guess.loss)


def guess_by_landmarks(
    objective: Objective, model: AnnyModel, evidence: Evidence, *, starts: int
) -> Guess | None:
    """Return the best of some poses of the bank that resemble the landmarks, after a short fit.

    None if too few landmarks are visible.
    """
    bank, camera = load_pose_bank(model), candidates(evidence, model)[0].camera().flat
    guesses = []
    for like in alike(bank, evidence, count=starts):
        unknowns = _start(like.root, bank.angles[like.number], model, camera, evidence.view)
        objective.minimize(unknowns, 15, stage="camera")
        objective.minimize(unknowns, 25, stage="joints")
        guesses.append(Guess(unknowns, objective.cost(unknowns, "joints"), evidence))
    return min(guesses, key=lambda guess: guess.loss, default=None)


def guess_by_outline(model: AnnyModel, evidence: Evidence, settings: FitSettings) -> Guess | None:
    """Return the best of some poses of the bank that fill the mask, after a short fit.

    The landmarks have little weight in that fit. None without a mask.
    """
    if evidence.mask is None or not len(evidence.mask.contour):
        return None
    bank, guesses = load_pose_bank(model), []
    for placed in alike_outline(bank, evidence.mask, count=settings.starts):
        unknowns = _start(
            placed.root, bank.angles[placed.number], model, placed.camera, evidence.view
        )
        doubted = evidence.doubted(TYPICAL_HEIGHT * placed.camera.scale)
        careful = Objective(model, doubted, settings)
        for _ in range(3):
            careful.renew_silhouette(unknowns)
            careful.minimize(unknowns, 10, stage="silhouette")
        guesses.append(Guess(unknowns, careful.cost(unknowns, "silhouette"), doubted))
    return min(guesses, key=lambda guess: guess.loss, default=None)


def _start(
    root: FloatArray, angles: FloatArray, model: AnnyModel, camera: OrthographicCamera, view: View
) -> Unknowns:
    return Unknowns.build(
        root=root,
        angles=angles,
        shape=model.shape_default,
        translation=np.zeros(3),
        camera=camera,
        view=view,
    )
