"""Training of the networks of the implicit surface, stage by stage: shape, then detail and color
on top of it.

A stopped run resumes from its checkpoint, on a CPU or with CUDA.
"""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from torch import Tensor, nn

from a2v.errors import InputError
from a2v.lab.checkpoints import read_checkpoint
from a2v.lab.runs import RateSchedule, Run, RunSettings, Training, carry_on, identity
from a2v.lab.studio.view import list_views
from a2v.lab.surface.batches import (
    Example,
    Prepared,
    ViewReader,
    align_example,
    make_example,
    stack,
)
from a2v.lab.surface.losses import depth_loss, distance_loss, normal_loss
from a2v.lab.surface.networks import (
    CoarseField,
    FineEncoder,
    FineField,
    MapEncoder,
    NetworkSettings,
    Painter,
    point_values,
)
from a2v.lab.surface.restore import restore_networks
from a2v.lab.untracing import calibrate
from a2v.reconstruction.implicit.inputs import FRAME
from a2v.reconstruction.implicit.model import MAPS_FILE
from a2v.sessions import WEIGHTS

FILE = "checkpoint.pt"
Stage = Literal["shape", "detail", "color"]
STAGES: tuple[Stage, ...] = ("shape", "detail", "color")
"""The stages in the order of their training; the later two depend on the first."""
CALIBRATION = 16
"""Number of batches by which normalizations of restored networks are calibrated."""


@dataclass(frozen=True)
class ReconstructionSettings(RunSettings):
    """Settings of the training of a stage.

    Attributes
    ----------
    iterations : int
        Number of iterations.
    batch_size : int
        Number of views per iteration.
    points : int
        Number of points of each view.
    learning_rate : float
        Learning rate of AdamW, after a short warm-up along half a cosine.
    weight_decay : float
        Weight decay of AdamW.
    crop : int
        Side of the part of the frame that the detail stage sees, pixels; a multiple of 8.
    half : bool
        Use bfloat16 for the operations that torch's autocast considers safe: two to three times the
        speed on recent CPUs.
    initial : str
        Start from the networks of another run's folder or of a model's ONNX files, to continue with
        more views or another rate. "shipped" means those of a2v, "" random
        weights.
    """

    iterations: int = 10_000
    batch_size: int = 4
    points: int = 2048
    learning_rate: float = 1e-3
    weight_decay: float = 1e-4
    crop: int = 512
    half: bool = True
    initial: str = ""

    def __post_init__(self) -> None:
        if min(self.iterations, self.batch_size, self.points) < 1:
            raise InputError("iterations, batch_size and points must be positive")
        if not 64 <= self.crop <= FRAME or self.crop % 8:
            raise InputError(f"crop is {self.crop}; expected a multiple of 8 from 64 to {FRAME}")


class Shape(nn.Module):
    """The whole person's networks: maps and coarse field."""

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__()
        self.encoder, self.field = MapEncoder(settings), CoarseField(settings)


class Detail(nn.Module):
    """The fine level's networks."""

    def __init__(self, settings: NetworkSettings) -> None:
        super().__init__()
        self.encoder, self.field = FineEncoder(settings), FineField(settings)


def make_networks(stage: Stage, settings: NetworkSettings) -> nn.Module:
    """Make fresh networks of a stage."""
    kinds: Mapping[str, Callable[[NetworkSettings], nn.Module]] = {
        "shape": Shape,
        "detail": Detail,
        "color": Painter,
    }
    return kinds[stage](settings).to(memory_format=torch.channels_last)  # type: ignore[call-overload, no-any-return]


def load_networks(folder: str | os.PathLike[str], stage: Stage) -> nn.Module:
    """Load the trained networks of a stage from a run's folder for inference.

    Raises
    ------
    InputError
        The stage has not been trained in this folder.
    """
    settings, weights = _read_networks(folder, stage)
    network = make_networks(stage, settings)
    network.load_state_dict(weights)
    return network.eval()


def _read_networks(
    folder: str | os.PathLike[str], stage: Stage
) -> tuple[NetworkSettings, dict[str, Tensor]]:
    """Read sizes and weights of a stage's networks in a run's folder."""
    content = read_checkpoint(Path(folder) / stage / FILE, ("model", "network"))
    return NetworkSettings(**content["network"]), content["model"]


class StageTraining(Training):
    """A stage's training in progress.

    Attributes
    ----------
    model : Module
    shape : Shape or None
        The trained first stage, for the later two.
    generator : numpy Generator
        Draws views and points.
    """

    STORED = ("model", "generator")

    def __init__(
        self,
        stage: Stage,
        *,
        views: str | os.PathLike[str],
        folder: str | os.PathLike[str],
        network: NetworkSettings,
        settings: ReconstructionSettings,
    ) -> None:
        super().__init__()
        self.stage, self.views, self.network, self.settings, self.device = (
            stage,
            views,
            network,
            settings,
            settings.claim(),
        )
        torch.manual_seed(settings.seed)
        self.shape = (
            None
            if stage == "shape"
            else load_networks(folder, "shape").to(self.device).requires_grad_(False)
        )
        self.model = make_networks(stage, network).to(self.device)
        self.optimizer = torch.optim.AdamW(
            self.model.parameters(), settings.learning_rate, weight_decay=settings.weight_decay
        )
        self.rate = RateSchedule(
            peak=settings.learning_rate, span=settings.iterations, floor=0.01, warm_up=200
        )
        self.generator = np.random.default_rng(settings.seed)
        self.files: list[Path] = []
        self.reader = ViewReader()

    def begin(self) -> None:
        """Begin with another run's networks if the settings name one."""
        if not self.settings.initial:
            return
        folder = WEIGHTS if self.settings.initial == "shipped" else Path(self.settings.initial)
        if (folder / MAPS_FILE).is_file():
            restore_networks(self.model, folder, self.stage)
            calibrate(self.model, (self._batch() for _ in range(CALIBRATION)), self._losses)
            return
        found, weights = _read_networks(self.settings.initial, self.stage)
        if found != self.network:
            raise InputError(
                f"{self.settings.initial} has other networks ({found}); give the same --network "
                "settings, or leave initial out"
            )
        self.model.load_state_dict(weights)

    def step(self) -> dict[str, float]:
        """Run one iteration; returns the number of available views, and the weighted losses."""
        batch = self._batch()
        self.model.train()
        losses = self._losses(batch)
        self.descend(torch.stack(list(losses.values())).sum(), largest_gradient=1.0)
        return {"views": float(len(self.files))} | {
            name: float(value.detach()) for name, value in losses.items()
        }

    def _batch(self) -> tuple[list[Prepared], list[Example]]:
        """Return views and examples of an iteration."""
        if self.iteration % 200 == 0 or not self.files:
            self.files = list_views(self.views, "training")
        settings, generator = self.settings, self.generator
        chosen = generator.integers(0, len(self.files), settings.batch_size)
        crop = settings.crop if self.stage == "detail" else 0
        views = [self.reader(self.files[i]) for i in chosen]
        return views, [
            make_example(one, generator, settings.points, colors=self.stage == "color", crop=crop)
            for one in views
        ]

    def _losses(self, batch: tuple[list[Prepared], list[Example]]) -> dict[str, Tensor]:
        """Return the weighted losses of a batch."""
        views, examples = batch
        return _losses(
            self.model,
            self.shape,
            stack(examples),
            functools.partial(_align, views, examples),
            self.settings,
            self.device,
        )

    def content(self) -> dict[str, Any]:
        """Return the weights, the sizes of the networks, and the generator's state."""
        return {
            "model": self.model.state_dict(),
            "generator": self.generator.bit_generator.state,
            "network": dataclasses.asdict(self.network),
        }

    def restore(self, content: Mapping[str, Any]) -> None:
        """See `Training`."""
        self.model.load_state_dict(content["model"])
        self.generator.bit_generator.state = content["generator"]


def train_reconstruction(
    stage: Stage,
    views: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    network: NetworkSettings | None = None,
    settings: ReconstructionSettings | None = None,
    on_log: Callable[[dict[str, float]], None] | None = None,
) -> nn.Module:
    """Train a stage in `folder`, or resume its training.

    It writes ``<stage>/checkpoint.pt`` (every few minutes, at the end and on Ctrl-C) and
    ``<stage>/log.csv``.

    Parameters
    ----------
    stage : "shape", "detail" or "color"
    views : path
        Folder of ``a2v studio``. Views that are added during the training are used, too.
    folder : path
        Folder of the run. "detail" and "color" need its "shape".
    on_log : callable
        Called with the mean losses since the last call, every `log_every` iterations.

    Raises
    ------
    InputError
        No views, an unknown stage, no trained shape, other settings than those of the checkpoint,
        an initial run that lacks the stage or has other networks, or a training that diverges.
    """
    if stage not in STAGES:
        raise InputError(f"unknown stage '{stage}'; choose from {', '.join(STAGES)}")
    network, settings = network or NetworkSettings(), settings or ReconstructionSettings()
    run = Run(
        Path(folder) / stage / FILE,
        identity(network, settings, digest=stage),
        settings.checkpoint_seconds,
    )
    training = StageTraining(stage, views=views, folder=folder, network=network, settings=settings)
    carry_on(training, run, settings, iterations=settings.iterations, on_log=on_log)
    return training.model.eval()


def _align(
    views: Sequence[Prepared], examples: Sequence[Example], maps: Tensor
) -> dict[str, Tensor]:
    """Apply `align_example` to a batch with maps (B, 8, 256, 256)."""
    depths = maps[:, 6:].detach().float().cpu().numpy()
    aligned = [
        align_example(view, example, depth)
        for view, example, depth in zip(views, examples, depths, strict=True)
    ]
    return {
        name: torch.from_numpy(np.stack([one[name] for one in aligned])).to(maps.device)
        for name in aligned[0]
    }


def _losses(
    model: nn.Module,
    shape: nn.Module | None,
    batch: Example,
    align: Callable[[Tensor], dict[str, Tensor]],
    settings: ReconstructionSettings,
    device: torch.device,
) -> dict[str, Tensor]:
    """Return the weighted losses of a batch."""

    def tensor(values: np.ndarray) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(values)).to(device)

    photo, guide = tensor(batch.photo), tensor(batch.guide)
    points = {name: tensor(values) for name, values in batch.points.items()}
    place = points["place"]

    def values_of(maps: Tensor) -> Tensor:
        return point_values(maps, guide, place, **align(maps))

    with torch.autocast(device.type, torch.bfloat16, enabled=settings.half):
        if shape is None:
            assert isinstance(model, Shape)
            features, maps = model.encoder(photo, guide)
            # the field follows the maps, right or wrong: its errors must not change them
            distance, _ = model.field(features, values_of(maps.detach()), place)
            return {
                "distance": distance_loss(distance, points["distance"]),
                "normals": normal_loss(maps[:, :6], tensor(batch.normals)),
                "depth": depth_loss(maps[:, 6:], tensor(batch.depth)),
            }
        assert isinstance(shape, Shape)
        with torch.no_grad():
            features, maps = shape.encoder(photo, guide)
            values = values_of(maps)
        if isinstance(model, Painter):
            colors = model(
                model.features(photo, guide, maps), photo, values, points["normals"], place
            )
            return {"color": (colors - points["colors"]).abs().mean()}
        assert isinstance(model, Detail)
        with torch.no_grad():
            coarse, context = shape.field(features, values, place)
        crop, corners = settings.crop, batch.part["corner"].astype(int) // 4
        around = torch.stack(
            [maps[i, :, v : v + crop // 4, u : u + crop // 4] for i, (u, v) in enumerate(corners)]
        )  # the maps have a quarter of the frame's pixels
        within = ((place + 1) / 2 * FRAME - tensor(batch.part["corner"])[:, None]) * 2 / crop - 1
        fine = model.encoder(tensor(batch.part["photo"]), around)
        distance = model.field(fine, within, coarse, context, values)
        kept = (within.abs() < 0.9).all(dim=-1)
        return {
            "distance": distance_loss(distance[kept], points["distance"][kept]),
            "normals": normal_loss(fine[:, :6], tensor(batch.part["normals"])),
        }
