"""Sources for `a2v evaluate`: exported motion models, baselines, and `first-frame`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from a2v.errors import InputError
from a2v.io import sha256
from a2v.lab.datasets import ActionDataset, load_dataset
from a2v.lab.evaluation.baselines import (
    FIRST_FRAME,
    first_frame_and_zeros,
    generator_of_baseline,
    open_baseline,
)
from a2v.lab.evaluation.sources import Generate, generator_of, generator_of_families
from a2v.motion import MotionModel
from pipelines.requests.motion import MODEL

MODELS = (
    f"{MODEL}, the baseline.pt of a2v train baseline, or {FIRST_FRAME} (a real first "
    "pose, then zeros)"
)
"""Help of the option that names the models."""

FINER = {"cmu": "cmu-fine"}
"""Data sets whose models of fine actions can be measured under the coarse names."""


@dataclass(frozen=True)
class Evaluated:
    """A model to measure: its sampler, and the SHA-256 of its file and of its training data (which
    may be unknown)."""

    generate: Generate
    sha256: str
    trained_on: str


def open_models(names: Sequence[str], dataset: ActionDataset, data: str) -> dict[str, Evaluated]:
    """Open models, by their names in the tables.

    `data` holds the clips of `dataset`, for models of fine actions.

    Raises
    ------
    InputError
        One is missing or has other joints or actions, unless they are the fine ones of the same
        clips.
    """
    models: dict[str, Evaluated] = {}
    for name in names:
        path = Path(name)
        kind, model = _opened(name, path, dataset, data)
        shown = kind if name == FIRST_FRAME else f"{kind} ({path.name})"
        if shown in models:  # such as runs/a/motion.onnx and runs/b/motion.onnx
            shown = f"{kind} ({path.parent.name}/{path.name})"
        if shown in models:
            raise InputError(
                f"model '{name}' is given twice, or two models lie in folders of the "
                "same name; rename one"
            )
        models[shown] = model
    return models


def _opened(name: str, path: Path, dataset: ActionDataset, data: str) -> tuple[str, Evaluated]:
    if name == FIRST_FRAME:
        return "a real first pose, then zeros", Evaluated(
            first_frame_and_zeros(dataset), FIRST_FRAME, dataset.sha256
        )
    if path.suffix == ".pt":
        trained = open_baseline(name, dataset)
        return trained.name, Evaluated(
            generator_of_baseline(trained, dataset), trained.sha256, trained.dataset_digest
        )
    model = MotionModel.load(name)
    finer = model.card.dataset == FINER.get(dataset.name)
    if (
        model.actions != dataset.actions and not finer
    ) or model.card.joint_names != dataset.skeleton.joint_names:
        raise InputError(
            f"model '{name}' was trained with other actions or joints than {dataset.name}; "
            f"evaluate it on {model.card.dataset}"
        )
    generate = generator_of(model, dataset.length)
    if finer:
        generate = generator_of_families(
            model, load_dataset(model.card.dataset, data), dataset, dataset.length
        )
    return model.card.decoder, Evaluated(
        generate, sha256(model.path), model.card.dataset_digest or ""
    )
