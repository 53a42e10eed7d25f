"""``a2v actions``: what a motion model can do."""

from __future__ import annotations

from typing import Any

HELP = "List the actions of a motion model, one name a line, in label order."
EXAMPLES = """examples:
  a2v actions
  a2v actions --model humanact12"""


def add_arguments(parser: Any) -> None:
    """Declare the options."""
    from pipelines.inputs import add_model_argument

    add_model_argument(parser)


def run(settings: Any) -> int:
    """Print the names."""
    from a2v.motion import MotionModel

    print("\n".join(MotionModel.load(settings.model).actions))
    return 0
