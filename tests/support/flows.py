"""A flow that trains in a second."""

from __future__ import annotations

import functools

import pytest

from a2v.lab.motion.flow import FlowSettings
from export.flow import Sampling
from pipelines.lab import train_flow

SMALL = FlowSettings(
    code_size=12,
    context_size=5,
    context_frames=4,
    width=32,
    blocks=2,
    condition_size=32,
    iterations=60,
    batch_size=32,
    pool=200,
    threads=1,
    device="cpu",
    learning_rate=5e-3,
    log_every=10,
)


def export_one_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let ``a2v train flow`` write one step of integration, not seven: an export takes 5, not 15
    seconds of processor time."""
    monkeypatch.setattr(train_flow, "Sampling", functools.partial(Sampling, steps=1))
