"""``a2v dag``: the picture of the pipeline."""

from __future__ import annotations

from typing import Any

HELP = "Draw the pipeline's graph: nodes, what they need, and where they fan out over frames (t) and views (c)."
EXAMPLES = """examples:
  a2v dag --out dag.svg
  a2v dag --out dag.png"""


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    parser.add_argument("--out", default="dag.svg", help="picture to write; .svg, .png or .pdf, or .dot for Graphviz' source")
    parser.add_argument("--drawer", default="auto", choices=["auto", "dot", "matplotlib"], help="auto: Graphviz' dot where it is installed")


def run(settings: Any) -> int:
    """Draw and print the path."""
    from pipelines.drawing import draw
    from pipelines.graph import video_graph

    draw(video_graph(), settings.out, drawer=settings.drawer)
    print(settings.out)
    return 0
