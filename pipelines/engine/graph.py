"""Graphs of nodes, their dependencies, and the `pipefunc.Pipeline` that runs them.

A step is a node and the name of its result. An argument with the name of a result is an edge. A map
specification repeats a node: ``pose[t] -> posed[t]`` calls it once per frame.
"""

from __future__ import annotations

import difflib
import graphlib
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from a2v.errors import InputError
from pipelines.engine.memo import Bound, Node
from pipelines.engine.store import Store


@dataclass(frozen=True)
class Step:
    """One node in a graph.

    Attributes
    ----------
    node : Node
    output : str or tuple of str
        Name of the result; a tuple names the members of a returned tuple.
    mapspec : str or None
        Fan-out, as in ``"pose[t] -> posed[t]"``; ``"... -> pose[t]"`` gives a list over t.
    together : function of the graph's inputs to int, optional
        Number of calls along the last axis that one worker gets at a time; 1 without it.
    """

    node: Node[Any, Any]
    output: str | tuple[str, ...]
    mapspec: str | None = None
    together: Callable[[Mapping[str, Any]], int] | None = None

    @property
    def outputs(self) -> tuple[str, ...]:
        """The names of the results of the step."""
        return (self.output,) if isinstance(self.output, str) else self.output

    @property
    def axes(self) -> tuple[str, ...]:
        """The names of the axes of its output, such as ``("t", "c")``."""
        found = re.search(r"->\s*\w+\[([^\]]*)\]", self.mapspec or "")
        return tuple(axis.strip() for axis in found.group(1).split(",")) if found else ()

    @property
    def fans_out(self) -> bool:
        """Whether the node is called many times."""
        return self.mapspec is not None and not self.mapspec.startswith("...")


Graph = Sequence[Step]

Parameters = dict[str, Any]
"""Build the inputs of a graph by name; the annotations of its nodes give their types."""


def build(
    graph: Graph,
    *,
    store: Store | None = None,
    events: str = "",
    fresh: Collection[str] = (),
    codes: Mapping[str, str] | None = None,
) -> Any:
    """Build the `pipefunc.Pipeline` of `graph` with its nodes bound to `store`; check all types.

    Parameters
    ----------
    fresh : names of outputs that are computed even when they are remembered
    """
    import pipefunc

    where = store or Store()
    functions = []
    for step in graph:
        bound = Bound(
            step.node, where, events, step.node.code(), fresh=bool(set(step.outputs) & set(fresh))
        )
        made = (
            None if step.fans_out or not step.axes else ("?",) * len(step.axes)
        )  # The sizes are known after the node has run.
        functions.append(
            pipefunc.PipeFunc(
                bound.as_function(),
                output_name=step.output,
                mapspec=step.mapspec,
                print_error=False,
                internal_shape=made,
            )
        )
    pipeline = pipefunc.Pipeline(functions, validate_type_annotations=False, print_error=False)
    pipeline.validate_type_annotations = True  # once for all, not again for each function
    pipeline.validate()
    return pipeline


def outputs_of(graph: Graph) -> tuple[str, ...]:
    """Return the names of all results of the graph, in its order."""
    return tuple(name for step in graph for name in step.outputs)


def inputs_of(graph: Graph) -> tuple[str, ...]:
    """Return the names of the parameters that come from outside."""
    given = set(outputs_of(graph))
    return tuple(
        dict.fromkeys(name for step in graph for name in arguments_of(step) if name not in given)
    )


def arguments_of(step: Step) -> tuple[str, ...]:
    """Return the names of a step's arguments."""
    return tuple(step.node.signature.parameters)


def needed_for(
    graph: Graph, targets: Collection[str], given: Collection[str] = ()
) -> tuple[Step, ...]:
    """Return the steps that `targets` need if the `given` outputs come from outside."""
    wanted, kept = set(targets) - set(given), set()
    for step in reversed(topological(graph)):
        if wanted & set(step.outputs):
            kept.add(step.node.name)
            wanted |= set(arguments_of(step)) - set(given)
    return tuple(step for step in graph if step.node.name in kept)


def downstream_of(graph: Graph, name: str) -> set[str]:
    """Return `name` and every output that depends on it."""
    found = {name}
    for step in topological(graph):
        if found & (set(arguments_of(step)) | set(step.outputs)):
            found |= set(step.outputs)
    return found


def topological(graph: Graph) -> list[Step]:
    """Return the steps in an order in which each follows those that it needs.

    Raises
    ------
    ValueError
        The steps need one another in a circle.
    """
    makers = {name: step for step in graph for name in step.outputs}
    needs = {
        step.node.name: {makers[name].node.name for name in arguments_of(step) if name in makers}
        for step in graph
    }
    by_name = {step.node.name: step for step in graph}
    try:
        return [by_name[name] for name in graphlib.TopologicalSorter(needs).static_order()]
    except graphlib.CycleError as error:
        raise ValueError(f"the graph has a cycle: {', '.join(error.args[1])}") from None


def check_names(graph: Graph, names: Collection[str], known: Sequence[str], what: str) -> None:
    """Refuse names that the graph does not know.

    Raises
    ------
    InputError
        It names the nearest ones.
    """
    for name in names:
        if name not in known:
            near = difflib.get_close_matches(name, known, n=3, cutoff=0.5)
            raise InputError(
                f"unknown {what} '{name}'; {'did you mean ' + ' or '.join(near) + '?' if near else 'choose from ' + ', '.join(known)}"  # noqa: E501
            )
