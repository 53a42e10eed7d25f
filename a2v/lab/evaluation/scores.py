"""Rows of evaluation tables, and the tables in Markdown and JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from a2v.lab.evaluation.metrics import confidence_interval
from a2v.lab.evaluation.physics import PhysicsMetrics

METRICS = ("fid", "accuracy", "diversity", "multimodality")


@dataclass(frozen=True)
class Scores:
    """Metrics of one model: every repeat's value by metric, and the physical measures of
    `physics_clips` clips."""

    name: str
    values: Mapping[str, tuple[float, ...]]
    physics: PhysicsMetrics | None = None

    def summary(self) -> dict[str, tuple[float, float]]:
        """Mean and half width of the 95 % interval by metric."""
        return {
            metric: confidence_interval(np.asarray(values))
            for metric, values in self.values.items()
        }


def _cell(scores: Scores, metric: str) -> str:
    mean, half = scores.summary()[metric]
    return f"{mean:.3f} ± {half:.3f}" if len(scores.values[metric]) > 1 else f"{mean:.3f}"


def markdown_table(scores: Sequence[Scores]) -> str:
    """The papers' table: mean ± half width of the 95 % interval (of several repeats)."""
    lines = ["| Methods | FID↓ | Accuracy↑ | Diversity→ | MModality→ |", "|---|---|---|---|---|"]
    lines += [
        f"| {row.name} | {' | '.join(_cell(row, metric) for metric in METRICS)} |" for row in scores
    ]
    return "\n".join(lines)


def actor_table(scores: Sequence[Scores]) -> str:
    """The table by ACTOR's protocol: mean ± half width of the 95 % interval, and in brackets the
    interval that ACTOR's code prints, 1.96 times the variance of the repeats."""
    lines = ["| Methods | FID↓ | Accuracy↑ | Diversity→ | MModality→ |", "|---|---|---|---|---|"]
    for row in scores:
        cells = [
            f"{_cell(row, metric)} ({1.96 * np.var(row.values[metric]):.4f})" for metric in METRICS
        ]
        lines.append(f"| {row.name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def action_table(tables: Mapping[str, Sequence[Scores]]) -> str:
    """The journal paper's Table 4: FID, accuracy and diversity of single actions side by side."""
    shown = METRICS[:3]
    head = [
        f"{action} {metric}" for action in tables for metric in ("FID↓", "Accuracy↑", "Diversity→")
    ]
    lines = [f"| Methods | {' | '.join(head)} |", "|---" * (len(head) + 1) + "|"]
    for rows in zip(*tables.values(), strict=True):
        lines.append(
            f"| {rows[0].name} | "
            f"{' | '.join(_cell(row, metric) for row in rows for metric in shown)} |"
        )
    return "\n".join(lines)


def physics_table(scores: Sequence[Scores]) -> str:
    """Physical plausibility, real motions first, since they are not at zero either; "" if it was
    not measured."""
    known = [row for row in scores if row.physics is not None]
    if not known:
        return ""
    columns = {
        "Foot skating": ("skating", 1),
        "Penetration mm": ("penetration", 1),
        "Float mm": ("floating", 1),
        "Slide mm/frame": ("slide", 1),
        "Jitter m/s³": ("jitter", 1),
        "Bone variation %": ("bone_variation", 100),
        "Slide in contact cm/s": ("contact_slide", 100),
        "Contacts over 30 cm/s %": ("contact_fast", 100),
    }
    lines = [f"| Methods | {' | '.join(columns)} |", "|---" * (len(columns) + 1) + "|"]
    for row in known:
        values = row.physics.as_dict() if row.physics is not None else {}
        lines.append(
            f"| {row.name} | "
            f"{' | '.join(f'{values[name] * factor:.3g}' for name, factor in columns.values())} "
            "|"
        )
    return "\n".join(lines)


def scores_as_dict(scores: Sequence[Scores]) -> dict[str, Any]:
    """Rows as JSON: every repeat's values by metric, and the physical measures."""
    return {
        row.name: {metric: list(numbers) for metric, numbers in row.values.items()}
        | ({"physics": row.physics.as_dict()} if row.physics else {})
        for row in scores
    }


def scores_from_dict(content: Mapping[str, Mapping[str, Any]]) -> dict[str, Scores]:
    """The inverse of `scores_as_dict`, by name."""
    return {
        name: Scores(
            name,
            {metric: tuple(row[metric]) for metric in METRICS},
            PhysicsMetrics(**row["physics"]) if "physics" in row else None,
        )
        for name, row in content.items()
    }
