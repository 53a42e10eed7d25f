"""LatentTransition: Wang et al. 2020 (diverse stochastic human-action generators by learning smooth
latent transitions)."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from a2v.lab.motion.baselines.base import (
    FIRST_STAGE,
    Baseline,
    Batch,
    Improve,
    Sizes,
    layers,
    normal,
    over_time,
    random_poses,
    real_or_not,
    wasserstein_round,
)

NOISE = 12
LARGEST_STEP = 0.3
SMOOTH_WEIGHT = 1e-4
"""Weight of the squared steps between latents."""
MAGNITUDE_WEIGHT = 0.1
"""Weight of the latents' squares."""
CLASS_WEIGHT = 0.01
"""Weight of the action's cross entropy."""


class LatentTransition(Baseline):
    """A Wasserstein GAN of poses, then a Bi-LSTM that generates steps through the GAN's latent
    space. The latent vector of a frame is the sum of the clipped steps up to it.

    The pose noise has 12 dimensions. The GAN's layers are 1024 wide, with batch norm in the
    generator. The Bi-LSTM (journal, Sec. 5.1.1) is 256 wide in each direction. The discriminator is
    a Bi-LSTM on poses and their differences that also classifies the action. Assumed: poses are
    generated without the class, which the Bi-LSTM receives in every frame; steps are clipped at .3;
    the discriminator is 128 wide; `FIRST_STAGE` of the training goes to the first stage.
    """

    SOURCE = "Wang et al., AAAI 2020"

    def __init__(self, sizes: Sizes) -> None:
        super().__init__(sizes)
        wide, narrow = sizes.hidden(1024), sizes.hidden(128)
        self.pose = layers(NOISE, wide, wide, sizes.pose, norm=True)
        self.pose_critic = layers(sizes.pose, wide, wide, 1)
        self.steps = nn.ModuleDict(
            {
                "recurrent": nn.LSTM(
                    2 * NOISE + sizes.actions,
                    sizes.hidden(256),
                    batch_first=True,
                    bidirectional=True,
                ),
                "exit": nn.Linear(2 * sizes.hidden(256), NOISE),
            }
        )
        self.judge = nn.ModuleDict(
            {
                "recurrent": nn.LSTM(2 * sizes.pose, narrow, batch_first=True, bidirectional=True),
                "exit": nn.Linear(2 * narrow, 1 + sizes.actions),
            }
        )

    def walk(self, actions: Tensor, frames: int, draws: torch.Generator) -> tuple[Tensor, Tensor]:
        """Return latent vectors (B, T, 12) and the steps (B, T - 1, 12) between them."""
        first = normal(draws, len(actions), NOISE)
        given = torch.cat([first, actions], -1)
        noise = normal(draws, len(actions), frames - 1, NOISE)
        hidden, _ = self.steps["recurrent"](torch.cat([noise, over_time(given, frames - 1)], -1))
        steps = self.steps["exit"](hidden).clamp(-LARGEST_STEP, LARGEST_STEP)
        return first[:, None] + functional.pad(steps.cumsum(1), (0, 0, 1, 0)), steps

    def poses_of(self, latents: Tensor) -> Tensor:
        """Return poses (B, T, D) of latent vectors (B, T, 12), using the running statistics of the
        batch norms."""
        poses: Tensor = self.pose.eval()(latents.flatten(0, 1)).unflatten(0, latents.shape[:2])
        return poses

    def sample(self, actions: Tensor, first: Tensor, draws: torch.Generator) -> Tensor:
        """See `Baseline`."""
        return self.poses_of(self.walk(actions, self.sizes.frames, draws)[0])

    def judged(self, poses: Tensor) -> Tensor:
        """Return outputs (B, 1 + C) for motions (B, T, D)."""
        hidden, _ = self.judge["recurrent"](
            torch.cat([poses, functional.pad(poses.diff(dim=1), (0, 0, 1, 0))], -1)
        )
        outputs: Tensor = self.judge["exit"](hidden.mean(1))
        return outputs

    def learn(
        self, batch: Batch, progress: float, improve: Improve, draws: torch.Generator
    ) -> dict[str, float]:
        """See `Baseline`."""
        if progress < FIRST_STAGE:
            real, _ = random_poses(batch, draws)
            self.pose.train()
            return wasserstein_round(
                lambda count: self.pose(normal(draws, count, NOISE)),
                self.pose,
                self.pose_critic,
                real,
                real[:, :0],
                improve,
                draws,
            )
        latents, steps = self.walk(batch.actions, self.sizes.frames, draws)
        made = self.poses_of(latents)
        real, false = self.judged(batch.poses), self.judged(made.detach())
        doubt = real_or_not(real[:, :1], True) + real_or_not(false[:, :1], False)
        discriminator = improve(
            self.judge, doubt + CLASS_WEIGHT * functional.cross_entropy(real[:, 1:], batch.labels)
        )
        outputs = self.judged(made)
        wish = real_or_not(outputs[:, :1], True) + CLASS_WEIGHT * functional.cross_entropy(
            outputs[:, 1:], batch.labels
        )
        wish = (
            wish
            + SMOOTH_WEIGHT * (steps.diff(dim=1) ** 2).sum((1, 2)).mean()
            + MAGNITUDE_WEIGHT * (steps**2).mean()
        )
        return {"discriminator": discriminator, "generator": improve(self.steps, wish)}
