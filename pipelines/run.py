"""Run the graph of a video, in the same way for the command line, notebooks and tests."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pipelines.engine.graph import Graph
from pipelines.engine.run import Outcome
from pipelines.engine.run import run as run_graph
from pipelines.graph import video_graph


def run(target: str | Sequence[str], *, graph: Graph | None = None, **given: Any) -> Outcome:
    """Compute `target` and only what it needs, with the options of `pipelines.engine.run.run`.

    Parameters
    ----------
    target : name of an output, or several
    graph : the steps; those of a video with a generated motion if None, of several photos where
    `other` is given
    given : options of `pipelines.engine.run.run` and the graph's inputs

    Raises
    ------
    InputError
        An unknown target, parameter or override (it names the nearest), or a missing parameter; and
        what nodes raise.
    """
    return run_graph(
        target, graph=video_graph(several="other" in given) if graph is None else graph, **given
    )
