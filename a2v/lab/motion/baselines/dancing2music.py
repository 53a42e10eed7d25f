"""Dancing2Music: Lee et al. 2019 (dancing to music), with actions in place of the music,
implemented from the paper and the authors' code (movements decoded from another first pose, codes
of sequences drawn from the action and noise, a discriminator of these codes)."""

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
    real_or_not,
)

SNIPPET = 32
INITIAL = 10
"""Size of the code of the first pose."""
MOVE = 512
"""Size of the code of a movement."""
SNIPPETS_STAGE = 0.2
"""Share of the iterations for the first stage, which take seven times as long as those of the
second."""
KL_WEIGHT = 0.01
"""Weight of the Kullback-Leibler divergence."""
SHIFT_WEIGHT = 1.0
"""Weight of the error of movements that are decoded from another initial pose."""
SEQUENCE_WEIGHT = 10.0
"""Weight of the error of sequences."""


class Gaussian(nn.Module):
    """Mean and log variance of a vector, and a draw."""

    def __init__(self, before: int, after: int) -> None:
        super().__init__()
        self.layer = nn.Linear(before, 2 * after)

    def forward(self, vector: Tensor, draws: torch.Generator) -> tuple[Tensor, Tensor, Tensor]:
        """Return a draw, the mean, and the divergence () from the standard normal, averaged over
        dimensions."""
        mean, logvar = self.layer(vector).chunk(2, -1)
        divergence = 0.5 * (mean**2 + logvar.exp() - 1 - logvar).mean()
        return mean + torch.exp(0.5 * logvar) * normal(draws, *mean.shape), mean, divergence


class Dancing2Music(Baseline):
    """A VAE learns snippets of 32 poses as an initial pose (10 numbers) and a movement (512); then
    a GAN learns the order of movements.

    GRUs are 1024 wide. Divergences have the weight 0.01, the sequence's L1 error 10. The last pose
    of a snippet is the initial pose of the next one. In the first stage each movement is also
    decoded from the initial pose of another snippet of the batch, and the result must have the same
    movement (L1). The second stage is a VAE of sequences of movements: an encoder gives a code of
    512 numbers, a decoder the movements. A network draws this code from the action and noise. One
    discriminator judges the codes, another one the movements. Assumed: divergences are means over
    dimensions, the network that draws codes has one hidden layer of 1024 and 512 numbers of noise,
    both discriminators see the action, the other snippet is one of the next clip in the batch,
    `SNIPPETS_STAGE` of the training for the first stage.
    """

    SOURCE = "Lee et al., NeurIPS 2019"

    def __init__(self, sizes: Sizes) -> None:
        super().__init__(sizes)
        wide, pose, actions = sizes.hidden(1024), sizes.pose, sizes.actions
        self.snippets = -(-(sizes.frames - 1) // (SNIPPET - 1))
        self.unit = nn.ModuleDict(
            {
                "initial": layers(pose, wide // 4 or 1, wide // 4 or 1),
                "z_initial": Gaussian(wide // 4 or 1, INITIAL),
                "move": nn.GRU(pose, wide, batch_first=True),
                "z_move": Gaussian(wide, MOVE),
                "recurrent": nn.GRU(INITIAL + MOVE, wide, batch_first=True),
                "exit": nn.Linear(wide, pose),
            }
        )
        self.composer = nn.ModuleDict(
            {
                "encoder": nn.GRU(MOVE, wide, batch_first=True),
                "z": Gaussian(wide, MOVE),
                "draw": layers(MOVE + actions, wide, MOVE),
                "decoder": nn.GRU(MOVE, wide, batch_first=True),
                "exit": nn.Linear(wide, MOVE),
            }
        )
        self.judges = nn.ModuleDict(
            {
                "moves": layers(self.snippets * MOVE + actions, wide, wide, 1),
                "code": layers(MOVE + actions, wide, wide, 1),
            }
        )

    @property
    def window(self) -> int:
        """Frames of whole snippets that share a pose."""
        return self.snippets * (SNIPPET - 1) + 1

    def moved(self, parts: Tensor, draws: torch.Generator) -> tuple[Tensor, Tensor, Tensor]:
        """Return a draw and the mean (N, 512) of the movements of snippets (N, 32, D), and the
        divergence ()."""
        drawn: tuple[Tensor, Tensor, Tensor] = self.unit["z_move"](
            self.unit["move"](parts)[1][0], draws
        )
        return drawn

    def decoded(self, initial: Tensor, move: Tensor) -> Tensor:
        """Return poses (N, 32, D) of an initial pose (N, 10) and a movement (N, 512)."""
        hidden, _ = self.unit["recurrent"](over_time(torch.cat([initial, move], -1), SNIPPET))
        poses: Tensor = self.unit["exit"](hidden)
        return poses

    def drawn(self, actions: Tensor, draws: torch.Generator) -> Tensor:
        """Draw codes (B, 512) of sequences of actions (B, C)."""
        noise = normal(draws, len(actions), MOVE)
        codes: Tensor = self.composer["draw"](torch.cat([noise, actions], -1))
        return codes

    def composed(self, code: Tensor) -> Tensor:
        """Return movements (B, S, 512) of a code (B, 512)."""
        hidden, _ = self.composer["decoder"](over_time(code, self.snippets))
        moves: Tensor = self.composer["exit"](hidden)
        return moves

    def learn(
        self, batch: Batch, progress: float, improve: Improve, draws: torch.Generator
    ) -> dict[str, float]:
        """See `Baseline`."""
        parts = moved_to_origin(
            batch.poses.unfold(1, SNIPPET, SNIPPET - 1).transpose(-1, -2).flatten(0, 1)
        )
        if progress < SNIPPETS_STAGE:
            initial, _, first = self.unit["z_initial"](self.unit["initial"](parts[:, 0]), draws)
            move, mean, second = self.moved(parts, draws)
            error = (self.decoded(initial, move) - parts).abs().mean()
            other = self.decoded(initial.roll(self.snippets, 0), move)
            # without detach, all movements become equal
            shift = (self.moved(moved_to_origin(other), draws)[1] - mean.detach()).abs().mean()
            wish = error + SHIFT_WEIGHT * shift + KL_WEIGHT * (first + second)
            return {"discriminator": 0.0, "generator": improve(self.unit, wish)}
        with torch.no_grad():
            moves = self.moved(parts, draws)[1].view(-1, self.snippets, MOVE)
        hidden = self.composer["encoder"](moves)[1][0]
        code, _, divergence = self.composer["z"](hidden, draws)
        made = self.drawn(batch.actions, draws)
        fake = self.composed(made)
        discriminator = improve(
            self.judges,
            self.judgment(moves, code.detach(), batch.actions, True)
            + self.judgment(fake.detach(), made.detach(), batch.actions, False),
        )
        wish = (
            self.judgment(fake, made, batch.actions, True)
            + SEQUENCE_WEIGHT * functional.l1_loss(self.composed(code), moves)
            + KL_WEIGHT * divergence
        )
        return {"discriminator": discriminator, "generator": improve(self.composer, wish)}

    def judgment(self, moves: Tensor, code: Tensor, actions: Tensor, real: bool) -> Tensor:
        """Return the cross entropy () of both discriminators' logits with the label `real`."""
        by_moves = self.judges["moves"](torch.cat([moves.flatten(1), actions], -1))
        by_code = self.judges["code"](torch.cat([code, actions], -1))
        return real_or_not(by_moves, real) + real_or_not(by_code, real)

    def sample(self, actions: Tensor, first: Tensor, draws: torch.Generator) -> Tensor:
        """See `Baseline`."""
        moves = self.composed(self.drawn(actions, draws))
        initial, root, parts = (
            normal(draws, len(actions), INITIAL),
            torch.zeros(len(actions), 1, 3),
            [],
        )
        for index in range(self.snippets):
            joints = (
                joints_of(moved_to_origin(self.decoded(initial, moves[:, index])))
                + root[:, :, None]
            )
            parts.append(joints[:, 1:] if index else joints)
            root = joints[:, -1:, 0]
            initial = self.unit["z_initial"](
                self.unit["initial"](moved_to_origin(joints[:, -1:].flatten(2))[:, 0]), draws
            )[1]
        return torch.cat(parts, 1)[:, : self.sizes.frames].flatten(2)


def joints_of(poses: Tensor) -> Tensor:
    """Return joints (B, T, J, 3) of poses (B, T, D)."""
    return poses.reshape(*poses.shape[:2], -1, 3)


def moved_to_origin(poses: Tensor) -> Tensor:
    """Move poses (B, T, D) so that the first root is at the origin."""
    joints = joints_of(poses)
    moved: Tensor = (joints - joints[:, :1, :1]).flatten(2)
    return moved
