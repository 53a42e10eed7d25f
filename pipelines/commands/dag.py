"""``a2v dag``: draw the pipeline."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pipelines.answer import Answer
from pipelines.engine.drawing import draw
from pipelines.graph import video_graph
from pipelines.options import option

HELP = "Draw the graph of the pipeline: its nodes, their inputs, and where they run per frame (t) and per view (c)."
EXAMPLES = """examples:
  a2v dag --out dag.svg
  a2v dag --out dag.png"""


@dataclass(frozen=True, kw_only=True)
class Options:
    """Options of the command."""

    out: str = option(
        "picture to write: .svg, .png or .pdf, or .dot for Graphviz' source", default="dag.svg"
    )
    drawer: str = option(
        "program that draws; auto: Graphviz' dot if it is installed, else matplotlib",
        default="auto",
        choices=("auto", "dot", "matplotlib"),
    )


def run(options: Options) -> Answer:
    """Draw the pipeline."""
    draw(video_graph(), options.out, drawer=options.drawer)
    return Answer(files=[Path(options.out)])
