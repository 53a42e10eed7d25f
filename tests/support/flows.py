"""A flow that trains in a second."""

from __future__ import annotations

from a2v.lab.motion.flow import FlowSettings

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
