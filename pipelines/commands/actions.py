"""``a2v actions``: what a motion model can do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from a2v.motion.prompts import Vocabulary
from pipelines.answer import Answer
from pipelines.motion_options import AUTO, FEW, MODEL, open_model
from pipelines.options import option

HELP = "List the actions of a motion model, one name a line."
EXAMPLES = """examples:
  a2v actions
  a2v actions --model humanact12
  a2v actions --find "sneaking thief"            what it would take that for, and what comes near"""


#: Most actions that --find names.
SHOWN = 8


@dataclass(frozen=True, kw_only=True)
class Options:
    """What the command takes."""

    model: str = option(MODEL, default=AUTO)
    find: str = option("words to look for", default="", metavar="TEXT")


def run(options: Options) -> Answer:
    """The names, all of them or those nearest to some words."""
    model = open_model(options.model)
    found: Sequence[str] = model.actions
    if options.find:
        found = [name for name, score in Vocabulary.of(model.card).rank(options.find)[:SHOWN] if score > 0]
    elif options.model == AUTO:
        found = tuple(dict.fromkeys([*open_model(FEW).actions, *found]))
    return Answer(text="\n".join(found), facts={"model": options.model, "actions": list(found)})
