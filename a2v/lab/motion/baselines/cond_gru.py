"""CondGRU: the papers' deterministic baseline, after Shlizerman et al. 2018 (audio to body
dynamics)."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from a2v.lab.motion.baselines.base import Baseline, Batch, Improve, Sizes, over_time

TEACHER_FORCING = 0.5


class CondGRU(Baseline):
    """The class, mapped to a vector of the size of a pose, is appended to the pose. A GRU of width
    128 and a linear layer give the next pose.

    The first pose is real, and the first state is zero. Half of the sequences get real poses
    throughout, the others their own. Assumed: squared error, no change of the pose's scale.
    """

    SOURCE = "Shlizerman et al., CVPR 2018"

    def __init__(self, sizes: Sizes) -> None:
        super().__init__(sizes)
        self.embed = nn.Linear(sizes.actions, sizes.pose)
        self.recurrent = nn.GRU(2 * sizes.pose, sizes.hidden(128), batch_first=True)
        self.exit = nn.Linear(sizes.hidden(128), sizes.pose)

    def follow(
        self, poses: Tensor, actions: Tensor, state: Tensor | None = None
    ) -> tuple[Tensor, Tensor]:
        """Return the successors of the poses (B, T, D), and the last state."""
        hidden, state = self.recurrent(
            torch.cat([over_time(self.embed(actions), poses.shape[1]), poses], -1), state
        )
        return self.exit(hidden), state

    def roll_out(self, first: Tensor, actions: Tensor, frames: int) -> Tensor:
        """Return the `frames` - 1 poses after the first (B, D), each generated from the last
        one."""
        pose, state, made = first[:, None], None, []
        for _ in range(frames - 1):
            pose, state = self.follow(pose, actions, state)
            made.append(pose)
        return torch.cat(made, 1)

    def learn(
        self, batch: Batch, progress: float, improve: Improve, draws: torch.Generator
    ) -> dict[str, float]:
        """See `Baseline`."""
        forced = torch.rand(len(batch.poses), generator=draws) < TEACHER_FORCING
        wanted, made = batch.poses[:, 1:], []
        for part, own in ((forced, False), (~forced, True)):
            if part.any():
                poses, actions = batch.poses[part], batch.actions[part]
                given = (
                    self.roll_out(poses[:, 0], actions, poses.shape[1])
                    if own
                    else self.follow(poses[:, :-1], actions)[0]
                )
                made.append(((given - wanted[part]) ** 2).flatten())
        return {"loss": improve(self, torch.cat(made).mean())}

    def sample(self, actions: Tensor, first: Tensor, draws: torch.Generator) -> Tensor:
        """See `Baseline`."""
        return torch.cat([first[:, None], self.roll_out(first, actions, self.sizes.frames)], 1)
