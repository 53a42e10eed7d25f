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
from a2v.motion.card import StepCard
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
    """A model to measure: its sampler, the SHA-256 of its file and of its training data (which may
    be unknown), and the temperature of its latents."""

    generate: Generate
    sha256: str
    trained_on: str
    temperature: float = 1.0


def open_models(names: Sequence[str], dataset: ActionDataset, data: str) -> dict[str, Evaluated]:
    """Open models, by their names in the tables.

    A VAE whose file has a temperature other than 1 is measured at 1, which is Eq. 10 of the journal
    paper, and once more as it is. `data` holds the clips of `dataset`, for models of fine actions.

    Raises
    ------
    InputError
        One is missing or has other joints or actions, unless they are the fine ones of the same
        clips.
    """
    models: dict[str, Evaluated] = {}
    for name in names:
        path = Path(name)
        kind, model, as_shipped = _opened(name, path, dataset, data)
        shown = kind if name == FIRST_FRAME else f"{kind} ({path.name})"
        if shown in models:  # such as runs/a/motion.onnx and runs/b/motion.onnx
            shown = f"{kind} ({path.parent.name}/{path.name})"
        if shown in models:
            raise InputError(
                f"model '{name}' is given twice, or two models lie in folders of the "
                "same name; rename one"
            )
        models[shown] = model
        if as_shipped is not None:
            models[f"{shown} at its temperature of {as_shipped.temperature:g}"] = as_shipped
    return models


def _opened(
    name: str, path: Path, dataset: ActionDataset, data: str
) -> tuple[str, Evaluated, Evaluated | None]:
    """The kind of a model, the model, and a VAE at its own temperature."""
    if name == FIRST_FRAME:
        made = Evaluated(first_frame_and_zeros(dataset), FIRST_FRAME, dataset.sha256)
        return "a real first pose, then zeros", made, None
    if path.suffix == ".pt":
        trained = open_baseline(name, dataset)
        made = Evaluated(
            generator_of_baseline(trained, dataset), trained.sha256, trained.dataset_digest
        )
        return trained.name, made, None
    model = MotionModel.load(name)
    finer = model.card.dataset == FINER.get(dataset.name)
    if (
        model.actions != dataset.actions and not finer
    ) or model.card.joint_names != dataset.skeleton.joint_names:
        raise InputError(
            f"model '{name}' was trained with other actions or joints than {dataset.name}; "
            f"evaluate it on {model.card.dataset}"
        )
    card, digest = model.card, sha256(model.path)
    temperature = card.temperature if isinstance(card, StepCard) else 1.0

    def measured(generate: Generate, at: float) -> Evaluated:
        return Evaluated(generate, digest, card.dataset_digest or "", at)

    if finer:
        generate = generator_of_families(
            model, load_dataset(card.dataset, data), dataset, dataset.length
        )
        return card.decoder, measured(generate, temperature), None
    own = measured(generator_of(model, dataset.length), temperature)
    if temperature == 1:
        return card.decoder, own, None
    at_one = generator_of(model, dataset.length, noise_scale=1 / temperature)
    return card.decoder, measured(at_one, 1.0), own
