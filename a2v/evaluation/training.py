"""Training of our own action classifiers, for data that the authors published none for."""

from __future__ import annotations

import copy
import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import nn

from a2v.datasets import ActionDataset, ClipSampler
from a2v.errors import InputError
from a2v.evaluation.classifier import ActionClassifier, Evaluator, load_evaluator
from a2v.evaluation.metrics import accuracy
from a2v.runs import Run, RunSettings, cosine_decay, identity, set_rate

FILE = "classifier.pt"
"""Checkpoint of a run, and at its end the classifier that `load_evaluator` reads."""


@dataclass(frozen=True)
class ClassifierSettings(RunSettings):
    """How a classifier is trained.

    Attributes
    ----------
    iterations, batch_size : int
    learning_rate, weight_decay : float
        AdamW, with a cosine decay to a hundredth.
    clip_gradient : float
        Largest norm of the gradient.
    """

    iterations: int = 1500
    batch_size: int = 64
    learning_rate: float = 2e-3
    weight_decay: float = 1e-4
    clip_gradient: float = 1.0
    checkpoint_seconds: float = 60.0

    def __post_init__(self) -> None:
        if min(self.iterations, self.batch_size, self.log_every) < 1:
            raise InputError("iterations, batch_size and log_every of the classifier must be positive")


def held_out_accuracy(evaluator: Evaluator, held_out: ActionDataset, *, windows: int = 4, seed: int = 0) -> float:
    """Share of right answers on random windows of clips (zero first state), `windows` of each."""
    clips = np.tile(np.arange(len(held_out)), windows)
    joints = ClipSampler(held_out, held_out.length).windows(clips, np.random.default_rng(seed))
    _, predicted = evaluator(held_out.frame.flip(joints))
    return accuracy(predicted, held_out.labels[clips])


def train_classifier(
    dataset: ActionDataset,
    folder: str | os.PathLike[str],
    *,
    held_out: ActionDataset | None = None,
    settings: ClassifierSettings | None = None,
    on_log: Callable[[dict[str, float]], None] | None = None,
) -> Evaluator:
    """Train, or go on with, the classifier in `folder` (``classifier.pt`` and ``log.csv``).

    The architecture is the papers', the windows are those of their protocol, and the GRU starts from random states, so that the
    result works under both protocols. Every iteration draws from its own seed: a run that was stopped ends with the weights of
    one that was not.

    Parameters
    ----------
    dataset : ActionDataset
        Clips to learn from.
    folder : path
    held_out : ActionDataset or None
        Clips to measure the accuracy on; never learned from.
    settings : ClassifierSettings
    on_log : callable
        Called with iteration, seconds, loss and, with `held_out`, accuracy, every `log_every` iterations.

    Raises
    ------
    InputError
        The run in `folder` was made with other data or settings, or training diverges.
    """
    settings = settings or ClassifierSettings()
    device = settings.claim()
    path = Path(folder) / FILE
    made_with = identity(settings, digest=dataset.digest) | {"frames": dataset.length}
    run = Run(path, made_with, settings.checkpoint_seconds)
    torch.manual_seed(settings.seed)
    network = ActionClassifier(3 * dataset.skeleton.n_joints, len(dataset.actions)).to(device)
    optimizer = torch.optim.AdamW(network.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay)
    iteration = 0
    log: list[dict[str, float]] = []
    content = run.resume(("model", "optimizer", "iteration", "log"))
    if content is not None:
        network.load_state_dict(content["model"])
        optimizer.load_state_dict(content["optimizer"])
        iteration, log = content["iteration"], list(content["log"])
        if iteration >= settings.iterations:  # finished: the file stays as it is, so that its digest names it
            return load_evaluator(path)
    sampler = ClipSampler(dataset, dataset.length)

    def save() -> None:
        info = {
            "dataset": dataset.name,
            "dataset_digest": dataset.digest,
            "actions": list(dataset.actions),
            "held_out": sorted(set(held_out.subjects)) if held_out is not None else [],
            "held_out_accuracy": log[-1].get("accuracy", math.nan) if log else math.nan,
            "iterations": iteration,
        }
        run.save({"model": network.state_dict(), "optimizer": optimizer.state_dict(), "iteration": iteration, "log": log, "a2v": info}, log)

    losses: list[float] = []
    with settings.loop(save):
        while iteration < settings.iterations:
            generator = np.random.default_rng([settings.seed, iteration])
            joints, labels, _ = sampler.batch(settings.batch_size, generator)
            state = generator.standard_normal((2, len(joints), network.recurrent.hidden_size), dtype=np.float32)
            batch, first, wanted = (torch.from_numpy(x).to(device) for x in (dataset.frame.flip(joints), state, labels))
            _, logits = network(batch.flatten(2), first)
            loss = nn.functional.cross_entropy(logits, wanted)
            set_rate(optimizer, settings.learning_rate * cosine_decay(iteration / settings.iterations, 0.01))
            optimizer.zero_grad(set_to_none=True)
            loss.backward()  # type: ignore[no-untyped-call]
            nn.utils.clip_grad_norm_(network.parameters(), settings.clip_gradient)
            optimizer.step()
            iteration += 1
            losses.append(float(loss.detach()))
            if iteration % settings.log_every == 0 or iteration == settings.iterations:
                row = {"iteration": float(iteration), "seconds": run.seconds, "loss": float(np.mean(losses))}
                if not np.isfinite(row["loss"]):
                    raise InputError(f"training diverged at iteration {iteration}; lower learning_rate")
                if held_out is not None:
                    row["accuracy"] = held_out_accuracy(Evaluator(copy.deepcopy(network).cpu().eval(), FILE, ""), held_out)
                log.append(row)
                losses = []
                if on_log is not None:
                    on_log(row)
            if run.due:
                save()
    return load_evaluator(path)
