"""Draw a graph with Graphviz if `dot` is installed, else with matplotlib."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

from a2v.errors import InputError
from a2v.io import atomic_path
from pipelines.engine.graph import Graph, Step, arguments_of, inputs_of, topological

_SINGLE = "#dbe9f6"
"""Fill color of a node that is called once."""
_FANNED = "#fde0c5"
"""Fill color of a node that is called many times."""
_INPUT = "#f2f2f2"
"""Fill color of an input."""


def draw(graph: Graph, path: str | os.PathLike[str], *, drawer: str = "auto") -> None:
    """Draw `graph` to `path`.

    Parameters
    ----------
    path : .svg, .png, .pdf or .dot
    drawer : "dot", "matplotlib" or "auto"

    Raises
    ------
    InputError
        Unknown format, a file that cannot be written, or `dot` is given but not installed.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".svg", ".png", ".pdf", ".dot"):
        raise InputError(f"cannot draw to '{path}'; expected .svg, .png, .pdf or .dot")
    if drawer == "dot" and not shutil.which("dot"):
        raise InputError(
            "Graphviz' dot is not installed (Debian: apt-get install graphviz); use --drawer "
            "matplotlib"
        )
    with atomic_path(path) as temporary:
        if suffix == ".dot":
            temporary.write_text(dot_source(graph), encoding="utf-8")
        elif drawer != "matplotlib" and shutil.which("dot"):
            subprocess.run(
                ["dot", f"-T{suffix[1:]}", "-o", str(temporary)],
                input=dot_source(graph),
                text=True,
                check=True,
            )
        else:
            _draw_with_matplotlib(graph, temporary)


def edges(graph: Graph) -> list[tuple[str, str, str]]:
    """Return every edge (from, to, label) of the graph; ``from`` is a node or an input."""
    maker = {name: step.node.name for step in graph for name in step.outputs}
    return [
        (maker.get(name, name), step.node.name, name)
        for step in graph
        for name in arguments_of(step)
    ]


def label(step: Step) -> str:
    """Return the name of the step with its result and axes."""
    gives = ", ".join(step.outputs) + (f"[{', '.join(step.axes)}]" if step.axes else "")
    return gives


def dot_source(graph: Graph) -> str:
    """Return the graph in Graphviz' language."""
    steps = {step.node.name: step for step in graph}
    lines = [
        "digraph a2v {",
        '  rankdir=TB; ranksep=0.35; nodesep=0.25; node [fontname="Helvetica", fontsize=11, '
        'style=filled, shape=box, color="#666666"];',
        '  edge [color="#888888", arrowsize=0.7];',
    ]
    for name, step in steps.items():
        tip = (step.node.__doc__ or "").split("\n")[0].replace('"', "'")
        lines.append(
            f'  "{name}" [label="{label(step)}", tooltip="{tip}", '
            f'fillcolor="{_FANNED if step.fans_out else _SINGLE}"];'
        )
    for name in inputs_of(graph):
        lines.append(
            f'  "in:{name}" [label="{name}", shape=plaintext, fontsize=9, fillcolor="{_INPUT}"];'
        )
    for source, target in dict.fromkeys(edge[:2] for edge in edges(graph)):
        lines.append(f'  "{source if source in steps else "in:" + source}" -> "{target}";')
    return "\n".join([*lines, "}"]) + "\n"


def _draw_with_matplotlib(graph: Graph, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rank: dict[str, int] = {}
    for step in topological(graph):
        rank[step.node.name] = 1 + max(
            (rank.get(source, 0) for source, target, _ in edges(graph) if target == step.node.name),
            default=0,
        )
    rows: dict[int, list[Step]] = {}
    for step in topological(graph):
        rows.setdefault(rank[step.node.name], []).append(step)
    place = {
        step.node.name: ((i + 1) / (len(row) + 1), -float(level))
        for level, row in rows.items()
        for i, step in enumerate(row)
    }
    figure = Figure(figsize=(9, 1.0 + 0.8 * len(rows)))
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.axis("off")
    for source, target, _ in dict.fromkeys(edges(graph)):
        if source in place:
            axes.annotate(
                "",
                place[target],
                place[source],
                arrowprops={"arrowstyle": "->", "color": "#888888", "shrinkA": 12, "shrinkB": 12},
            )
    for step in graph:
        given = [name for name in arguments_of(step) if name in inputs_of(graph)]
        text = label(step) + (f"\n({', '.join(given)})" if given else "")
        box = {
            "boxstyle": "round,pad=0.4",
            "facecolor": _FANNED if step.fans_out else _SINGLE,
            "edgecolor": "#666666",
        }
        axes.text(*place[step.node.name], text, ha="center", va="center", fontsize=8, bbox=box)
    axes.set_xlim(0, 1)
    axes.set_ylim(-len(rows) - 0.7, -0.3)
    figure.savefig(path, format=path.suffix[1:])
