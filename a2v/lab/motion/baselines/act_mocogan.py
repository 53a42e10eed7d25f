"""Act-MoCoGAN: MoCoGAN (Tulyakov et al. 2018) with motions and poses in place of videos and
images."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from a2v.lab.motion.baselines.base import (
    Baseline,
    Batch,
    Improve,
    Sizes,
    layers,
    normal,
    over_time,
    random_poses,
    real_or_not,
)

NOISE = 30
"""Size of the noise of a frame."""
CONTENT = 30
"""Size of the noise vector that all frames of a motion share."""
CLASS_WEIGHT = 0.7
"""Weight of the action's cross entropy in the generator's loss."""
POSE_WEIGHT = 0.5
"""Weight of the loss of the discriminator of single poses in the same loss."""


class ActMoCoGAN(Baseline):
    """A GRU turns the noise of each frame into motion codes. A two-layer GRU turns the codes, a
    noise vector that all frames of a motion share, and the class into poses.

    The discriminator of motions is a two-layer GRU with 30 features and 1 + C outputs: real or not,
    and the class. The discriminator of poses, which sees them without their root, has one hidden
    layer of 128. The loss is a binary cross entropy, plus .7 of the class's cross entropy and .5 of
    the poses'. The GRUs that generate start from random states. Assumed: the shared vector has 30
    dimensions, the discriminator of poses sees no class, and the features are a tanh of the last
    state.
    """

    SOURCE = "Tulyakov et al., CVPR 2018"

    def __init__(self, sizes: Sizes) -> None:
        super().__init__(sizes)
        wide = sizes.hidden(128)
        self.made = nn.ModuleDict(
            {
                "codes": nn.GRU(NOISE, wide, batch_first=True),
                "recurrent": nn.GRU(
                    wide + CONTENT + sizes.actions, wide, num_layers=2, batch_first=True
                ),
                "exit": nn.Linear(wide, sizes.pose),
            }
        )
        self.judge = nn.ModuleDict(
            {
                "recurrent": nn.GRU(sizes.pose, wide, num_layers=2, batch_first=True),
                "features": nn.Linear(wide, 30),
                "exit": nn.Linear(30, 1 + sizes.actions),
                "pose": layers(sizes.pose, wide, 1),
            }
        )

    def sample(self, actions: Tensor, first: Tensor, draws: torch.Generator) -> Tensor:
        """See `Baseline`."""
        clips, frames, wide = len(actions), self.sizes.frames, self.sizes.hidden(128)
        noise, start = normal(draws, clips, frames, NOISE), normal(draws, 1, clips, wide)
        codes, _ = self.made["codes"](noise, start)
        shared = torch.cat([normal(draws, clips, CONTENT), actions], -1)
        hidden, _ = self.made["recurrent"](
            torch.cat([codes, over_time(shared, frames)], -1), normal(draws, 2, clips, wide)
        )
        poses: Tensor = self.made["exit"](hidden)
        return poses

    def judged(self, poses: Tensor) -> Tensor:
        """Return outputs (B, 1 + C) for motions (B, T, D)."""
        hidden, _ = self.judge["recurrent"](poses)
        outputs: Tensor = self.judge["exit"](torch.tanh(self.judge["features"](hidden[:, -1])))
        return outputs

    def judged_poses(self, batch: Batch, draws: torch.Generator) -> Tensor:
        """Return logits of random poses, each moved so that its root is at the origin."""
        poses, _ = random_poses(batch, draws)
        joints = poses.view(len(poses), -1, 3)
        logits: Tensor = self.judge["pose"]((joints - joints[:, :1]).flatten(1))
        return logits

    def learn(
        self, batch: Batch, progress: float, improve: Improve, draws: torch.Generator
    ) -> dict[str, float]:
        """See `Baseline`."""
        made = batch._replace(poses=self.sample(batch.actions, batch.poses[:, 0], draws))
        fake = made._replace(poses=made.poses.detach())
        real, false = self.judged(batch.poses), self.judged(fake.poses)
        doubt = real_or_not(real[:, :1], True) + real_or_not(false[:, :1], False)
        doubt = doubt + CLASS_WEIGHT * functional.cross_entropy(real[:, 1:], batch.labels)
        poses = real_or_not(self.judged_poses(batch, draws), True) + real_or_not(
            self.judged_poses(fake, draws), False
        )
        discriminator = improve(self.judge, doubt + POSE_WEIGHT * poses)
        outputs = self.judged(made.poses)
        wish = real_or_not(outputs[:, :1], True) + CLASS_WEIGHT * functional.cross_entropy(
            outputs[:, 1:], batch.labels
        )
        wish = wish + POSE_WEIGHT * real_or_not(self.judged_poses(made, draws), True)
        return {"discriminator": discriminator, "generator": improve(self.made, wish)}
