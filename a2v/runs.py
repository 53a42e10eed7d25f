"""What every training shares: where it runs, how its rate falls, and a folder from which a stopped run goes on."""

from __future__ import annotations

import dataclasses
import math
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2v.errors import InputError
from a2v.io import atomic_path, write_csv

if TYPE_CHECKING:
    import torch

FREE_TO_CHANGE = frozenset({"threads", "device", "checkpoint_seconds", "log_every", "quick_products"})
"""Settings that do not change what is learned, so that a run may be resumed with others."""


@dataclass(frozen=True)
class RunSettings:
    """What every training's settings have.

    Attributes
    ----------
    seed : int
    threads : int
        CPU threads; 0 for torch's default.
    device : str
        "auto" takes CUDA where there is one.
    checkpoint_seconds : float
        Time between checkpoints.
    log_every : int
        Iterations between lines of the log.
    quick_products : bool
        Matrix products by oneDNN instead of MKL while training on a CPU: twice as fast on AMD's. On a CPU with AMX it
        rounds factors to bfloat16.
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
        """A training loop's matrix products as `quick_products` says; afterwards they are what they were."""
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
        """A training loop: `products`, and `save` whatever ends it, Ctrl-C too."""
        with self.products():
            try:
                yield
            finally:
                save()


def choose_device(name: str) -> torch.device:
    """The device called `name`; "auto" is CUDA where there is one, else the CPU."""
    import torch

    return torch.device("cuda" if torch.cuda.is_available() else "cpu") if name == "auto" else torch.device(name)


def cosine_decay(progress: float, floor: float) -> float:
    """Factor of the learning rate: 1 at `progress` 0, falling along half a cosine to `floor` at 1."""
    return floor + (1 - floor) * 0.5 * (1 + math.cos(math.pi * progress))


def set_rate(optimizer: torch.optim.Optimizer, rate: float) -> None:
    """Let every group of `optimizer` learn at `rate`."""
    for group in optimizer.param_groups:
        group["lr"] = rate


def identity(*settings: Any, digest: str) -> dict[str, Any]:
    """What makes two runs the same: the settings (dataclasses) that change what is learned, and the data's digest."""
    values = {name: value for chosen in settings for name, value in dataclasses.asdict(chosen).items()}
    return {name: value for name, value in values.items() if name not in FREE_TO_CHANGE} | {"dataset_digest": digest}


class Run:
    """A checkpoint file that is written now and then, and read when the same training is started again.

    Parameters
    ----------
    path : path
        The checkpoint; ``log.csv`` goes beside it.
    made_with : mapping
        See `identity`.
    every : float
        Seconds between checkpoints.
    """

    def __init__(self, path: str | os.PathLike[str], made_with: Mapping[str, Any], every: float) -> None:
        self.path, self.made_with, self.every = Path(path), dict(made_with), every
        self._saved = self._began = time.monotonic()

    def resume(self, needed: Iterable[str]) -> dict[str, Any] | None:
        """Content of the checkpoint, None where there is none; the clock goes on from it.

        Raises
        ------
        InputError
            It cannot be read, or was made with other data or settings (the first difference is named).
        """
        if not self.path.exists():
            return None
        content = read_checkpoint(self.path, needed)
        old = content["made_with"]
        for name, value in sorted(self.made_with.items()):
            if old.get(name) != value:
                raise InputError(f"{self.path} was made with {name}={old.get(name)}, not {value}; give another folder or the same settings")
        self._began = time.monotonic() - content["seconds"]
        return content

    @property
    def seconds(self) -> float:
        """Time the training has taken, all its sessions together."""
        return time.monotonic() - self._began

    @property
    def due(self) -> bool:
        """Whether it is time for a checkpoint."""
        return time.monotonic() - self._saved > self.every

    def save(self, content: Mapping[str, Any], log: Sequence[Mapping[str, Any]] = ()) -> None:
        """Write the checkpoint and the log, each under its name only when it is whole."""
        import torch

        with atomic_path(self.path) as temporary:
            torch.save({**content, "made_with": self.made_with, "seconds": self.seconds}, temporary)
        if log:
            write_csv(self.path.with_name("log.csv"), log)
        self._saved = time.monotonic()


def read_checkpoint(path: str | os.PathLike[str], needed: Iterable[str]) -> dict[str, Any]:
    """The content of a checkpoint; nothing but tensors and plain values is unpickled.

    Raises
    ------
    InputError
        The file is missing, damaged, or lacks an entry of `needed`.
    """
    import torch

    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
        missing = {"made_with", "seconds", *needed} - set(content)
    except FileNotFoundError:
        raise InputError(f"{path} does not exist; train first (a2v train)") from None
    except Exception:  # torch raises many kinds for a damaged file, and advises to read it without care
        raise InputError(f"{path} cannot be read as a checkpoint; it is damaged, or something else") from None
    if missing:
        raise InputError(f"{path} is no checkpoint of this training (it lacks {', '.join(sorted(missing))}); give another folder")
    return dict(content)
