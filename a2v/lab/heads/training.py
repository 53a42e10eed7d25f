"""Train the network that completes heads."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from a2v.io import atomic_path
from a2v.lab.heads.charts import HeadCharts
from a2v.lab.heads.imitated import TARGETS, HeadImitator
from a2v.lab.heads.networks import HeadCompleter
from a2v.reconstruction.coloring.completing import CHANNELS
from a2v.types import Progress


@dataclass(frozen=True)
class HeadTraining:
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
    seed : int
    """

    iterations: int = 4000
    batch: int = 16
    fresh: int = 4
    kept: int = 3000
    learning_rate: float = 2e-3
    seed: int = 0


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


def train_heads(
    charts: HeadCharts,
    folder: str | os.PathLike[str],
    settings: HeadTraining,
    *,
    progress: Progress | None = None,
) -> HeadCompleter:
    """Train; a stopped training goes on from ``checkpoint.pt`` in `folder`."""
    torch.manual_seed(settings.seed)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    network = HeadCompleter()
    optimizer = torch.optim.AdamW(network.parameters(), settings.learning_rate, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.LambdaLR(
        optimizer, lambda step: 0.5 * (1 + math.cos(math.pi * min(step / settings.iterations, 1)))
    )
    first, path = 0, folder / "checkpoint.pt"
    if path.exists():
        state = torch.load(path, weights_only=True)
        network.load_state_dict(state["network"])
        optimizer.load_state_dict(state["optimizer"])
        first = int(state["iteration"])
        for _ in range(first):
            schedule.step()
    generator = np.random.default_rng([settings.seed, first])
    imitator = HeadImitator(charts)
    inputs = torch.zeros((settings.kept, CHANNELS, 96, 128), dtype=torch.float16)
    targets = torch.zeros((settings.kept, TARGETS, 96, 128), dtype=torch.float16)
    count = 0

    def add() -> int:
        nonlocal count
        place = count % settings.kept
        made, target = imitator.draw(generator)
        inputs[place], targets[place] = torch.from_numpy(made), torch.from_numpy(target)
        count += 1
        return place

    while count < min(300, settings.kept):
        add()
    network.train()
    mean: dict[str, float] = {}
    for iteration in range(first, settings.iterations):
        new = [add() for _ in range(settings.fresh)]
        old = generator.integers(min(count, settings.kept), size=settings.batch - settings.fresh)
        index = torch.tensor([*new, *old])
        chart, target = inputs[index].float(), targets[index].float()
        parts = losses(network(chart), target, chart)
        loss = torch.stack(list(parts.values())).sum()
        optimizer.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        schedule.step()
        for name, value in parts.items():
            mean[name] = 0.99 * mean.get(name, float(value.detach())) + 0.01 * float(value.detach())
        if (iteration + 1) % 100 == 0:
            with open(folder / "losses.txt", "a", encoding="utf-8") as log:
                values = " ".join(f"{name} {value:.4f}" for name, value in mean.items())
                log.write(f"{iteration + 1} {values}\n")
        if (iteration + 1) % 500 == 0 or iteration + 1 == settings.iterations:
            with atomic_path(path) as temporary:
                torch.save(
                    {
                        "network": network.state_dict(),
                        "optimizer": optimizer.state_dict(),
                        "iteration": iteration + 1,
                    },
                    temporary,
                )
        if progress is not None:
            progress(iteration + 1, settings.iterations)
    return network.eval()
