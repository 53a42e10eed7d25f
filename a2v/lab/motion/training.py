"""Training of the temporal VAE (Sec. 4.1.5-4.1.6): resumable, on a CPU or CUDA."""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from torch import nn

from a2v.errors import InputError
from a2v.lab.checkpoints import read_checkpoint
from a2v.lab.datasets import ActionDataset, ClipSampler
from a2v.lab.motion.losses import AlignmentLoss, ReconstructionLoss, vae_losses
from a2v.lab.motion.networks import VAESettings
from a2v.lab.motion.vae import MotionVAE
from a2v.lab.runs import NEWER, RateSchedule, Run, RunSettings, Training, carry_on, identity

FILE = "checkpoint.pt"
KL_END: Mapping[str, float] = {"cmu": 0.1, "ntu_vibe": 0.1}
"""Final weight of the KL term by data set (Sec. 5, implementation details); 0.01 for HumanAct12 and
for other data."""


@dataclass(frozen=True)
class TrainSettings(RunSettings):
    """Settings of the training of the VAE; the defaults are the journal paper's.

    Attributes
    ----------
    iterations : int
        Number of iterations.
    batch_size : int
        Number of clips per iteration.
    length : int
        Number of frames per clip; 0 for the data set's own (60 for HumanAct12, 100 for CMU).
    balance : float
        Share of a batch that is drawn uniformly from all actions instead of from all clips. It is
        not in the paper, whose evaluation draws actions uniformly.
    learning_rate : float
        Learning rate of Adam.
    weight_decay : float
        Weight decay of Adam.
    schedule : "constant" or "cosine"
        "cosine" lowers the learning rate to a hundredth toward the end (not in the paper; see
        docs).
    teacher_forcing : float
        Probability p_tf that a sequence is fed the real previous poses.
    teacher_forcing_meaning : "paper" or "published"
        Meaning of `teacher_forcing`: the probability of real previous poses, as in the paper, or of
        the model's *own*, as in the published code.
    kl_start : float
        Weight of the KL term at the start; it is ramped linearly over the training.
    kl_end : float
        Weight of the KL term at the end; a negative value takes the data set's.
    align_weight : float
        Weight of the trajectory alignment term (GLMI only).
    alignment : "norm" or "mse"
        Form of the trajectory alignment term: Eq. 12, or the published code's mean squared error,
        with which roots leap (see docs/research/motion-vae.md).
    reconstruction : "norm" or "mse"
        Form of the reconstruction loss: Eq. 13, or the published code's mean squared error, for
        which the published weights of the KL term were tuned (see docs/research/motion-vae.md).
    clip_gradient : float
        Largest norm of the gradient; 0 for no limit, as in the paper.
    initial : str
        ``checkpoint.pt`` of another run, whose weights the training begins with (a restart with
        other settings); empty for drawn weights. `a2v train motion` takes an exported .onnx too
        (`export.reread`), whose posterior begins as the prior.
    """

    iterations: int = 50_000
    batch_size: int = 128
    length: int = 0
    balance: float = 0.0
    learning_rate: float = 2e-4
    weight_decay: float = 1e-5
    schedule: Literal["constant", "cosine"] = "constant"
    teacher_forcing: float = 0.6
    teacher_forcing_meaning: Literal["paper", "published"] = "paper"
    kl_start: float = 0.001
    kl_end: float = -1.0
    align_weight: float = 10.0
    alignment: AlignmentLoss = field(default="norm", metadata=NEWER)
    reconstruction: ReconstructionLoss = "mse"
    clip_gradient: float = 0.0
    initial: str = field(default="", metadata=NEWER)

    def __post_init__(self) -> None:
        if not 0 <= self.teacher_forcing <= 1:
            raise InputError(
                f"teacher_forcing is {self.teacher_forcing}; expected a probability from 0 to 1"
            )
        if self.iterations < 1 or self.batch_size < 1 or self.length < 0:
            raise InputError(
                "iterations and batch_size must be positive, length must not be negative"
            )
        if not 0 <= self.balance <= 1:
            raise InputError(
                f"balance is {self.balance}; expected 0 (all clips equally often) to 1 (all "
                "actions equally often)"
            )

    def final_kl(self, dataset: ActionDataset) -> float:
        """Return the weight of the KL term at the end of the ramp."""
        return KL_END.get(dataset.name, 0.01) if self.kl_end < 0 else self.kl_end


class VAETraining(Training):
    """A VAE's training in progress.

    Attributes
    ----------
    model : MotionVAE
    generator : numpy Generator
        Draws batches, noise, and the sequences that see real poses.
    """

    STORED = ("model", "generator")
    REMEDY = "lower learning_rate or set clip_gradient"

    def __init__(self, dataset: ActionDataset, vae: VAESettings, settings: TrainSettings) -> None:
        super().__init__()
        torch.manual_seed(settings.seed)
        self.settings, self.dataset, self.device = settings, dataset.name, settings.claim()
        self.model = MotionVAE(dataset.skeleton, len(dataset.actions), vae).to(self.device)
        if settings.initial:
            _begin_with(settings.initial, self.model)
        self.optimizer = torch.optim.Adam(
            self.model.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay
        )
        self.generator = np.random.default_rng(settings.seed)
        self.span = max(settings.iterations - 1, 1)
        self.rate = RateSchedule(
            peak=settings.learning_rate,
            span=self.span,
            floor=1.0 if settings.schedule == "constant" else 0.01,
        )
        self.sampler = ClipSampler(
            dataset, settings.length or dataset.length, balance=settings.balance
        )
        self.final_kl = settings.final_kl(dataset)

    def step(self) -> dict[str, float]:
        """Run one iteration; returns the unweighted terms of Eq. 12 and the current weights."""
        model, generator, settings = self.model, self.generator, self.settings
        batch, labels, bone_lengths = self.sampler.batch(settings.batch_size, generator)
        noise = generator.standard_normal(
            (*batch.shape[:2], model.settings.latent_size), dtype=np.float32
        )
        forced = generator.random(len(batch)) < settings.teacher_forcing
        if settings.teacher_forcing_meaning == "published":
            forced = ~forced
        joints, lengths, draws, teacher = (
            torch.from_numpy(x).to(self.device) for x in (batch, bone_lengths, noise, forced)
        )
        actions = nn.functional.one_hot(torch.from_numpy(labels), model.n_actions).to(
            self.device, joints.dtype
        )
        kl_weight = settings.kl_start + (self.final_kl - settings.kl_start) * (
            self.iteration / self.span
        )
        result = model.reconstruct(joints, actions, lengths, draws, teacher)
        losses = vae_losses(
            result,
            joints,
            reconstruction=settings.reconstruction,
            roots=model.settings.roots,
            alignment=settings.alignment,
        )
        total = (
            losses.reconstruction + kl_weight * losses.kl + settings.align_weight * losses.alignment
        )
        self.descend(total, largest_gradient=settings.clip_gradient)
        terms = {name: float(value.detach()) for name, value in losses._asdict().items()}
        return terms | {"kl_weight": kl_weight, "learning_rate": self.rate(self.iteration)}

    def content(self) -> dict[str, Any]:
        """Return the weights, the generator's state, and the sizes of the networks."""
        return {
            "model": self.model.state_dict(),
            "generator": self.generator.bit_generator.state,
            "vae": dataclasses.asdict(self.model.settings),
            "dataset": self.dataset,
        }

    def restore(self, content: Mapping[str, Any]) -> None:
        """See `Training`."""
        self.model.load_state_dict(content["model"])
        self.generator.bit_generator.state = content["generator"]


def _begin_with(path: str, model: MotionVAE) -> None:
    """Set the weights of `model` to those of another run.

    Raises
    ------
    InputError
        The file is not the checkpoint of a VAE, or has other sizes.
    """
    content = read_checkpoint(path, VAETraining.STORED)
    try:
        model.load_state_dict(content["model"])
    except (RuntimeError, TypeError, AttributeError):  # torch lists every weight
        raise InputError(
            f"initial: {path} has other layers than this training; give a checkpoint.pt of a2v "
            "train motion of the same data set and --vae settings"
        ) from None


def start(dataset: ActionDataset, vae: VAESettings, settings: TrainSettings) -> VAETraining:
    """Make a new training with seeded weights.

    Raises
    ------
    InputError
        GLMI was requested for data without a trajectory.
    """
    spread = max(float(np.abs(joints[:, 0] - joints[:1, 0]).max()) for joints in dataset.joints)
    if vae.decoder.startswith("glmi") and (spread < 1e-4 or not dataset.trajectory):
        # NTU-VIBE's roots sway by centimeters and do not travel, so GLMI is of no use
        raise InputError(
            f"{dataset.name} has no root trajectory, which '{vae.decoder}' infers; "
            "use 'lie' or 'plain'"
        )
    return VAETraining(dataset, vae, settings)


def train(
    dataset: ActionDataset,
    folder: str | os.PathLike[str],
    *,
    vae: VAESettings | None = None,
    settings: TrainSettings | None = None,
    on_log: Callable[[VAETraining, dict[str, float]], None] | None = None,
) -> MotionVAE:
    """Train in `folder`, or resume its run.

    Writes ``checkpoint.pt`` (every few minutes, at the end and on Ctrl-C) and ``log.csv``.

    Parameters
    ----------
    dataset : ActionDataset
    folder : path
        A checkpoint there is resumed; its settings must agree with these.
    vae, settings
        Sizes and schedule.
    on_log : callable
        Called with the training and the mean terms since the last call, every `log_every`
        iterations; terms that it adds are logged.

    Raises
    ------
    InputError
        GLMI was requested for data without a trajectory, the run in `folder` was made with other
        data or settings, or training diverges.
    """
    vae, settings = vae or VAESettings(), settings or TrainSettings()
    run = Run(
        Path(folder) / FILE,
        identity(vae, settings, digest=dataset.sha256),
        settings.checkpoint_seconds,
    )
    training = start(dataset, vae, settings)
    show = on_log and functools.partial(on_log, training)
    carry_on(training, run, settings, iterations=settings.iterations, on_log=show)
    return training.model.eval()
