"""``a2v actions``: what a motion model can do."""

from __future__ import annotations

from dataclasses import dataclass

from a2v.motion import MotionModel
from a2v.motion.prompts import Vocabulary
from pipelines.answer import Answer
from pipelines.motion_options import MODEL
from pipelines.options import option

HELP = "List the actions of a motion model, one name a line, in label order."
EXAMPLES = """examples:
  a2v actions
  a2v actions --model humanact12
  a2v actions --model cmu-fine --find "sneaking thief"            what it would take that for, and what comes near"""


#: Most actions that --find names.
SHOWN = 8


@dataclass(frozen=True, kw_only=True)
class Options:
    """What the command takes."""

    model: str = option(MODEL, default="cmu")
    find: str = option("words to look for", default="", metavar="TEXT")


def run(options: Options) -> Answer:
    """The names, all of them or those nearest to some words."""
    model = MotionModel.load(options.model)
    ranked = [name for name, score in Vocabulary.of(model.card).rank(options.find)[:SHOWN] if score > 0] if options.find else model.actions
    return Answer(text="\n".join(ranked), facts={"model": options.model, "actions": ranked})
