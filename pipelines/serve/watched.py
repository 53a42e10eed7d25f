"""How the page's child processes run graphs: own workers, progress reports, kept outcomes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pipelines.engine.progress import Listener
from pipelines.engine.store import Store
from pipelines.inputs import RunOptions

if TYPE_CHECKING:
    from pipelines.engine.graph import Graph
    from pipelines.engine.run import Early, Outcome


@dataclass(frozen=True, kw_only=True)
class Watched(RunOptions):
    """Options of the page for running a graph: own workers, progress reports, kept outcomes."""

    pool: Executor | None = None
    listener: Listener | None = None
    early: Early = field(default_factory=dict)
    outcomes: list[Outcome] = field(default_factory=list)

    @property
    def store(self) -> Store:
        """The store of the values."""
        return Store(self.cache)

    def run(
        self,
        targets: str | Sequence[str],
        parameters: Mapping[str, object],
        *,
        graph: Graph | None = None,
        start: str | None = None,
        overrides: Mapping[str, Any] | None = None,
        early: Early | None = None,
    ) -> Outcome:
        """Run as `RunOptions.run` without progress bars; the page's early outputs come first."""
        from pipelines.run import run

        given: dict[str, Any] = dict(parameters)
        outcome = run(
            targets,
            graph=graph,
            executor=self.pool or "serial",
            store=self.store,
            start=start,
            overrides=overrides,
            progress=self.listener,
            early=_together(self.early, early or {}),
            **given,
        )
        self.outcomes.append(outcome)
        return outcome


def _together(first: Early, then: Early) -> Early:
    """Merge two sets of early outputs; where both name a node, both are called, `first` first."""

    def both(name: str) -> Callable[[Outcome], None]:
        def tell(outcome: Outcome) -> None:
            for part in (first, then):
                if name in part:
                    part[name](outcome)

        return tell

    return {name: both(name) for name in {**first, **then}}


def spent(outcome: Outcome) -> dict[str, float]:
    """Return the seconds of the nodes that were computed."""
    return {
        name: stats.span[1] - stats.span[0]
        for name, stats in outcome.nodes.items()
        if not stats.cached and stats.span[1] > stats.span[0]
    }
