"""Training of the baselines (resumable, on a CPU), and sampling from trained ones."""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from a2v.errors import InputError
from a2v.io import sha256
from a2v.lab.checkpoints import read_checkpoint
from a2v.lab.datasets import ActionDataset, ClipSampler
from a2v.lab.motion.baselines import NAMES
from a2v.lab.motion.baselines.act_mocogan import ActMoCoGAN
from a2v.lab.motion.baselines.base import Baseline, Batch, Sizes
from a2v.lab.motion.baselines.cond_gru import CondGRU
from a2v.lab.motion.baselines.dancing2music import Dancing2Music
from a2v.lab.motion.baselines.latent_transition import LatentTransition
from a2v.lab.motion.baselines.starts import kept_starts, read_starts
from a2v.lab.motion.baselines.two_stage_gan import TwoStageGAN
from a2v.lab.runs import RateSchedule, Run, RunSettings, Training, carry_on, identity
from a2v.types import FloatArray, IntArray

FILE = "baseline.pt"
KINDS: Mapping[str, type[Baseline]] = dict(
    zip(NAMES, (CondGRU, TwoStageGAN, ActMoCoGAN, Dancing2Music, LatentTransition), strict=True)
)


@dataclass(frozen=True)
class BaselineSettings(RunSettings):
    """Settings of the training of a baseline.

    Attributes
    ----------
    name : str
        Name of the system: condgru, two-stage-gan, act-mocogan, dancing2music or
        latent-transition.
    iterations : int
        Number of iterations; for systems with two stages, their sum.
    batch_size : int
        Clips per iteration.
    learning_rate : float
        Learning rate of Adam, with betas (0.5, 0.999).
    width : float
        Factor on the widths of hidden layers; 1 is the originals' size.
    """

    name: str = "condgru"
    iterations: int = 20_000
    batch_size: int = 64
    learning_rate: float = 2e-4
    width: float = 1.0

    def __post_init__(self) -> None:
        if self.name not in KINDS:
            raise InputError(f"unknown baseline '{self.name}'; choose from {', '.join(KINDS)}")
        if min(self.iterations, self.batch_size, self.log_every) < 1 or not 0 < self.width <= 4:
            raise InputError(
                "iterations, batch_size and log_every of a baseline must be "
                "positive, its width at most 4"
            )
        if self.batch_size < 2:
            raise InputError("batch_size of a baseline is 1; batch norms need at least 2")


class BaselineTraining(Training):
    """A baseline's training in progress; every iteration draws from its own seed."""

    STORED = ("model", "baseline")

    def __init__(self, dataset: ActionDataset, settings: BaselineSettings) -> None:
        super().__init__()
        if settings.claim().type == "cuda" and settings.device == "auto":
            settings = dataclasses.replace(settings, device="cpu")
        self.dataset, self.settings = dataset, settings
        torch.manual_seed(settings.seed)
        self.sizes = Sizes(
            3 * dataset.skeleton.n_joints, len(dataset.actions), dataset.length, settings.width
        )
        self.model = KINDS[settings.name](self.sizes)
        # one optimizer for all networks: it does not change weights without a gradient
        self.optimizer = torch.optim.Adam(
            self.model.parameters(), lr=settings.learning_rate, betas=(0.5, 0.999)
        )
        self.rate = RateSchedule(peak=settings.learning_rate, span=settings.iterations, floor=1.0)
        self.sampler = ClipSampler(dataset, self.model.window)

    def improve(self, module: nn.Module, loss: Tensor) -> float:
        """See `a2v.lab.motion.baselines.base.Improve`."""
        weights = list(module.parameters())
        self.optimizer.zero_grad(set_to_none=True)
        for weight, gradient in zip(
            weights, torch.autograd.grad(loss, weights, allow_unused=True), strict=True
        ):
            weight.grad = gradient
        self.optimizer.step()
        return float(loss.detach())

    def step(self) -> dict[str, float]:
        """Run one iteration; return the losses that the baseline names."""
        seed, iteration = self.settings.seed, self.iteration
        joints, labels, _ = self.sampler.batch(
            self.settings.batch_size, np.random.default_rng([seed, iteration])
        )
        known = torch.from_numpy(labels)
        batch = Batch(
            torch.from_numpy(joints).flatten(2),
            functional.one_hot(known, self.sizes.actions).float(),
            known,
        )
        self.model.train()
        draws = torch.Generator().manual_seed(seed * 1_000_003 + iteration)
        return self.model.learn(batch, iteration / self.settings.iterations, self.improve, draws)

    def trained(self) -> TrainedBaseline:
        """The baseline at this iteration, to sample from; it has no file yet."""
        about = self.settings.name, self.model.eval(), self.dataset.actions, self.dataset.name
        return TrainedBaseline(*about, self.dataset.sha256, self.iteration, sha256="")

    def content(self) -> dict[str, Any]:
        """Return the weights and their description."""
        about = {
            "name": self.settings.name,
            "sizes": dataclasses.asdict(self.sizes),
            "actions": list(self.dataset.actions),
        }
        return {
            "model": self.model.state_dict(),
            "baseline": about | {"dataset": self.dataset.name},
            "starts": kept_starts(self.dataset),
        }

    def restore(self, content: Mapping[str, Any]) -> None:
        """See `Training`."""
        self.model.load_state_dict(content["model"])


@dataclass(frozen=True)
class TrainedBaseline:
    """A baseline that was trained.

    Attributes
    ----------
    name : str
    model : Baseline
        In `eval` mode.
    actions : tuple of str
    dataset, dataset_digest : str
        Its training data.
    iterations : int
    sha256 : str
        SHA-256 of its file.
    starts : ActionDataset or None
        First poses and skeleton of its file (`read_starts`); None before it has a file, and for
        files of older versions.
    """

    name: str
    model: Baseline
    actions: tuple[str, ...]
    dataset: str
    dataset_digest: str
    iterations: int
    sha256: str
    starts: ActionDataset | None = None

    @torch.no_grad()
    def generate(
        self, labels: IntArray, first: FloatArray, generator: np.random.Generator
    ) -> FloatArray:
        """Sample joints (N, T, J, 3) float32, native units and the world's axes, first root at the
        origin.

        Parameters
        ----------
        labels : (N,) int
        first : (N, J, 3) float32
            Real first poses with their root at the origin; only CondGRU uses them.
        generator : numpy Generator
        """
        draws = torch.Generator().manual_seed(int(generator.integers(2**62)))
        actions = functional.one_hot(torch.from_numpy(labels), len(self.actions)).float()
        given = torch.from_numpy(first).flatten(1)
        made = torch.cat(
            [
                self.model.sample(*part, draws)
                for part in zip(torch.split(actions, 500), torch.split(given, 500), strict=True)
            ]
        )
        joints = made.view(*made.shape[:2], -1, 3).numpy()
        moved: FloatArray = joints - joints[:, :1, :1]
        return moved


def train_baseline(
    dataset: ActionDataset,
    folder: str | os.PathLike[str],
    *,
    settings: BaselineSettings,
    on_log: Callable[[BaselineTraining, dict[str, float]], None] | None = None,
) -> TrainedBaseline:
    """Train the baseline in `folder`, or resume its training (``baseline.pt`` and ``log.csv``).

    Parameters
    ----------
    dataset : ActionDataset
    folder : path
    settings : BaselineSettings
    on_log : callable
        Called with the training and each row of the log; what it adds to the row goes into the
        log.

    Raises
    ------
    InputError
        The run in `folder` was made with other data or settings, or training diverges.
    """
    path = Path(folder) / FILE
    run = Run(path, identity(settings, digest=dataset.sha256), settings.checkpoint_seconds)
    training = BaselineTraining(dataset, settings)
    show = on_log and functools.partial(on_log, training)
    carry_on(training, run, settings, iterations=settings.iterations, on_log=show)
    return load_baseline(path)


def load_baseline(path: str | os.PathLike[str]) -> TrainedBaseline:
    """Read a file of `train_baseline`; only tensors and plain values are unpickled.

    Raises
    ------
    InputError
        The file is missing, damaged, or not a baseline.
    """
    content = read_checkpoint(path, (*BaselineTraining.STORED, "iteration"))
    try:
        about = content["baseline"]
        model = KINDS[about["name"]](Sizes(**about["sizes"]))
        model.load_state_dict(content["model"])
        facts = (
            str(about["name"]),
            model.eval(),
            tuple(map(str, about["actions"])),
            str(about["dataset"]),
        )
        made_with = content["made_with"]["dataset_digest"]
        kept = content.get("starts")
        starts = None if kept is None else read_starts(kept, facts[2], facts[3])
        if starts is not None and 3 * starts.skeleton.n_joints != model.sizes.pose:
            raise ValueError("its first poses have other joints")
    except (KeyError, TypeError, ValueError, RuntimeError, AttributeError):
        raise InputError(
            f"{path} holds no baseline of a2v; give the {FILE} of a2v train baseline"
        ) from None
    return TrainedBaseline(*facts, made_with, int(content["iteration"]), sha256(path), starts)
