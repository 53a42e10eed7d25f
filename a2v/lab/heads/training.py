"""Train the network that completes heads."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from a2v.body.head_chart import HEIGHT, WIDTH
from a2v.lab.heads.charts import HeadCharts
from a2v.lab.heads.imitated import TARGETS, HeadImitator
from a2v.lab.heads.networks import HeadCompleter
from a2v.lab.runs import RateSchedule, Run, RunSettings, Training, carry_on, identity
from a2v.reconstruction.coloring.completing import CHANNELS

_FIRST = 300
"""Number of examples that are drawn before the first iteration."""


@dataclass(frozen=True)
class HeadSettings(RunSettings):
    """Settings of the training.

    Attributes
    ----------
    iterations, batch : int
    fresh : int
        Number of new examples in an iteration; the others of a batch are drawn from the last
        `kept` ones.
    kept : int
    learning_rate : float
        At the beginning; it falls to zero along a cosine.
    """

    iterations: int = 4000
    batch: int = 16
    fresh: int = 4
    kept: int = 3000
    learning_rate: float = 2e-3
    threads: int = 1


def losses(found: Tensor, target: Tensor, chart: Tensor) -> dict[str, Tensor]:
    """Losses of outputs (B, OUTPUTS, H, W) beside targets (B, TARGETS, H, W) of input charts."""
    shown, trust, bare = chart[:, 5:6], chart[:, 3:4], target[:, 10:11]

    def mean(values: Tensor, weight: Tensor) -> Tensor:
        return (values * weight).sum() / (weight.sum() * values.shape[1] + 1)

    logits = functional.binary_cross_entropy_with_logits(
        found[:, 6:9], target[:, 6:9], reduction="none"
    )
    return {
        "outer": mean((found[:, :3] - target[:, :3]).abs(), shown),
        "skin": mean((found[:, 3:6] - target[:, 3:6]).abs(), bare),
        "cover": 0.1 * mean(logits[:, :1], shown),
        "keep": 0.1 * mean(logits[:, 1:2], trust),
        "keep_skin": 0.05 * mean(logits[:, 2:3], trust * bare),
        "offset": 0.05 * mean((found[:, 9:] - target[:, 9:10]).abs(), shown),
    }


class HeadTraining(Training):
    """The training in progress; examples are drawn while it runs."""

    STORED = ("network",)

    def __init__(self, charts: HeadCharts, settings: HeadSettings) -> None:
        super().__init__()
        self.settings, self.device = settings, settings.claim()
        torch.manual_seed(settings.seed)
        self.network = HeadCompleter().train().to(self.device)
        self.optimizer = torch.optim.AdamW(
            self.network.parameters(), settings.learning_rate, weight_decay=1e-4
        )
        self.rate = RateSchedule(peak=settings.learning_rate, span=settings.iterations, floor=0.0)
        self._imitator = HeadImitator(charts)
        self._inputs, self._targets = (
            torch.zeros((settings.kept, channels, HEIGHT, WIDTH), dtype=torch.float16)
            for channels in (CHANNELS, TARGETS)
        )

    def begin(self) -> None:
        """Draw the first examples."""
        self._begin_at(0)

    def _begin_at(self, iteration: int) -> None:
        self._generator, self._drawn = np.random.default_rng([self.settings.seed, iteration]), 0
        for _ in range(min(_FIRST, self.settings.kept)):
            self._draw()

    def _draw(self) -> int:
        """Draw an example in place of the oldest one; returns its place."""
        place = self._drawn % self.settings.kept
        chart, target = map(torch.from_numpy, self._imitator.draw(self._generator))
        self._inputs[place], self._targets[place] = chart, target
        self._drawn += 1
        return place

    def step(self) -> dict[str, float]:
        """Run one iteration; returns the weighted losses."""
        settings = self.settings
        new = [self._draw() for _ in range(settings.fresh)]
        old = self._generator.integers(
            min(self._drawn, settings.kept), size=settings.batch - settings.fresh
        )
        index = torch.tensor([*new, *old])
        chart, target = (
            drawn[index].float().to(self.device) for drawn in (self._inputs, self._targets)
        )
        found = losses(self.network(chart), target, chart)
        self.descend(torch.stack(list(found.values())).sum(), largest_gradient=1.0)
        return {name: float(value.detach()) for name, value in found.items()}

    def content(self) -> dict[str, Any]:
        """The weights."""
        return {"network": self.network.state_dict()}

    def restore(self, content: Mapping[str, Any]) -> None:
        """Take up the weights; examples are drawn anew."""
        self.network.load_state_dict(content["network"])
        self._begin_at(content["iteration"])


def train_heads(
    charts: HeadCharts,
    folder: str | os.PathLike[str],
    settings: HeadSettings,
    *,
    on_log: Callable[[dict[str, float]], None] | None = None,
) -> HeadCompleter:
    """Train; a stopped training goes on from ``checkpoint.pt`` in `folder`.

    Raises
    ------
    InputError
        See `carry_on`.
    """
    training = HeadTraining(charts, settings)
    digest = hashlib.sha256(charts.colors.tobytes()).hexdigest()
    made_with = identity(settings, digest=digest)
    run = Run(Path(folder) / "checkpoint.pt", made_with, settings.checkpoint_seconds)
    carry_on(training, run, settings, iterations=settings.iterations, on_log=on_log)
    return training.network.cpu().eval()
