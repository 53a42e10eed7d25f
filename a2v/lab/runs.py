"""Common parts of all trainings: device, learning rate, loop, and a folder from which a stopped run
resumes."""

from __future__ import annotations

import dataclasses
import math
import os
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from a2v.errors import InputError
from a2v.io import atomic_path, shorten, write_csv
from a2v.lab.checkpoints import read_checkpoint

if TYPE_CHECKING:
    import torch

FREE_TO_CHANGE = frozenset(
    {"threads", "device", "checkpoint_seconds", "log_every", "quick_products"}
)
"""Settings that do not change the result, so that a run may be resumed with other values."""
NEWER: Mapping[str, bool] = {"newer": True}
"""Metadata of a field that older runs lack. Its default value does not distinguish two runs."""


@dataclass(frozen=True)
class RunSettings:
    """Common settings of all trainings.

    Attributes
    ----------
    seed : int
        Seed of every random draw of the training.
    threads : int
        CPU threads; 0 for torch's default.
    device : str
        "auto" takes CUDA if it is available.
    checkpoint_seconds : float
        Time between checkpoints.
    log_every : int
        Iterations between lines of the log.
    quick_products : bool
        Compute matrix products by oneDNN instead of MKL while training on a CPU. It is twice as
        fast on AMD's CPUs. On a CPU with AMX it rounds factors to bfloat16.
    """

    seed: int = 0
    threads: int = 0
    device: str = "auto"
    checkpoint_seconds: float = 180.0
    log_every: int = 50
    quick_products: bool = True

    def claim(self) -> torch.device:
        """Set torch's threads, and return the device to train on."""
        import torch

        if self.threads:
            torch.set_num_threads(self.threads)
        return choose_device(self.device)

    @contextmanager
    def products(self) -> Iterator[None]:
        """Context with the matrix products of `quick_products`; the previous setting is restored
        afterwards."""
        import torch

        matmul = torch.backends.mkldnn.matmul  # type: ignore[attr-defined]  # torch's stubs lack it
        before = matmul.fp32_precision
        if self.quick_products:
            matmul.fp32_precision = "bf16"
        try:
            yield
        finally:
            matmul.fp32_precision = before

    @contextmanager
    def loop(self, save: Callable[[], None]) -> Iterator[None]:
        """Context of a training loop: `products`, and `save` however it ends, Ctrl-C included."""
        with self.products():
            try:
                yield
            finally:
                save()


def choose_device(name: str) -> torch.device:
    """Return the device called `name`; "auto" is CUDA if it is available, else the CPU.

    Raises
    ------
    InputError
        It is not one of auto, cpu, cuda, cuda:0..., or not available.
    """
    import torch

    count = torch.cuda.device_count() if torch.cuda.is_available() else 0
    if name not in (
        "auto",
        "cpu",
        *(["cuda"] if count else []),
        *(f"cuda:{index}" for index in range(count)),
    ):
        raise InputError(
            f"device is '{shorten(name, 40)}'; expected auto, cpu"
            + (f", cuda or cuda:0 to cuda:{count - 1}" if count else "; there is no CUDA here")
        )
    return torch.device("cuda" if count else "cpu") if name == "auto" else torch.device(name)


@dataclass(frozen=True, kw_only=True)
class RateSchedule:
    """A learning rate that rises linearly, then falls along half a cosine.

    Attributes
    ----------
    peak : float
    span : int
        Iteration at which the rate has reached its floor.
    floor : float
        Final rate as a fraction of `peak`; 1 for a constant rate.
    warm_up : int
        Number of iterations of the rise.
    """

    peak: float
    span: int
    floor: float
    warm_up: int = 1

    def __call__(self, iteration: int) -> float:
        """Return the rate of an iteration, counted from 0."""
        return (
            self.peak
            * min(1.0, (iteration + 1) / self.warm_up)
            * self._decay(iteration / self.span)
        )

    def _decay(self, progress: float) -> float:
        return self.floor + (1 - self.floor) * 0.5 * (1 + math.cos(math.pi * progress))


def identity(*settings: Any, digest: str) -> dict[str, Any]:
    """Return the identity of a run: the settings (dataclasses) that change the result, and the
    data's digest."""
    values: dict[str, Any] = {}
    for chosen in settings:
        same = {
            item.name
            for item in dataclasses.fields(chosen)
            if item.metadata.get("newer") and getattr(chosen, item.name) == item.default
        }
        values |= {
            name: value for name, value in dataclasses.asdict(chosen).items() if name not in same
        }
    return {name: value for name, value in values.items() if name not in FREE_TO_CHANGE} | {
        "dataset_digest": digest
    }


class Run:
    """A checkpoint file that is written periodically, and read when the same training is started
    again.

    Parameters
    ----------
    path : path
        The checkpoint; ``log.csv`` goes beside it.
    made_with : mapping
        See `identity`.
    every : float
        Seconds between checkpoints.
    """

    def __init__(
        self, path: str | os.PathLike[str], made_with: Mapping[str, Any], every: float
    ) -> None:
        self.path, self.made_with, self.every = Path(path), dict(made_with), every
        self._saved = self._began = time.monotonic()

    def resume(self, needed: Iterable[str]) -> dict[str, Any] | None:
        """Return the content of the checkpoint, or None if there is none. The clock continues from
        it.

        Raises
        ------
        InputError
            It cannot be read, or was made with other data or settings; the message names the first
            difference.
        """
        if not self.path.exists():
            return None
        content = read_checkpoint(self.path, needed)
        old = content["made_with"]
        for name in sorted({*self.made_with, *old}):
            value = self.made_with.get(name, "its default")
            if name not in old or old[name] != value:
                raise InputError(
                    f"{self.path} was made with "
                    f"{name}={old.get(name, 'its default')}, not {value}; give "
                    "another folder or the same settings"
                )
        self._began = time.monotonic() - content["seconds"]
        return content

    @property
    def seconds(self) -> float:
        """Total time of the training over all its sessions, seconds."""
        return time.monotonic() - self._began

    @property
    def due(self) -> bool:
        """Whether it is time for a checkpoint."""
        return time.monotonic() - self._saved > self.every

    def save(self, content: Mapping[str, Any], log: Sequence[Mapping[str, Any]] = ()) -> None:
        """Write the checkpoint and the log, each atomically."""
        import torch

        with atomic_path(self.path) as temporary:
            torch.save({**content, "made_with": self.made_with, "seconds": self.seconds}, temporary)
        if log:
            write_csv(self.path.with_name("log.csv"), log)
        self._saved = time.monotonic()


class Training(ABC):
    """A training in progress; `carry_on` runs, saves and restores it.

    Attributes
    ----------
    optimizer : torch Optimizer
        A group of weights may have a "share" of the rate.
    rate : RateSchedule
    iteration : int
        Number of finished iterations.
    log : list of dict
        A row of mean losses every ``log_every`` iterations.
    """

    STORED: ClassVar[tuple[str, ...]]
    """Entries of `content` that a checkpoint of this training must have."""
    REMEDY: ClassVar[str] = "lower learning_rate"
    """Advice in the message if the training diverges."""

    optimizer: torch.optim.Optimizer
    rate: RateSchedule

    def __init__(self) -> None:
        self.iteration = 0
        self.log: list[dict[str, float]] = []

    @abstractmethod
    def step(self) -> dict[str, float]:
        """Run iteration number `iteration`. Return its losses and other values whose means go to
        the log."""

    @abstractmethod
    def content(self) -> dict[str, Any]:
        """Return the content of a checkpoint besides optimizer, iteration and log: tensors and
        plain values."""

    @abstractmethod
    def restore(self, content: Mapping[str, Any]) -> None:
        """Restore the state from the `content` of a checkpoint."""

    def begin(self) -> None:  # noqa: B027  # most need no preparation
        """Prepare a training without a checkpoint."""

    def measure(self) -> dict[str, float]:
        """Return further values of a row of the log, measured when it is written."""
        return {}

    def descend(self, loss: torch.Tensor, *, largest_gradient: float = 0.0) -> None:
        """Take one optimizer step on `loss` (); the gradient's norm is limited to
        `largest_gradient` unless that is 0."""
        from torch import nn

        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        if largest_gradient > 0:
            nn.utils.clip_grad_norm_(
                [weight for group in self.optimizer.param_groups for weight in group["params"]],
                largest_gradient,
            )
        self.optimizer.step()


def carry_on(
    training: Training,
    run: Run,
    settings: RunSettings,
    *,
    iterations: int,
    on_log: Callable[[dict[str, float]], None] | None = None,
) -> None:
    """Begin a training, or resume it from `run`, until `iterations` are done.

    Its checkpoint is written every ``settings.checkpoint_seconds``, at the end and on Ctrl-C. That
    of a finished training is not changed.

    Parameters
    ----------
    training : Training
        Fresh; changed in place.
    run : Run
    settings : RunSettings
    iterations : int
        Total number, earlier sessions included.
    on_log : callable
        Called with each new row of the log; what it adds to the row is kept.

    Raises
    ------
    InputError
        The checkpoint cannot be read or is of another training (see `Run.resume`), or a loss is not
        finite.
    """
    content = run.resume((*training.STORED, "optimizer", "iteration", "log"))
    if content is None:
        training.begin()
    else:
        training.restore(content)
        training.optimizer.load_state_dict(content["optimizer"])
        training.iteration, training.log = content["iteration"], list(content["log"])
        if training.iteration >= iterations:
            return

    def save() -> None:
        kept = {
            "optimizer": training.optimizer.state_dict(),
            "iteration": training.iteration,
            "log": training.log,
        }
        run.save(training.content() | kept, training.log)

    recent: list[dict[str, float]] = []
    with settings.loop(save):
        while training.iteration < iterations:
            rate = training.rate(training.iteration)
            for group in training.optimizer.param_groups:
                group["lr"] = rate * group.get("share", 1.0)
            recent.append(training.step())
            training.iteration += 1
            if training.iteration % settings.log_every == 0 or training.iteration == iterations:
                row = _mean_row(training, run, recent)
                recent = []
                training.log.append(row)
                if on_log is not None:
                    on_log(row)
            if run.due:
                save()


def _mean_row(
    training: Training, run: Run, recent: Sequence[Mapping[str, float]]
) -> dict[str, float]:
    """Return a row of the log. Raises InputError if a mean is not finite."""
    mean = {name: float(np.mean([losses[name] for losses in recent])) for name in recent[0]}
    row = {"iteration": float(training.iteration), "seconds": run.seconds} | mean
    if not np.isfinite(list(mean.values())).all():
        raise InputError(f"training diverged at iteration {training.iteration}; {training.REMEDY}")
    return row | training.measure()
