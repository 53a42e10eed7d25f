"""Common parts of the five baselines: sizes, a batch, and one step of the optimizer."""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

FIRST_STAGE = 0.6
"""Share of the training for the first of two stages. Iterations of the second take far more
time."""

Improve = Callable[[nn.Module, Tensor], float]
"""Takes one optimizer step on the weights of only one module to lower a loss (); returns the loss
as a number."""


@dataclass(frozen=True)
class Sizes:
    """Sizes of the data: numbers per pose D = 3 J, actions C, frames per clip T. `width` multiplies
    the widths of hidden layers."""

    pose: int
    actions: int
    frames: int
    width: float = 1.0

    def hidden(self, published: int) -> int:
        """The width of a hidden layer that is `published` wide in the original."""
        return max(2, round(published * self.width))


class Batch(NamedTuple):
    """Clips: poses (B, T, D) native units with the first root at the origin, actions (B, C)
    one-hot, labels (B,)."""

    poses: Tensor
    actions: Tensor
    labels: Tensor


class Baseline(nn.Module, ABC):
    """A model of motions that is trained from clips and sampled by action."""

    SOURCE: ClassVar[str]
    """The paper that describes it."""

    def __init__(self, sizes: Sizes) -> None:
        super().__init__()
        self.sizes = sizes

    @property
    def window(self) -> int:
        """Number of frames of its training clips."""
        return self.sizes.frames

    @abstractmethod
    def learn(
        self, batch: Batch, progress: float, improve: Improve, draws: torch.Generator
    ) -> dict[str, float]:
        """Run one iteration after the fraction `progress` of the training; returns losses by names,
        the same names in every iteration."""

    @abstractmethod
    def sample(self, actions: Tensor, first: Tensor, draws: torch.Generator) -> Tensor:
        """Sample poses (B, T, D) of actions (B, C). `first` (B, D) are real first poses, which only
        CondGRU needs. Call it in `eval` mode."""


def layers(*widths: int, norm: bool = False, slope: float = 0.2) -> nn.Sequential:
    """Return linear layers of these widths with leaky rectifiers between them, each after a batch
    norm if `norm`."""
    parts: list[nn.Module] = []
    for index, (before, after) in enumerate(itertools.pairwise(widths)):
        parts.append(nn.Linear(before, after))
        if index < len(widths) - 2:
            parts += [nn.BatchNorm1d(after)] * norm + [nn.LeakyReLU(slope)]
    return nn.Sequential(*parts)


def normal(draws: torch.Generator, *shape: int) -> Tensor:
    """Draw standard normal numbers of a shape."""
    return torch.randn(*shape, generator=draws)


def over_time(vector: Tensor, frames: int) -> Tensor:
    """Repeat a vector (B, N) for every frame: (B, T, N)."""
    return vector[:, None].expand(-1, frames, -1)


def real_or_not(logits: Tensor, real: bool) -> Tensor:
    """Return the binary cross entropy () of logits with the label `real`."""
    return functional.binary_cross_entropy_with_logits(logits, torch.full_like(logits, float(real)))


def random_poses(batch: Batch, draws: torch.Generator, each: int = 4) -> tuple[Tensor, Tensor]:
    """Return poses (B each, D) of random frames, and their actions (B each, C)."""
    clips, frames = batch.poses.shape[:2]
    chosen = torch.randint(0, frames, (clips, each), generator=draws)
    return batch.poses[torch.arange(clips)[:, None], chosen].flatten(
        0, 1
    ), batch.actions.repeat_interleave(each, 0)


CRITIC_STEPS = 3
"""Steps of a critic per step of its generator."""
GRADIENT_PENALTY = 10.0
"""Weight of the gradient's norm (lambda of Gulrajani et al. 2017)."""


def wasserstein_round(
    generate: Callable[[int], Tensor],
    generator: nn.Module,
    critic: nn.Module,
    real: Tensor,
    given: Tensor,
    improve: Improve,
    draws: torch.Generator,
) -> dict[str, float]:
    """Take `CRITIC_STEPS` steps of a critic and one of its generator, with the gradient penalty of
    Gulrajani et al. (2017).

    Parameters
    ----------
    generate : makes N poses (N, D)
    real : (N, D)
    given : (N, C) or (N, 0)
        Further inputs of the critic for each pose.
    """
    for _ in range(CRITIC_STEPS):
        fake = generate(len(real)).detach()
        share = torch.rand(len(real), 1, generator=draws)
        between = (share * real + (1 - share) * fake).requires_grad_()
        (slope,) = torch.autograd.grad(
            critic(torch.cat([between, given], -1)).sum(), between, create_graph=True
        )
        both = critic(torch.cat([torch.cat([fake, real]), torch.cat([given, given])], -1))
        distance = both[: len(fake)].mean() - both[len(fake) :].mean()
        criticized = improve(
            critic, distance + GRADIENT_PENALTY * ((slope.norm(dim=-1) - 1) ** 2).mean()
        )
    made = improve(generator, -critic(torch.cat([generate(len(real)), given], -1)).mean())
    return {"discriminator": criticized, "generator": made}
