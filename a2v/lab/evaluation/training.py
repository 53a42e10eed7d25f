"""Training of our own action classifiers, for data without a published one."""

from __future__ import annotations

import copy
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from a2v.errors import InputError
from a2v.lab.datasets import ActionDataset, ClipSampler
from a2v.lab.evaluation.classifier import ActionClassifier, Evaluator, Facing, load_evaluator
from a2v.lab.evaluation.metrics import accuracy
from a2v.lab.runs import RateSchedule, Run, RunSettings, Training, carry_on, identity

FILE = "classifier.pt"
"""Checkpoint of a run, and at its end the classifier that `load_evaluator` reads."""


@dataclass(frozen=True)
class ClassifierSettings(RunSettings):
    """How a classifier is trained.

    Attributes
    ----------
    iterations : int
        Number of iterations.
    batch_size : int
        Clips per iteration.
    learning_rate : float
        Learning rate of AdamW, with a cosine decay to a hundredth.
    weight_decay : float
        Weight decay of AdamW.
    clip_gradient : float
        Largest norm of the gradient.
    face_forward : bool
        Windows are turned so that their first frame faces +z, in training and whenever the
        classifier is used. So it recognizes actions by the movement, not by the heading in the
        laboratory. For data without a published classifier.
    balance : float
        Share of a batch that is drawn uniformly from all actions instead of from all clips, so that
        actions with few clips are learned too.
    """

    iterations: int = 1500
    batch_size: int = 64
    learning_rate: float = 2e-3
    weight_decay: float = 1e-4
    clip_gradient: float = 1.0
    face_forward: bool = False
    balance: float = 0.0
    checkpoint_seconds: float = 60.0

    def __post_init__(self) -> None:
        if min(self.iterations, self.batch_size, self.log_every) < 1:
            raise InputError(
                "iterations, batch_size and log_every of the classifier must be positive"
            )
        if not 0 <= self.balance <= 1:
            raise InputError(
                f"balance of the classifier is {self.balance}; expected 0 (all "
                "clips equally often) to 1 (all actions equally often)"
            )


def held_out_accuracy(
    evaluator: Evaluator, held_out: ActionDataset, *, windows: int = 4, seed: int = 0
) -> float:
    """Share of right answers on random windows of clips (zero first state), `windows` of each."""
    clips = np.tile(np.arange(len(held_out)), windows)
    joints = ClipSampler(held_out, held_out.length).windows(clips, np.random.default_rng(seed))
    _, predicted = evaluator(held_out.frame.flip(joints))
    return accuracy(predicted, held_out.labels[clips])


class ClassifierTraining(Training):
    """A classifier's training in progress; every iteration draws from its own seed."""

    STORED = ("model",)

    def __init__(
        self, dataset: ActionDataset, held_out: ActionDataset | None, settings: ClassifierSettings
    ) -> None:
        super().__init__()
        self.dataset, self.held_out, self.settings, self.device = (
            dataset,
            held_out,
            settings,
            settings.claim(),
        )
        torch.manual_seed(settings.seed)
        self.network = ActionClassifier(3 * dataset.skeleton.n_joints, len(dataset.actions)).to(
            self.device
        )
        self.optimizer = torch.optim.AdamW(
            self.network.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay
        )
        self.rate = RateSchedule(peak=settings.learning_rate, span=settings.iterations, floor=0.01)
        self.sampler = ClipSampler(dataset, dataset.length, balance=settings.balance)
        self.facing = Facing.of(dataset) if settings.face_forward else None

    def step(self) -> dict[str, float]:
        """One iteration; its cross entropy as "loss"."""
        generator = np.random.default_rng([self.settings.seed, self.iteration])
        joints, labels, _ = self.sampler.batch(self.settings.batch_size, generator)
        motions = self.dataset.frame.flip(joints)
        motions = self.facing.turn(motions) if self.facing else motions
        state = generator.standard_normal(
            (2, len(joints), self.network.recurrent.hidden_size), dtype=np.float32
        )
        batch, first, wanted = (
            torch.from_numpy(x).to(self.device) for x in (motions, state, labels)
        )
        _, logits = self.network(batch.flatten(2), first)
        loss = nn.functional.cross_entropy(logits, wanted)
        self.descend(loss, largest_gradient=self.settings.clip_gradient)
        return {"loss": float(loss.detach())}

    def measure(self) -> dict[str, float]:
        """The "accuracy" on held-out clips, if there are any."""
        if self.held_out is None:
            return {}
        return {
            "accuracy": held_out_accuracy(
                Evaluator(
                    copy.deepcopy(self.network).cpu().eval(), FILE, "", {"facing": self.facing}
                ),
                self.held_out,
            )
        }

    def content(self) -> dict[str, Any]:
        """Return the weights, and under "a2v" the description that `load_evaluator` returns."""
        info = {
            "dataset": self.dataset.name,
            "dataset_digest": self.dataset.sha256,
            "actions": list(self.dataset.actions),
            "held_out": sorted(set(self.held_out.subjects)) if self.held_out is not None else [],
            "held_out_accuracy": self.log[-1].get("accuracy", math.nan) if self.log else math.nan,
            "iterations": self.iteration,
            "facing": self.facing and tuple(self.facing),
        }
        return {"model": self.network.state_dict(), "a2v": info}

    def restore(self, content: Mapping[str, Any]) -> None:
        """See `Training`."""
        self.network.load_state_dict(content["model"])


def train_classifier(
    dataset: ActionDataset,
    folder: str | os.PathLike[str],
    *,
    held_out: ActionDataset | None = None,
    settings: ClassifierSettings | None = None,
    on_log: Callable[[dict[str, float]], None] | None = None,
) -> Evaluator:
    """Train the classifier in `folder`, or resume its training (``classifier.pt`` and ``log.csv``).

    The architecture is the papers', the windows are those of their protocol, and the GRU starts
    from random states, so that the result works under both protocols. Every iteration draws from
    its own seed: a run that was stopped ends with the weights of one that was not.

    Parameters
    ----------
    dataset : ActionDataset
        Clips to learn from.
    folder : path
    held_out : ActionDataset or None
        Clips to measure the accuracy on; never learned from.
    settings : ClassifierSettings
    on_log : callable
        Called with iteration, seconds, loss and, with `held_out`, accuracy, every `log_every`
        iterations.

    Raises
    ------
    InputError
        The run in `folder` was made with other data or settings, or training diverges.
    """
    settings = settings or ClassifierSettings()
    path = Path(folder) / FILE
    run = Run(
        path,
        identity(settings, digest=dataset.sha256) | {"frames": dataset.length},
        settings.checkpoint_seconds,
    )
    carry_on(
        ClassifierTraining(dataset, held_out, settings),
        run,
        settings,
        iterations=settings.iterations,
        on_log=on_log,
    )
    return load_evaluator(path)
