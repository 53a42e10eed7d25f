"""Rows of the tables of ``a2v evaluate``: each is written as soon as it is measured."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from a2v.lab.datasets import ActionDataset
from a2v.lab.evaluation.classifier import Evaluator
from a2v.lab.evaluation.protocol import (
    REAL,
    REAL_ALIKE,
    ActionRows,
    EvaluationSettings,
    evaluate,
    evaluate_actions,
    report,
)
from a2v.lab.evaluation.scores import Scores, scores_as_dict, scores_from_dict
from a2v.lab.evaluation.sources import Generate
from pipelines.bar import bar
from pipelines.lab.evaluated import Evaluated
from pipelines.lab.tables import write_numbers


class Table:
    """The rows of a table.

    Rows of the same models, data, classifier and protocol that its file already has are kept, so a
    killed run can resume and models can be added.
    """

    def __init__(
        self,
        out: Path,
        dataset: ActionDataset,
        evaluator: Evaluator,
        protocol: EvaluationSettings,
        opened: Mapping[str, Evaluated],
    ) -> None:
        self.out, self.dataset, self.evaluator, self._protocol = out, dataset, evaluator, protocol
        self._described = {
            name: {"sha256": model.sha256, "trained_on": model.trained_on or None}
            | ({} if model.temperature == 1 else {"temperature": model.temperature})
            for name, model in opened.items()
        }
        self.models: Mapping[str, Generate] = {
            name: model.generate for name, model in opened.items()
        }
        self._known, self._known_actions = _known_rows(
            out.with_suffix(".json"), self.content([]), self._described
        )

    def content(self, rows: Sequence[Scores]) -> dict[str, object]:
        """Return the numbers of `rows` with their protocol."""
        names = {row.name for row in rows}
        models = {name: about for name, about in self._described.items() if name in names}
        return report(rows, self.dataset, self.evaluator, self._protocol) | {"models": models}

    def measure(self) -> list[Scores]:
        """Measure the rows of all models; each is written as soon as it is measured."""
        measured = list(self._known.values())

        def keep(row: Scores) -> None:
            measured.append(row)
            write_numbers(self.out, self.content(measured) | {"unfinished": True})

        with bar("evaluate", "set") as progress:
            return evaluate(
                self.models,
                self.dataset,
                self.evaluator,
                self._protocol,
                known=self._known,
                progress=progress,
                on_row=keep,
            )

    def measure_actions(
        self, actions: Sequence[str], protocol: EvaluationSettings, content: Mapping[str, object]
    ) -> dict[str, list[Scores]]:
        """Measure the rows of single actions; write each beside `content` when it is measured."""
        single = {action: list(rows.values()) for action, rows in self._known_actions.items()}

        def keep(action: str, row: Scores) -> None:
            single.setdefault(action, []).append(row)
            write_numbers(
                self.out, {**content, **actions_content(protocol, single), "unfinished": True}
            )

        with bar("actions", "set") as progress:
            return evaluate_actions(
                self.models,
                self.dataset,
                self.evaluator,
                actions,
                protocol,
                rows=ActionRows(self._known_actions, keep),
                progress=progress,
            )


def actions_content(
    protocol: EvaluationSettings, rows: Mapping[str, Sequence[Scores]]
) -> dict[str, object]:
    """Return the numbers of single actions in the format of the JSON file."""
    return {
        "actions": {
            "clips": protocol.clips,
            "scores": {action: scores_as_dict(part) for action, part in rows.items()},
        }
    }


def _known_rows(
    path: Path, wanted: Mapping[str, Any], models: Mapping[str, Mapping[str, Any]]
) -> tuple[dict[str, Scores], dict[str, dict[str, Scores]]]:
    """Return the valid rows of an earlier table at `path`, by name.

    The second mapping has those of single actions, by action and name.
    """
    try:
        old = json.loads(path.read_text(encoding="utf-8"))
        if any(
            old[part] != wanted[part] for part in ("protocol", "dataset", "classifier", "versions")
        ):
            return {}, {}
        kept = {
            REAL,
            REAL_ALIKE,
            *(name for name, about in models.items() if old["models"].get(name) == about),
        }

        def rows(part: Mapping[str, Any]) -> dict[str, Scores]:
            return scores_from_dict({name: row for name, row in part.items() if name in kept})

        actions = old.get("actions", {}).get("scores", {})
        return rows(old["scores"]), {action: rows(part) for action, part in actions.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}, {}  # missing, or not such a table: all rows are measured again
