"""Two-stage GAN: Cai et al. 2018 (deep video generation of human action), in 3D."""

from __future__ import annotations

import torch
from torch import Tensor, nn

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

NOISE = 30


class TwoStageGAN(Baseline):
    """A Wasserstein GAN learns poses of an action; then a recurrent network learns sequences of its
    latent vectors that make a motion.

    Pose noise and motion noise have 30 dimensions, hidden layers are 128 (poses) and 256 (motion)
    wide; The first latent vector is drawn, and an LSTM generates the other T - 1. Assumed: two
    hidden layers, the gradient penalty, a class-conditional discriminator of motions with binary
    cross entropy, `FIRST_STAGE` of the training for the first stage; the poses keep the root's
    path.
    """

    SOURCE = "Cai et al., ECCV 2018"

    def __init__(self, sizes: Sizes) -> None:
        super().__init__(sizes)
        narrow, wide = sizes.hidden(128), sizes.hidden(256)
        self.pose = layers(NOISE + sizes.actions, narrow, narrow, sizes.pose)
        self.pose_critic = layers(sizes.pose + sizes.actions, narrow, narrow, 1)
        self.motion = nn.ModuleDict(
            {
                "begin": nn.Linear(NOISE + sizes.actions, wide),
                "recurrent": nn.LSTM(NOISE + sizes.actions, wide, batch_first=True),
                "exit": nn.Linear(wide, NOISE),
            }
        )
        self.judge = nn.ModuleDict(
            {
                "recurrent": nn.LSTM(sizes.pose + sizes.actions, wide, batch_first=True),
                "exit": nn.Linear(wide, 1),
            }
        )

    def latents(self, actions: Tensor, frames: int, draws: torch.Generator) -> Tensor:
        """Return latent vectors (B, T, 30) of motions."""
        first = normal(draws, len(actions), NOISE)
        noise = normal(draws, len(actions), frames - 1, NOISE)
        state = torch.tanh(self.motion["begin"](torch.cat([first, actions], -1)))[None]
        hidden, _ = self.motion["recurrent"](
            torch.cat([noise, over_time(actions, frames - 1)], -1), (state, torch.zeros_like(state))
        )
        return torch.cat([first[:, None], self.motion["exit"](hidden)], 1)

    def sample(self, actions: Tensor, first: Tensor, draws: torch.Generator) -> Tensor:
        """See `Baseline`."""
        latents = self.latents(actions, self.sizes.frames, draws)
        poses: Tensor = self.pose(torch.cat([latents, over_time(actions, self.sizes.frames)], -1))
        return poses

    def judged(self, poses: Tensor, actions: Tensor) -> Tensor:
        """Return logits (B, 1) of whether motions are real."""
        hidden, _ = self.judge["recurrent"](
            torch.cat([poses, over_time(actions, poses.shape[1])], -1)
        )
        logits: Tensor = self.judge["exit"](hidden.mean(1))
        return logits

    def learn(
        self, batch: Batch, progress: float, improve: Improve, draws: torch.Generator
    ) -> dict[str, float]:
        """See `Baseline`."""
        if progress < FIRST_STAGE:
            real, given = random_poses(batch, draws)

            def generate(count: int) -> Tensor:
                poses: Tensor = self.pose(torch.cat([normal(draws, count, NOISE), given], -1))
                return poses

            return wasserstein_round(
                generate, self.pose, self.pose_critic, real, given, improve, draws
            )
        made = self.sample(batch.actions, batch.poses[:, 0], draws)
        judged = real_or_not(self.judged(batch.poses, batch.actions), True) + real_or_not(
            self.judged(made.detach(), batch.actions), False
        )
        discriminator = improve(self.judge, judged)
        return {
            "discriminator": discriminator,
            "generator": improve(self.motion, real_or_not(self.judged(made, batch.actions), True)),
        }
