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

LATENT = 12
"""Size of the latent vector of a pose."""
NOISE = 64
"""Size of the noise of a frame."""
LARGEST_STEP = 1.0
SMOOTH_WEIGHT = 1e-4
"""Weight of the squared differences between consecutive poses."""
MAGNITUDE_WEIGHT = 0.1
"""Weight of the squared steps."""
CLASS_WEIGHT = 0.01
"""Weight of the action's cross entropy."""


class MotionJudge(nn.Module):
    """A Bi-LSTM on poses and their differences, its mean over time, and one hidden layer."""

    def __init__(self, sizes: Sizes, given: int, outputs: int) -> None:
        super().__init__()
        narrow = sizes.hidden(256)
        self.recurrent = nn.LSTM(
            2 * sizes.pose + given, narrow, batch_first=True, bidirectional=True
        )
        self.exit = layers(2 * narrow, sizes.hidden(1024), outputs, slope=0.0)

    def forward(self, poses: Tensor, given: Tensor) -> Tensor:
        """Return outputs (B, O) for motions (B, T, D), with further inputs (B, G) in every
        frame."""
        steps = poses.diff(dim=1)
        frames = torch.cat([poses[:, :-1], steps, over_time(given, steps.shape[1])], -1)
        outputs: Tensor = self.exit(self.recurrent(frames)[0].mean(1))
        return outputs


class LatentTransition(Baseline):
    """A Wasserstein GAN of the poses of an action, then a Bi-LSTM that generates steps through the
    GAN's latent space. The latent vector of a frame is the sum of the clipped steps up to it.

    As in the authors' code (zheshiyige/Learning-Diverse-Stochastic-Human-Action-Generators,
    commit c931913): latents have 12 dimensions and begin uniformly in [-1, 1]; the noise of a frame
    has 64; generator and critic of poses have one hidden layer of 1024, the generator's with batch
    norm; the discriminator of motions is a Bi-LSTM of 256 in each direction with a hidden layer of
    1024; all of them receive the class. A classifier of the same form is trained with the generator
    on real and generated motions. The steps come from a Bi-LSTM, as the journal says (Sec. 5.1.1);
    the code has one direction. Assumed: it also receives the first latent vector, the
    discriminator's states are averaged over time, the squared steps are summed over a motion and
    averaged over motions, discriminator and generator take turns, and `FIRST_STAGE` of the training
    goes to the first stage.
    """

    SOURCE = "Wang et al., AAAI 2020"

    def __init__(self, sizes: Sizes) -> None:
        super().__init__(sizes)
        wide, narrow, actions = sizes.hidden(1024), sizes.hidden(256), sizes.actions
        self.pose = layers(LATENT + actions, wide, sizes.pose, norm=True, slope=0.0)
        self.pose_critic = layers(sizes.pose + actions, wide, 1, slope=0.0)
        self.made = nn.ModuleDict(
            {
                "recurrent": nn.LSTM(
                    LATENT + NOISE + actions, narrow, batch_first=True, bidirectional=True
                ),
                "exit": nn.Linear(2 * narrow, LATENT),
                "classifier": MotionJudge(sizes, 0, actions),
            }
        )
        self.judge = MotionJudge(sizes, actions, 1)

    def walk(self, actions: Tensor, frames: int, draws: torch.Generator) -> tuple[Tensor, Tensor]:
        """Return latent vectors (B, T, 12) and the steps (B, T - 1, 12) between them."""
        first = first_latents(len(actions), draws)
        noise = normal(draws, len(actions), frames - 1, NOISE)
        given = over_time(torch.cat([first, actions], -1), frames - 1)
        hidden, _ = self.made["recurrent"](torch.cat([noise, given], -1))
        steps = self.made["exit"](hidden).clamp(-LARGEST_STEP, LARGEST_STEP)
        return first[:, None] + functional.pad(steps.cumsum(1), (0, 0, 1, 0)), steps

    def poses_of(self, latents: Tensor, actions: Tensor) -> Tensor:
        """Return poses (B, T, D) of latent vectors (B, T, 12), using the running statistics of the
        batch norm."""
        given = torch.cat([latents, over_time(actions, latents.shape[1])], -1)
        poses: Tensor = self.pose.eval()(given.flatten(0, 1)).unflatten(0, latents.shape[:2])
        return poses

    def sample(self, actions: Tensor, first: Tensor, draws: torch.Generator) -> Tensor:
        """See `Baseline`."""
        return self.poses_of(self.walk(actions, self.sizes.frames, draws)[0], actions)

    def learn(
        self, batch: Batch, progress: float, improve: Improve, draws: torch.Generator
    ) -> dict[str, float]:
        """See `Baseline`."""
        if progress < FIRST_STAGE:
            real, given = random_poses(batch, draws)
            self.pose.train()
            return wasserstein_round(
                lambda count: self.pose(torch.cat([first_latents(count, draws), given], -1)),
                self.pose,
                self.pose_critic,
                real,
                given,
                improve,
                draws,
            )
        latents, steps = self.walk(batch.actions, self.sizes.frames, draws)
        made = self.poses_of(latents, batch.actions)
        true, false = self.judge(
            torch.cat([batch.poses, made.detach()]), batch.actions.repeat(2, 1)
        ).chunk(2)
        discriminator = improve(self.judge, real_or_not(true, True) + real_or_not(false, False))
        guesses = self.made["classifier"](
            torch.cat([batch.poses, made]), batch.actions.new_empty(2 * len(made), 0)
        )
        wish = real_or_not(self.judge(made, batch.actions), True)
        # the mean over real and generated motions is half of the sum
        wish = wish + 2 * CLASS_WEIGHT * functional.cross_entropy(guesses, batch.labels.repeat(2))
        wish = (
            wish
            + SMOOTH_WEIGHT * (made.diff(dim=1) ** 2).sum((1, 2)).mean()
            + MAGNITUDE_WEIGHT * (steps**2).sum((1, 2)).mean()
        )
        return {"discriminator": discriminator, "generator": improve(self.made, wish)}


def first_latents(count: int, draws: torch.Generator) -> Tensor:
    """Draw latent vectors (N, 12), uniform in [-1, 1]."""
    return 2 * torch.rand(count, LATENT, generator=draws) - 1
