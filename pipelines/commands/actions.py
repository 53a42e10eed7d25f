"""``a2v actions``: what a motion model can do."""

from __future__ import annotations

from dataclasses import dataclass

from a2v.motion import MotionModel
from pipelines.inputs import MODEL
from pipelines.options import option

HELP = "List the actions of a motion model, one name a line, in label order."
EXAMPLES = """examples:
  a2v actions
  a2v actions --model humanact12"""


@dataclass(frozen=True, kw_only=True)
class Options:
    """What the command takes."""

    model: str = option(MODEL, default="cmu")


def run(options: Options) -> int:
    """Print the names."""
    print("\n".join(MotionModel.load(options.model).actions))
    return 0
