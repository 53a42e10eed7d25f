"""Training of the body map on quick views. A stopped run resumes from its checkpoint, on a CPU or
with CUDA."""

from __future__ import annotations

import copy
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from a2v.errors import InputError
from a2v.lab.bodymap.examples import QuickViews, make_example, stack
from a2v.lab.bodymap.losses import errors, losses, tensors
from a2v.lab.bodymap.networks import BodyMapNetwork
from a2v.lab.checkpoints import read_checkpoint
from a2v.lab.runs import RateSchedule, Run, RunSettings, Training, carry_on, identity
from a2v.lab.untracing import calibrate, fill, read_weights
from a2v.perception.bodymap import FILE as SHIPPED

FILE = "checkpoint.pt"
CALIBRATION = 16
"""Number of batches by which normalizations of restored networks are calibrated."""
_AT_ONCE = 32
"""Number of views that are measured at a time."""


@dataclass(frozen=True)
class BodyMapSettings(RunSettings):
    """Settings of the training of the body map.

    Attributes
    ----------
    iterations : int
        Number of iterations.
    batch_size : int
        Number of views per iteration.
    learning_rate : float
        Peak learning rate of AdamW. It follows half a cosine after a short warm-up.
    weight_decay : float
        Weight decay of AdamW.
    backbone_share : float
        Learning rate of BlazePose's own weights as a share of the others'.
    average : float
        Decay of the moving average of the weights per iteration. The average is exported.
    half : bool
        Use bfloat16 for the operations that torch's autocast considers safe.
    measured : int
        Number of validation views on which each row of the log is measured.
    initial : str
        Start from the averaged weights of a run's folder, or from a ``bodymap.onnx``. "shipped" is
        the file of a2v, "" starts from BlazePose's weights.
    """

    iterations: int = 12_000
    batch_size: int = 16
    learning_rate: float = 1e-3
    weight_decay: float = 0.02
    backbone_share: float = 0.15
    average: float = 0.998
    half: bool = True
    measured: int = 192
    initial: str = ""
    log_every: int = 250

    def __post_init__(self) -> None:
        if min(self.iterations, self.batch_size, self.log_every) < 1:
            raise InputError("iterations, batch_size and log_every must be positive")
        if not 0 <= self.average < 1 or min(self.backbone_share, self.measured) < 0:
            raise InputError(
                "average must be from 0 to below 1, and backbone_share and measured at least 0"
            )


def initial_folder(initial: str) -> Path:
    """Return the folder that `BodyMapSettings.initial` names."""
    return SHIPPED.parent if initial == "shipped" else Path(initial)


def stored_weights(folder: str | os.PathLike[str]) -> dict[str, np.ndarray]:
    """Read the weights in a folder's ``bodymap.onnx``, for `a2v.lab.untracing.fill`.

    Raises
    ------
    InputError
        There is no such file.
    """
    return read_weights(Path(folder) / SHIPPED.name, {"body.": ""})


def load_network(folder: str | os.PathLike[str]) -> tuple[BodyMapNetwork, dict[str, Any]]:
    """Load the averaged network of a run's folder for inference, and facts on its training.

    Raises
    ------
    InputError
        The folder has no trained network.
    """
    content = read_checkpoint(Path(folder) / FILE, ("average", "iteration"))
    network = BodyMapNetwork()
    network.load_state_dict(content["average"])
    facts = {
        "training": content["made_with"],
        "iterations": content["iteration"],
        "seconds": round(content["seconds"]),
    }
    return network.eval(), facts


class BodyMapTraining(Training):
    """A training in progress.

    Attributes
    ----------
    model, average : BodyMapNetwork
        The trained network, and the moving average of its weights.
    generator : numpy Generator
        Draws views and their changes.
    """

    STORED = ("model", "average", "generator")

    def __init__(self, views: str | os.PathLike[str], settings: BodyMapSettings) -> None:
        super().__init__()
        self.settings, self.device = settings, settings.claim()
        torch.manual_seed(settings.seed)
        self.model: BodyMapNetwork = BodyMapNetwork().to(
            self.device, memory_format=torch.channels_last
        )  # type: ignore[call-overload]
        self.average: BodyMapNetwork = copy.deepcopy(self.model)
        self.average.eval().requires_grad_(False)
        backbone = [weight for weight in self.model.backbone.parameters() if weight.requires_grad]
        own = [
            weight
            for name, weight in self.model.named_parameters()
            if not name.startswith("backbone.")
        ]
        groups: list[dict[str, Any]] = [
            {"params": own},
            {"params": backbone, "share": settings.backbone_share},
        ]
        self.optimizer = torch.optim.AdamW(
            groups, settings.learning_rate, weight_decay=settings.weight_decay
        )
        warm_up = max(1, min(300, settings.iterations // 10))
        self.rate = RateSchedule(
            peak=settings.learning_rate, span=settings.iterations, floor=0.01, warm_up=warm_up
        )
        self.generator = np.random.default_rng(settings.seed)
        self.views = QuickViews(views, "training")
        self.held_out = QuickViews(views, "validation") if settings.measured else None

    def begin(self) -> None:
        """Begin with another run's weights if the settings name one."""
        if not self.settings.initial:
            return
        folder = initial_folder(self.settings.initial)
        if (folder / FILE).is_file():
            network, _ = load_network(folder)
            self.model.load_state_dict(network.state_dict())
        else:
            fill(self.model, stored_weights(folder), otherwise="leave initial out")
            calibrate(
                self.model, (self._batch()["picture"] for _ in range(CALIBRATION)), self.model.look
            )
        self.average.load_state_dict(self.model.state_dict())

    def step(self) -> dict[str, float]:
        """Run one iteration; returns the number of available views, and the weighted losses."""
        if self.iteration % 200 == 0:
            self.views.refresh()
        true = self._batch()
        self.model.train()
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.settings.half):
            seen = self.model.look(true["picture"])
        found = losses(self.model.conclude(seen.float()), true)
        self.descend(torch.stack(list(found.values())).sum(), largest_gradient=2.0)
        self._take_average()
        return {"views": float(len(self.views))} | {
            name: float(value.detach()) for name, value in found.items()
        }

    def _batch(self) -> dict[str, Tensor]:
        """Return the examples of an iteration."""
        chosen = self.generator.integers(0, len(self.views), self.settings.batch_size)
        return tensors(
            stack([make_example(self.views.view(int(index)), self.generator) for index in chosen]),
            self.device,
        )

    @torch.no_grad()
    def _take_average(self) -> None:
        """Move the average toward the weights, quickly at first."""
        done = self.iteration + 1
        kept = min(self.settings.average, done / (done + 100))
        for averaged, own in zip(
            self.average.state_dict().values(), self.model.state_dict().values(), strict=True
        ):
            if averaged.dtype.is_floating_point:
                averaged.lerp_(own, 1 - kept)
            else:
                averaged.copy_(own)

    @torch.no_grad()
    def measure(self) -> dict[str, float]:
        """Return errors of the averaged network on people, clothes and clips that are not in
        training data; see `errors`."""
        if self.held_out is None:
            return {}
        found: dict[str, list[Tensor]] = {}
        count = min(self.settings.measured, len(self.held_out))
        for start in range(0, count, _AT_ONCE):
            views = [
                self.held_out.view(index) for index in range(start, min(start + _AT_ONCE, count))
            ]
            true = tensors(stack([make_example(view) for view in views]), self.device)
            for name, values in errors(self.average(true["picture"]), true).items():
                found.setdefault(name, []).append(values)
        return {
            f"held_out_{name}": float(torch.cat(values).nanmean()) for name, values in found.items()
        }

    def content(self) -> dict[str, Any]:
        """Return the weights, their average, and the generator's state."""
        return {
            "model": self.model.state_dict(),
            "average": self.average.state_dict(),
            "generator": self.generator.bit_generator.state,
        }

    def restore(self, content: Mapping[str, Any]) -> None:
        """See `Training`."""
        self.model.load_state_dict(content["model"])
        self.average.load_state_dict(content["average"])
        self.generator.bit_generator.state = content["generator"]


def train_bodymap(
    views: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    settings: BodyMapSettings | None = None,
    on_log: Callable[[dict[str, float]], None] | None = None,
) -> BodyMapNetwork:
    """Train the body map in `folder`, or resume its training; returns the averaged network.

    It writes ``checkpoint.pt`` (every few minutes, at the end and on Ctrl-C) and ``log.csv``.

    Parameters
    ----------
    views : path
        Folder of `a2v.lab.studio.quick.dataset.write_quick_views`. Views that are added during the
        training are used, too.
    folder : path
        Folder of the run.
    on_log : callable
        Called with the mean losses since the last call and the held-out errors, every `log_every`
        iterations.

    Raises
    ------
    InputError
        No views, other settings than those of the checkpoint, an initial run without weights, or a
        training that diverges.
    """
    settings = settings or BodyMapSettings()
    run = Run(
        Path(folder) / FILE, identity(settings, digest="quick views"), settings.checkpoint_seconds
    )
    training = BodyMapTraining(views, settings)
    carry_on(training, run, settings, iterations=settings.iterations, on_log=on_log)
    return training.average
