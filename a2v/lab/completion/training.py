"""Training of the completion of hidden colors on a CPU; a stopped run resumes from its
checkpoint."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from torch import Tensor

from a2v.lab.checkpoints import read_checkpoint
from a2v.lab.completion.layout import COLUMNS, ROWS, skin_sheets
from a2v.lab.completion.networks import Completion, CompletionSettings, filled_up
from a2v.lab.runs import RateSchedule, Run, RunSettings, Training, carry_on, identity
from a2v.types import ByteArray, FloatArray

FILE = "checkpoint.pt"
_WAIST = (48, 68)
"""Rows of the halved sheets between which clothes of two people are joined."""
_LEGS = 22
"""Largest distance in columns from the middle of the legs."""


@dataclass(frozen=True)
class CompletionTraining(RunSettings):
    """Settings of the training.

    Attributes
    ----------
    iterations : int
    batch_size : int
        Number of people per iteration.
    learning_rate : float
        Of AdamW, after a short warm-up along half a cosine.
    half : bool
        Use bfloat16 for the operations that torch's autocast considers safe.
    """

    iterations: int = 3000
    batch_size: int = 8
    learning_rate: float = 1.5e-3
    half: bool = True


def known_maps() -> FloatArray:
    """Maps (6, H / 2, W / 2) of the layout: the body on both sheets, columns from the middle and
    rows, and depths."""
    sheets = skin_sheets()[0]
    rows, columns = np.meshgrid(
        np.linspace(-1, 1, ROWS // 2), np.linspace(-1, 1, COLUMNS // 2), indexing="ij"
    )
    size = (COLUMNS // 2, ROWS // 2)
    small = [
        cv2.resize(image.astype(np.float32), size, interpolation=cv2.INTER_AREA)
        for image in (*sheets.filled, *(5 * sheets.depth))
    ]
    return np.asarray(np.stack([*small[:2], np.abs(columns), rows, *small[2:]]), np.float32)


def lab_of(colors: ByteArray) -> FloatArray:
    """CIELAB / 100 of sRGB colors (2, H, W, 3); (2, 3, H, W) float32."""
    lab = [cv2.cvtColor(one.astype(np.float32) / 255, cv2.COLOR_RGB2LAB) for one in colors]
    return np.asarray(np.stack(lab).transpose(0, 3, 1, 2) / 100, np.float32)


class Sheets:
    """The people of a split in a folder of `write_people`."""

    def __init__(self, folder: str | os.PathLike[str], split: str) -> None:
        """See the class."""
        parts = [np.load(path) for path in sorted(Path(folder).glob(f"{split}-*.npz"))]
        self.colors = np.concatenate([part["colors"] for part in parts])
        self.trust = np.concatenate([part["trust"] for part in parts])
        self.names = np.concatenate([part["names"] for part in parts])

    def drawn(self, generator: np.random.Generator) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Draw a person in a photo: its colors, the true colors (2, 3, H, W), and the trust (2, 1,
        H, W)."""
        one = int(generator.integers(len(self.colors)))
        colors = self.colors[one]
        if generator.random() < 0.35:
            colors = joined(
                colors, self.colors[int(generator.integers(len(self.colors)))], generator
            )
        other = one if generator.random() < 0.3 else int(generator.integers(len(self.colors)))
        trust = self.trust[other].astype(np.float32)[:, None] / 255
        true = lab_of(colors)
        if generator.random() < 0.5:
            true, trust = true[..., ::-1], trust[..., ::-1]
        true = _warped(true, generator)
        if generator.random() < 0.4:
            true = _other_hues(true, generator)
        photo = _in_light(true, generator)
        if generator.random() < 0.5:
            trust = _with_holes(trust, generator)
        return photo, true, np.ascontiguousarray(trust)


def joined(upper: ByteArray, lower: ByteArray, generator: np.random.Generator) -> ByteArray:
    """Give the person `upper` (2, H, W, 3) the legs and feet of another one."""
    height, width = upper.shape[1:3]
    row = int(generator.integers(*_WAIST))
    rows, columns = np.mgrid[:height, :width]
    legs = (rows >= row) & (np.abs(columns - width / 2 + 0.5) < _LEGS)
    return np.where(legs[None, ..., None], lower, upper)


def _coarse(generator: np.random.Generator, shape: tuple[int, int], cells: int) -> FloatArray:
    field = generator.standard_normal((cells, cells)).astype(np.float32)
    return np.asarray(cv2.resize(field, shape[::-1], interpolation=cv2.INTER_CUBIC))


def _warped(lab: FloatArray, generator: np.random.Generator) -> FloatArray:
    """Shift the colors by about a pixel, as errors of fits do."""
    height, width = lab.shape[-2:]
    columns, rows = np.meshgrid(np.arange(width), np.arange(height))
    result = []
    for one in lab:
        x = (columns + 0.8 * _coarse(generator, (height, width), 7)).astype(np.float32)
        y = (rows + 0.8 * _coarse(generator, (height, width), 7)).astype(np.float32)
        image = np.ascontiguousarray(one.transpose(1, 2, 0))
        result.append(cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE))
    return np.asarray(np.stack(result).transpose(0, 3, 1, 2))


def _other_hues(lab: FloatArray, generator: np.random.Generator) -> FloatArray:
    """Turn the hues of everything, so that no garment is learned by heart."""
    turn, strength = generator.uniform(0, 2 * np.pi), generator.uniform(0.5, 1.5)
    cosine, sine = strength * np.cos(turn), strength * np.sin(turn)
    result = lab.copy()
    result[:, 1] = cosine * lab[:, 1] - sine * lab[:, 2]
    result[:, 2] = sine * lab[:, 1] + cosine * lab[:, 2]
    return result


def _in_light(lab: FloatArray, generator: np.random.Generator) -> FloatArray:
    """Light the colors (2, 3, H, W) unevenly."""
    shape = (lab.shape[-2], lab.shape[-1])
    result = lab.copy()
    slope = generator.normal(0, 0.05) * np.linspace(-1, 1, shape[1])[None]
    for side in (0, 1):
        shade = 0.05 * _coarse(generator, shape, 5) + 0.025 * _coarse(generator, shape, 16) + slope
        result[side, 0] *= 1 + shade
        result[side] += 0.008 * generator.standard_normal((3, 1, 1))
    return result + 0.008 * generator.standard_normal(result.shape).astype(np.float32)


def _with_holes(trust: FloatArray, generator: np.random.Generator) -> FloatArray:
    """Hide a few more round places, as held things do."""
    result = trust.copy()
    height, width = trust.shape[-2:]
    rows, columns = np.mgrid[:height, :width]
    for _ in range(int(generator.integers(1, 4))):
        row, column, radius = (
            generator.integers(height),
            generator.integers(width),
            3 + 7 * generator.random(),
        )
        hole = (rows - row) ** 2 + (columns - column) ** 2 < radius**2
        result[..., hole] = 0
    return result


def losses(made: Tensor, true: Tensor, trust: Tensor, filled: Tensor) -> dict[str, Tensor]:
    """Mean absolute errors of colors and of their differences between neighbors; visible pixels
    count a tenth. `filled` is (2, H, W)."""
    weight = (filled[None, :, None] > 0.5).float() * (1 - 0.9 * trust)
    error = (made - true).abs()
    color = (weight * error).sum() / (3 * weight.sum())
    away = made - true
    sideways = (away[..., 1:] - away[..., :-1]).abs() * weight[..., 1:] * weight[..., :-1]
    along = (away[..., 1:, :] - away[..., :-1, :]).abs() * weight[..., 1:, :] * weight[..., :-1, :]
    return {"color": color, "detail": 0.5 * (sideways.sum() + along.sum()) / (3 * weight.sum())}


class CompletionRun(Training):
    """The training in progress."""

    STORED = ("model", "generator")

    def __init__(
        self,
        folder: str | os.PathLike[str],
        network: CompletionSettings,
        settings: CompletionTraining,
    ) -> None:
        super().__init__()
        self.settings, self.network, self.device = settings, network, settings.claim()
        torch.manual_seed(settings.seed)
        known = known_maps()
        self.model: Completion = Completion(network, known).to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        self.filled = torch.from_numpy(known[:2])
        self.optimizer = torch.optim.AdamW(
            self.model.parameters(), settings.learning_rate, weight_decay=1e-3
        )
        self.rate = RateSchedule(
            peak=settings.learning_rate, span=settings.iterations, floor=0.01, warm_up=100
        )
        self.generator = np.random.default_rng(settings.seed)
        self.people = Sheets(folder, "training")
        self.others = Sheets(folder, "validation")

    def step(self) -> dict[str, float]:
        """Run one iteration."""
        photo, true, trust = self._batch(self.people, self.generator, self.settings.batch_size)
        with torch.autocast("cpu", torch.bfloat16, enabled=self.settings.half):
            made = self.model.train()(photo, trust)
        found = losses(made, true, trust, self.filled)
        self.descend(torch.stack(list(found.values())).sum(), largest_gradient=1.0)
        return {name: float(value.detach()) for name, value in found.items()}

    def measure(self) -> dict[str, float]:
        """Mean CIELAB distance at hidden places of 24 people of the validation split: of the
        network, and of the nearest visible colors of the same sheet and of the other one."""
        if self.iteration % 250:
            return {}
        photo, true, trust = self._batch(self.others, np.random.default_rng(7), 24)
        self.model.eval()
        with torch.no_grad(), torch.autocast("cpu", torch.bfloat16, enabled=self.settings.half):
            made = self.model(photo, trust)
        near = filled_up(photo.flatten(0, 1), trust.flatten(0, 1)).view_as(photo)
        weight = (self.filled[None, :, None] > 0.5).float() * (trust < 0.05)
        found = {"network": made.float(), "near": near, "mirrored": near.flip(1)}
        return {
            name: float(
                (100 * (values - true).norm(dim=2, keepdim=True) * weight).sum() / weight.sum()
            )
            for name, values in found.items()
        }

    def _batch(
        self, people: Sheets, generator: np.random.Generator, count: int
    ) -> tuple[Tensor, Tensor, Tensor]:
        drawn = [people.drawn(generator) for _ in range(count)]
        return tuple(  # type: ignore[return-value]
            torch.from_numpy(np.ascontiguousarray(np.stack(values), np.float32))
            for values in zip(*drawn, strict=True)
        )

    def content(self) -> dict[str, Any]:
        """Return the weights, the sizes of the network, and the generator's state."""
        return {
            "model": self.model.state_dict(),
            "generator": self.generator.bit_generator.state,
            "network": dataclasses.asdict(self.network),
        }

    def restore(self, content: Mapping[str, Any]) -> None:
        """See `Training`."""
        self.model.load_state_dict(content["model"])
        self.generator.bit_generator.state = content["generator"]


def train_completion(
    people: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    network: CompletionSettings | None = None,
    settings: CompletionTraining | None = None,
    on_log: Callable[[dict[str, float]], None] | None = None,
) -> Completion:
    """Train the completion in `folder`, or resume its training, with `people` of `write_people`."""
    network, settings = network or CompletionSettings(), settings or CompletionTraining()
    run = Run(
        Path(folder) / FILE,
        identity(network, settings, digest="completion"),
        settings.checkpoint_seconds,
    )
    training = CompletionRun(people, network, settings)
    carry_on(training, run, settings, iterations=settings.iterations, on_log=on_log)
    return training.model.eval()


def load_completion(folder: str | os.PathLike[str]) -> Completion:
    """Load the trained network of a folder for inference."""
    content = read_checkpoint(Path(folder) / FILE, ("model", "network"))
    model = Completion(CompletionSettings(**content["network"]), known_maps())
    model.load_state_dict(content["model"])
    return model.eval()
