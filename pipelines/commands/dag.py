"""``a2v dag``: the picture of the pipeline."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pipelines.answer import Answer
from pipelines.engine.drawing import draw
from pipelines.graph import video_graph
from pipelines.options import option

HELP = "Draw the pipeline's graph: nodes, what they need, and where they fan out over frames (t) and views (c)."
EXAMPLES = """examples:
  a2v dag --out dag.svg
  a2v dag --out dag.png"""


@dataclass(frozen=True, kw_only=True)
class Options:
    """What the command takes."""

    out: str = option(
        "picture to write; .svg, .png or .pdf, or .dot for Graphviz' source", default="dag.svg"
    )
    drawer: str = option(
        "auto: Graphviz' dot where it is installed",
        default="auto",
        choices=("auto", "dot", "matplotlib"),
    )


def run(options: Options) -> Answer:
    """Draw."""
    draw(video_graph(), options.out, drawer=options.drawer)
    return Answer(files=[Path(options.out)])
