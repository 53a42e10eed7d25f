"""Our own motion model: flow matching over whole windows (not in the papers).

A network transports Gaussian noise to the code of a window (`a2v.lab.motion.windows`) along
straight paths (Lipman et al. 2023; Liu et al. 2023). Its conditions are the action, the fraction of
the window in motion, and the frames that the window continues. There is no loop over frames, so
that it does not drift inside a window; successive windows continue each other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from a2v.errors import InputError
from a2v.lab.motion.windows import WindowCodec
from a2v.lab.runs import RunSettings

GUIDANCE = 1.5
"""Default strength with which velocities are pushed toward the action
(docs/research/motion-flow.md)."""


@dataclass(frozen=True)
class FlowSettings(RunSettings):
    """Sizes and training of the flow.

    Attributes
    ----------
    code_size : int
        Number of coefficients of a window.
    context_size : int
        Number of coefficients of the frames that a window continues.
    foot_place : float
        Weight of the error of foot positions in the code (`a2v.lab.motion.windows.foot_metric`).
    foot_step : float
        Weight of the error of foot motion between frames in the code.
    context_frames : int
        Number of frames that the next window gets as context.
    width : int
        Width of the residual blocks of the network.
    blocks : int
        Number of residual blocks of the network.
    condition_size : int
        Width of the vector that scales, shifts and gates the blocks. It is narrower than the
        blocks, since there is one per window.
    iterations : int
        Number of iterations.
    batch_size : int
        Windows per iteration.
    learning_rate : float
        Learning rate of AdamW, with a cosine decay to a fiftieth.
    weight_decay : float
        Weight decay of AdamW.
    balance : float
        Share of windows drawn with all actions equally likely; the others are drawn with all clips
        equally likely. For data sets with rare actions.
    face_forward : bool
        Turn every window so that its first frame faces +z. Then the recording's heading is not
        learned, and a motion of any heading can be continued.
    context_dropout : float
        Share of windows on which the network is trained without context.
    action_dropout : float
        Share of windows on which the network is trained without an action, which guidance requires.
    emphasis : float
        The error of a coefficient is weighted by its standard deviation to this power: 0 weights
        all equally, 1 in proportion to their effect on the joints.
    half : bool
        Matrix products in bfloat16 (weights and sums stay float32): three times the speed on a CPU
        that has it.
    average : float
        Decay of the exponential moving average of the weights. The average is the result.
    pool : int
        Number of windows that are encoded at a time.
    initial : str
        ``flow.pt`` of a run of the same sizes and actions to start from, or an exported flow of the
        same sizes, whose actions are matched by name. "" starts from random weights.
    """

    code_size: int = 384
    context_size: int = 48
    foot_place: float = 1.0
    foot_step: float = 16.0
    context_frames: int = 8
    width: int = 512
    blocks: int = 6
    condition_size: int = 128
    iterations: int = 16_000
    batch_size: int = 512
    learning_rate: float = 1e-3
    weight_decay: float = 1e-4
    balance: float = 0.0
    face_forward: bool = False
    context_dropout: float = 0.5
    action_dropout: float = 0.1
    emphasis: float = 0.5
    half: bool = False
    average: float = 0.998
    pool: int = 6000
    initial: str = ""

    def __post_init__(self) -> None:
        if (
            min(
                self.code_size,
                self.context_size,
                self.context_frames,
                self.width,
                self.blocks,
                self.iterations,
                self.batch_size,
            )
            < 1
        ):
            raise InputError(
                "sizes, frames, iterations and batch_size of the flow must be positive"
            )


class Modulation(NamedTuple):
    """Scale, shift and gate of a block under a condition, (B, W) each."""

    scale: Tensor
    shift: Tensor
    gate: Tensor


class _Block(nn.Module):
    """Residual layer that the condition scales, shifts and gates."""

    def __init__(self, width: int, condition_size: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(width, elementwise_affine=False)
        self.inner = nn.Linear(width, width)
        self.outer = nn.Linear(width, width)
        self.modulation = nn.Linear(condition_size, 3 * width)
        nn.init.zeros_(self.modulation.weight)
        nn.init.zeros_(self.modulation.bias)

    def modulations(self, condition: Tensor) -> Modulation:
        """Return scale, shift and gate of the block under conditions (B, C)."""
        # Three products with their biases. Splitting the result of a single product took
        # onnxruntime longer than the product.
        weights, (scale_bias, shift_bias, gate_bias) = (
            self.modulation.weight.chunk(3),
            self.modulation.bias.chunk(3),
        )
        biases = (1 + scale_bias, shift_bias, 1 + gate_bias)
        return Modulation(
            *(
                nn.functional.linear(condition, weight, bias)
                for weight, bias in zip(weights, biases, strict=True)
            )
        )

    def forward(self, hidden: Tensor, by: Modulation) -> Tensor:
        inner = nn.functional.silu(self.inner(self.norm(hidden) * by.scale + by.shift))
        result: Tensor = hidden + by.gate * self.outer(inner)
        return result


class FlowNetwork(nn.Module):
    """Velocity of the flow at a point, a time and a condition.

    Parameters
    ----------
    n_actions : int
    settings : FlowSettings
    traits : sequence of sequences of str
        Traits that each action shares with others, so that an action with three clips learns from
        similar ones. Empty: no action shares anything.
    """

    frequencies: Tensor
    has_trait: Tensor

    def __init__(
        self, n_actions: int, settings: FlowSettings, traits: Sequence[Sequence[str]] = ()
    ) -> None:
        super().__init__()
        width, shared = settings.width, settings.condition_size
        self.n_actions, self.settings = n_actions, settings
        self.register_buffer("frequencies", torch.exp(torch.linspace(0, 6, 32)))
        self.entry = nn.Linear(settings.code_size, width)
        self.time = nn.Linear(64, shared)
        self.action = nn.Embedding(n_actions + 1, shared)  # the last entry is "no action"
        names = sorted({trait for own in traits for trait in own})
        has = torch.zeros(n_actions + 1, len(names))
        for action, own in enumerate(traits):
            has[action, [names.index(trait) for trait in own]] = 1
        self.register_buffer("has_trait", has, persistent=False)
        self.trait = nn.Parameter(torch.randn(len(names), shared)) if names else None
        self.active = nn.Linear(64, shared)
        self.context = nn.Linear(settings.context_size + 1, shared)
        self.mix = nn.Linear(shared, shared)
        self.blocks = nn.ModuleList(_Block(width, shared) for _ in range(settings.blocks))
        self.exit = nn.Linear(width, settings.code_size)
        nn.init.zeros_(self.exit.weight)
        nn.init.zeros_(self.exit.bias)

    def _waves(self, value: Tensor) -> Tensor:
        angle = value[:, None] * self.frequencies
        return torch.cat([angle.sin(), angle.cos()], -1)

    def condition(
        self, actions: Tensor, active: Tensor, context: Tensor, has_context: Tensor
    ) -> Tensor:
        """Return the condition (B, W) of the velocity, from everything except point and time.

        Parameters
        ----------
        actions : (B,) int64
            `n_actions` for no action.
        active : (B,)
            Share of the window before the motion ends and its last pose is held, in (0, 1].
        context : (B, C)
            Code of the frames that are continued.
        has_context : (B,)
            1 if `context` is used, 0 if the window starts a motion.
        """
        known = torch.cat([context * has_context[:, None], has_context[:, None]], -1)
        action = self.action(actions)
        if self.trait is not None:
            action = action + self.has_trait[actions] @ self.trait
        result: Tensor = action + self.active(self._waves(active)) + self.context(known)
        return result

    def modulations(self, time: Tensor, condition: Tensor) -> list[Modulation]:
        """Return the modulation of each block at times (B,) under conditions (B, C)."""
        inner: Tensor = self.time(self._waves(time)) + condition
        shared = nn.functional.silu(self.mix(nn.functional.silu(inner)))
        blocks: list[_Block] = list(self.blocks)  # type: ignore[arg-type]
        return [block.modulations(shared) for block in blocks]

    def velocity(self, point: Tensor, modulations: Sequence[Modulation]) -> Tensor:
        """Velocity (B, D) at point (B, D) under `modulations`."""
        hidden = self.entry(point)
        for block, by in zip(self.blocks, modulations, strict=True):
            hidden = block(hidden, by)
        velocity: Tensor = self.exit(hidden)
        return velocity

    def forward(self, point: Tensor, time: Tensor, condition: Tensor) -> Tensor:
        """Velocity (B, D) at point (B, D) and time (B,) under a `condition` (B, C)."""
        return self.velocity(point, self.modulations(time, condition))

    def integrate(
        self,
        noise: Tensor,
        condition: Tensor,
        without: Tensor,
        *,
        steps: int,
        guidance: float = 1.0,
        guided_until: float = 1.0,
        steer: Callable[[Tensor], Tensor] | None = None,
    ) -> Tensor:
        """Integrate the flow from noise (B, D) at time 0 to codes at time 1.

        It uses the second-order Adams-Bashforth method: a step extrapolates from the last two
        velocities, and needs one evaluation of the network. The first is a midpoint step with two
        evaluations.

        A guided velocity is moved away from the velocity without the action (classifier-free
        guidance, Ho and Salimans 2022), which takes two evaluations side by side.

        Parameters
        ----------
        noise : (B, D)
        condition, without : (B, C)
            With the action and without it.
        steps : int
        guidance : float
            1 for none.
        guided_until : float
            Steps that start at this time or later are not guided. The action is determined early,
            and later guidance only reduces variety (Kynkäänniemi et al. 2024).
        steer : callable or None
            Moves codes (B, D) toward the constraints. It is applied to the predicted final code at
            every evaluation, and to the result.
        """
        starts = [step / steps for step in range(steps)]
        times = [0.0, 0.5 / steps, *starts[1:]]
        guided = [guidance != 1 and start < guided_until for start in (0.0, *starts)]
        # times and conditions are known in advance: one product for all evaluations instead of one
        # for each
        known = [
            part for push in guided for part in ((condition, without) if push else (condition,))
        ]
        counts = [1 + push for push in guided]
        each = (
            noise.new_tensor(np.repeat(times, counts).tolist())[:, None]
            .expand(-1, noise.shape[0])
            .flatten()
        )
        blocks = [
            [torch.split(part.reshape(len(known), -1, part.shape[-1]), counts) for part in by]
            for by in self.modulations(each, torch.cat(known))
        ]

        def slope(evaluation: int, point: Tensor) -> Tensor:
            velocity = unsteered(evaluation, point)
            if steer is None:
                return velocity
            left = 1 - times[evaluation]
            return (steer(point + left * velocity) - point) / left

        def unsteered(evaluation: int, point: Tensor) -> Tensor:
            chosen = [
                Modulation(*(part[evaluation].flatten(0, 1) for part in block)) for block in blocks
            ]
            if not guided[evaluation]:
                return self.velocity(point, chosen)
            pushed, free = (
                self.velocity(torch.cat([point, point]), chosen)
                .reshape(2, -1, point.shape[1])
                .unbind()
            )
            return free + guidance * (pushed - free)

        before = slope(0, noise)
        point = noise + slope(1, noise + before * (0.5 / steps)) / steps
        for evaluation in range(2, steps + 1):
            velocity = slope(evaluation, point)
            point, before = point + (1.5 * velocity - 0.5 * before) / steps, velocity
        return point if steer is None else steer(point)


@dataclass
class FlowModel:
    """A trained flow with its codec."""

    network: FlowNetwork
    codec: WindowCodec
