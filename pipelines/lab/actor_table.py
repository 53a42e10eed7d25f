"""The table of ``a2v evaluate --protocol actor``: ours and published rows by ACTOR's protocol."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from a2v.lab.datasets import ActionDataset
from a2v.lab.evaluation.classifier import Evaluator
from a2v.lab.evaluation.protocol import EvaluationSettings
from a2v.lab.evaluation.published import published_actor_table
from a2v.lab.evaluation.scores import actor_table
from pipelines.answer import Answer
from pipelines.lab.evaluated import Evaluated
from pipelines.lab.evaluation_rows import Table
from pipelines.lab.tables import table_result, write_table


def make_actor_table(
    out: Path,
    measuring: EvaluationSettings,
    dataset: ActionDataset,
    evaluator: Evaluator,
    opened: Mapping[str, Evaluated],
) -> Answer:
    """Make the table of ACTOR's protocol, with the published rows."""
    settings = replace(
        measuring,
        labels="each",
        clips=min(measuring.clips, len(dataset)),
        physics_clips=0,
    )
    table = Table(out, dataset, evaluator, settings, opened)
    scores = table.measure()
    text = [
        f"# {dataset.name}, ACTOR's protocol",
        f"{settings.clips} of {len(dataset)} recordings, each once, and a generated clip for each "
        f"one's action; {dataset.length} frames, shorter recordings hold their last pose; "
        f"{settings.repeats} repeats, {settings.state} classifier state, seed {settings.seed}; "
        f"classifier {evaluator.source}. Mean ± 1.96 standard deviations / √repeats, in brackets "
        "what ACTOR's code prints: 1.96 times the variance.",
        actor_table(scores),
    ]
    if published := published_actor_table(dataset.name):
        text += ["As published, in this protocol (joints are SMPL's there):", published]
    content = table.content(scores)
    return table_result(out, write_table(out, text, content), content)
