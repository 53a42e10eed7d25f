"""Training of the temporal VAE (Sec. 4.1.5-4.1.6): resumable, on a CPU or CUDA."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from torch import nn

from a2v.datasets import ActionDataset, ClipSampler
from a2v.errors import InputError
from a2v.motion.losses import ReconstructionLoss, vae_losses
from a2v.motion.networks import MotionVAE, VAESettings
from a2v.runs import Run, RunSettings, cosine_decay, identity, set_rate

FILE = "checkpoint.pt"
KL_END = {"cmu": 0.1, "ntu_vibe": 0.1}
"""Final weight of the KL term by data set (Sec. 5, implementation details); 0.01 for HumanAct12 and for other data."""


@dataclass(frozen=True)
class TrainSettings(RunSettings):
    """How the VAE is trained; the defaults are the journal paper's.

    Attributes
    ----------
    iterations : int
    batch_size : int
        Clips an iteration.
    length : int
        Frames a clip; 0 for the data set's own (60 for HumanAct12, 100 for CMU).
    learning_rate, weight_decay : float
        Adam.
    schedule : "constant" or "cosine"
        "cosine" lowers the learning rate to a hundredth towards the end (not the paper's; see docs).
    teacher_forcing : float
        Probability p_tf that a sequence is fed the real previous poses.
    teacher_forcing_meaning : "paper" or "published"
        The published trainer feeds back the model's *own* pose with this probability.
    kl_start, kl_end : float
        Weight of the KL term, ramped linearly over the training; kl_end < 0 takes the data set's.
    align_weight : float
        Weight of the trajectory alignment term (GLMI only).
    reconstruction : "norm" or "mse"
        Eq. 13, or the published code's, which its weights of the KL term were tuned for (see docs/research/motion-vae.md).
    clip_gradient : float
        Largest norm of the gradient; 0 for no limit (the paper's).
    """

    iterations: int = 50_000
    batch_size: int = 128
    length: int = 0
    learning_rate: float = 2e-4
    weight_decay: float = 1e-5
    schedule: Literal["constant", "cosine"] = "constant"
    teacher_forcing: float = 0.6
    teacher_forcing_meaning: Literal["paper", "published"] = "paper"
    kl_start: float = 0.001
    kl_end: float = -1.0
    align_weight: float = 10.0
    reconstruction: ReconstructionLoss = "mse"
    clip_gradient: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.teacher_forcing <= 1:
            raise InputError(f"teacher_forcing is {self.teacher_forcing}; expected a probability from 0 to 1")
        if self.iterations < 1 or self.batch_size < 1 or self.length < 0:
            raise InputError("iterations and batch_size must be positive, length must not be negative")

    def final_kl(self, dataset: ActionDataset) -> float:
        """The KL term's weight at the end of the ramp."""
        return KL_END.get(dataset.name, 0.01) if self.kl_end < 0 else self.kl_end


@dataclass
class TrainState:
    """A run in progress: what a checkpoint holds."""

    model: MotionVAE
    optimizer: torch.optim.Optimizer
    generator: np.random.Generator
    iteration: int = 0
    seconds: float = 0.0
    log: list[dict[str, float]] = field(default_factory=list)


def start(dataset: ActionDataset, vae: VAESettings, settings: TrainSettings) -> TrainState:
    """A fresh run with seeded weights.

    Raises
    ------
    InputError
        GLMI is asked for data without a trajectory.
    """
    spread = max(float(np.abs(joints[:, 0] - joints[:1, 0]).max()) for joints in dataset.joints)
    if vae.decoder.startswith("glmi") and (spread < 1e-4 or not dataset.trajectory):
        # NTU-VIBE's roots sway by centimetres and go nowhere: no use
        raise InputError(f"{dataset.name} has no root trajectory, which '{vae.decoder}' infers; use 'lie' or 'plain'")
    torch.manual_seed(settings.seed)
    model = MotionVAE(dataset.skeleton, len(dataset.actions), vae).to(settings.claim())
    optimizer = torch.optim.Adam(model.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay)
    return TrainState(model, optimizer, np.random.default_rng(settings.seed))


def train_step(state: TrainState, sampler: ClipSampler, settings: TrainSettings, *, kl_end: float) -> dict[str, float]:
    """One iteration; returns the unweighted terms of Eq. 12 and the weights in force."""
    model, generator = state.model, state.generator
    device = next(model.parameters()).device
    batch, labels, bone_lengths = sampler.batch(settings.batch_size, generator)
    noise = generator.standard_normal((*batch.shape[:2], model.settings.latent_size), dtype=np.float32)
    forced = generator.random(len(batch)) < settings.teacher_forcing
    if settings.teacher_forcing_meaning == "published":
        forced = ~forced
    joints, lengths, draws, teacher = (torch.from_numpy(x).to(device) for x in (batch, bone_lengths, noise, forced))
    actions = nn.functional.one_hot(torch.from_numpy(labels), model.n_actions).to(device, joints.dtype)

    progress = state.iteration / max(settings.iterations - 1, 1)
    kl_weight = settings.kl_start + (kl_end - settings.kl_start) * progress
    rate = settings.learning_rate * (1.0 if settings.schedule == "constant" else cosine_decay(progress, 0.01))
    set_rate(state.optimizer, rate)

    result = model.reconstruct(joints, actions, lengths, draws, teacher)
    losses = vae_losses(result, joints, reconstruction=settings.reconstruction)
    total = losses.reconstruction + kl_weight * losses.kl + settings.align_weight * losses.alignment
    state.optimizer.zero_grad(set_to_none=True)
    total.backward()  # type: ignore[no-untyped-call]
    if settings.clip_gradient > 0:
        nn.utils.clip_grad_norm_(model.parameters(), settings.clip_gradient)
    state.optimizer.step()
    state.iteration += 1
    terms = {name: float(value.detach()) for name, value in losses._asdict().items()}
    return terms | {"kl_weight": kl_weight, "learning_rate": rate}


def train(
    dataset: ActionDataset,
    folder: str | os.PathLike[str],
    *,
    vae: VAESettings | None = None,
    settings: TrainSettings | None = None,
    on_log: Callable[[TrainState, dict[str, float]], None] | None = None,
) -> MotionVAE:
    """Train, or go on with, the run in `folder`.

    Writes ``checkpoint.pt`` (every few minutes, at the end and on Ctrl-C) and ``log.csv``.

    Parameters
    ----------
    dataset : ActionDataset
    folder : path
        A checkpoint there is resumed; its settings must agree with these.
    vae, settings
        Sizes and schedule.
    on_log : callable
        Called with the state and the mean terms since the last call, every `log_every` iterations.
    """
    vae, settings = vae or VAESettings(), settings or TrainSettings()
    run = Run(Path(folder) / FILE, identity(vae, settings, digest=dataset.digest), settings.checkpoint_seconds)
    state = start(dataset, vae, settings)
    content = run.resume(("model", "optimizer", "generator", "iteration", "log"))
    if content is not None:
        state.model.load_state_dict(content["model"])
        state.optimizer.load_state_dict(content["optimizer"])
        state.generator.bit_generator.state = content["generator"]
        state.iteration, state.log = content["iteration"], list(content["log"])
    sampler = ClipSampler(dataset, settings.length or dataset.length)
    kl_end = settings.final_kl(dataset)
    recent: list[dict[str, float]] = []

    def save() -> None:
        run.save(_checkpoint(state, dataset, vae), state.log)

    with settings.loop(save):
        while state.iteration < settings.iterations:
            recent.append(train_step(state, sampler, settings, kl_end=kl_end))
            state.seconds = run.seconds
            if state.iteration % settings.log_every == 0 or state.iteration == settings.iterations:
                mean = {name: float(np.mean([terms[name] for terms in recent])) for name in recent[0]}
                row = {"iteration": float(state.iteration), "seconds": state.seconds} | mean
                recent = []
                if not np.isfinite(row["reconstruction"]):
                    raise InputError(f"training diverged at iteration {state.iteration}; lower learning_rate or set clip_gradient")
                if on_log is not None:
                    on_log(state, row)
                state.log.append(row)
            if run.due:
                save()
    return state.model.eval()


def _checkpoint(state: TrainState, dataset: ActionDataset, vae: VAESettings) -> dict[str, Any]:
    return {
        "model": state.model.state_dict(),
        "optimizer": state.optimizer.state_dict(),
        "generator": state.generator.bit_generator.state,
        "iteration": state.iteration,
        "log": state.log,
        "vae": dataclasses.asdict(vae),
        "dataset": dataset.name,
    }
